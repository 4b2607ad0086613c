"""Differences of the descriptions of two experiments."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from spherical_wrist.recording.experiment_text import unit


class Setting(NamedTuple):
    """A value that two descriptions do not share.

    Attributes:
        name: dotted, such as ``law.K``.
        unit: of the value; empty where it has none, or where only the file of a user's own law knows it.
        a: value in the first description; None where it has none.
        b: value in the second.
    """

    name: str
    unit: str
    a: Any
    b: Any


def differing_settings(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[Setting, ...]:
    """The values that differ, in the order of the descriptions.

    Args:
        a: an experiment as plain tables, as it is recorded.
        b: another one.
    """
    values_a, values_b = dict(_flat(a)), dict(_flat(b))
    names = dict.fromkeys([*values_a, *values_b])
    return tuple(
        Setting(name, unit(name, a) or unit(name, b), values_a.get(name), values_b.get(name))
        for name in sorted(names, key=_place([*a, *b]))
        if values_a.get(name) != values_b.get(name)
    )


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _place(keys: list[str]) -> Any:
    """A key to sort dotted names by: parts together, in the order of the descriptions."""
    order = {key: place for place, key in reversed(list(enumerate(keys)))}
    return lambda name: order.get(name, order.get(name.partition(".")[0], len(order)))  # a foreign key may have dots
