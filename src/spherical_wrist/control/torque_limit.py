"""Limits of the motors in use: anti-windup, and the largest mismatch that is believed.

Integrals and estimates stop while the motors are at their limits, which the signal carries. A law that uses no more
than a part of them has a limit of its own.
"""

from typing import ClassVar

from spherical_wrist.control.contract import Array, ModelBasedLaw, Signal
from spherical_wrist.parameters import NonNegativeVector, quantity


class LimitAwareLaw(ModelBasedLaw):
    """A law with an integral or an estimate, which stops where the motors have no more to give."""

    abstract: ClassVar[bool] = True

    torque_limit: NonNegativeVector = quantity(
        0.0, "N·m", "limit per axis where integrals and estimates stop, if below the motors'; 0 for theirs", gain=False
    )


def limit_of(signal: Signal, axis: int, own: Array) -> float:
    """Return the largest torque about an axis [N·m]: what the motors in use give, or a law's own limit below that.

    Args:
        signal: signal, with the limits of the motors.
        axis: body axis.
        own: the law's own limits (3,) [N·m], 0 for none.
    """
    most = float(signal.torque_limit[axis])
    return min(most, own[axis]) if own[axis] > 0.0 else most


def largest_mismatch(signal: Signal, axis: int) -> float:
    """Return the largest mismatch δ of the acceleration about an axis that is believed [rad/s²]: 2 τ_max / H_ii.

    Motors that hold out against a mismatch at their limit see τ_max / H_ii; twice that, a plant of half the inertia.
    """
    return 2.0 * float(signal.torque_limit[axis]) / float(signal.H[axis, axis])


def largest_integral(signal: Signal, axis: int, rate: float, own: float, share: float) -> float:
    """Return the largest integral part of a surface [rad/s], which reaching at ``rate`` [1/s] turns into acceleration.

    Args:
        signal: signal, with the limits of the motors and the inertia.
        axis: body axis.
        rate: κ [1/s].
        own: the law's own limit [rad/s], 0 for none.
        share: share of what the motors can do, τ_max / H_ii, that the integral may ask for.
    """
    return own if own > 0.0 else 0.5 * share * largest_mismatch(signal, axis) / rate


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
