"""Table of all parameters of an experiment, with units, in as few lines as the terminal allows."""

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.output import IDEAL, name_of
from spherical_wrist.recording.experiment_text import unit

FIRM = "\u00a0"
"""Space at which no line breaks."""
SHORT = re.compile(r" = |\[[^\[\]]{,40}\]")
"""Parts of a long word that stay on one line."""
MARGIN = 14
"""Width of the names of the parts [columns]."""


def parameters_table(description: Mapping[str, Any], width: int) -> Table:
    """Lay out the parts of an experiment, without ideal sensors and motors, and its other parameters that are not zero.

    Args:
        description: the experiment as plain tables, as it is recorded.
        width: width of the terminal [columns].
    """
    table = Table(show_header=False, box=None, padding=(0, 1), pad_edge=False)
    others = {}
    for key, entry in description.items():
        if not isinstance(entry, Mapping):
            others[key] = entry
        elif entry != IDEAL.get(key):
            values = {f"{key}.{name}": value for name, value in entry.items() if name != "name"}
            name = name_of(entry)
            words = Text(folded([name, *_words(values, description)], width - MARGIN))
            words.stylize("bold", 0, len(name))
            table.add_row(Text(key, "dim"), words)
    shown = {name: value for name, value in others.items() if not _is_zero(value) or name == "seed"}
    table.add_row(Text("experiment", "dim"), folded(_words(shown, description), width - MARGIN))
    return table


def folded(words: Iterable[str], width: int, start: str = "") -> str:
    """Wrap words to lines; a word that is longer than a line breaks between the rows of a matrix."""
    room = max(width, 20)
    firm = (FIRM.join(word.split(" ")) if len(word) <= room else SHORT.sub(_firm, word) for word in words)
    lines = textwrap.wrap(start + "  ".join(firm), room, break_on_hyphens=False)
    return "\n".join(lines).replace(FIRM, " ")


def _firm(found: re.Match[str]) -> str:
    return found[0].replace(" ", FIRM)


def written(value: Any) -> str:
    """Write a value: three equal numbers as one, a dash for None."""
    if isinstance(value, list):
        alike = len(value) == 3 and not isinstance(value[0], list) and value.count(value[0]) == 3
        return _plain(value[0] if alike else value)
    return "—" if value is None else _plain(value)


def _plain(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def _words(values: Mapping[str, Any], description: Mapping[str, Any]) -> Iterator[str]:
    """Yield names, values and units of the parameters that have a value."""
    for name, value in values.items():
        if value is not None:
            yield f"{name.rpartition('.')[2]} = {written(value)} {unit(name, description)}".rstrip()


def _is_zero(value: Any) -> bool:
    return value is None or (all(map(_is_zero, value)) if isinstance(value, list) else value == 0)
