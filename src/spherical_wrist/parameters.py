"""Frozen, validated parameters with units: the base of every law, reference, disturbance, sensor and motor.

A *family* is a direct subclass of :class:`Member`, such as ``Law``; its subclasses are its members. Each carries a name
and its parameters as annotated fields, is written in a file of its own and joins its family by being defined.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_serializer
from pydantic_core import ErrorDetails

from spherical_wrist.consent import code_is_withheld, is_code
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError, as_exception, one_line
from spherical_wrist.user_file import file_with_class, member_from_file

if TYPE_CHECKING:
    import numpy.typing as npt


def per_axis(value: Any) -> Any:
    """Expand one number to all three axes, and turn arrays into tuples.

    Raises:
        ValueError: it is neither one number nor three.
    """
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, bool | int | float):
        return (value, value, value)
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("one number, or three (one per axis x, y, z), is needed")
    return tuple(value)


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Components = Annotated[tuple[float, float, float], BeforeValidator(per_axis)]
"""A vector within another value; a field of its own is a ``Vector``."""

if TYPE_CHECKING:

    class _PerAxis:
        """Vector of a field for type checkers: one number or three are given, three are read."""

        def __get__(self, instance: object, owner: Any, /) -> tuple[float, float, float]: ...

        def __set__(self, instance: object, value: float | Sequence[float] | npt.NDArray[Any], /) -> None: ...

    Vector = _PerAxis
    PositiveVector = _PerAxis
    NonNegativeVector = _PerAxis
else:
    Vector = Components
    PositiveVector = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(per_axis)]
    NonNegativeVector = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(per_axis)]


def quantity(
    default: Any,
    unit: str,
    meaning: str,
    *,
    gain: bool = True,
    percent: bool = False,
    searched: tuple[float, float] | None = None,
    acts_with: Mapping[str, Any] | None = None,
    random: bool = False,
) -> Any:
    """Declare a parameter; the annotation of the field says which values are valid.

    Args:
        default: value where none is given.
        unit: physical unit, ``""`` for a number without one.
        meaning: one line for tables and help.
        gain: False for a positive number or vector of a law that nobody tunes, such as a limit of the motors.
        percent: True for a fraction that people think of in per cent, and that summaries show so.
        searched: of a gain that ``wrist design`` finds: the range that it searches, on a logarithmic scale; of a
            vector, with the same value on every axis.
        acts_with: of a parameter that has an effect only beside others: their names, each with the value that it
            must have, or ``True`` for any value but zero, false and empty. One of them is enough.
        random: True if a run depends on its seed where the parameter has an effect; of sensors and motors.
    """
    extra: dict[str, Any] = {"unit": unit}
    if not gain:
        extra["gain"] = False
    if percent:
        extra["percent"] = True
    if searched is not None:
        extra["searched"] = list(searched)
    if acts_with:
        extra["acts_with"] = dict(acts_with)
    if random:
        extra["random"] = True
    return Field(default, description=meaning, json_schema_extra=extra)


def inherited(model: type[BaseModel], name: str, default: Any, *, searched: tuple[float, float] | None = None) -> Any:
    """Declare another default, and range to search, for a parameter of a base class; unit, meaning and effects stay."""
    return quantity(default, unit_of(model, name), model.model_fields[name].description or "", searched=searched)


def unit_of(model: type[BaseModel], name: str) -> str:
    """Return the unit of a field, ``""`` if it has none."""
    return str(_declared(model, name, "unit", ""))


def is_gain(model: type[BaseModel], name: str) -> bool:
    """Return False if a field is declared as no gain."""
    return bool(_declared(model, name, "gain", True))


def is_percentage(model: type[BaseModel], name: str) -> bool:
    """Return True if a field is declared as a fraction that is shown in per cent."""
    return bool(_declared(model, name, "percent", False))


def searched(model: type[BaseModel], name: str) -> tuple[float, float] | None:
    """Return the range in which ``wrist design`` searches a gain; None of any other parameter."""
    found = _declared(model, name, "searched", None)
    return None if found is None else (float(found[0]), float(found[1]))


def matters(model: type[BaseModel], name: str, values: Mapping[str, Any]) -> bool:
    """Return False if a parameter has no effect because those that it acts with are off.

    Args:
        model: class that declares the parameter.
        name: parameter.
        values: values of the other parameters by name, as in an instance or in a recording; defaults stand for
            those that are missing.
    """
    needs: Mapping[str, Any] = _declared(model, name, "acts_with", {})
    for other, needed in needs.items():
        value = values.get(other, model.model_fields[other].default)
        found = not _off(value) if needed is True else _same(value, needed)
        if found and matters(model, other, values):
            return True
    return not needs


def _declared(model: type[BaseModel], name: str, key: str, default: Any) -> Any:
    """Return an entry of :func:`quantity`; a class that gives a field another default keeps the entries of its base."""
    for base in model.__mro__:
        field = base.model_fields.get(name) if issubclass(base, BaseModel) else None
        if field is not None and isinstance(field.json_schema_extra, dict) and key in field.json_schema_extra:
            return field.json_schema_extra[key]
    return default


def _first_default(model: type[BaseModel], name: str) -> Any:
    """Return the default of a field in the class that first declares it."""
    first = next(each for each in reversed(model.__mro__) if issubclass(each, BaseModel) and name in each.model_fields)
    return first.model_fields[name].default


def _off(value: Any) -> bool:
    """True for zero, false, empty, none, and vectors of these."""
    return all(map(_off, value)) if isinstance(value, list | tuple) else not value


def _same(value: Any, other: Any) -> bool:
    """True if two values are equal; a list equals a tuple, and one number a vector that has it on every axis."""
    several = [isinstance(each, list | tuple) for each in (value, other)]
    if all(several):
        return len(value) == len(other) and all(map(_same, value, other))
    if any(several):
        many, one = (value, other) if several[0] else (other, value)
        return len(many) == 3 and all(_same(each, one) for each in many)
    return bool(value == other)


class Parameters(BaseModel):
    """A frozen set of parameters: finite numbers only, no unknown names.

    Raises:
        ParameterError: in one line, where a value or a name is not valid.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True, defer_build=True)

    def __init__(self, /, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise ParameterError(_explain(error, type(self), values)) from None

    def __eq__(self, other: object) -> bool:
        """Return True if all parameters are equal, whatever has been computed from them so far."""
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def __hash__(self) -> int:
        """Return a hash of the parameters."""
        return hash((type(self), *(getattr(self, name) for name in type(self).model_fields)))

    @classmethod
    def elsewhere(cls, name: str, values: Mapping[str, Any]) -> list[str]:
        """Return dotted names of parameters of its parts that a name may stand for; here, none.

        Args:
            name: name that is none of its own parameters.
            values: what was given, by parameter.
        """
        return []

    def replaced(self, **changes: Any) -> Self:
        """Return a copy with some parameters changed, validated again."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **changes})


def paths_of(part: Parameters) -> dict[str, Path]:
    """Return the parameters that are files, by name."""
    values = ((name, getattr(part, name)) for name in type(part).model_fields)
    return {name: value for name, value in values if isinstance(value, Path)}


class Member(Parameters):
    """A named member of a family.

    Attributes:
        name: the member's name: the class name in snake case, so ``ComputedTorque`` is ``"computed_torque"``.
        address: name of the member in an experiment: its name, or the file that it was loaded from.
        files: of a member from a user's own file, that file and the modules beside it that it imports, as read then.
        fault: error that is raised if a user's own file cannot be loaded.
        members: of a family, its members by name, without those that a user's own file defines.
    """

    name: ClassVar[str] = ""
    address: ClassVar[str] = ""
    kind: ClassVar[str] = ""
    members: ClassVar[dict[str, type["Member"]]] = {}
    files: ClassVar[Mapping[Path, bytes]] = {}
    fault: ClassVar[type[WristError]] = ParameterError

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Name the class, and register it in its family if the package itself defines it."""
        cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        cls.address = cls.name
        if Member in cls.__bases__:
            cls.members = {}
        elif cls.__module__.startswith("spherical_wrist.") and not cls.__dict__.get("abstract", False):
            cls.members[cls.name] = cls

    @model_serializer(mode="wrap")
    def _with_name(self, standard: Any) -> dict[str, Any]:
        return {"name": self.address, **standard(self)}

    @property
    def acting(self) -> tuple[str, ...]:
        """Names of the parameters that have an effect: not at the default of the class that first declares them.

        The defaults of a family are harmless: a member in which no parameter acts does nothing.
        """
        return self._acting

    @property
    def is_random(self) -> bool:
        """True if a parameter that has an effect is declared as random."""
        return any(_declared(type(self), name, "random", False) for name in self.acting)

    @cached_property  # with the underscore, by which pydantic does not take what is cached for a field
    def _acting(self) -> tuple[str, ...]:
        values = {name: getattr(self, name) for name in type(self).model_fields}
        return tuple(
            name
            for name, value in values.items()
            if not _same(value, _first_default(type(self), name)) and matters(type(self), name, values)
        )

    @classmethod
    def source(cls) -> bytes:
        """Return all text of the user's file that defines the member and of its helpers; empty for the package's."""
        return b"".join(content for _, content in sorted(cls.files.items()))

    @classmethod
    def resolve(cls, given: Any, default: str) -> Any:
        """Return the member that ``given`` describes: an instance, a class, a name, or a table of name and parameters.

        Args:
            given: the description.
            default: name for a table that has none.

        Raises:
            UnknownNameError: the name is not in the family; the message has the nearest valid one.
            ParameterError: a parameter is not valid.
        """
        if isinstance(given, cls):
            return given
        member, values = cls.described(given, default)
        try:
            return member(**values)
        except ParameterError as error:
            raise ParameterError(f"{cls.kind} {member.name}: {error}") from None
        except BaseException as error:  # a user's code may raise anything
            found = as_exception(error)
            if not member.files or isinstance(found, cls.fault):
                raise
            raise cls.fault(f"{cls.kind} {member.name} raised {type(error).__name__}: {one_line(error)}") from None

    @classmethod
    def described(cls, given: Any, default: str) -> "tuple[type[Member], dict[str, Any]]":
        """Return the class of the member that ``given`` describes, as for :meth:`resolve`, and its parameters.

        Raises:
            UnknownNameError: the name is not in the family; the message has the nearest valid one.
            ParameterError: it is no description of a member.
        """
        if isinstance(given, cls):
            return type(given), dict(given)
        if isinstance(given, type) and issubclass(given, cls) and given is not cls:
            return given, {}
        table = {"name": given} if isinstance(given, str) else given
        if not isinstance(table, Mapping):
            raise ParameterError(
                f"{cls.kind} = {given!r}: a name, a table of a name and parameters, an instance or a class of a "
                f"{cls.kind} is needed"
            )
        name = table.get("name", default)
        values = {str(key): value for key, value in table.items() if key != "name"}
        if code_is_withheld() and is_code(name):
            return _placeholder(cls, name, tuple(values)), values
        return cls.member(name), values

    @classmethod
    def advice(cls, name: str) -> str:
        """Return advice on a name that is unknown."""
        if name[:1].isupper() and name.isidentifier():
            return f"one of your own is given with its file: path/to/file.py:{name}"
        return f"`wrist list {cls.kind}` shows them all"

    @classmethod
    def member(cls, name: Any) -> "type[Member]":
        """Return the member with a name, or that of ``path/to/file.py:Name`` from a user's own file.

        Raises:
            UnknownNameError: there is none; the message has the nearest valid one.
            WristError: of the family's kind: the file cannot be loaded, or has no such member.
        """
        if is_code(name):
            return _placeholder(cls, name, ()) if code_is_withheld() else member_from_file(name, cls)
        if not isinstance(name, str) or name not in cls.members:
            raise _unknown(cls, str(name))
        return cls.members[name]


def _unknown(family: type[Member], name: str) -> ParameterError:
    """Return the error for a name that a family does not have; it may be that of a class in the user's folder."""
    try:
        own = file_with_class(name, Path.cwd())
    except OSError:  # the working directory was deleted
        own = ""
    if own:
        return ParameterError(f"unknown {family.kind} {name!r}: one of your own is given with its file, {own}")
    return UnknownNameError(family.kind, name, family.members, f"; {family.advice(name)}")


def _placeholder(family: type[Member], address: str, names: tuple[str, ...]) -> type[Member]:
    """Return a member that stands for a Python file which is not loaded: it has these parameters, and does nothing.

    Raises:
        ParameterError: a name cannot be that of a parameter.
    """
    for name in names:
        if not name.isidentifier() or name.startswith(("_", "model_")) or hasattr(family, name):
            raise ParameterError(f"{family.kind} {address!r} cannot have a parameter {one_line(repr(name), 60)}")
    annotations = {"abstract": ClassVar[bool], **dict.fromkeys(names, Any)}
    name = address.rpartition(":")[2]
    member: type[Member] = type(
        name if name.isidentifier() else family.__name__,
        (family,),
        {"__module__": __name__, "__annotations__": annotations, "abstract": True, **dict.fromkeys(names)},
    )
    member.address = address
    return member


def _explain(error: ValidationError, model: type[BaseModel], values: Mapping[str, Any]) -> str:
    """Return the first fault of a validation in one line, with the number of further ones."""
    details = error.errors()
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    return _sentence(details[0], model, values) + more


def _sentence(detail: ErrorDetails, model: type[BaseModel], values: Mapping[str, Any]) -> str:
    path = [str(part) for part in detail["loc"]]
    if detail["type"] == "extra_forbidden":
        inner = model.elsewhere(path[-1], values) if issubclass(model, Parameters) and len(path) == 1 else []
        if inner:
            return f"unknown parameter {path[-1]!r}: did you mean {' or '.join(map(repr, inner))}?"
        return str(UnknownNameError("parameter", path[-1], model.model_fields))
    message = detail["msg"].removeprefix("Value error, ")
    message = message.replace("Input should be", "must be").replace("valid number", "number")
    if not path:  # raised by a validator of the whole model, which names the parameters itself
        return one_line(message)
    field = path[0]
    unit = f" [{unit_of(model, field)}]" if field in model.model_fields and unit_of(model, field) else ""
    try:
        given = one_line(repr(detail["input"]), limit=80)
    except ValueError:  # raised for integers that Python does not print
        given = "an integer of thousands of digits"
    return one_line(f"{'.'.join(path)} = {given}{unit}: {message}")
