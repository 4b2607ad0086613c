"""Angles q = (α, β, γ) of the paper as a chart of attitude: R = Rx(α) Ry(β) Rz(γ), body → world.

Their rates follow from the body rate ω by the Jacobian E, which does not depend on α, with c = cos and s = sin:

    ω = E q̇,    E(β, γ) = [Rzᵀ Ryᵀ x̂, Rzᵀ ŷ, ẑ] = |  cβ cγ   sγ   0 |       ω̇ = E q̈ + Ė q̇
                                                  | −cβ sγ   cγ   0 |
                                                  |  sβ       0   1 |

det E = cos β: at β = ±π/2 the axes of α and γ coincide, E has no inverse, and only α ± γ is determined by the attitude.
The wrist itself has no such point; for this reason the loop does not use angles.

Every function takes one set of angles (3,) or many (..., 3), in rad, rad/s and rad/s². Rates and accelerations of the
attitude are those of the body frame.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from spherical_wrist.arrays import Array
from spherical_wrist.errors import WristError

SINGULAR = 1e-12
"""|cos β| below which an attitude counts as singular: the rounding noise of an attitude in double precision."""


class SingularChartError(WristError):
    """Angles too near β = ±π/2 to compute their rates or accelerations from a torque."""


def attitude_of_angles(angles: Array) -> Array:
    """Compute the quaternions (..., 4) of Rx(α) Ry(β) Rz(γ)."""
    quaternions: Array = _rotation(angles).as_quat(scalar_first=True)
    return quaternions.reshape(*np.shape(angles)[:-1], 4)


def matrix_of_angles(angles: Array) -> Array:
    """Compute the rotation matrices Rx(α) Ry(β) Rz(γ), (..., 3, 3)."""
    matrices: Array = _rotation(angles).as_matrix()
    return matrices.reshape(*np.shape(angles), 3)


def angles_of_attitude(attitude: Array) -> Array:
    """Compute the angles (..., 3) of quaternions (..., 4) of any norm: α, γ in (−π, π], β in [−π/2, π/2].

    The other angles of the same attitude are :func:`other_family` of these, plus whole turns. Where cos β is below
    ``SINGULAR``, only α + γ (β = π/2) or α − γ (β = −π/2) is determined; both angles get half of it, which is the
    shortest answer.

    From the quaternion, cos β/2 ± sin β/2 times the sine and cosine of (α ± γ)/2 are sums of two components; this
    keeps the attitude to rounding arbitrarily near the singularity, where SciPy's ``as_euler`` is off by up to 1e-7.
    """
    w, x, y, z = np.moveaxis(np.asarray(attitude, float), -1, 0)
    plus, minus = np.hypot(x + z, w + y), np.hypot(x - z, w - y)
    beta = 2.0 * np.arctan2(plus, minus) - 0.5 * np.pi
    # cos β = 2 plus minus / (plus² + minus²), and at the singularity one of the two is zero
    scale = 0.5 * SINGULAR * (plus + minus)
    total = np.where(plus > scale, 2.0 * np.arctan2(x + z, w + y), 0.0)
    difference = np.where(minus > scale, 2.0 * np.arctan2(x - z, w - y), 0.0)
    # each is known up to two turns; if only one is determined, one turn is enough
    alone = (plus <= scale) | (minus <= scale)
    total, difference = (np.where(alone, wrapped(angle), angle) for angle in (total, difference))
    return np.stack([wrapped(0.5 * (total + difference)), beta, wrapped(0.5 * (total - difference))], axis=-1)


def other_family(angles: Array) -> Array:
    """Return the other angles (..., 3) of the same attitude, (α + π, π − β, γ + π), each in (−π, π]."""
    return wrapped(np.array([1.0, -1.0, 1.0]) * angles + np.pi)


def wrapped(angle: Array) -> Array:
    """Wrap an angle to (−π, π]; one in that range is returned bit for bit."""
    turned = angle - 2.0 * np.pi * np.ceil(angle / (2.0 * np.pi) - 0.5)
    within: Array = np.clip(turned, -np.pi, np.pi)  # rounding may exceed the end
    return within


def rate_jacobian(angles: Array) -> Array:
    """Compute E (..., 3, 3), with ω = E q̇."""
    (sb, cb), (sc, cc) = _sines(angles)
    zero, one = np.zeros_like(sb), np.ones_like(sb)
    return stacked([[cb * cc, sc, zero], [-cb * sc, cc, zero], [sb, zero, one]])


def rate_jacobian_derivative(angles: Array, rates: Array) -> Array:
    """Compute Ė (..., 3, 3) [1/s] along q̇."""
    (sb, cb), (sc, cc) = _sines(angles)
    b, c = rates[..., 1], rates[..., 2]
    zero = np.zeros_like(sb * b)
    return stacked(
        [
            [-sb * cc * b - cb * sc * c, cc * c, zero],
            [sb * sc * b - cb * cc * c, -sc * c, zero],
            [cb * b, zero, zero],
        ]
    )


def body_rate(angles: Array, rates: Array) -> Array:
    """Compute ω = E q̇ (..., 3) [rad/s]."""
    return product(rate_jacobian(angles), rates)


def body_acceleration(angles: Array, rates: Array, accelerations: Array) -> Array:
    """Compute ω̇ = E q̈ + Ė q̇ (..., 3) [rad/s²]."""
    return product(rate_jacobian(angles), accelerations) + product(rate_jacobian_derivative(angles, rates), rates)


def angle_rates(angles: Array, rate: Array) -> Array:
    """Compute q̇ = E⁻¹ ω (..., 3) [rad/s].

    Raises:
        SingularChartError: an attitude is singular.
    """
    require_regular(angles, 1.0 / SINGULAR)
    (sb, cb), (sc, cc) = _sines(angles)
    first = (cc * rate[..., 0] - sc * rate[..., 1]) / cb
    return np.stack([first, sc * rate[..., 0] + cc * rate[..., 1], rate[..., 2] - sb * first], axis=-1)


def angle_accelerations(angles: Array, rates: Array, acceleration: Array) -> Array:
    """Compute q̈ = E⁻¹ (ω̇ − Ė q̇) (..., 3) [rad/s²] from the angle rates q̇ and the body acceleration ω̇.

    Raises:
        SingularChartError: an attitude is singular.
    """
    return angle_rates(angles, acceleration - product(rate_jacobian_derivative(angles, rates), rates))


def condition(angles: Array) -> Array:
    """Compute the condition number (...) of E in the 2-norm, (1 + |sin β|) / |cos β|: 1 at β = 0, infinite at ±π/2.

    The singular values of E are √(1 + |sin β|), 1 and √(1 − |sin β|).
    """
    beta = np.asarray(angles, float)[..., 1]
    ratio: Array = (1.0 + np.abs(np.sin(beta))) / np.abs(np.cos(beta))
    return ratio


def require_regular(angles: Array, largest: float) -> None:
    """Check that the chart can be inverted at all of these angles.

    Raises:
        SingularChartError: the condition number of E is above ``largest`` somewhere, or an angle is not finite.
    """
    conditions = np.atleast_1d(condition(angles))
    if not np.all(conditions <= largest):
        worst = int(np.argmin(conditions <= largest))
        beta = np.asarray(angles, float).reshape(-1, 3)[worst, 1]
        raise SingularChartError(
            f"β = {beta:.9g} rad: the angles are singular at β = ±π/2, and here the condition number of their rate "
            f"Jacobian is {conditions.flat[worst]:.3g}; it must be at most {largest:.3g}: stay further away, or "
            "use attitude and body rate, which have no such point"
        )


def stacked(rows: list[list[Array]]) -> Array:
    """Stack rows of components (...) to matrices (..., n, m)."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def product(matrix: Array, vector: Array) -> Array:
    """Multiply matrices (..., n, m) by vectors (..., m)."""
    result: Array = np.einsum("...ij,...j->...i", matrix, vector)
    return result


def _rotation(angles: Array) -> Rotation:
    # capital letters: about the turned axes; SciPy before 1.17 takes no more than two dimensions
    return Rotation.from_euler("XYZ", np.asarray(angles, float).reshape(-1, 3))


def _sines(angles: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return sine and cosine of β and of γ."""
    beta, gamma = np.asarray(angles, float)[..., 1], np.asarray(angles, float)[..., 2]
    return (np.sin(beta), np.cos(beta)), (np.sin(gamma), np.cos(gamma))
