"""Inverse of eq. (7) and (8): all angles with which the wrist has an attitude, a direction or a tip position.

An attitude has two **families** of angles: (α, β, γ) with |β| ≤ π/2, and (α + π, π − β, γ + π). Without limits, angles
are modulo whole turns, and each family is given once, in (−π, π]. With limits, angles are those of real joints: every
whole turn more or less that the limits allow is a solution of its own.

At the **singularity** β = ±π/2 the families meet in a line of solutions: only α + γ (at +π/2) or α − γ (at −π/2) is
determined. Then each answer represents its line: without limits there is one; with limits, one for each segment of
the line within them, its point nearest to α = γ = 0.

Invalid input (no unit vector, no rotation, no finite number) is an error; a valid target that is out of reach gives an
empty answer with a reason.
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.paper.angle_chart import SINGULAR, angles_of_attitude, matrix_of_angles, other_family
from spherical_wrist.paper.denavit_hartenberg import Chain

TURN = 2.0 * np.pi

TOLERANCE = 1e-9
"""Largest deviation of a direction from unit length, of a matrix from a rotation, and of a tip from the sphere [1]."""

SLACK = 1e-12
"""Excess over a limit [rad] that is allowed, so that rounding does not make the limit itself unreachable."""


class Solutions(NamedTuple):
    """Solutions for one target.

    Attributes:
        angles: (m, 3) [rad], those nearest to zero first; m = 0 if the target is out of reach.
        singular: True if each answer represents a line of them, along which α and γ change together.
        reason: reason for no answer; empty if there is one.
    """

    angles: Array
    singular: bool
    reason: str


def families(rotation: Array) -> Array:
    """Compute both families of angles (..., 2, 3), in (−π, π], of rotations (..., 3, 3), body → world.

    Raises:
        ParameterError: a matrix is not a rotation.
    """
    matrix = np.asarray(rotation, float)
    if matrix.shape[-2:] != (3, 3):
        raise ParameterError(f"rotation of shape {matrix.shape}: matrices (..., 3, 3) are needed")
    gram = np.swapaxes(matrix, -1, -2) @ matrix
    if not (np.all(np.abs(gram - np.eye(3)) <= TOLERANCE) and np.all(np.linalg.det(matrix) > 0.0)):
        raise ParameterError(
            "not a rotation: a matrix with R^T R = 1 and det R = 1 is needed; make its columns orthonormal"
        )
    attitude = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    first = angles_of_attitude(attitude).reshape(matrix.shape[:-1])
    return np.stack([first, other_family(first)], axis=-2)


def angles_of_rotation(rotation: Array, limits: Array | None = None) -> Solutions:
    """Find all angles of one rotation (3, 3), body → world.

    Args:
        rotation: attitude of the wrist.
        limits: lowest and highest α, β, γ (3, 2) [rad]; None for any, modulo whole turns.

    Raises:
        ParameterError: not one rotation, or the limits are not (3, 2), finite and in order.
    """
    if np.shape(rotation) != (3, 3):
        raise ParameterError(
            f"rotation of shape {np.shape(rotation)}: one matrix (3, 3) is needed; for many, see families"
        )
    both = families(rotation)
    singular = bool(np.abs(np.cos(both[0, 1])) <= SINGULAR)
    if limits is None:
        return Solutions(_sorted(list(both[:1] if singular else both)), singular, "")
    box = np.asarray(limits, float)
    if box.shape != (3, 2) or not np.isfinite(box).all() or np.any(box[:, 0] > box[:, 1]):
        raise ParameterError(f"limits {box.tolist()}: three pairs of lowest and highest angle, finite, are needed")
    if singular:
        found, needs = _on_the_line(both[0], box), _line(both[0])
    else:
        turns = [[_turns(angle, *bound) for angle, bound in zip(family, box, strict=True)] for family in both]
        found = [np.array(angles) for choice in turns for angles in itertools.product(*choice)]
        needs = " or ".join("(" + ", ".join(f"{angle:.6g}" for angle in family) + ")" for family in both)
    allowed = ", ".join(f"{name} {low:.6g} to {high:.6g}" for name, (low, high) in zip("αβγ", box, strict=True))
    reason = f"out of reach: it takes (α, β, γ) = {needs} rad up to whole turns; the limits are {allowed}"
    return Solutions(_sorted(found), singular, "" if found else reason)


def rotation_towards(chain: Chain, direction: Array, roll: Array | float = 0.0) -> Array:
    """Compute the rotation (..., 3, 3) with the tool along ``direction``, turned by ``roll`` about its own axis.

    It is Rx(α) Ry(β) Rz(roll) A with |β| ≤ π/2, and A the shortest turn of the lever to −z, which is no turn on the
    shipped wrist: there, roll is the γ of the first family. Towards world ±x, roll is counted from α = 0; near there,
    at a distance of s, an error ε of the direction turns the tool about its own axis by ε / s.

    Args:
        chain: the wrist.
        direction: unit vectors (..., 3), world frame, from the centre of the ball to the tip.
        roll: angle about the tool's axis, (...) [rad].

    Raises:
        ParameterError: a direction is not a unit vector, or a roll is not finite.
    """
    u, roll = np.asarray(direction, float), np.asarray(roll, float)
    if u.shape[-1:] != (3,) or not np.all(np.abs(np.linalg.norm(u, axis=-1) - 1.0) <= TOLERANCE):
        raise ParameterError("direction: unit vectors of three numbers are needed; divide each by its length")
    if not np.isfinite(roll).all():
        raise ParameterError("roll: finite numbers [rad] are needed")
    across = np.hypot(u[..., 1], u[..., 2])
    alpha = np.where(across > SINGULAR, np.arctan2(u[..., 1], -u[..., 2]), 0.0)
    beta = np.arctan2(-u[..., 0], across)
    swing = matrix_of_angles(np.stack(np.broadcast_arrays(alpha, beta, roll), axis=-1))
    straight: Array = Rotation.align_vectors([[0.0, 0.0, -1.0]], [chain.lever])[0].as_matrix()
    return swing @ straight


def angles_of_direction(chain: Chain, direction: Array, roll: float = 0.0, limits: Array | None = None) -> Solutions:
    """Find all angles for one tool direction (3,) and roll [rad], as :func:`rotation_towards` defines them.

    Raises:
        ParameterError: the direction is not a unit vector, the roll not finite, or the limits not valid.
    """
    return angles_of_rotation(rotation_towards(chain, direction, roll), limits)


def angles_of_tip(chain: Chain, tip: Array, roll: float = 0.0, limits: Array | None = None) -> Solutions:
    """Find all angles for one tip position (3,) [m], world frame, on the sphere of the lever about the ball.

    Raises:
        ParameterError: the tip or the roll is not finite, or the limits are not valid.
    """
    place = np.asarray(tip, float)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise ParameterError(f"tip {place.tolist()}: a position of three finite numbers [m] is needed")
    arm = place - chain.base[:3, 3]
    distance, length = float(np.linalg.norm(arm)), float(np.linalg.norm(chain.lever))
    if not abs(distance - length) <= TOLERANCE * length:
        reason = f"out of reach: {distance:.9g} m from the centre of the ball; the tip is always at {length:.9g} m"
        return Solutions(np.empty((0, 3)), False, reason)
    return angles_of_direction(chain, arm / distance, roll, limits)


def _turns(angle: float, low: float, high: float) -> Array:
    """Return the angle plus every number of whole turns within the limits."""
    first, last = np.ceil((low - SLACK - angle) / TURN), np.floor((high + SLACK - angle) / TURN)
    turns: Array = angle + TURN * np.arange(first, last + 1.0)
    return turns


def _on_the_line(angles: Array, box: Array) -> list[Array]:
    """Return one set of angles for each segment of the line α ± γ = const within the limits."""
    sign = np.sign(angles[1])
    (low, high), other = box[0], np.sort(sign * box[2])  # of α, and of ±γ
    found = []
    for beta in _turns(angles[1], *box[1]):
        for total in _turns(angles[0] + sign * angles[2], low + other[0], high + other[1]):
            alpha = np.clip(0.5 * total, max(low, total - other[1]), min(high, total - other[0]))
            found.append(np.array([alpha, beta, sign * (total - alpha)]))
    return found


def _line(angles: Array) -> str:
    """Describe the line in words."""
    total = angles[0] + np.sign(angles[1]) * angles[2]
    return f"(α, {angles[1]:.6g}, γ) with α {'+' if angles[1] > 0.0 else '−'} γ = {total:.6g}"


def _sorted(found: list[Array]) -> Array:
    return np.array(sorted(found, key=lambda angles: float(np.linalg.norm(angles)))).reshape(-1, 3)
