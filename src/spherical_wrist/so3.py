"""Rotations as unit quaternions (w, x, y, z), body → world, without a singularity.

These plain functions of floats and tuples run interpreted, and are compiled into the closed loop. ``log`` has no
singularity up to and including a half turn, and gives the same result for q and −q. It is ambiguous only at an exact
half turn, where either sign of the axis is correct. Conventions are those of MuJoCo's ``mju_*`` functions. The last
functions do the same for arrays of many attitudes, in NumPy.
"""

from math import atan2, cos, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def quaternion_product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Compute the Hamilton product p ⊗ q, which rotates a vector from body to world by q first, then by p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


def relative_attitude(q: Quaternion, target: Quaternion) -> Quaternion:
    """Compute q⁻¹ ⊗ target: the target attitude relative to the body frame."""
    return quaternion_product((q[0], -q[1], -q[2], -q[3]), target)


def quaternion_exp(v: Vector3) -> Quaternion:
    """Compute the quaternion of the rotation vector v [rad]: (cos |v|/2, v/|v| sin |v|/2)."""
    angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    # below 1e-4 the second term of the series is under the rounding of the first
    scale = 0.5 - angle * angle / 48.0 if angle < 1e-4 else sin(0.5 * angle) / angle
    return (cos(0.5 * angle), scale * v[0], scale * v[1], scale * v[2])


def quaternion_log(q: Quaternion) -> Vector3:
    """Compute the shortest rotation vector v [rad], |v| ≤ π, with exp(v) = ±q. The norm of q does not matter."""
    w, x, y, z = q
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return (0.0, 0.0, 0.0)
    scale = 2.0 * atan2(sine, w) / sine
    return (scale * x, scale * y, scale * z)


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Compute the cross product a × b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rotate(q: Quaternion, v: Vector3) -> Vector3:
    """Compute R(q) v: a body-frame vector in the world frame."""
    u = (q[1], q[2], q[3])
    t = cross(u, v)
    t = (2.0 * t[0], 2.0 * t[1], 2.0 * t[2])
    s = cross(u, t)
    return (v[0] + q[0] * t[0] + s[0], v[1] + q[0] * t[1] + s[1], v[2] + q[0] * t[2] + s[2])


def attitude_error(q: Quaternion, desired: Quaternion) -> Vector3:
    """Compute the attitude error e = log(q⁻¹ ⊗ q_d) [rad], body frame: eq. (9), desired minus actual, on SO(3)."""
    return quaternion_log(relative_attitude(q, desired))


def rate_error(q: Quaternion, rate: Vector3, desired: Quaternion, desired_rate: Vector3) -> Vector3:
    """Compute the rate error ė = R(q⁻¹ q_d) ω_d − ω [rad/s], body frame; it is d/dt of e to first order in e only."""
    carried = rotate(relative_attitude(q, desired), desired_rate)
    return (carried[0] - rate[0], carried[1] - rate[1], carried[2] - rate[2])


def feed_forward(
    q: Quaternion, rate: Vector3, desired: Quaternion, desired_rate: Vector3, desired_acceleration: Vector3
) -> Vector3:
    """Compute the feed-forward R_e ω̇_d − ω × R_e ω_d [rad/s²], R_e = R(q⁻¹ q_d): the desired acceleration, body frame.

    It is d/dt (R_e ω_d): with ω̇ equal to it, the rate error ė is constant.
    """
    turn = relative_attitude(q, desired)
    acceleration = rotate(turn, desired_acceleration)
    transport = cross(rate, rotate(turn, desired_rate))
    return (acceleration[0] - transport[0], acceleration[1] - transport[1], acceleration[2] - transport[2])


class State(NamedTuple):
    """Attitude, and body-frame rate [rad/s]."""

    attitude: Quaternion
    rate: Vector3


def advance(q: Quaternion, rate: Vector3, acceleration: Vector3, time: float) -> State:
    """Compute the state after ``time`` [s] at constant body-frame acceleration [rad/s²], to second order in time."""
    half = 0.5 * time
    mean = (
        time * (rate[0] + half * acceleration[0]),
        time * (rate[1] + half * acceleration[1]),
        time * (rate[2] + half * acceleration[2]),
    )
    reached = (
        rate[0] + time * acceleration[0],
        rate[1] + time * acceleration[1],
        rate[2] + time * acceleration[2],
    )
    return State(quaternion_product(q, quaternion_exp(mean)), reached)


def rotation_vectors(attitudes: Array) -> Array:
    """Compute the shortest rotation vectors [rad], (n, 3), of attitudes (n, 4); see :func:`quaternion_log`.

    Rows that are not finite give vectors that are not.
    """
    with np.errstate(all="ignore"):
        w, v = attitudes[:, :1], attitudes[:, 1:]
        sine = np.sqrt(np.square(v).sum(axis=1, keepdims=True))
        angle = 2.0 * np.arctan2(sine, np.abs(w))
        vectors: Array = np.where(w < 0.0, -v, v) * (angle / np.where(sine > 0.0, sine, 1.0))
    return vectors


def products(p: Array, q: Array) -> Array:
    """Compute the Hamilton products p ⊗ q of quaternions (4,) or (n, 4), row by row; see :func:`quaternion_product`."""
    components: Any = quaternion_product(tuple(p.T), tuple(q.T))
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def inverses(q: Array) -> Array:
    """Compute the inverses of unit quaternions (4,) or (n, 4)."""
    inverse: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def attitude_errors(attitudes: Array, desired: Array) -> Array:
    """Compute log(q⁻¹ ⊗ q_d) [rad], (n, 3), of attitudes (n, 4) row by row; see :func:`attitude_error`."""
    return rotation_vectors(products(inverses(attitudes), desired))
