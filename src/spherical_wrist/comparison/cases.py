"""Cases for the comparison of laws: the default suite, and suites from a user's own file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.actuation import Realistic as RealisticMotor
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError
from spherical_wrist.experiment.description import Experiment, read_toml, with_changes
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.sensing import Realistic as RealisticSensing

IDEAL, FAULTY = "ideal hardware", "non-ideal hardware"


JUDGED = {
    "rms": ("rms_error_rad", "rms_tip_error_mm"),
    "largest": ("max_error_rad", "max_tip_error_mm"),
}
"""Attitude error and tip error by which the runs of a case are judged, by the word that a case has for them."""


SIZES = ("duration", "disturbance.level", "disturbance.amplitude")
"""Parameters by which a case may be changed and still be what it says."""


class Case(NamedTuple):
    """Condition under which laws are compared.

    Attributes:
        name: short name, valid in a file name.
        meaning: description in a sentence.
        changes: changed parameters of the experiment by dotted name; see ``with_changes``.
        discriminates: the difference between laws that it shows.
        judged: ``"rms"`` or ``"largest"``: the errors that count, a key of ``JUDGED``.
        duration: simulated time [s] where neither the experiment nor the settings say it; None for the default one.
    """

    name: str
    meaning: str
    changes: Mapping[str, Any]
    discriminates: str = ""
    judged: str = "rms"
    duration: float | None = None

    @property
    def figures(self) -> tuple[str, str]:
        """Names of the metrics by which it is judged: an attitude error [rad] and a tip error [mm]."""
        return JUDGED[self.judged]

    def experiment(self, tables: Mapping[str, Any], changes: Mapping[str, Any]) -> Experiment:
        """Create the experiment of this case.

        Args:
            tables: experiment that the case changes, as plain tables.
            changes: values by dotted name that override both.

        Raises:
            WristError: a parameter of the case is not valid.
        """
        usual = {} if self.duration is None else {"duration": self.duration}
        try:
            return Experiment(**with_changes(with_changes({**usual, **tables}, self.changes), changes))
        except WristError as error:
            raise ParameterError(f"case {self.name!r}: {error}") from None

    def overridden(self, changes: Mapping[str, Any]) -> list[str]:
        """Return the names of its changed parameters that other values by dotted name replace, but for sizes."""
        replaced = (name for name in self.changes if name in changes or name.partition(".")[0] in changes)
        return [name for name in replaced if name not in SIZES]


def group_of(experiment: Experiment) -> str:
    """Return ``IDEAL`` for ideal sensors and motors and no dry friction, and ``FAULTY`` otherwise."""
    ideal = experiment.sensing.ideal and experiment.actuation.ideal and not experiment.friction
    return IDEAL if ideal else FAULTY


DURATION = 4.5
"""Simulated time [s] of a case: from 2 s on, more than a period of each axis of the Lissajous motion."""
_sensors, _motors, REALISTIC = RealisticSensing(), RealisticMotor(), HARDWARE["realistic"]


def _torque(shape: str, level: float = 0.25, **parameters: float) -> dict[str, Any]:
    """Return the changes for a disturbance of a shape and a size."""
    named = {f"disturbance.{name}": value for name, value in parameters.items()}
    return {"disturbance.name": shape, "disturbance.level": level, "disturbance.amplitude": None, **named}


def _late(delay: float, *, known: bool = True) -> dict[str, Any]:
    return {"sensing.delay": delay, "sensing.timestamped": known}


DEFAULT: tuple[Case, ...] = (
    Case("constant-heavy", "constant torque of 25 %, plant a quarter heavier",
         {**_torque("constant"), "mass_scale": 1.25},
         "precision under slow torques and a wrong model: integral action or an observer"),
    Case("double-mass", "constant torque of 25 %, plant twice as heavy", {**_torque("constant"), "mass_scale": 2.0},
         "laws whose loop gain goes with the believed mass, and those that limit what they believe"),
    Case("sine-15hz", "sinusoidal torque of 25 % at 15 Hz", _torque("sinusoid", frequency=15.0),
         "bandwidth of disturbance rejection"),
    Case("sine-40hz", "sinusoidal torque of 25 % at 40 Hz", _torque("sinusoid", frequency=40.0),
         "amplification beyond that bandwidth"),
    Case("square-5hz", "square wave of 25 % at 5 Hz", _torque("square", frequency=5.0),
         "speed of recovery from a step of torque", "largest"),
    Case("worst", "the worst torque within 25 %, built for each law", _torque("worst"),
         "the largest error that any torque of this size can cause", "largest"),
    Case("worst-light", "the worst torque within 25 %, plant half as heavy", {**_torque("worst"), "mass_scale": 0.5},
         "damping with a loop gain twice as large as believed", "largest"),
    Case("worst-late", "the worst torque within 25 %, samples 0.5 ms old, motors 0.5 ms late, plant twice as heavy",
         {**_torque("worst"), **_late(5e-4), "actuation.lag": 5e-4, "mass_scale": 2.0},
         "stability with half the loop gain and late torques: prediction", "largest"),
    Case("recorded", "a sensor turned in the hand (recorded), 30 g at the tip",
         {"reference.name": "recorded", "reference.file": "hand_held", "reference.smoothing": 0.04, "payload": 0.03,
          "steady_from": 0.5},
         "fast motion of a person with an inertia that nobody said", duration=4.2),
    Case("slender-hand", "a slender hand of half a kilogram, sinusoidal torque of 25 % at 5 Hz",
         {"model": "slender_hand", **_torque("sinusoid", frequency=5.0)},
         "limits in absolute numbers: an inertia 37 times as small about the spin axis, where the tip lies"),
    Case("cranked-tool", "a wrist on its side with a cranked tool, all faults of the realistic hardware",
         {**REALISTIC, "model": "cranked_tool"},
         "gains that suit one wrist: small inertia that is not diagonal, a tip off the spin axis"),
    Case("initial-error", "0.5, −0.4 and 0.8 rad of error at the start",
         {"initial_error": [0.5, -0.4, 0.8], "steady_from": 0.0},
         "return from a large error: saturation, windup, overshoot", duration=2.0),
    Case("initial-rate", "10, −10 and 15 rad/s of rate error at the start",
         {"initial_rate_error": [10.0, -10.0, 15.0], "steady_from": 0.0},
         "catching a wrist that turns fast", duration=2.0),
    Case("friction", "dry friction of 5 mN·m", {"friction": 5e-3},
         "a torque that jumps where the rate changes its sign"),
    Case("unknown-delay", "samples 1 ms old, unknown to the controller", _late(1e-3, known=False),
         "delay margin; all that have it make the same error, that of the delay"),
    Case("unknown-delay-light", "samples 1 ms old, unknown to the controller, plant half as heavy",
         {**_late(1e-3, known=False), "mass_scale": 0.5}, "delay margin at twice the loop gain"),
    Case("delay-15hz", "samples 2 ms old, sinusoidal torque of 25 % at 15 Hz",
         {**_late(2e-3), **_torque("sinusoid", frequency=15.0)},
         "what is left of the bandwidth with a known delay"),
    Case("delay-heart", "samples 3 ms old, on a beating heart", {**_late(3e-3), "reference": "beating_heart"},
         "prediction over a long known delay", duration=5.4),
    Case("lost-samples", "20 % of the samples lost, on a step", {"sensing.loss": 0.2, "reference": "step",
         "steady_from": 0.5}, "samples that do not come, while the wrist is moved quickly", duration=2.0),
    Case("rate-noise", "noise and bias of a MEMS gyroscope, the attitude exact",
         {"sensing.rate_noise": _sensors.rate_noise, "sensing.rate_bias": _sensors.rate_bias},
         "trust in the rate where the attitude is the better sensor"),
    Case("no-gyro", "no gyroscope: the rate from attitudes with noise of 1 arc minute",
         {"sensing.rate": "estimated", "sensing.attitude_noise": _sensors.attitude_noise},
         "amplification of noise by rate feedback"),
    Case("slow-motors", "torque in steps of 0.5 mN·m, lagging by 2 ms",
         {"actuation.torque_quantum": 5e-4, "actuation.lag": 2e-3}, "prediction over a slow motor"),
    Case("failed-coil", "24 coils of uneven strength, one of them failed, realistic sensors, torque of 5 Hz",
         {**REALISTIC, **_torque("sinusoid", frequency=5.0), "actuation":
          {"name": "spherical_motor", "lag": _motors.lag, "strength_error": 0.02, "failed": [0]}},
         "torques that are not what was asked for"),
    Case("realistic", "all faults of sensors and motors", REALISTIC,
         "noise against precision, where all is as expected"),
    Case("realistic-heart", "all faults, on a beating heart", {**REALISTIC, "reference": "beating_heart"},
         "the same with quick accelerations", duration=5.4),
    Case("realistic-suture", "all faults, on needle drives, the centre of mass off by 5 mm",
         {**REALISTIC, "reference": "suture", "com_shift": [0.004, 0.003, 0.0]},
         "the same with rests, and gravity that is not where the model has it", duration=6.4),
    Case("realistic-tremor", "all faults, tremor of a hand of 12.5 % RMS", {**REALISTIC, **_torque("tremor", 0.125)},
         "noise against bandwidth"),
    Case("realistic-payload", "all faults, 50 g at the tip of a plant a quarter heavier",
         {**REALISTIC, "payload": 0.05, "mass_scale": 1.25},
         "an inertia across the tool of nearly three times that of the model"),
    Case("realistic-noise", "all faults, ten times the noise",
         {**REALISTIC, "sensing.attitude_noise": 10.0 * _sensors.attitude_noise,
          "sensing.rate_noise": 10.0 * _sensors.rate_noise}, "averaging of noise, and detectors that noise sets off"),
    Case("realistic-no-gyro", "all faults, and no gyroscope", {**REALISTIC, "sensing.rate": "estimated"},
         "noise of an estimated rate with late samples and motors"),
)  # fmt: skip
"""Default suite. What a case does not mention is as in the default experiment: a Lissajous motion, a constant torque of
25 %, a plant a quarter heavier than its model, ideal hardware. Sizes of faults are those of the realistic hardware.

