"""Axes of a frontier: the parameters along which a wrist deviates from the nominal one, each an entry of one table.

Options, help, terminal table, JSON, picture, guide and tests follow from :data:`AXES`; a new axis is one entry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from spherical_wrist.errors import UnknownNameError

if TYPE_CHECKING:
    from spherical_wrist.experiment.description import Experiment


class Axis(NamedTuple):
    """Parameter along which a wrist deviates from the nominal one. Its other parameters keep their values.

    Attributes:
        name: short name.
        parameter: parameter of the experiment that is varied.
        unit: unit of that parameter.
        base: value of the nominal wrist, where the search starts.
        first: first deviation that is tested.
        limit: last value, above ``base``, or below it.
        shown: factor for display, and the display unit.
        change: function that returns the experiment with a value of the parameter.
        meaning: what varies, in a sentence without a full stop.
        growth: ratio of neighbouring deviations of the grid that precedes the bisection.
    """

    name: str
    parameter: str
    unit: str
    base: float
    first: float
    limit: float
    shown: tuple[float, str]
    change: Callable[[Experiment, float], Experiment]
    meaning: str
    growth: float = 3.0

    @property
    def downwards(self) -> bool:
        """True if values fall from the base; deviations are then those of base / value from 1."""
        return self.limit < self.base

    @property
    def span(self) -> float:
        """Largest deviation."""
        return self.deviation(self.limit)

    def value(self, deviation: float) -> float:
        """Return the value of the parameter at a deviation ≥ 0 from its base, rounded to six digits."""
        return float(f"{self.base / (1.0 + deviation) if self.downwards else self.base + deviation:.6g}")

    def deviation(self, value: float) -> float:
        """Return the deviation of a value from the base."""
        return self.base / value - 1.0 if self.downwards else value - self.base

    def up_to(self, limit: float) -> Axis:
        """Return the axis with no value above ``limit``."""
        return self._replace(limit=min(self.limit, limit))


def _mass(experiment: Experiment, value: float) -> Experiment:
    return experiment.replaced(mass_scale=value)


def _sensing(experiment: Experiment, **changes: float | bool) -> Experiment:
    return experiment.replaced(sensing=experiment.sensing.replaced(**changes))


def _level(experiment: Experiment, value: float) -> Experiment:
    return experiment.replaced(disturbance=experiment.disturbance.replaced(level=value, amplitude=None))


def _frequency(experiment: Experiment, value: float) -> Experiment:
    """Return the experiment with a disturbance of a frequency [Hz].

    That of the experiment keeps its shape if it has a frequency, and becomes a sinusoid otherwise. Where there is none,
    its size is the default of an experiment. A frequency of 0 is a constant torque.
    """
    from spherical_wrist.disturbance import Constant, Disturbance, Sinusoid

    given = experiment.disturbance
    size: dict[str, Any] = {"level": given.level, "amplitude": given.amplitude}
    if not given.size(1.0):
        size = {"level": Disturbance.model_fields["level"].default}
    shape: Disturbance = Constant()
    if value:
        shape = (given if "frequency" in type(given).model_fields else Sinusoid()).replaced(frequency=value)
    return experiment.replaced(disturbance=shape.replaced(**size))


AXES: dict[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis(
            "heavier", "mass_scale", "", 1.0, 0.02, 10.0, (1.0, "×"), _mass,
            "scale of the plant's mass and inertia, upwards",
        ),
        Axis(
            "lighter", "mass_scale", "", 1.0, 0.02, 0.1, (1.0, "×"), _mass,
            "scale of the plant's mass and inertia, downwards",
        ),
        Axis(
            "com", "com_shift (x)", "m", 0.0, 1e-4, 0.1, (1e3, "mm"),
            lambda experiment, value: experiment.replaced(com_shift=(value, 0.0, 0.0)),
            "shift of the plant's centres of mass to the side",
        ),
        Axis(
            "payload", "payload", "kg", 0.0, 1e-3, 1.0, (1e3, "g"),
            lambda experiment, value: experiment.replaced(payload=value),
            "point mass at the plant's tool tip",
        ),
        Axis(
            "friction", "friction", "N·m", 0.0, 1e-4, 1.0, (1e3, "mN·m"),
            lambda experiment, value: experiment.replaced(friction=value),
            "dry friction of the plant's joint, per axis",
        ),
        Axis(
            "disturbance", "disturbance.level", "", 0.0, 0.02, 20.0, (100.0, "%"), _level,
            "size of the disturbance, as a share of the reference's peak nominal torque",
        ),
        Axis(
            "frequency", "disturbance.frequency", "Hz", 0.0, 0.5, 200.0, (1.0, "Hz"), _frequency,
            "frequency of a sinusoidal disturbance, from a constant one on, of 25 % unless the experiment gives "
            "a size; the error rises and falls with it",
            1.5,
        ),
        Axis(
            "delay", "sensing.delay", "s", 0.0, 2e-4, 0.05, (1e3, "ms"),
            lambda experiment, value: _sensing(experiment, delay=value, timestamped=True),
            "age of the samples, which the controller knows",
        ),
        Axis(
            "unknown_delay", "sensing.delay", "s", 0.0, 2e-4, 0.05, (1e3, "ms"),
            lambda experiment, value: _sensing(experiment, delay=value, timestamped=False),
            "age of the samples, which the controller takes for fresh",
        ),
        Axis(
            "lag", "actuation.lag", "s", 0.0, 2e-4, 0.1, (1e3, "ms"),
            lambda experiment, value: experiment.replaced(actuation=experiment.actuation.replaced(lag=value)),
            "time constant of the motors, which the controller knows",
        ),
        Axis(
            "noise", "sensing.attitude_noise", "rad", 0.0, 1e-5, 0.1, (1e3, "mrad"),
            lambda experiment, value: _sensing(experiment, attitude_noise=value),
            "attitude noise, standard deviation per axis and sample",
        ),
    )
}  # fmt: skip
"""All axes by name, in the order of tables.

:meta hide-value:
"""


def chosen_axes(names: Iterable[str] = ()) -> tuple[Axis, ...]:
    """Return the axes with these names; all axes if no name is given.

    Raises:
        UnknownNameError: a name is unknown.
    """
    wanted = tuple(dict.fromkeys(names)) or tuple(AXES)
    for name in wanted:
        if name not in AXES:
            raise UnknownNameError("axis", name, AXES)
    return tuple(AXES[name] for name in wanted)


def markdown_table() -> str:
    """Return the axes as a Markdown table for the documentation."""
    rows = [("axis", "parameter", "from", "to", "unit", "varies"), ("---",) * 6]
    rows += [
        (f"`{name}`", f"`{axis.parameter}`", f"{axis.base:g}", f"{axis.limit:g}", axis.unit, axis.meaning)
        for name, axis in AXES.items()
    ]
    return "\n".join("| {} | {} | {} | {} | {} | {} |".format(*row) for row in rows)
