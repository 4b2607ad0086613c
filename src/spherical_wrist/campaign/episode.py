"""Episode of a campaign: an experiment with the values of one sample and one law."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from spherical_wrist.channels import XYZ
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.parameters import Parameters

AXES = XYZ


class Episode(NamedTuple):
    """Episode of a campaign.

    Attributes:
        id: sample × number of laws + index of the law; it does not depend on how the campaign is run.
        sample: index of the sample, which is the same for every law.
        law: label of the law.
        seed: seed of the episode.
        values: varied parameters by dotted name.
        base: experiment with this law, before the values are applied.
    """

    id: int
    sample: int
    law: str
    seed: int
    values: Mapping[str, Any]
    base: Experiment

    def experiment(self) -> Experiment:
        """Create the experiment of this episode.

        Raises:
            ParameterError: the values give no valid experiment.
        """
        return changed(self.base, {"seed": self.seed, **self.values})


def changed(base: Experiment, values: Mapping[str, Any]) -> Experiment:
    """Change parameters of ``base`` by dotted name, such as ``law.K``, or ``com_shift.x`` for one axis of three.

    Whole parts and their names (``disturbance.name``) are changed before their parameters.

    Raises:
        UnknownNameError: a parameter or an axis is unknown; the message has the closest name.
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
    """Return ``owner`` with changed parameters of its own, of its parts, and of single axes; each part changes once."""
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
    """Return the first words of dotted names, which must be parameters of ``owner``."""
    firsts = list(dict.fromkeys(name.partition(".")[0] for name in names))
    for first in firsts:
        if first not in type(owner).model_fields:
            raise UnknownNameError("parameter", first, type(owner).model_fields)
    return firsts
