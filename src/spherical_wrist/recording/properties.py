"""Properties of a run in its recording, checked when they are read: a recording may come from anywhere.

What a recording says is taken as it was written, so that nothing is converted: a number must be a number.
"""

from collections.abc import Mapping
from functools import cache
from math import isfinite
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model
from pydantic.fields import FieldInfo

from spherical_wrist.errors import one_line
from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.bound import BOUND
from spherical_wrist.measure.metrics import LIMITS
from spherical_wrist.parameters import NonNegative, Positive

DEEPEST = 8
"""Deepest nesting of the values of an experiment."""

LATER = {"bound"}
"""Parameters of an experiment that recordings of formats 1 and 2 lack."""

LARGEST_NUMBER = 2**128
"""Whole numbers are smaller than this."""

_Group = ConfigDict(strict=True, allow_inf_nan=False, frozen=True)
_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Vector = Annotated[tuple[_Finite, _Finite, _Finite], Field(strict=False)]


class _Outcome(BaseModel):
    model_config = _Group
    status: Annotated[Status, Field(strict=False)]
    time_s: NonNegative
    reason: str
    warnings: list[str] = []


class _Measurement(BaseModel):
    model_config = _Group
    steady_from: NonNegative
    period: Positive
    lever: _Vector
    boundary_layer: _Vector | None
    resistance: NonNegative | None
    steady_until: NonNegative | None = None
    surface_stays: bool = False
    bound: Positive = BOUND
    limit_shares: Annotated[tuple[_Vector, ...], Field(strict=False, max_length=LIMITS)] = ()
    current_limit: Positive | None = None


class _File(BaseModel):
    model_config = _Group
    path: str


class _Run(BaseModel):
    model_config = _Group
    wall_time_s: NonNegative


class _Properties(BaseModel):
    model_config = _Group
    experiment: dict[str, Any]
    outcome: _Outcome
    metrics: dict[str, Annotated[float, Field(allow_inf_nan=True)] | None]
    measurement: _Measurement
    versions: dict[str, str]
    files: dict[str, _File] = {}
    run: _Run


def check_properties(properties: Any) -> None:
    """Check the groups of entries that describe a run.

    Raises:
        ValueError: one is missing, has another type, or a value that it cannot have; the message names it.
    """
    _validate(_Properties, properties, "")
    _validate(_described(), _checked(properties["experiment"], "experiment"), "experiment.")


def _validate(model: type[BaseModel], given: Any, place: str) -> None:
    try:
        model.model_validate(given)
    except ValidationError as error:
        fault = error.errors()[0]
        place += ".".join(map(str, fault["loc"]))
        if fault["type"] == "missing":
            raise ValueError(f"it lacks {place}") from None
        message = fault["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
        raise ValueError(f"{place} = {one_line(repr(fault['input']), 60)}: {one_line(message, 100)}") from None


@cache
def _described() -> type[BaseModel]:
    """Return the model of a described experiment: parts are tables with a name, the other values those of their type.

    Parameters of parts are checked only where an experiment is made of them, since other versions have others.
    """
    fields: dict[str, Any] = {}
    for name, field in Experiment.model_fields.items():
        if name in PARTS:
            fields[name] = (_part(name), ...)
        elif name == "model":
            fields[name] = (str | None, None)
        else:
            fields[name] = (_kind(field), ... if field.default is not None and name not in LATER else None)
    return create_model("Described", __config__=_Group, **fields)


def _part(name: str) -> type[BaseModel]:
    """Return the model of a described part: its name, and the parameters that all members of its family have."""
    common: dict[str, Any] = {key: (_kind(field), ...) for key, field in PARTS[name].model_fields.items()}
    return create_model(name, __config__=_Group, name=(str, ...), **common)


def _kind(field: FieldInfo) -> Any:
    """Return the annotation of a field, with its constraints."""
    kind: Any = field.annotation
    for demand in field.metadata:
        kind = Annotated[kind, demand]
    return kind


def _checked(value: Any, place: str, depth: int = 0) -> Any:
    """Return a value with tuples for its lists.

    Raises:
        ValueError: it is nested too deeply, or a number in it is not finite or too large.
    """
    if depth > DEEPEST:
        raise ValueError(f"{place} is nested too deeply")
    if isinstance(value, Mapping):
        return {key: _checked(entry, f"{place}.{one_line(key, 40)}", depth + 1) for key, entry in value.items()}
    if isinstance(value, list):
        return tuple(_checked(entry, place, depth + 1) for entry in value)
    if isinstance(value, int) and abs(value) >= LARGEST_NUMBER:
        raise ValueError(f"{place} is a number of {value.bit_length()} bits")
    if isinstance(value, float) and not isfinite(value):
        raise ValueError(f"{place} is not a finite number")
    return value
