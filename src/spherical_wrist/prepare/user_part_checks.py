"""Checks of laws, and of references and disturbances from a user's own file, because the loop does not check them.

The most likely mistake in a reference is a wrong derivative. Nothing else would show it: a wrong acceleration in the
feed-forward looks like an error of the law. So the derivatives are compared with central differences.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.control.contract import COMMAND, Law
from spherical_wrist.disturbance import Disturbance, Torque
from spherical_wrist.dynamics import MOTION
from spherical_wrist.errors import LawError, ParameterError, WristError, as_exception, one_line
from spherical_wrist.loop.engine import interpreted_step
from spherical_wrist.parameters import Member
from spherical_wrist.prepare.inputs import HasMotion
from spherical_wrist.reference import Reference

Given = TypeVar("Given")

INSTANTS, SPACING = 64, 1e-4
"""Check of derivatives: number of instants, and step of the central differences [s]."""

TOLERANCE = 1e-3
"""Tolerance of a derivative, relative to 1 plus its largest norm: far above the error of central differences."""

JUMPS = 0.1
"""Fraction of the instants that may fail, because a motion may have jumps, as a step has."""


def checked_motion(reference: Reference, draw: Callable[[], np.random.Generator], duration: float) -> HasMotion:
    """Draw the random parameters of a reference; if it is from a user's own file, check every motion that it returns.

    Args:
        reference: reference of the experiment.
        draw: creates the random generator of the reference.
        duration: duration of the run [s].

    Raises:
        ParameterError: the user's code raises, or returns no valid motion.
    """
    if not type(reference).files:
        return reference if type(reference).drawn is Reference.drawn else reference.drawn(draw())
    drawn = _called(reference, lambda: reference.drawn(draw()))
    checked = _CheckedMotion(drawn)
    _check_derivatives(checked, np.linspace(2.0 * SPACING, max(duration, 4.0 * SPACING), INSTANTS))
    return checked


def checked_warnings(reference: Reference, duration: float) -> tuple[str, ...]:
    """Return the warnings of a reference, which may be from a user's own file.

    Args:
        reference: reference of the experiment.
        duration: duration of the run [s].

    Raises:
        ParameterError: the user's code raises, or a recorded motion cannot be read.
    """
    return tuple(map(str, _called(reference, lambda: list(reference.warnings(duration)))))


def checked_torque(
    disturbance: Disturbance, peak: float, random: np.random.Generator, worst: Callable[[], Torque]
) -> Torque:
    """Return the torque function of a disturbance; if it is from a user's own file, check every torque that it returns.

    Args:
        disturbance: disturbance of the experiment.
        peak: see :meth:`spherical_wrist.disturbance.Disturbance.torque`.
        random: see :meth:`spherical_wrist.disturbance.Disturbance.torque`.
        worst: see :meth:`spherical_wrist.disturbance.Disturbance.torque`.

    Raises:
        ParameterError: the user's code raises, or returns no valid torque.
    """
    if not type(disturbance).files:
        return disturbance.torque(peak, random, worst)
    torque = _called(disturbance, lambda: disturbance.torque(peak, random, worst))

    def checked(time: Array) -> Array:
        found = np.asarray(_called(disturbance, lambda: torque(time)))
        wanted = (len(time), 3)
        if found.shape != wanted or found.dtype.kind not in "fiu":
            raise _fault(disturbance, f"its torque has shape {found.shape} of {found.dtype}, not {wanted} of numbers")
        if not (finite := np.isfinite(found).all(axis=1)).all():
            raise _fault(disturbance, f"its torque at t = {time[finite.argmin()]:.6g} s is not finite")
        return np.ascontiguousarray(found, dtype=np.float64)

    return checked


class _CheckedMotion:
    """Reference from a user's own file, whose motions are checked."""

    def __init__(self, reference: Reference) -> None:
        self.reference = reference

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _CheckedMotion) and self.reference == other.reference

    def __hash__(self) -> int:
        return hash(self.reference)

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """Return the checked motion (n,), MOTION, at times (n,) [s]."""
        reference = self.reference
        found: Any = _called(reference, lambda: reference.motion(time))
        if not isinstance(found, np.ndarray) or found.dtype != MOTION or found.shape != time.shape:
            raise _fault(reference, "motion must return motion_of(attitude, rate, acceleration), one row for each time")
        for name in ("attitude", "rate", "acceleration"):
            finite = np.isfinite(found[name]).all(axis=1)
            if not finite.all():
                raise _fault(reference, f"its {name} at t = {time[finite.argmin()]:.6g} s is not finite")
        unit = np.abs(np.linalg.norm(found["attitude"], axis=1) - 1.0) < 1e-6
        if not unit.all():
            raise _fault(reference, f"its attitude at t = {time[unit.argmin()]:.6g} s is not a unit quaternion")
        return np.ascontiguousarray(found)


def _check_derivatives(motion: _CheckedMotion, time: Array) -> None:
    from scipy.spatial.transform import Rotation

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
    """Call a user's code, and return its result.

    Raises:
        ParameterError: the code raises.
    """
    try:
        return function()
    except WristError:
        raise
    except BaseException as error:  # a user's code may raise anything
        as_exception(error)
        raise _fault(part, f"raised {type(error).__name__}: {one_line(error)}") from None


def _fault(part: Member, what: str) -> ParameterError:
    return ParameterError(f"{part.kind} {part.name!r}: {what}")


def check_step(law: Law, signal: npt.NDArray[np.void], state: npt.NDArray[np.float64]) -> None:
    """Check one step of a law, run in plain Python on a copy of its state: compiled code raises no errors.

    Args:
        law: the law.
        signal: SIGNAL array of length one.
        state: the law's packed state; not changed.

    Raises:
        LawError: the step raises, writes no finite torque, or its surface does not match ``has_surface``.
    """
    command = np.full(COMMAND.itemsize // 8, np.nan).view(COMMAND).view(np.recarray)
    time = float(signal["time"][0])
    name = f"law {law.name!r} at t = {time:.6g} s"
    try:
        packed = law.packed(float(signal["period"][0]))
        interpreted_step(law)(signal.view(np.recarray)[0], packed, state.copy(), command[0])
    except WristError:
        raise
    except BaseException as error:  # a user's law may raise anything
        as_exception(error)
        raise LawError(f"{name} raised {type(error).__name__}: {one_line(error)}") from None
    torque = command["torque"][0]
    if not np.isfinite(torque).all():
        found = ", ".join(f"{part:.4g}" for part in torque)
        raise LawError(f"{name} wrote the torque [{found}] N·m: command.torque[0], [1] and [2] must be finite numbers")
    written = [name for name in ("surface", "slope") if not np.isnan(command[name][0]).all()]
    if written and not law.has_surface:
        raise LawError(
            f"law {law.name!r} writes command.{written[0]}: declare has_surface = True in its class, or do not write it"
        )
    if law.has_surface and len(written) < 2:
        raise LawError(
            f"law {law.name!r} declares has_surface = True: write command.surface and command.slope at every step"
        )
