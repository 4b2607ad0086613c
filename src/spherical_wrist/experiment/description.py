"""Experiment: the complete description of a run, validated and frozen."""

import json
import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from math import floor, inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self, Unpack

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, SerializeAsAny, ValidationInfo

from spherical_wrist.actuation import Actuation, SphericalMotor
from spherical_wrist.consent import code_is_withheld
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.errors import ParameterError, WristError, one_line, refuse_huge_integers
from spherical_wrist.experiment.options import WHOLE
from spherical_wrist.experiment.perturbation import Perturbation, Start
from spherical_wrist.experiment.presets import with_hardware
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.experiment.values import ExperimentValues
from spherical_wrist.files import read_whole
from spherical_wrist.measure.bound import BOUND, SOURCE
from spherical_wrist.measure.metrics import MetricSettings
from spherical_wrist.package_files import named_file
from spherical_wrist.parameters import Member, NonNegative, Parameters, Positive, Vector, quantity
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing

if TYPE_CHECKING:  # these import MuJoCo, which is too slow for completion in the shell
    from spherical_wrist.wrist import Wrist, WristFile

STEADY_FROM = 2.0
"""Default start of the steady window [s]."""


def _member(given: Any, info: ValidationInfo) -> Any:
    """Resolve a part of an experiment in the family of its field."""
    name = info.field_name or ""
    return PARTS[name].resolve(given, default=Experiment.model_fields[name].default)


def _fields_of_chosen(part: str, values: Mapping[str, Any]) -> Iterable[str]:
    """Return the parameters of the member that a part was given as, or is by default; none if it is not valid."""
    default = Experiment.model_fields[part].default
    try:
        member, _ = PARTS[part].described(values.get(part, default), default)
    except WristError:  # or a level, which is the default's
        member, _ = PARTS[part].described(default, default)
    return member.model_fields


def _level(given: Any) -> Any:
    return {"level": given} if isinstance(given, int | float) else given


def _model_file(given: Path) -> Path:
    return named_file("model", given).resolve()


def _names(given: Any) -> Any:
    return [name.strip() for name in given.split(",")] if isinstance(given, str) else given