Every case shows another difference between laws. Of about 140 candidates, those were left out that rank the 21 laws of
the package like a case that stays: Spearman's rank correlation of the combined errors beyond 0.98. Of those that stay,
most pairs are below 0.9. A constant or a 1 Hz torque on a lighter or heavier plant, which suites are usually made of,
correlate by 0.996 with one another. By 0.98 and more they do with a shifted centre of mass, half the mass, a rate from
exact attitudes, 5 % of lost samples, 1.5 ms of known delay, slow motors, a slender hand, a cranked tool and a suture,
each alone: a constant torque shows one property of a law, whatever else is changed. Frequency, peak, noise, friction,
unknown delay and large errors show others, so that here faults, masses, wrists and motions are combined with them.

Left out as well is a constant torque on a plant that equals the model. There, laws with an integral leave 0.3 nm at
the tip, ``fuzzy_integral_sliding`` 27 nm and ``fuzzy_observer_sliding`` 121 nm: ratios of hundreds that nobody can
see.
"""

OWN = ("name", "meaning", "discriminates", "judged")
"""Keys of a case that are not parameters of the experiment."""


def select(cases: tuple[Case, ...], names: list[str]) -> tuple[Case, ...]:
    """Return the cases with these names, in the order of the names; all cases if no name is given.

    Raises:
        UnknownNameError: a name is unknown.
    """
    known = {case.name: case for case in cases}
    for name in names:
        if name not in known:
            raise UnknownNameError("case", name, known)
    return tuple(known[name] for name in dict.fromkeys(names)) or cases


def read_cases(path: Path) -> tuple[Case, ...]:
    """Read a suite from a TOML file with tables ``[[case]]``, each with a ``name`` and parameters of an experiment.

    For example::

        [[case]]
        name = "heavy and late"
        meaning = "half as heavy again, samples 2 ms old"   # optional
        discriminates = "prediction over the delay"         # optional
        judged = "largest"                                  # optional: the errors that count, RMS if nothing is said
        mass_scale = 1.5
        sensing.delay = 0.002

    Raises:
        ParameterError: the file cannot be read, or is not a suite.
    """
    tables = read_toml(path)
    given = tables.get("case")
    source = f"cases {str(path)!r}"
    if set(tables) != {"case"} or not isinstance(given, list) or not all(isinstance(entry, dict) for entry in given):
        raise ParameterError(f"{source}: only tables [[case]] are valid, each with a name and parameters")
    if not given:
        raise ParameterError(f"{source}: the file has no case; add a table [[case]] with a name and parameters")
    cases = tuple(_case(entry, f"{source}, case {number}") for number, entry in enumerate(given, start=1))
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(f"{source}: two cases are called {name!r}")
    return cases


def _case(table: dict[str, Any], source: str) -> Case:
    name = table.get("name")
    if not isinstance(name, str) or not name.strip():
        raise ParameterError(f"{source}: a name is needed, such as name = 'heavy'")
    if "law" in table:
        raise ParameterError(f"{source} ({name!r}): a case cannot set the law; give laws with --law")
    judged = table.get("judged", "rms")
    if judged not in JUDGED:
        raise UnknownNameError("judged", str(judged), JUDGED, f" ({source}, {name!r})")
    changes = _dotted({key: value for key, value in table.items() if key not in OWN})
    return Case(name, str(table.get("meaning", "")), changes, str(table.get("discriminates", "")), judged)


def _dotted(table: Mapping[str, Any]) -> dict[str, Any]:
    """Flatten nested tables to dotted names, with the name of each part before its parameters."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            named = sorted(value.items(), key=lambda item: item[0] != "name")
            flat.update({f"{key}.{parameter}": inner for parameter, inner in named})
        else:
            flat[key] = value
    return flat
