"""Where the descriptions of two experiments differ."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from spherical_wrist.actuation import Actuation
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.parameters import Member, unit_of
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing

_FAMILIES: Mapping[str, type[Member]] = {
    "law": Law,
    "reference": Reference,
    "disturbance": Disturbance,
    "sensing": Sensing,
    "actuation": Actuation,
}


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


def unit(name: str, description: Mapping[str, Any]) -> str:
    """The unit of a value of an experiment.

    Args:
        name: dotted, such as ``law.K``.
        description: the experiment, whose names of laws and other parts say what parameters they have.
    """
    key, _, parameter = name.partition(".")
    if key not in Experiment.model_fields:
        return ""
    if not parameter:
        return unit_of(Experiment, key)
    part, family = description.get(key), _FAMILIES.get(key)
    if family is None or not isinstance(part, Mapping):
        return ""
    member = family.members.get(str(part.get("name")))
    return unit_of(member, parameter) if member is not None and parameter in member.model_fields else ""


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _place(keys: list[str]) -> Any:
    """A key to sort dotted names by: parts together, in the order of the descriptions."""
    order = {key: place for place, key in reversed(list(enumerate(keys)))}
    return lambda name: order[name.partition(".")[0]]