class Experiment(Parameters):
    """Complete description of one closed-loop run. The same experiment gives the same bits.

    The defaults are the default run of ``wrist run``: the paper's fuzzy law on a Lissajous motion, against a constant
    disturbance of 25 % and a plant 25 % heavier than the nominal model. Without model error and disturbance:
    ``Experiment(disturbance=0, mass_scale=1)``.

    ``law``, ``reference``, ``sensing`` and ``actuation`` take a name, a table of ``name`` and parameters, an instance,
    or a class; ``disturbance`` also takes a number, the level of a constant one. ``duration`` also takes ``"whole"``,
    the time of a whole recorded motion. The steady window ends with the run, or with the motion if that ends earlier.
    ``hardware="realistic"`` stands for realistic sensors, motors and friction; see
    :data:`spherical_wrist.experiment.presets.HARDWARE`.

    Raises:
        ParameterError: a value is not valid, or a name is unknown; in one line.
    """

    law: Annotated[SerializeAsAny[Law], BeforeValidator(_member)] = quantity(
        "fuzzy_sliding_computed_torque", "", "control law"
    )
    reference: Annotated[SerializeAsAny[Reference], BeforeValidator(_member)] = quantity(
        "lissajous", "", "desired motion"
    )
    disturbance: Annotated[SerializeAsAny[Disturbance], BeforeValidator(_member), BeforeValidator(_level)] = quantity(
        "constant", "", "torque on the plant's joint, unknown to the controller"
    )
    sensing: Annotated[SerializeAsAny[Sensing], BeforeValidator(_member)] = quantity(
        "ideal", "", "sensors, which give the controller the state of the wrist"
    )
    actuation: Annotated[SerializeAsAny[Actuation], BeforeValidator(_member)] = quantity(
        "ideal", "", "motors, which produce the commanded torque"
    )
    mass_scale: Positive = quantity(1.25, "", "multiplies mass and inertia of every moving body of the plant")
    com_shift: Vector = quantity((0.0, 0.0, 0.0), "m", "shift of the plant's centres of mass, body frame")
    payload: NonNegative = quantity(0.0, "kg", "point mass at the plant's tool tip")
    friction: NonNegative = quantity(0.0, "N·m", "dry friction of the plant's joint, per axis")
    damping: NonNegative = quantity(0.0, "N·m·s/rad", "viscous damping added to the plant's joint")
    initial_error: Vector = quantity((0.0, 0.0, 0.0), "rad", "attitude error e at the start")
    initial_rate_error: Vector = quantity((0.0, 0.0, 0.0), "rad/s", "rate error ė at the start")
    duration: Positive = quantity(10.0, "s", "simulated time, a multiple of the control period")
    control_period: Positive = quantity(0.001, "s", "time between two torques, a multiple of the physics period")
    physics_period: Positive | None = quantity(
        None, "s", "physics step; default: the largest up to the model's that fits"
    )
    steady_from: NonNegative | None = quantity(
        None, "s", "start of the steady window; default: 2 s, or half the duration of runs or motions up to 2 s"
    )
    bound: Positive = quantity(BOUND, "mm", f"bound on the tip error, by which the run is judged: {SOURCE}")
    seed: Annotated[int, Field(ge=0)] = quantity(0, "", "seed of everything random")
    model: Annotated[Path, AfterValidator(_model_file)] | None = quantity(
        None, "", "MJCF file of the wrist, or the name of a model of the package; default: its model wrist"
    )
    joint: str | None = quantity(None, "", "ball joint of the wrist, if the model has several")
    motors: Annotated[tuple[str, str, str] | None, BeforeValidator(_names)] = quantity(
        None, "", "three motors on that joint, if there are more: a list, or A,B,C"
    )
    tip: str | None = quantity(None, "", "site of the tool tip, if there are several and none is called tip")
    hinges: Annotated[tuple[str, str, str] | None, BeforeValidator(_names)] = quantity(
        None, "", "three hinges to be turned into the ball joint, with their motors: a list, or A,B,C"
    )

    def __init__(self, /, **values: Unpack[ExperimentValues]) -> None:
        given = with_hardware(values)
        if given.get("duration") == WHOLE:
            known = {name: value for name, value in given.items() if name != "duration"}
            given = {**known, "duration": _whole(type(self)(**known))}
        super().__init__(**given)

    @classmethod
    def from_toml(cls, path: Path | str, changes: Mapping[str, Any] | None = None) -> Self:
        """Read an experiment file, whose keys are the parameters of this class.

        Args:
            path: TOML file.
            changes: values that override those in the file; see :func:`with_changes`.

        Raises:
            ParameterError: the file cannot be read, is not TOML, or does not describe an experiment.
        """
        return cls(**with_changes(read_toml(Path(path)), changes or {}))

    @classmethod
    def elsewhere(cls, name: str, values: Mapping[str, Any]) -> list[str]:
        """Return dotted names of parameters of its parts that a name may stand for.

        They are those of the parts that were chosen, such as a law of the user's own; else those that other members
        of the families have; else that of a chosen part whose name is nearly the same.
        """
        chosen = {part: _fields_of_chosen(part, values) for part in PARTS}
        found = [part for part, fields in chosen.items() if name in fields]
        found = found or [
            part
            for part, family in PARTS.items()
            if any(name in member.model_fields for member in family.members.values())
        ]
        if found:
            return [f"{part}.{name}" for part in found]
        known = [*cls.model_fields, *(field for fields in chosen.values() for field in fields)]
        near = get_close_matches(name, known, n=1)
        return [f"{part}.{near[0]}" for part, fields in chosen.items() if near and near[0] in fields]

    @property
    def perturbation(self) -> Perturbation:
        """Differences between plant and nominal model."""
        return Perturbation(self.mass_scale, self.com_shift, self.payload, self.friction, self.damping)

    @property
    def wrist_file(self) -> "WristFile":
        """MJCF file of the wrist, with the names of its parts."""
        from spherical_wrist.wrist import Names, WristFile

        return WristFile(self.model, Names(self.joint, self.motors, self.tip, self.hinges))

    def nominal(self) -> "Wrist":
        """Load the nominal wrist.

        Raises:
            ModelError: the MJCF file is not a wrist.
        """
        return self.wrist_file.load()

    @property
    def start(self) -> Start:
        """Initial errors."""
        return Start(self.initial_error, self.initial_rate_error)

    @property
    def drawn_reference(self) -> Reference:
        """Reference with its random parameters drawn, from the seed of the experiment."""
        return self.reference.drawn(self.generator_of_reference())

    def generator_of_reference(self) -> np.random.Generator:
        """Create the random generator of the reference."""
        return np.random.default_rng([self.seed, 3])

    def timing(self, nominal: "Wrist") -> Timing:
        """Return control and physics periods: without a physics step, one that fits up to the timestep of the model.

        Raises:
            ParameterError: the duration is no multiple of the control period, or that of the physics step.
        """
        from spherical_wrist.experiment.timing import Timing

        if self.physics_period is None:
            return Timing.fitted(self.duration, self.control_period, float(nominal.model.opt.timestep))
        return Timing.of(self.duration, self.control_period, self.physics_period)

    def measurement(self, wrist: "Wrist") -> MetricSettings:
        """Return the settings of the metrics."""
        steady_from, moving, until = self.steady_from, self.duration, None
        if self.reference.end() < self.duration:
            moving = until = self.reference.end()
        if steady_from is None:
            steady_from = STEADY_FROM if moving > STEADY_FROM else 0.5 * moving
        layer = self.law.boundary_layer
        lever = (float(wrist.lever[0]), float(wrist.lever[1]), float(wrist.lever[2]))
        resistance = self.actuation.resistance if isinstance(self.actuation, SphericalMotor) else None
        current_limit = self.actuation.current_limit if isinstance(self.actuation, SphericalMotor) else None
        return MetricSettings(
            steady_from, self.control_period, lever, layer, resistance, until,
            bound=self.bound, limit_shares=wrist.limit_shares, current_limit=current_limit,
        )  # fmt: skip


