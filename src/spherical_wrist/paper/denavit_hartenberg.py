"""Kinematics of the wrist as a Denavit-Hartenberg chain of three joints, eq. (3) to (8): tip from angles.

The ball joint is three joints whose axes meet in its centre. With the standard convention, each link is first turned
by θ and moved by d along its joint axis, then moved by a and turned by the twist along the new x axis:

    | joint | θ           | d       | a               | twist |
    |-------|-------------|---------|-----------------|-------|
    | 1     | α + π/2     | 0       | 0               | π/2   |
    | 2     | β + π/2     | 0       | 0               | π/2   |
    | 3     | γ + φ       | lever_z | √(lx² + ly²)    | 0     |

φ = atan2(ly, lx) is the heading of the lever; the shipped wrist has the lever (0, 0, −115 mm), so φ = a = 0 and
d₃ = −115 mm. The constant rotation P before the chain aligns joint axis 1 with world x; after the chain comes the
constant rotation Rz(−φ). With both, its rotation is Rx(α) Ry(β) Rz(γ). (P turns z to x, x to y and y to z;
P Rz P Rz P Rz is the chain, and P = Rz(π/2) Rx(π/2) is one U·V of eq. (4).)

Angles are (3,) or (..., 3) [rad]; lengths are in metres, rotations body → world, positions in the world frame.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.paper.angle_chart import stacked
from spherical_wrist.wrist import Wrist

QUARTER = 0.5 * np.pi


def joint_rotation(theta: Array) -> Array:
    """Compute U (..., 3, 3) of eq. (5): rotation by θ about the joint's axis, z."""
    s, c = np.sin(theta), np.cos(theta)
    zero, one = np.zeros_like(s), np.ones_like(s)
    return stacked([[c, -s, zero], [s, c, zero], [zero, zero, one]])


def twist_rotation(twist: Array) -> Array:
    """Compute V (..., 3, 3) of eq. (6): rotation by the link's twist α about its x; the paper writes V(θ)."""
    s, c = np.sin(twist), np.cos(twist)
    zero, one = np.zeros_like(s), np.ones_like(s)
    return stacked([[one, zero, zero], [zero, c, -s], [zero, s, c]])


class Link(NamedTuple):
    """Row of the table.

    Attributes:
        offset: θ for an angle of zero [rad].
        d: displacement along the joint's axis [m].
        a: displacement along the link's x axis [m].
        twist: angle from the joint's axis to the next one, about the link's x axis [rad].
    """

    offset: float
    d: float
    a: float
    twist: float

    def rotation(self, angle: Array) -> Array:
        """Compute U(θ) V(twist) (..., 3, 3), eq. (4): the next frame in the joint's."""
        return joint_rotation(angle + self.offset) @ twist_rotation(np.asarray(self.twist))

    def transform(self, angle: Array) -> Array:
        """Compute the same with the translation (a cos θ, a sin θ, d), (..., 4, 4): one factor of eq. (8)."""
        theta = np.asarray(angle + self.offset)
        place = [self.a * np.cos(theta), self.a * np.sin(theta), np.full_like(theta, self.d)]
        return _homogeneous(self.rotation(angle), np.stack(place, axis=-1))


@dataclass(frozen=True)
class Chain:
    """Denavit-Hartenberg chain of a wrist.

    Attributes:
        base: transform from the frame of joint 1 to the world (4, 4): the centre of the ball, and P.
        links: the table.
        tool: rotation from the body frame to the last frame (3, 3), Rz(−φ).
        lever: vector from the centre of the ball to the tip, body frame [m].
    """

    base: Array
    links: tuple[Link, Link, Link]
    tool: Array
    lever: Array

    @classmethod
    def of(cls, wrist: Wrist) -> "Chain":
        """Create the chain of a wrist.

        Raises:
            ParameterError: the tip is at the centre of the ball, or the wrist's mount is turned against the world.
        """
        if not np.array_equal(wrist.mount, np.eye(3)):
            raise ParameterError(
                "the chain begins along the world's axes, and this wrist's mount is turned against them"
            )
        x, y, z = (float(v) for v in wrist.lever)
        if not np.linalg.norm(wrist.lever) > 0.0:
            raise ParameterError("the tip is at the centre of the ball: a tool needs length; move the site 'tip' away")
        heading = float(np.arctan2(y, x))
        right = Link(QUARTER, 0.0, 0.0, QUARTER)
        base = _homogeneous(right.rotation(np.asarray(0.0)), wrist.anchor)
        tool = joint_rotation(np.asarray(-heading))
        return cls(base, (right, right, Link(heading, z, float(np.hypot(x, y)), 0.0)), tool, wrist.lever.copy())

    def rotation(self, angles: Array) -> Array:
        """Compute the body's rotation Rx(α) Ry(β) Rz(γ) (..., 3, 3): eq. (7) with the constant rotations."""
        first, second, third = (link.rotation(np.asarray(angles)[..., i]) for i, link in enumerate(self.links))
        return self.base[:3, :3] @ first @ second @ third @ self.tool

    def transform(self, angles: Array) -> Array:
        """Compute the tip's frame in the world (..., 4, 4), eq. (8): body axes, and the tip's position.

        The paper's eq. (8) has no translation, which puts the tip at the centre of the ball; this one has.
        """
        first, second, third = (link.transform(np.asarray(angles)[..., i]) for i, link in enumerate(self.links))
        return self.base @ first @ second @ third @ _homogeneous(self.tool, np.zeros(3))

    def tip(self, angles: Array) -> Array:
        """Compute the tip's position (..., 3) [m]."""
        return self.transform(angles)[..., :3, 3]

    def residual(self, target: Array, angles: Array) -> Array:
        """Compute Ψ(X, q) of eq. (3), (..., 3) [rad]: rotation vector, body frame, from the chain's attitude to X.

        It is zero if and only if the angles q reach the attitude X, (..., 3, 3).
        """
        turn = np.swapaxes(self.rotation(angles), -1, -2) @ target
        vectors: Array = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_rotvec()
        return vectors.reshape(turn.shape[:-1])


def _homogeneous(rotation: Array, place: Array) -> Array:
    """Build [[R, p], [0, 1]] (..., 4, 4) from R (..., 3, 3) and p (..., 3)."""
    matrix = np.zeros((*rotation.shape[:-2], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = rotation, place, 1.0
    return matrix
