"""What an agent does: it asks for a torque, or sets the gains of the experiment's law.

Either way an action is written into the packed parameters of the law that the loop runs, and held until the next one.
Numbers beyond ±1 are cut there.

``torque``
    One number a_j per motor: its control is a_j times its limit, the upper one for a_j > 0 and the lower one for
    a_j < 0, and the torque is what the three motors make of it. The law is :class:`Applied`.

``gains``
    One number a per gain: the gain is its value in the experiment times ``gain_factor`` to the power of a, on all axes
    alike. Gains are the positive numbers and vectors that the law's step reads, widths such as ``phi`` included; but
    not limits of the motors, nor what a table of the law is made of, nor what the law would refuse at an end of the
    range. Zeros are the experiment's own law, to the last bit.
"""

from collections.abc import Sequence
from math import inf
from types import FunctionType
from typing import Any, ClassVar, NamedTuple, Self, cast

import numpy as np
import numpy.typing as npt

from spherical_wrist.control import Law
from spherical_wrist.control.contract import Command, ModelBasedLaw, Signal
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError
from spherical_wrist.parameters import Vector, quantity
from spherical_wrist.tuning.ranges import positive
from spherical_wrist.wrist import Wrist

Array = npt.NDArray[np.float64]
SPACES = ("torque", "gains")


class Applied(ModelBasedLaw):
    """The torque that is asked for, whatever is seen. It looks ahead where the experiment's law does."""

    abstract: ClassVar[bool] = True

    torque: Vector = quantity((0.0, 0.0, 0.0), "N·m", "body-frame torque")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """See the class."""
        for i in range(3):
            command.torque[i] = parameters.torque[i]


class Actions(NamedTuple):
    """How actions become parameters.

    Attributes:
        law: the law that the loop runs.
        names: of the numbers of an action.
        slots: where among the packed parameters they go, (m,).
        defaults: what is there before, (m,).
        columns: of gains, which number of an action multiplies each slot, (m,).
        factor: of gains, what 1 multiplies them with; of torques, 0.
        motors: of torques, (3, 3), body-frame torque from the controls of the motors.
        limits: of torques, lower and upper controls (2, 3).
    """

    law: Law
    names: tuple[str, ...]
    slots: npt.NDArray[np.intp]
    defaults: Array
    columns: npt.NDArray[np.intp]
    factor: float
    motors: Array
    limits: Array

    @classmethod
    def of(cls, action: object, law: Law, wrist: Wrist, gains: Sequence[str] | None, factor: float) -> Self:
        """The actions of a kind.

        Args:
            action: ``"torque"`` or ``"gains"``.
            law: the experiment's.
            wrist: the nominal wrist, whose motors they are.
            gains: names of those that are set; None for all of them.
            factor: the largest that a gain is multiplied or divided by.

        Raises:
            UnknownNameError: there is no such kind of action.
            ParameterError: something else is not valid; in one line.
        """
        if action == "gains":
            return cls._gains(law, gains, factor)
        if action != "torque":
            raise UnknownNameError("action", action, SPACES)
        if gains is not None:
            raise ParameterError(f"gains = {gains!r}: they are set where action = 'gains', and not by a torque")
        limits = np.stack([wrist.lower, wrist.upper])
        if not np.isfinite(limits).all():
            raise ParameterError(
                "action = 'torque' is a fraction of what the motors can do, and motors of this model have no limit: "
                "give all three a ctrlrange or a forcerange"
            )
        applied = Applied(prediction=law.looks_ahead)
        slots, columns = _slots(applied, "torque"), np.arange(3)
        return cls(applied, ("motor_0", "motor_1", "motor_2"), slots, np.zeros(3), columns, 0.0, wrist.motors, limits)

    @classmethod
    def _gains(cls, law: Law, gains: Sequence[str] | None, factor: float) -> Self:
        if not 1.0 < factor < inf:
            raise ParameterError(f"gain_factor = {factor!r}: must be a number above 1")
        known = gains_of(law, factor)
        if isinstance(gains, str):
            raise ParameterError(f"gains = {gains!r}: a list of names is needed, such as ['{gains}']")
        for name in gains or ():
            if name not in known:
                raise UnknownNameError("gain", name, known, f" of law {law.name}")
        names = tuple(known if gains is None else gains)
        if not names or len(set(names)) < len(names):
            raise ParameterError(f"law {law.name!r}: gains = {list(names)}: at least one is needed, and none twice")
        slots = [_slots(law, name) for name in names]
        columns = np.repeat(np.arange(len(names)), [len(each) for each in slots])
        joined = np.concatenate(slots)
        return cls(law, names, joined, law.packed()[joined], columns, float(factor), np.eye(3), np.zeros((2, 3)))

    def write(self, actions: Array, packed: Array) -> None:
        """Writes actions (n, k) within ±1 into packed parameters (n, size)."""
        if self.factor:
            packed[:, self.slots] = self.defaults * self.factor ** actions[:, self.columns]
        else:
            controls = actions * np.where(actions < 0.0, -self.limits[0], self.limits[1])
            packed[:, self.slots] = controls @ self.motors.T


def gains_of(law: Law, factor: float) -> list[str]:
    """Names of the gains that can be set while the law runs, up and down by a factor."""
    read = _mentioned(cast(FunctionType, type(law).step), set())
    return [name for name in positive(law) if name in read and _free(law, name, factor)]


def _mentioned(function: FunctionType, visited: set[FunctionType]) -> set[str]:
    """Names that a function, and what it calls, may look up."""
    visited.add(function)
    names = set(function.__code__.co_names)
    called = [value for name in names if isinstance(value := function.__globals__.get(name), FunctionType)]
    return names.union(*(_mentioned(each, visited) for each in called if each not in visited))


def _free(law: Law, name: str, factor: float) -> bool:
    """Whether a parameter may be scaled on its own: the law takes it, and nothing is derived from it."""
    value = getattr(law, name)
    for scale in (1.0 / factor, factor):
        scaled = tuple(scale * each for each in value) if isinstance(value, tuple) else scale * value
        try:
            other = law.replaced(**{name: scaled}).derived()
        except WristError:
            return False
        if any(not np.array_equal(array, other[key]) for key, array in law.derived().items()):
            return False
    return True


def _slots(law: Law, name: str) -> npt.NDArray[np.intp]:
    """Where the numbers of a parameter lie among the packed ones."""
    numbered = np.arange(len(law.packed()), dtype=np.float64).view(law.layout())
    return np.ravel(numbered[name]).astype(np.intp)
