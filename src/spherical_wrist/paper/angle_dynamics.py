"""Dynamics of the spherical motor in the paper's angles, eq. (1) and (2).

With q = (α, β, γ), R = Rx(α) Ry(β) Rz(γ) and ω = E(β, γ) q̇ (see :mod:`spherical_wrist.paper.angle_chart`), the kinetic
energy is ½ q̇ᵀ H q̇ and Lagrange's equations are eq. (1), with gravity G and damping D, which the paper leaves out:

    H(q) q̈ + B(q) [α̇β̇, α̇γ̇, β̇γ̇] + C(q) [α̇², β̇², γ̇²] + G(q) + D(q) q̇ = Q

**Torque.** H is symmetric, as the paper says, for the *generalised* torque only: Q = Eᵀ τ, with τ the body torque
of the motors and of the loop. Its components push along the three axes of the angles: world x, the y axis turned by α,
and body z. They are not at right angles to each other unless β = 0. The paper's (τ_x, τ_y, τ_z) is therefore read as Q;
a body torque would make the leading matrix I E, which is not symmetric.

**Singularity.** At β = ±π/2 the chart is singular and so is H = Eᵀ I E: rates and accelerations of the angles grow
without bound while the wrist moves smoothly. cond H grows as the square of cond E.

This form is for reading and comparison. The loop uses the body-frame form (:mod:`spherical_wrist.dynamics`).
"""

from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ModelError
from spherical_wrist.paper.angle_chart import (
    angle_accelerations,
    attitude_of_angles,
    body_rate,
    matrix_of_angles,
    product,
    rate_jacobian,
    rate_jacobian_derivative,
    require_regular,
)
from spherical_wrist.wrist import Wrist

LARGEST_CONDITION = 1e3
"""Largest condition number of E for eq. (2): |β| up to 2·10⁻³ rad (0.11°) below π/2.

H is then inverted with a condition number up to about 10⁶ times that of the inertia, which leaves nine digits."""

PAIRS = ((0, 1), (0, 2), (1, 2))
"""Indices of the products [α̇β̇, α̇γ̇, β̇γ̇] that B multiplies."""


