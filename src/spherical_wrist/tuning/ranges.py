"""Search space of a law: ranges of its parameters, and the law of values within them."""

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import NamedTuple

from spherical_wrist.channels import XYZ
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError
from spherical_wrist.parameters import is_gain, matters, unit_of

AXES = XYZ
FACTOR = 4.0
"""Factor from the default to the ends of a range that is not given."""


class Range(NamedTuple):
    """Range of a parameter.

    Attributes:
        name: ``law.K``; of one axis, ``law.K.x``. A vector that is scaled as a whole is given by its largest component.
        low: smallest value.
        high: largest value.
        default: the value of the law to begin with, between the two.
        unit: of all three.
    """

    name: str
    low: float
    high: float
    default: float
    unit: str

    @property
    def logarithmic(self) -> bool:
        """True if the range is searched on a logarithmic scale."""
        return self.low > 0.0


class Space(NamedTuple):
    """A law and the ranges of its parameters.

    Attributes:
        law: with the default gains.
        ranges: searched ranges.
    """

    law: Law
    ranges: tuple[Range, ...]

    def law_with(self, values: Mapping[str, float]) -> Law:
        """Return the law with these values by name of their ranges.

        Raises:
            ParameterError: the law refuses them.
        """
        changes: dict[str, float | tuple[float, ...]] = {}
        for each, value in zip(self.ranges, self.used(values).values(), strict=True):
            if value != each.default:
                field, axis = _parts(each.name)
                changes[field] = _changed(changes.get(field, getattr(self.law, field)), axis, value)
        return self.law.replaced(**changes)

    def used(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the values that are used for these: with four digits, so that a person can read and type them.

        A default stays as it is, and stands for a value that is not there.
        """
        given = {each.name: (values.get(each.name, each.default), each.default) for each in self.ranges}
        return {name: value if value == default else _rounded(value) for name, (value, default) in given.items()}

    @property
    def defaults(self) -> dict[str, float]:
        """Values of the law to begin with."""
        return {each.name: each.default for each in self.ranges}

    def without(self, names: Iterable[str]) -> "Space":
        """Return the space without some of the ranges."""
        left_out = set(names)
        return self._replace(ranges=tuple(each for each in self.ranges if each.name not in left_out))


def space_of(law: Law, texts: Iterable[str] = (), *, per_axis: bool = False) -> Space:
    """Return the space to be searched.

    Args:
        law: with the default gains.
        texts: ranges ``law.K=0.01:0.2``, or ``law.K.x=…`` of one axis; none for all :func:`tunable` parameters of
            the law, a factor of ``FACTOR`` up and down.
        per_axis: the three components of a vector on their own, instead of one factor for all.

    Raises:
        ParameterError: a text is not of this form, its range leaves out the default, or the law refuses its ends.
        UnknownNameError: the law has no such number.
    """
    given = [found for text in texts for found in _read(law, text, per_axis)]
    names = [each.name for each in given]
    for each in given:
        whole = each.name.rpartition(".")[0]
        if names.count(each.name) > 1 or whole in names:
            raise ParameterError(f"--parameter {each.name}: it is given twice")
        _check(law, each)
    ranges = given or [each for field in tunable(law) for each in _around(law, field, per_axis)]
    if not ranges:
        raise ParameterError(f"law {law.name!r} has no positive number to tune: give ranges with --parameter")
    return Space(law, tuple(ranges))


def numbers(law: Law) -> dict[str, float | tuple[float, ...]]:
    """Return the parameters that are numbers, or vectors of three numbers."""
    fields = {name: getattr(law, name) for name in type(law).model_fields}
    return {name: value for name, value in fields.items() if isinstance(value, float) or _is_vector(value)}


def tunable(law: Law) -> list[str]:
    """Return the names of the gains: positive numbers and vectors with an effect that are not declared otherwise."""
    values = {name: getattr(law, name) for name in type(law).model_fields}
    found = {name: min(_components(value)) > 0.0 and is_gain(type(law), name) for name, value in numbers(law).items()}
    return [name for name, is_one in found.items() if is_one and matters(type(law), name, values)]


def _around(law: Law, field: str, per_axis: bool) -> list[Range]:
    names = _names(law, field, per_axis)
    return [_range(law, name, default / FACTOR, default * FACTOR) for name in names for default in [_value(law, name)]]


def _read(law: Law, text: str, per_axis: bool) -> list[Range]:
    name, equals, rest = (part.strip() for part in text.partition("="))
    low, colon, high = rest.partition(":")
    try:
        ends = float(low), float(high)
    except ValueError:
        ends = (float("nan"), float("nan"))
    if not (equals and colon and all(map(isfinite, ends)) and ends[0] < ends[1]):
        raise ParameterError(f"--parameter {text!r}: NAME=LOW:HIGH is needed, such as law.K=0.01:0.2")
    field, axis = _parts(name)
    known = numbers(law)
    if not name.startswith("law.") or field not in known:
        raise UnknownNameError("parameter", name, [f"law.{each}" for each in known], f" of law {law.name}")
    if axis and (axis not in AXES or not isinstance(known[field], tuple)):
        raise ParameterError(f"--parameter {name}: law.{field} = {known[field]} has no such axis; a vector has x, y, z")
    return [_range(law, each, *ends) for each in ([name] if axis else _names(law, field, per_axis))]


def _check(law: Law, given: Range) -> None:
    """Refuse a range that leaves out the default, which is always tried, or whose ends are no values."""
    if not given.low <= given.default <= given.high:
        raise ParameterError(
            f"--parameter {given.name}={given.low:g}:{given.high:g} leaves out the default gain {given.default:g}: "
            f"widen it, or begin elsewhere with --set law.{_parts(given.name)[0]}=..."
        )
    for end in (given.low, given.high):
        try:
            Space(law, (given,)).law_with({given.name: end})
        except WristError as error:
            raise ParameterError(f"--parameter {given.name}={given.low:g}:{given.high:g}: {error}") from None


def _names(law: Law, field: str, per_axis: bool) -> list[str]:
    vector = per_axis and isinstance(getattr(law, field), tuple)
    return [f"law.{field}.{axis}" for axis in AXES] if vector else [f"law.{field}"]


def _range(law: Law, name: str, low: float, high: float) -> Range:
    return Range(name, low, high, _value(law, name), unit_of(type(law), _parts(name)[0]))


def _value(law: Law, name: str) -> float:
    field, axis = _parts(name)
    values = _components(getattr(law, field))
    return values[AXES.index(axis)] if axis else max(values, key=abs)


def _changed(before: float | tuple[float, ...], axis: str, value: float) -> float | tuple[float, ...]:
    """Return a number, one component of a vector, or the whole vector by one factor, changed to a value."""
    if not isinstance(before, tuple):
        return value
    if axis:
        return tuple(value if axis == own else old for own, old in zip(AXES, before, strict=True))
    largest = max(before, key=abs)
    return tuple(_rounded(old * (value / largest) if largest else value) for old in before)


def _parts(name: str) -> tuple[str, str]:
    """Return field and axis of ``law.FIELD`` or ``law.FIELD.AXIS``."""
    field, _, axis = name.removeprefix("law.").partition(".")
    return field, axis


def _components(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _is_vector(value: object) -> bool:
    return isinstance(value, tuple) and len(value) == len(AXES) and all(isinstance(each, float) for each in value)


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
