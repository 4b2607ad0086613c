"""The torque of a spherical motor: linear in its coil currents, by a map that turns with the rotor.

With p magnetic poles around the rotor, the flux through a coil in the direction s (fixed in the world) is the harmonic
Φ(u) = (k/m) Re (u_x + i u_y)^m of u = R(q)ᵀ s, m = p/2: for eight poles sin⁴θ cos 4φ, the lowest spherical harmonic
with that many poles, which outside the rotor decays the least. A current i in it has the energy i Φ(u). Under a small
turn δθ of the rotor in its own frame u changes by u × δθ, so that the coil's torque, in the body frame, is
i ∇Φ(u) × u: never about the coil's own axis. The columns ∇Φ(u_j) × u_j are the 3 × N torque map K(q), τ = K i;
k [N·m/A] is the largest torque per ampere, on the equator.

The currents of least norm that make τ are i = Kᵀ (K Kᵀ)⁻¹ τ, and so those of least copper loss (Yan et al., 2011,
doi:10.1007/978-94-007-1646-9_3). Where one exceeds the limit, all are scaled down alike,
which keeps the direction of the torque.
"""

from math import acos, cos, pi, sqrt
from typing import Any

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.so3 import Quaternion, Vector3, cross, rotate


def coil_torque(attitude: Quaternion, direction: Vector3, order: int) -> Vector3:
    """Return the torque of one coil of unit strength per ampere, body frame: ∇Φ(u) × u / k, with m = ``order``."""
    back = (attitude[0], -attitude[1], -attitude[2], -attitude[3])
    u = rotate(back, direction)
    x, y = 1.0, 0.0  # (u_x + i u_y)^(m − 1)
    for _ in range(order - 1):
        x, y = x * u[0] - y * u[1], x * u[1] + y * u[0]
    return cross((x, -y, 0.0), u)


def fill_map(attitude: Quaternion, coils: Array, strength: Array, order: int, K: Array) -> None:
    """Write the torque map K (3, N) [N·m/A] at an attitude.

    Args:
        attitude: of the rotor.
        coils: directions of the coils, (N, 3), world frame.
        strength: largest torque per ampere of each coil [N·m/A], (N,).
        order: m, half the number of poles.
        K: written.
    """
    for j in range(len(coils)):
        t = coil_torque(attitude, (coils[j, 0], coils[j, 1], coils[j, 2]), order)
        for i in range(3):
            K[i, j] = strength[j] * t[i]


def gram(K: Array) -> tuple[float, float, float, float, float, float]:
    """Return K Kᵀ as its entries 00, 11, 22, 01, 02, 12."""
    a = b = c = d = e = f = 0.0
    for j in range(K.shape[1]):
        x, y, z = K[0, j], K[1, j], K[2, j]
        a, b, c = a + x * x, b + y * y, c + z * z
        d, e, f = d + x * y, e + x * z, f + y * z
    return a, b, c, d, e, f


def condition(g: Any) -> float:
    """Return the condition number of K from the entries of K Kᵀ, the root of the ratio of its extreme eigenvalues.

    The eigenvalues of a symmetric 3 × 3 matrix in closed form (Smith, Comm. ACM 4:168, 1961), good to 1e-8 of the
    largest; infinite where K has not rank three.
    """
    a, b, c, d, e, f = g
    mean = (a + b + c) / 3.0
    a, b, c = a - mean, b - mean, c - mean
    spread = sqrt((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) / 6.0)
    if spread == 0.0:
        return 1.0 if mean > 0.0 else np.inf
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / (2.0 * spread * spread * spread)
    angle = acos(min(1.0, max(-1.0, half))) / 3.0
    largest, smallest = mean + 2.0 * spread * cos(angle), mean + 2.0 * spread * cos(angle + 2.0 * pi / 3.0)
    return sqrt(largest / smallest) if smallest > 1e-14 * largest else np.inf


def largest_torques(K: Array, g: Any, limit: float) -> Vector3:
    """Return the largest torque about each axis alone that currents within ±``limit`` [A] make [N·m].

    The currents of least norm for a unit torque about axis i are Kᵀ (K Kᵀ)⁻¹ e_i.

    Args:
        K: torque map as the controller believes it.
        g: ``gram(K)``.
        limit: largest current [A].
    """
    a, b, c, d, e, f = g
    A, D, E = b * c - f * f, e * f - d * c, d * f - b * e  # cofactors of K Kᵀ
    determinant = a * A + d * D + e * E
    scale = a + b + c
    if determinant <= 1e-14 * scale * scale * scale:
        return (0.0, 0.0, 0.0)
    B, C, F = a * c - e * e, a * b - d * d, d * e - a * f
    x = y = z = 0.0
    for j in range(K.shape[1]):
        u, v, w = K[0, j], K[1, j], K[2, j]
        x = max(x, abs(A * u + D * v + E * w))
        y = max(y, abs(D * u + B * v + F * w))
        z = max(z, abs(E * u + F * v + C * w))
    unit = limit * determinant
    return (unit / x, unit / y, unit / z)


def allocate(K: Array, g: Any, torque: Vector3, limit: float, current: Array) -> bool:
    """Write the currents of least norm [A], (N,), that make ``torque`` [N·m]; whether the limit cut them.

    Args:
        K: torque map as the controller believes it.
        g: ``gram(K)``.
        torque: wanted torque (3,) [N·m].
        limit: largest current [A].
        current: written; zeros where K has not rank three, which counts as cut.
    """
    a, b, c, d, e, f = g
    A, D, E = b * c - f * f, e * f - d * c, d * f - b * e  # cofactors of K Kᵀ
    determinant = a * A + d * D + e * E
    scale = a + b + c
    if determinant <= 1e-14 * scale * scale * scale:
        for j in range(len(current)):
            current[j] = 0.0
        return True
    B, C, F = a * c - e * e, a * b - d * d, d * e - a * f
    x = (A * torque[0] + D * torque[1] + E * torque[2]) / determinant
    y = (D * torque[0] + B * torque[1] + F * torque[2]) / determinant
    z = (E * torque[0] + F * torque[1] + C * torque[2]) / determinant
    largest = 0.0
    for j in range(len(current)):
        current[j] = K[0, j] * x + K[1, j] * y + K[2, j] * z
        largest = max(largest, abs(current[j]))
    if largest <= limit:
        return False
    for j in range(len(current)):
        current[j] *= limit / largest
    return True
