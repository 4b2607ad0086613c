"""Actions: an agent sets the torque, or the gains of the experiment's law.

An action is written to the packed parameters of the law that the loop runs, and held until the next action. Its numbers
are clipped to ±1.

``torque``
    One number a_j per motor. The control of the motor is a_j times its limit: the upper limit for a_j > 0, the lower
    limit for a_j < 0. The torque is that of the three motors. The law is :class:`TorqueAction`.

``gains``
    One number a per gain. The gain is its value in the experiment times ``gain_factor`` to the power of a, the same
    factor on all axes. Gains are the positive numbers and vectors of the law, widths such as ``phi`` included. Excluded
    are parameters that are declared as no gain (limits of the motors), that have no effect with the law's other
    parameters, that a table of the law is computed from, or that the law refuses at an end of the range. An action of
    zeros gives exactly the experiment's law.
"""

from collections.abc import Sequence
from math import inf
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.control import Law
from spherical_wrist.control.contract import Command, ModelBasedLaw, Signal
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError
from spherical_wrist.parameters import Vector, quantity
from spherical_wrist.tuning.ranges import tunable
from spherical_wrist.wrist import Wrist

SPACES = ("torque", "gains")


class TorqueAction(ModelBasedLaw):
    """Law that commands a constant torque: the action. It predicts the state if the experiment's law does."""

    abstract: ClassVar[bool] = True

    torque: Vector = quantity((0.0, 0.0, 0.0), "N·m", "body-frame torque")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """Command the torque of the parameters."""
        for i in range(3):
            command.torque[i] = parameters.torque[i]


class Actions(NamedTuple):
    """Mapping from actions to packed parameters of a law.

    Attributes:
        law: law that the loop runs.
        names: names of the numbers of an action.
        indices: indices among the packed parameters that actions write to, (m,).
        defaults: default values of these parameters, (m,).
        columns: index of the action's number for each of these parameters, (m,).
        factor: for gains, factor of an action of 1; 0 for torques.
        motors: for torques, matrix (3, 3) from controls of the motors to body-frame torque.
        limits: for torques, lower and upper limits of the controls (2, 3).
    """

    law: Law
    names: tuple[str, ...]
    indices: npt.NDArray[np.intp]
    defaults: Array
    columns: npt.NDArray[np.intp]
    factor: float
    motors: Array
    limits: Array

    @classmethod
    def of(cls, action: object, law: Law, wrist: Wrist, gains: Sequence[str] | None, factor: float) -> Self:
        """Create the mapping for a kind of action.

        Args:
            action: ``"torque"`` or ``"gains"``.
            law: law of the experiment.
            wrist: nominal wrist, which gives the motors.
            gains: names of the gains that are set; None for all.
            factor: largest factor by which a gain is multiplied or divided.

        Raises:
            UnknownNameError: ``action`` is unknown.
            ParameterError: another argument is not valid; in one line.
        """
        if action == "gains":
            return cls._gains(law, gains, factor)
        if action != "torque":
            raise UnknownNameError("action", action, SPACES)
        if gains is not None:
            raise ParameterError(f"gains = {gains!r}: only for action = 'gains'; leave it out for action = 'torque'")
        limits = np.stack([wrist.lower, wrist.upper])
        if not np.isfinite(limits).all():
            raise ParameterError(
                "action = 'torque' is a fraction of the motors' limits, and motors of this model have no limit: "
                "give all three a ctrlrange or a forcerange"
            )
        commanding = TorqueAction(prediction=law.looks_ahead)
        names, indices = ("motor_0", "motor_1", "motor_2"), _indices(commanding, "torque")
        return cls(commanding, names, indices, np.zeros(3), np.arange(3), 0.0, wrist.motors, limits)

    @classmethod
    def _gains(cls, law: Law, gains: Sequence[str] | None, factor: float) -> Self:
        if not 1.0 < factor < inf:
            raise ParameterError(f"gain_factor = {factor!r}: must be a number above 1")
        known = tunable_gains(law, factor)
        if isinstance(gains, str):
            raise ParameterError(f"gains = {gains!r}: a list of names is needed, such as ['{gains}']")
        for name in gains or ():
            if name not in known:
                raise UnknownNameError("gain", name, known, f" of law {law.name}")
        names = tuple(known if gains is None else gains)
        if not names or len(set(names)) < len(names):
            raise ParameterError(f"law {law.name!r}: gains = {list(names)}: at least one is needed, and none twice")
        indices = [_indices(law, name) for name in names]
        columns = np.repeat(np.arange(len(names)), [len(each) for each in indices])
        joined = np.concatenate(indices)
        return cls(law, names, joined, law.packed()[joined], columns, float(factor), np.eye(3), np.zeros((2, 3)))

    def write(self, actions: Array, packed: Array) -> None:
        """Write actions (n, k) within ±1 to packed parameters (n, size)."""
        if self.factor:
            packed[:, self.indices] = self.defaults * self.factor ** actions[:, self.columns]
        else:
            controls = actions * np.where(actions < 0.0, -self.limits[0], self.limits[1])
            packed[:, self.indices] = controls @ self.motors.T


def tunable_gains(law: Law, factor: float) -> list[str]:
    """Return the names of the gains that can be multiplied and divided by a factor while the law runs."""
    return [name for name in tunable(law) if _is_scalable(law, name, factor)]


def _is_scalable(law: Law, name: str, factor: float) -> bool:
    """Return True if the law accepts a scaled parameter, and derives nothing from it."""
    value = getattr(law, name)
    for scale in (1.0 / factor, factor):
        scaled = tuple(scale * each for each in value) if isinstance(value, tuple) else scale * value
        try:
            other = law.replaced(**{name: scaled}).computed()
        except WristError:
            return False
        if any(not np.array_equal(array, other[key]) for key, array in law.computed().items()):
            return False
    return True


def _indices(law: Law, name: str) -> npt.NDArray[np.intp]:
    """Return the indices of a parameter among the packed parameters."""
    numbered = np.arange(len(law.packed()), dtype=np.float64).view(law.layout())
    return np.ravel(numbered[name]).astype(np.intp)
