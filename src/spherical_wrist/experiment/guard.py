"""What a user's own reference or disturbance returns, checked: the loop believes it, and would go on with nonsense.

A reference of one's own is most easily wrong in its derivatives, which nothing else would notice: the errors of a law
that is fed forward a wrong acceleration look like the law's. So the derivatives are compared with central differences.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from spherical_wrist.disturbance import Disturbance, Torque
from spherical_wrist.dynamics import MOTION
from spherical_wrist.errors import ParameterError, WristError, one_line
from spherical_wrist.parameters import Member
from spherical_wrist.reference import Reference
from spherical_wrist.simulation.nominal import Motion

Array = npt.NDArray[np.float64]
Given = TypeVar("Given")

INSTANTS, SPACING = 64, 1e-4
"""Of the check of derivatives: how many, and how far apart the differences are taken [s]."""

TOLERANCE = 1e-3
"""Of a derivative, relative to the largest there is, plus 1: far above what differences err by, far below a mistake."""

JUMPS = 0.1
"""Fraction of the instants that may fail: a motion may jump now and then, as a step does."""


def guarded_motion(reference: Reference, draw: Callable[[], np.random.Generator], duration: float) -> Motion:
    """The drawn reference; of one from a user's own file, checked whenever it is asked for a motion.

    Args:
        reference: as the experiment describes it.
        draw: makes the generator of what is random in it.
        duration: of the run [s].

    Raises:
        ParameterError: the user's code raises, or its motion is not one.
    """
    if not type(reference).files:
        return reference if type(reference).drawn is Reference.drawn else reference.drawn(draw())
    drawn = _called(reference, lambda: reference.drawn(draw()))
    guarded = _GuardedMotion(drawn)
    _check_derivatives(guarded, np.linspace(2.0 * SPACING, max(duration, 4.0 * SPACING), INSTANTS))
    return guarded


def guarded_torque(disturbance: Disturbance, peak: float, random: np.random.Generator) -> Torque:
    """The torque of a disturbance; of one from a user's own file, checked whenever it is asked for.

    Args:
        disturbance: as the experiment describes it.
        peak: see :meth:`spherical_wrist.disturbance.Disturbance.torque`.
        random: likewise.

    Raises:
        ParameterError: the user's code raises, or its torque is not one.
    """
    if not type(disturbance).files:
        return disturbance.torque(peak, random)
    torque = _called(disturbance, lambda: disturbance.torque(peak, random))

    def checked(time: Array) -> Array:
        found = np.asarray(_called(disturbance, lambda: torque(time)))
        wanted = (len(time), 3)
        if found.shape != wanted or found.dtype.kind not in "fiu":
            raise _fault(disturbance, f"its torque has shape {found.shape} of {found.dtype}, not {wanted} of numbers")
        if not (finite := np.isfinite(found).all(axis=1)).all():
            raise _fault(disturbance, f"its torque at t = {time[finite.argmin()]:.6g} s is not finite")
        return np.ascontiguousarray(found, dtype=np.float64)

    return checked


class _GuardedMotion:
    """See :func:`guarded_motion`."""

    def __init__(self, reference: Reference) -> None:
        self.reference = reference

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _GuardedMotion) and self.reference == other.reference

    def __hash__(self) -> int:
        return hash(self.reference)

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """The motion (n,), MOTION, at times (n,) [s]."""
        reference = self.reference
        found: Any = _called(reference, lambda: reference.motion(time))
        if not isinstance(found, np.ndarray) or found.dtype != MOTION or found.shape != time.shape:
            raise _fault(reference, "motion must return motion_of(attitude, rate, acceleration), a row for every time")
        for name in ("attitude", "rate", "acceleration"):
            finite = np.isfinite(found[name]).all(axis=1)
            if not finite.all():
                raise _fault(reference, f"its {name} at t = {time[finite.argmin()]:.6g} s is not finite")
        unit = np.abs(np.linalg.norm(found["attitude"], axis=1) - 1.0) < 1e-6
        if not unit.all():
            raise _fault(reference, f"its attitude at t = {time[unit.argmin()]:.6g} s is no unit quaternion")
        return np.ascontiguousarray(found)


def _check_derivatives(motion: _GuardedMotion, time: Array) -> None:
    before, now, after = (motion.motion(time + shift) for shift in (-SPACING, 0.0, SPACING))
    turns = [Rotation.from_quat(each["attitude"], scalar_first=True) for each in (before, after)]
    differences = {
        "rate": (turns[0].inv() * turns[1]).as_rotvec() / (2.0 * SPACING),
        "acceleration": (after["rate"] - before["rate"]) / (2.0 * SPACING),
    }
    for name, expected in differences.items():
        off = np.linalg.norm(now[name] - expected, axis=1)
        wrong = off > TOLERANCE * (1.0 + np.linalg.norm(expected, axis=1).max())
        if wrong.mean() > JUMPS:
            k = int(off.argmax())
            of = {"rate": "attitude", "acceleration": "rate"}[name]
            given, found = (", ".join(f"{part:.5g}" for part in vector[k]) for vector in (now[name], expected))
            raise _fault(
                motion.reference,
                f"its {name} is not the derivative of its {of}: at t = {time[k]:.4g} s it is ({given}), and by "
                f"differences of the {of} ({found}); both in the frame of the desired attitude",
            )


def _called(part: Member, function: Callable[[], Given]) -> Given:
    """What a user's code returns.

    Raises:
        ParameterError: it raises.
    """
    try:
        return function()
    except WristError:
        raise
    except Exception as error:  # a user's code may raise anything
        raise _fault(part, f"raised {type(error).__name__}: {one_line(error)}") from None


def _fault(part: Member, what: str) -> ParameterError:
    return ParameterError(f"{part.kind} {part.name!r}: {what}")