def _whole(experiment: Experiment) -> float:
    """Return the time [s] of the whole motion, in full control periods."""
    if code_is_withheld():  # a motion is read for it, and a description from elsewhere may name any file
        raise ParameterError("duration = 'whole': the seconds are needed where no file is to be read")
    whole, period = experiment.reference.whole(), experiment.control_period
    if whole == inf:
        raise ParameterError(
            f"duration = 'whole': reference {experiment.reference.name!r} has no end, as a recorded motion has; give "
            "the seconds"
        )
    return max(1, floor(whole / period + 1e-6)) * period


PARTS: Mapping[str, type[Member]] = {
    name: field.annotation
    for name, field in Experiment.model_fields.items()
    if isinstance(field.annotation, type) and issubclass(field.annotation, Member)
}
"""Base classes of the parts of an experiment that have a name and parameters, by parameter of the experiment."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        ParameterError: the file cannot be read, or is not TOML.
    """
    try:
        values = parsed_toml(read_whole(path).decode("utf-8-sig"))
        refuse_huge_integers(values)
    except OSError as error:
        raise ParameterError(f"experiment {str(path)!r} cannot be read: {error.strerror or error}") from None
    except RecursionError:
        raise ParameterError(f"experiment {str(path)!r} is not valid: its values are nested too deeply") from None
    except ValueError as error:
        raise ParameterError(f"experiment {str(path)!r} is not valid TOML: {one_line(error)}") from None
    except ParameterError as error:
        raise ParameterError(f"experiment {str(path)!r}: {error}") from None
    return values


def parsed_toml(text: str) -> dict[str, Any]:
    """Parse TOML.

    Raises:
        ValueError: it is not TOML.
        RecursionError: its values are nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:  # raised for integers of too many digits, with advice for programmers
        raise ValueError(str(error).partition(";")[0]) from None


def with_changes(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy ``tables`` with values changed by dotted name: ``{"law.K": 0.02}`` changes K in the table ``law``.

    A part may also be an instance, as in ``dict(experiment)``. A name such as ``law = "pd"`` becomes a table if one of
    its parameters is changed. A change of a part's name drops the part's parameters, except the size of a disturbance,
    which every shape has.
    """
    result = dict(tables)
    # names first, in any order of the changes: the other changes are parameters of the named parts
    for dotted, value in sorted(changes.items(), key=lambda change: ("." in change[0]) - change[0].endswith(".name")):
        key, _, parameter = dotted.partition(".")
        if not parameter:
            result[key] = value
            continue
        table = result.get(key, {})
        if isinstance(table, Member) and parameter != "name":
            result[key] = _with_parameter(table, parameter, value)
            continue
        if isinstance(table, Member):
            table = {"name": table.name, **dict(table)}
        if not isinstance(table, Mapping):
            table = {"level" if isinstance(table, int | float) else "name": table}
        if parameter == "name" and table.get("name") != value:
            table = {name: kept for name, kept in table.items() if name in ("level", "amplitude")}
        result[key] = {**table, parameter: value}
    return result


def _with_parameter(part: Member, name: str, value: Any) -> Member:
    try:
        return part.replaced(**{name: value})
    except ParameterError as error:
        raise ParameterError(f"{part.kind} {part.name}: {error}") from None


def toml(value: Any, *, exact: bool = False) -> str:
    """Write plain data as a TOML value; entries of tables that are None are left out.

    Args:
        value: the data.
        exact: True to keep whole numbers of floating point what they are, 1.0; otherwise they are written as 1.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return str(int(value)) if not exact and value.is_integer() and abs(value) < 1e6 else repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        entries = ((key, each) for key, each in value.items() if each is not None)
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml(each, exact=exact)}" for key, each in entries) + " }"
    if isinstance(value, list | tuple):
        return "[" + ",".join(toml(each, exact=exact) for each in value) + "]"
    return str(value)
