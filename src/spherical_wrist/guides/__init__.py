"""User guides: Markdown beside this file, read with ``wrist guide NAME``."""

import re
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.errors import UnknownNameError

NAMES = (
    "commands",
    "conventions",
    "law",
    "comparing",
    "validation",
    "campaigns",
    "reference",
    "disturbance",
    "hardware",
    "wrist",
    "recordings",
    "paper",
    "learning",
)
"""All guides, in reading order."""

TABLES = {"axes": "experiment.axes", "channels": "channels", "metrics": "measure.metrics"}
"""Modules with tables that a guide includes where it says ``<!-- table of channels -->``, by the name of the table."""


class Guide(NamedTuple):
    """User guide.

    Attributes:
        name: name on the command line.
        title: its heading, in plain text.
        source: its Markdown, in which tables of the package are only named.
    """

    name: str
    title: str
    source: str

    @property
    def text(self) -> str:
        """All of it, as Markdown, without the comments by which a script finds the figures."""
        source = re.sub(r"^<!-- (figures: \w+|end of figures) -->\n", "", self.source, flags=re.MULTILINE)
        return re.sub(r"^<!-- table of (\w+) -->$", lambda found: _table(found[1]), source, flags=re.MULTILINE)


def read_guide(name: str) -> Guide:
    """Read the guide of a name.

    Raises:
        UnknownNameError: there is none; the message has the valid names.
    """
    if name not in NAMES:
        raise UnknownNameError("guide", name, NAMES, "; `wrist guide` lists them")
    text = (Path(__file__).parent / f"{name}.md").read_text(encoding="utf-8")
    return Guide(name, text.partition("\n")[0].removeprefix("# "), text)


def _table(name: str) -> str:
    table: str = import_module(f"spherical_wrist.{TABLES[name]}").markdown_table()
    return table
