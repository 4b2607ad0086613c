"""Frozen, validated parameters with units: the base of every law, reference and disturbance.

A *family* is a direct subclass of :class:`Member`, such as ``Law``; its subclasses are its members. Each carries a name
and its parameters as annotated fields, is written in a file of its own and joins its family by being defined.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_serializer
from pydantic_core import ErrorDetails

from spherical_wrist.errors import ParameterError, UnknownNameError, WristError, one_line
from spherical_wrist.user_file import member_from_file


def _per_axis(value: Any) -> Any:
    """One number stands for all three axes; arrays become tuples."""
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, bool | int | float):
        return (value, value, value)
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("one number, or three (one per axis x, y, z), is needed")
    return tuple(value)


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Vector = Annotated[tuple[float, float, float], BeforeValidator(_per_axis)]
PositiveVector = Annotated[tuple[Positive, Positive, Positive], BeforeValidator(_per_axis)]
NonNegativeVector = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(_per_axis)]


def quantity(default: Any, unit: str, meaning: str) -> Any:
    """A field with a default, a unit (``""`` where it has none) and a meaning; the annotation says what is valid."""
    return Field(default, description=meaning, json_schema_extra={"unit": unit})


def unit_of(model: type[BaseModel], name: str) -> str:
    """The unit of one field, ``""`` where it has none."""
    extra = model.model_fields[name].json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


class Parameters(BaseModel):
    """A frozen set of parameters: finite numbers only, no unknown names.

    Raises:
        ParameterError: in one line, where a value or a name is not valid.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise ParameterError(_explain(error, type(self))) from None

    def replaced(self, **changes: Any) -> Self:
        """A copy with some parameters changed, validated again."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **changes})


class Member(Parameters):
    """A named member of a family.

    Attributes:
        name: the member's name: the class name in snake case, so ``ComputedTorque`` is ``"computed_torque"``.
        address: what an experiment calls the member: its name, or where it was loaded from.
        files: of a member from a user's own file, that file and the modules beside it that it imports, as read then.
        fault: what is raised where a user's own file cannot be loaded.
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
        """Names the class; puts it in its family where the package itself defines it."""
        cls.name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        cls.address = cls.name
        if Member in cls.__bases__:
            cls.members = {}
        elif cls.__module__.startswith("spherical_wrist.") and not cls.__dict__.get("abstract", False):
            cls.members[cls.name] = cls

    @model_serializer(mode="wrap")
    def _with_name(self, standard: Any) -> dict[str, Any]:
        return {"name": self.address, **standard(self)}

    @classmethod
    def source(cls) -> bytes:
        """All text of the user's own file and its helpers that the member was loaded from; empty for the package's."""
        return b"".join(content for _, content in sorted(cls.files.items()))

    @classmethod
    def resolve(cls, given: Any, default: str) -> Any:
        """The member that ``given`` describes: an instance, a name, or a table of ``name`` and parameters.

        Args:
            given: the description.
            default: the name that a table without one stands for.

        Raises:
            UnknownNameError: the name is not in the family; the message has the nearest valid one.
            ParameterError: a parameter is not valid.
        """
        if isinstance(given, cls):
            return given
        table = {"name": given} if isinstance(given, str) else given
        if not isinstance(table, Mapping):
            raise ParameterError(f"{cls.kind} = {given!r}: a name, or a table of a name and parameters, is needed")
        name = table.get("name", default)
        member = cls.member(name)
        try:
            return member(**{str(key): value for key, value in table.items() if key != "name"})
        except ParameterError as error:
            raise ParameterError(f"{cls.kind} {member.name}: {error}") from None

    @classmethod
    def member(cls, name: Any) -> "type[Member]":
        """The member of the family with a name, or ``path/to/file.py:Name`` from a user's own file.

        Raises:
            UnknownNameError: there is none; the message has the nearest valid one.
            WristError: of the family's kind: the file cannot be loaded, or has no such member.
        """
        if isinstance(name, str) and ".py:" in name:
            return member_from_file(name, cls)
        if not isinstance(name, str) or name not in cls.members:
            raise UnknownNameError(cls.kind, name, cls.members, "; `wrist list` shows them all")
        return cls.members[name]


def _explain(error: ValidationError, model: type[BaseModel]) -> str:
    """The first complaint of a validation in one line, with the number of further ones."""
    details = error.errors()
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    return _sentence(details[0], model) + more


def _sentence(detail: ErrorDetails, model: type[BaseModel]) -> str:
    path = [str(part) for part in detail["loc"]]
    if detail["type"] == "extra_forbidden":
        return str(UnknownNameError("parameter", path[-1], model.model_fields))
    said = detail["msg"].removeprefix("Value error, ")
    said = said.replace("Input should be", "must be").replace("valid number", "number")
    if not path:  # of a validator of the whole: its own words say what
        return one_line(said)
    field = path[0]
    unit = f" [{unit_of(model, field)}]" if field in model.model_fields and unit_of(model, field) else ""
    given = one_line(repr(detail["input"]), limit=80)
    return one_line(f"{'.'.join(path)} = {given}{unit}: {said}")
