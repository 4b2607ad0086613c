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


def _hold_off(shape: str, size: str) -> list[Case]:
    masses = (("light", 0.75), ("right", 1.0), ("heavy", 1.25))
    changes = {"disturbance.name": shape, "disturbance.level": 0.25, "disturbance.amplitude": None}
    return [
        Case(f"{shape}-{word}", f"{size} of 25 %, plant mass × {mass:g}", {**changes, "mass_scale": mass})
        for word, mass in masses
    ]


_sensors, _motors = RealisticSensing(), RealisticMotor()

DEFAULT: tuple[Case, ...] = (
    *_hold_off("constant", "constant disturbance"),
    *_hold_off("sinusoid", "sinusoidal disturbance (1 Hz)"),
    Case("attitude-noise", "attitude noise of 1 arc minute", {"sensing.attitude_noise": _sensors.attitude_noise}),
    Case("attitude-steps", "attitude in steps of 16 bits a turn",
         {"sensing.attitude_quantum": _sensors.attitude_quantum}),
    Case("rate-noise", "noise and bias of a MEMS gyroscope",
         {"sensing.rate_noise": _sensors.rate_noise, "sensing.rate_bias": _sensors.rate_bias}),
    Case("rate-estimated", "no rate sensor: the rate from attitude samples", {"sensing.rate": "estimated"}),
    Case("delay-1ms", "samples 1 ms old", {"sensing.delay": 1e-3}),
    Case("delay-1.5ms", "samples 1.5 ms old", {"sensing.delay": 1.5e-3}),
    Case("lost-samples", "5 % of the samples lost", {"sensing.loss": 0.05}),
    Case("slow-motors", "torque in steps of 12 bits, lagging by 0.5 ms",
         {"actuation.torque_quantum": _motors.torque_quantum, "actuation.lag": _motors.lag}),
    Case("friction", "dry friction in the bearing", {"friction": HARDWARE["realistic"]["friction"]}),
    Case("cogging", "cogging of 1 % of the largest torque", {"actuation.cogging": _motors.cogging}),
    Case("spherical-motor", "24 coils, their currents in least norm", {"actuation.name": "spherical_motor"}),
    Case("failed-coil", "one of the 24 coils fails, unknown to the controller",
         {"actuation.name": "spherical_motor", "actuation.failed": [0]}),
    Case("realistic", "all of these faults, on the reference of the experiment", HARDWARE["realistic"]),
    Case("realistic-heart", "all of these faults, on a beating heart",
         {**HARDWARE["realistic"], "reference": "beating_heart"}),
    Case("realistic-suture", "all of these faults, on needle drives",
         {**HARDWARE["realistic"], "reference": "suture"}),
)  # fmt: skip
"""Default suite. Sizes of faults that are not in the meaning are those of the realistic hardware."""

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
