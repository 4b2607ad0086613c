"""Anti-windup: integrals stop while the motors are at their limits, which the law knows."""

from typing import ClassVar

from spherical_wrist.control.contract import ModelBasedLaw
from spherical_wrist.parameters import PositiveVector, quantity


class LimitAwareLaw(ModelBasedLaw):
    """A law with an integral or an estimate, which stops where the motors have no more to give."""

    abstract: ClassVar[bool] = True

    torque_limit: PositiveVector = quantity(
        (0.25, 0.20, 0.33), "N·m", "limit of the motors per axis, where integrals and estimates stop", gain=False
    )


def limited(value: float, limit: float) -> float:
    """Return the value clipped to ±limit."""
    return min(limit, max(-limit, value))


def integrated(integral: float, change: float, torque: float, limit: float) -> float:
    """Return an integral torque after ``change``, which is left out where it would push beyond the motors' limit.

    Conditional integration (Åström and Hägglund, 1995, PID Controllers: Theory, Design, and Tuning).

    Args:
        integral: the integral torque so far [N·m].
        change: torque to be added [N·m].
        torque: torque of the rest of the law [N·m].
        limit: limit of the motor [N·m].

    Returns:
        The integral torque, within ±limit.
    """
    raised = limited(integral + change, limit)
    whole = torque + raised
    return integral if abs(whole) > limit and whole * change > 0.0 else raised