@dataclass(frozen=True)
class AngleDynamics:
    """Wrist of eq. (1). Angles, rates and torques are (3,) or (..., 3); matrices are (..., 3, 3).

    Attributes:
        inertia: I (3, 3) about the centre of the ball, body frame, armature included [kg·m²].
        moment: mass times centre of mass (3,), from the centre of the ball, body frame [kg·m].
        damping: viscous damping of the joint [N·m·s/rad].
        gravity: acceleration of gravity (3,), in the frame of the wrist's mount [m/s²].
    """

    inertia: Array
    moment: Array
    damping: float
    gravity: Array

    @classmethod
    def of(cls, wrist: Wrist) -> "AngleDynamics":
        """Read the numbers from a compiled wrist.

        Joint limits and contacts are left out: they are constraints, not part of eq. (1).

        Raises:
            ModelError: eq. (1) with gravity and damping is not the whole of the model's dynamics.
        """
        model = wrist.model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)  # at the start, where the body frame is the mount
        inertia = np.empty((3, 3))
        mujoco.mj_fullM(model, data, inertia)
        weight = (model.body_mass * (1.0 - model.body_gravcomp))[wrist.moving]  # less gravity compensation
        moment = weight @ (data.xipos[wrist.moving] - wrist.anchor) @ wrist.mount
        found = cls(inertia, moment, float(model.dof_damping[0]), model.opt.gravity @ wrist.mount)
        _check(found, model)
        return found

    def inertia_matrix(self, angles: Array) -> Array:
        """Compute H = Eᵀ I E [kg·m²], eq. (1): symmetric, positive definite where cos β ≠ 0, the same for every α."""
        E = rate_jacobian(angles)
        return _transposed(E) @ self.inertia @ E

    def christoffel(self, angles: Array) -> Array:
        """Compute the Christoffel symbols of the first kind, (..., 3, 3, 3).

        Γ_ijk = ½ (∂H_ij/∂q_k + ∂H_ik/∂q_j − ∂H_jk/∂q_i). The derivatives are exact: ∂H/∂q_k = (∂E/∂q_k)ᵀ I E + its
        transpose, and ∂E/∂q_k is Ė along the unit rate k.
        """
        E = rate_jacobian(angles)
        products = [_transposed(rate_jacobian_derivative(angles, unit)) @ self.inertia @ E for unit in np.eye(3)]
        slopes = np.stack([half + _transposed(half) for half in products], axis=-1)  # [..., i, j, k] = ∂H_ij/∂q_k
        return 0.5 * (slopes + np.swapaxes(slopes, -1, -2) - np.moveaxis(slopes, -1, -3))

    def coriolis_matrix(self, angles: Array) -> Array:
        """Compute B [kg·m²], eq. (1), the factor of [α̇β̇, α̇γ̇, β̇γ̇]. Each pair occurs twice: B_i,jk = 2 Γ_ijk."""
        symbols = self.christoffel(angles)
        return np.stack([2.0 * symbols[..., j, k] for j, k in PAIRS], axis=-1)

    def centrifugal_matrix(self, angles: Array) -> Array:
        """Compute C [kg·m²], eq. (1), the factor of [α̇², β̇², γ̇²]: C_ij = Γ_ijj."""
        return np.stack([self.christoffel(angles)[..., j, j] for j in range(3)], axis=-1)

    def velocity_matrix(self, angles: Array, rates: Array) -> Array:
        """Compute N_ij = Σ_k Γ_ijk q̇_k [kg·m²/s]: N q̇ is the B and C part of eq. (1), and Ḣ − 2N is skew-symmetric.

        This is the N of eq. (36), Sᵀ (Ḣ − 2N) S = 0. Other factorisations of the same torque do not have the property.
        """
        result: Array = np.einsum("...ijk,...k->...ij", self.christoffel(angles), np.asarray(rates, float))
        return result

    def gravity_torque(self, angles: Array) -> Array:
        """Compute G = ∂V/∂q (..., 3) [N·m] of V = −(R m r_c) · g: the generalised torque that holds the wrist."""
        down = product(_transposed(matrix_of_angles(angles)), self.gravity)
        return generalised_torque(angles, np.cross(down, self.moment))

    def damping_matrix(self, angles: Array) -> Array:
        """Compute D = d Eᵀ E [N·m·s/rad]."""
        E = rate_jacobian(angles)
        return self.damping * (_transposed(E) @ E)

    def bias(self, angles: Array, rates: Array) -> Array:
        """Compute eq. (1) without H q̈: generalised Coriolis, centrifugal, gravity and damping torque (..., 3) [N·m]."""
        rates = np.asarray(rates, float)
        products = np.stack([rates[..., j] * rates[..., k] for j, k in PAIRS], axis=-1)
        return (
            product(self.coriolis_matrix(angles), products)
            + product(self.centrifugal_matrix(angles), rates**2)
            + self.gravity_torque(angles)
            + product(self.damping_matrix(angles), rates)
        )

    def torque(self, angles: Array, rates: Array, accelerations: Array) -> Array:
        """Compute eq. (1): the generalised torque Q (..., 3) [N·m] of a motion. It holds everywhere."""
        return product(self.inertia_matrix(angles), accelerations) + self.bias(angles, rates)

    def acceleration(self, angles: Array, rates: Array, torque: Array) -> Array:
        """Compute eq. (2): q̈ = H⁻¹ (Q − bias) (..., 3) [rad/s²] under a generalised torque Q [N·m].

        Raises:
            SingularChartError: the condition number of E is above ``LARGEST_CONDITION``.
        """
        require_regular(angles, LARGEST_CONDITION)
        return _solved(self.inertia_matrix(angles), torque - self.bias(angles, rates))


def generalised_torque(angles: Array, torque: Array) -> Array:
    """Compute Q = Eᵀ τ (..., 3) [N·m], the body torque τ along the axes of α, β and γ: Q · q̇ = τ · ω."""
    return product(_transposed(rate_jacobian(angles)), torque)


def body_torque(angles: Array, torque: Array) -> Array:
    """Compute τ = E⁻ᵀ Q (..., 3) [N·m], the body torque of a generalised torque Q, as the motors give it.

    Raises:
        SingularChartError: the condition number of E is above ``LARGEST_CONDITION``.
    """
    require_regular(angles, LARGEST_CONDITION)
    return _solved(_transposed(rate_jacobian(angles)), np.asarray(torque, float))


def _transposed(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def _solved(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, vector[..., None])[..., 0], np.float64)


def _check(found: AngleDynamics, model: mujoco.MjModel) -> None:
    """Compare with MuJoCo's inverse dynamics at two states: the model must have no forces that eq. (1) lacks."""
    free = copy(model)
    free.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    free.jnt_actgravcomp[:] = 0  # which inverse dynamics would count as a torque of the motors
    data = mujoco.MjData(free)
    angles, rates = np.array([[0.3, -0.5, 0.7], [-0.8, 0.4, 1.9]]), np.array([[7.0, -5.0, 3.0], [-2.0, 6.0, 4.0]])
    for q, v in zip(angles, rates, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = attitude_of_angles(q), body_rate(q, v), 0.0
        mujoco.mj_inverse(free, data)
        wanted = generalised_torque(q, data.qfrc_inverse)
        motion = found.torque(q, v, angle_accelerations(q, v, np.zeros(3)))
        if not np.allclose(motion, wanted, rtol=0.0, atol=1e-9 * (np.abs(wanted).max() + np.abs(motion).max())):
            raise ModelError(
                "eq. (1) has one rigid body, gravity and linear damping; this model has more: a spring, friction, "
                "a fluid, uneven armature, non-linear damping or a stage switched off: take it out of the MJCF"
            )
