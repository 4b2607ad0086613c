"""Experiment as text for the viewer, with units and meaning from the declared parameters."""

from collections.abc import Iterator, Mapping
from itertools import zip_longest
from typing import Any

from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.parameters import Member, is_percentage, matters, unit_of
from spherical_wrist.plain_text import markdown
from spherical_wrist.recording.metrics_text import is_zero, table, text, words

FIRST = ("law", "reference", "disturbance", "mass_scale", "payload", "seed")
"""Entries that come first."""


def title(description: Mapping[str, Any]) -> str:
    """Return the title of a recording: its law and its reference."""
    parts = [description[key] for key in ("law", "reference") if key in description]
    return " · ".join(str(part["name"]) if isinstance(part, Mapping) else text(part) for part in parts) or "wrist"


def experiment_text(description: Mapping[str, Any]) -> str:
    """Return an experiment as a Markdown table; parameters of its parts beside it, for the height of the view.

    Entries that are zero or not given are left out, except the seed; likewise faults that sensors and motors do not
    have, and parameters that have no effect beside the others.

    Args:
        description: experiment as plain tables, as it is recorded.
    """
    rows: list[tuple[str, str]] = []
    details: list[tuple[str, str]] = []
    for key in sorted(description, key=lambda key: FIRST.index(key) if key in FIRST else len(FIRST)):
        value = description[key]
        if isinstance(value, Mapping) and "name" in value:
            _add_part(key, value, rows, details)
        elif value is not None and (key == "seed" or not is_zero(value)):
            rows.append((markdown(words(key)), f"{markdown(text(value))} {unit(key, description)}".strip()))
    if not details:
        return table(("experiment", ""), rows)
    entries = [*rows, *details]
    middle = max(len(rows), (len(entries) + 1) // 2)
    pairs = zip_longest(entries[:middle], entries[middle:], fillvalue=("", ""))
    return table(("experiment", "", "parameters", ""), [(*left, *right) for left, right in pairs])


def unit(name: str, description: Mapping[str, Any]) -> str:
    """Return the unit of a value of an experiment, ``""`` if it has none or only the file of a user's own law knows it.

    Args:
        name: dotted name, such as ``law.K``.
        description: the experiment, whose names of laws and other parts say what parameters they have.
    """
    key, _, parameter = name.partition(".")
    if not parameter:
        return unit_of(Experiment, key) if key in Experiment.model_fields else ""
    member = _member(key, description.get(key))
    return unit_of(member, parameter) if member is not None and parameter in member.model_fields else ""


def _member(key: str, part: Any) -> type[Member] | None:
    """Return the class of a part, None if it is not one of the package's."""
    if key not in PARTS or not isinstance(part, Mapping):
        return None
    return PARTS[key].members.get(str(part.get("name")))


def _add_part(key: str, part: Mapping[str, Any], rows: list[tuple[str, str]], details: list[tuple[str, str]]) -> None:
    """Add a part to the table of the experiment, its parameters to the other table, unless there is room beside it."""
    name, faulty = markdown(part["name"]), key == "disturbance" or hasattr(PARTS.get(key), "ideal")
    entries = [(markdown(words(entry) if faulty else entry), markdown(value)) for entry, value in effects(key, part)]
    if key == "disturbance":
        rows.append((words(key), ", ".join([f"**{name}**", *(f"{entry} {value}" for entry, value in entries)])))
    elif not hasattr(PARTS.get(key), "ideal") or name != "ideal":
        rows.append((words(key), f"**{name}**"))
        details += [(f"{words(key)}: {entry}", value) for entry, value in entries]
    elif entries:  # a line each: the viewer would cut a long one off
        heads = [(words(key), "**ideal** but for "), *[("", "")] * (len(entries) - 1)]
        rows += [(head, f"{but}{entry} {value}") for (head, but), (entry, value) in zip(heads, entries, strict=True)]


def effects(key: str, part: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the parameters of a part that have an effect, by name, with their values and units.

    Args:
        key: parameter of the experiment, such as ``sensing``.
        part: the part, as it is recorded.
    """
    member, family = _member(key, part), PARTS.get(key)
    faults = hasattr(family, "ideal")
    for name, value in part.items():
        known = member is not None and name in member.model_fields
        if name == "name" or value is None or (known and member is not None and not matters(member, name, part)):
            continue
        if faults and (is_zero(value) or _is_usual_choice(family, name, value)):
            continue
        if known and member is not None and is_percentage(member, name) and isinstance(value, int | float):
            yield name, f"{text(100.0 * value)} %"
        else:
            yield name, f"{text(value)} {unit(f'{key}.{name}', {key: part})}".strip()


def _is_usual_choice(family: type[Member] | None, name: str, value: Any) -> bool:
    """Return True for a choice by name that every member of a family makes by default."""
    usual = family is not None and name in family.model_fields and family.model_fields[name].default == value
    return usual and isinstance(value, str)
