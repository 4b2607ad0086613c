"""One episode of a campaign: an experiment with the values of one sample, under one law."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.parameters import Parameters

AXES = ("x", "y", "z")


class Episode(NamedTuple):
    """One episode: where it stands in the design, and what is its own.

    Attributes:
        id: sample × number of laws + position of the law: the same however the campaign is run.
        sample: index of the sample, which every law sees.
        law: label of the law.
        seed: of everything random in it.
        values: the varied parameters by dotted name.
        base: the experiment under this law before they are applied.
    """

    id: int
    sample: int
    law: str
    seed: int
    values: Mapping[str, Any]
    base: Experiment

    def experiment(self) -> Experiment:
        """What is simulated.

        Raises:
            ParameterError: the values do not make a valid experiment.
        """
        return changed(self.base, {"seed": self.seed, **self.values})


def changed(base: Experiment, values: Mapping[str, Any]) -> Experiment:
    """``base`` with parameters changed by dotted name, such as ``law.K`` or, for one axis of three, ``com_shift.x``.

    Whole parts and their names (``disturbance.name``) are changed before what belongs to them.

    Raises:
        UnknownNameError: there is no such parameter or axis; the message has the nearest.
        ParameterError: a value is not valid.
    """
    whole = {name: value for name, value in values.items() if "." not in name}
    named = {name: value for name, value in values.items() if name.endswith(".name") and name.count(".") == 1}
    if not named and not whole.keys() & {name.partition(".")[0] for name in values if "." in name}:
        return _with(base, values) if values else base
    base = base.replaced(**whole) if whole else base
    if named:
        parts = {name: getattr(base, name).model_dump() for name in _firsts(base, named)}
        base = base.replaced(**with_changes(parts, named))
    rest = {name: value for name, value in values.items() if name not in whole and name not in named}
    return _with(base, rest) if rest else base


def _with(owner: Any, values: Mapping[str, Any]) -> Any:
    """``owner`` with its own parameters, those of its parts and single axes changed, each part once."""
    changes = {name: value for name, value in values.items() if "." not in name}
    for name in _firsts(owner, values.keys() - changes.keys()):
        inner = {key.removeprefix(f"{name}."): value for key, value in values.items() if key.startswith(f"{name}.")}
        part = getattr(owner, name)
        changes[name] = _part_with(part, inner) if isinstance(part, Parameters) else _axes_of(name, part, inner)
    return owner.replaced(**changes)


def _part_with(part: Any, values: Mapping[str, Any]) -> Any:
    try:
        return _with(part, values)
    except ParameterError as error:
        raise ParameterError(f"{part.kind} {part.name}: {error}") from None


def _axes_of(name: str, vector: Any, values: Mapping[str, Any]) -> tuple[Any, ...]:
    if not isinstance(vector, tuple) or len(vector) != len(AXES):
        raise ParameterError(f"{name}.{next(iter(values))}: {name} = {vector} has no axes and no parts")
    axes = dict(zip(AXES, vector, strict=True))
    for axis, value in values.items():
        if axis not in axes:
            raise UnknownNameError(f"axis of {name}", axis, AXES)
        axes[axis] = value
    return tuple(axes.values())


def _firsts(owner: Parameters, names: Iterable[str]) -> list[str]:
    """The first words of dotted names, which must be parameters of ``owner``."""
    firsts = list(dict.fromkeys(name.partition(".")[0] for name in names))
    for first in firsts:
        if first not in type(owner).model_fields:
            raise UnknownNameError("parameter", first, type(owner).model_fields)
    return firsts
