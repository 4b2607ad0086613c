"""An experiment: the whole description of a run, validated and frozen."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, SerializeAsAny

from spherical_wrist.actuation import Actuation, SphericalMotor
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.metrics import Measurement
from spherical_wrist.parameters import NonNegative, Parameters, Positive, Vector, quantity
from spherical_wrist.plant import Perturbation, perturbed
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing
from spherical_wrist.simulation.closed_loop import Start
from spherical_wrist.simulation.hardware import Hardware
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.wrist import Names, Wrist, WristFile

STEADY_FROM = 2.0
"""Start of the steady window [s], where an experiment does not say otherwise."""


def _law(given: Any) -> Any:
    return Law.resolve(given, default="fuzzy_sliding_computed_torque")


def _reference(given: Any) -> Any:
    return Reference.resolve(given, default="lissajous")


def _disturbance(given: Any) -> Any:
    given = {"level": given} if isinstance(given, int | float) else given
    return Disturbance.resolve(given, default="constant")


def _sensing(given: Any) -> Any:
    return Sensing.resolve(given, default="ideal")


def _actuation(given: Any) -> Any:
    return Actuation.resolve(given, default="ideal")


def _names(given: Any) -> Any:
    return [name.strip() for name in given.split(",")] if isinstance(given, str) else given


class Experiment(Parameters):
    """One closed-loop run, described completely: the same experiment gives the same bits.

    The defaults are the default run of ``wrist run``: the paper's fuzzy law on a Lissajous motion, against a constant
    disturbance of 25 % and a plant 25 % heavier than the controller believes. A perfect model is
    ``Experiment(disturbance=0, mass_scale=1)``.

    ``law``, ``reference``, ``sensing`` and ``actuation`` take a name, a table of ``name`` and parameters, or an
    instance; ``disturbance`` also takes a number, the level of a constant one.

    Raises:
        ParameterError: a value is not valid, or a name unknown; in one line.
    """

    law: Annotated[SerializeAsAny[Law], BeforeValidator(_law)] = quantity(
        "fuzzy_sliding_computed_torque", "", "control law"
    )
    reference: Annotated[SerializeAsAny[Reference], BeforeValidator(_reference)] = quantity(
        "lissajous", "", "desired motion"
    )
    disturbance: Annotated[SerializeAsAny[Disturbance], BeforeValidator(_disturbance)] = quantity(
        "constant", "", "torque on the plant's joint that the controller does not know"
    )
    sensing: Annotated[SerializeAsAny[Sensing], BeforeValidator(_sensing)] = quantity(
        "ideal", "", "what the controller sees of the wrist"
    )
    actuation: Annotated[SerializeAsAny[Actuation], BeforeValidator(_actuation)] = quantity(
        "ideal", "", "what becomes of the torque that the controller asks for"
    )
    mass_scale: Positive = quantity(1.25, "", "multiplies mass and inertia of every moving body of the plant")
    com_shift: Vector = quantity((0.0, 0.0, 0.0), "m", "shift of the plant's centres of mass, body frame")
    payload: NonNegative = quantity(0.0, "kg", "point mass at the plant's tool tip")
    friction: NonNegative = quantity(0.0, "N·m", "dry friction of the plant's joint, per axis")
    damping: NonNegative = quantity(0.0, "N·m·s/rad", "viscous damping added to the plant's joint")
    initial_error: Vector = quantity((0.0, 0.0, 0.0), "rad", "attitude error e at the start")
    initial_rate_error: Vector = quantity((0.0, 0.0, 0.0), "rad/s", "rate error ė at the start")
    duration: Positive = quantity(10.0, "s", "simulated time, a multiple of the control period")
    control_period: Positive = quantity(0.001, "s", "time from torque to torque, a multiple of the physics period")
    physics_period: Positive | None = quantity(None, "s", "physics step; the model's own where none is given")
    steady_from: NonNegative | None = quantity(
        None, "s", "start of the steady window; 2 s, or half the duration of runs of up to 2 s, where none is given"
    )
    seed: Annotated[int, Field(ge=0)] = quantity(0, "", "seed of everything random")
    model: Annotated[Path, AfterValidator(Path.resolve)] | None = quantity(
        None, "", "MJCF file of the wrist; the one of the package where none is given"
    )
    joint: str | None = quantity(None, "", "the wrist's ball joint, where the model has several")
    motors: Annotated[tuple[str, str, str] | None, BeforeValidator(_names)] = quantity(
        None, "", "the three motors on that joint, where there are more: a list, or A,B,C"
    )
    tip: str | None = quantity(None, "", "site of the tool tip, where none of several is called tip")

    @classmethod
    def from_toml(cls, path: Path | str, changes: Mapping[str, Any] | None = None) -> Self:
        """Reads an experiment file, whose keys are the parameters of this class.

        Args:
            path: TOML file.
            changes: values that take the place of those in the file; see :func:`with_changes`.

        Raises:
            ParameterError: the file cannot be read, is not TOML, or does not describe an experiment.
        """
        return cls(**with_changes(read_toml(Path(path)), changes or {}))

    @property
    def perturbation(self) -> Perturbation:
        """What differs between plant and nominal model."""
        return Perturbation(self.mass_scale, self.com_shift, self.payload, self.friction, self.damping)

    @property
    def wrist_file(self) -> WristFile:
        """Where the wrist comes from."""
        return WristFile(self.model, Names(self.joint, self.motors, self.tip))

    def nominal(self) -> Wrist:
        """The wrist that the controller believes in.

        Raises:
            ModelError: the MJCF file is not a wrist.
        """
        return self.wrist_file.load()

    def plant(self) -> Wrist:
        """The wrist that is simulated.

        Raises:
            ModelError: the MJCF file is not a wrist.
        """
        return perturbed(self.nominal(), self.perturbation)

    @property
    def start(self) -> Start:
        """The initial errors."""
        return Start(self.initial_error, self.initial_rate_error)

    @property
    def drawn_reference(self) -> Reference:
        """The reference with everything random in it drawn, from the experiment's seed."""
        return self.reference.drawn(self.generator_of_reference())

    def generator_of_reference(self) -> np.random.Generator:
        """A new generator of everything random in the reference."""
        return np.random.default_rng([self.seed, 3])

    @property
    def hardware(self) -> Hardware:
        """Sensors and motors, with the seed of their faults."""
        return Hardware(self.sensing, self.actuation, self.seed)

    def timing(self, nominal: Wrist) -> Timing:
        """Control and physics periods.

        Raises:
            ParameterError: they do not fit into each other.
        """
        physics = float(nominal.model.opt.timestep) if self.physics_period is None else self.physics_period
        return Timing.of(self.duration, self.control_period, physics)

    def measurement(self, wrist: Wrist) -> Measurement:
        """What the metrics depend on besides the series."""
        steady_from = self.steady_from
        if steady_from is None:
            steady_from = STEADY_FROM if self.duration > STEADY_FROM else 0.5 * self.duration
        layer = self.law.boundary_layer
        lever = (float(wrist.lever[0]), float(wrist.lever[1]), float(wrist.lever[2]))
        resistance = self.actuation.resistance if isinstance(self.actuation, SphericalMotor) else None
        return Measurement(steady_from, self.control_period, lever, layer, resistance)


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        ParameterError: it cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ParameterError(f"experiment {str(path)!r} cannot be read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"experiment {str(path)!r} is not valid TOML: {one_line(error)}") from None
    except RecursionError:
        raise ParameterError(f"experiment {str(path)!r} is not valid: its values are nested too deeply") from None


def with_changes(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of ``tables`` with values changed by dotted name: ``{"law.K": 0.02}`` changes K in the table ``law``.

    A name such as ``law = "pd"`` becomes a table where a parameter of it is changed. Where a name is changed, the
    parameters go with it, but for the size of a disturbance, which every shape has.
    """
    result = dict(tables)
    # names first: what is changed of a part belongs to the part that is named, in whatever order they are given
    for dotted, value in sorted(changes.items(), key=lambda change: ("." in change[0]) - change[0].endswith(".name")):
        key, _, parameter = dotted.partition(".")
        if not parameter:
            result[key] = value
            continue
        table = result.get(key, {})
        if not isinstance(table, Mapping):
            table = {"level" if isinstance(table, int | float) else "name": table}
        if parameter == "name" and table.get("name") != value:
            table = {name: kept for name, kept in table.items() if name in ("level", "amplitude")}
        result[key] = {**table, parameter: value}
    return result
