"""References given by the paper's angles α, β, γ: R = Rx(α) Ry(β) Rz(γ)."""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.parameters import NonNegative, NonNegativeVector, Vector, quantity
from spherical_wrist.reference.base import Reference, motion_of


def motion_of_angles(angles: Array, rates: Array, accelerations: Array) -> npt.NDArray[Any]:
    """Return the motion of R = Rx(α) Ry(β) Rz(γ) from angles [rad] and their first two derivatives, each (n, 3).

    With the columns of E(β, γ) = [Rzᵀ Ryᵀ x̂, Rzᵀ ŷ, ẑ], the body rate is ω = E (α̇, β̇, γ̇), and its derivative
    ω̇ = E (α̈, β̈, γ̈) + Ė (α̇, β̇, γ̇).
    """
    a1, b1, c1 = rates.T
    a2, b2, c2 = accelerations.T
    (sb, cb), (sc, cc) = ((np.sin(x), np.cos(x)) for x in angles.T[1:])
    rate = np.stack([cb * cc * a1 + sc * b1, -cb * sc * a1 + cc * b1, sb * a1 + c1], axis=1)
    turning = np.stack(
        [
            -(sb * cc * b1 + cb * sc * c1) * a1 + cc * c1 * b1,
            (sb * sc * b1 - cb * cc * c1) * a1 - sc * c1 * b1,
            cb * b1 * a1,
        ],
        axis=1,
    )
    direct = np.stack([cb * cc * a2 + sc * b2, -cb * sc * a2 + cc * b2, sb * a2 + c2], axis=1)
    return motion_of(quaternion_of_angles(angles), rate, direct + turning)


def quaternion_of_angles(angles: Array) -> Array:
    """Return quaternions (n, 4) of Rx(α) Ry(β) Rz(γ) from angles [rad] (n, 3).

    SciPy's ``from_euler`` gives the same, but would take a third of the time of a whole run.
    """
    (sa, ca), (sb, cb), (sc, cc) = ((np.sin(half), np.cos(half)) for half in 0.5 * angles.T)
    w, x, y, z = ca * cb, sa * cb, ca * sb, sa * sb  # of Rx Ry
    return np.stack([w * cc - z * sc, x * cc + y * sc, y * cc - x * sc, w * sc + z * cc], axis=1)


def motion_of_waves(time: Array, amplitude: Array, frequency: Array, phase: Array) -> npt.NDArray[Any]:
    """Return the motion of angles A sin(2π f t + φ), one wave per angle; A [rad], f [Hz] and φ [rad] are (3,)."""
    omega = 2.0 * np.pi * frequency
    argument = omega * time[:, None] + phase
    angles = amplitude * np.sin(argument)
    return motion_of_angles(angles, amplitude * omega * np.cos(argument), -(omega**2) * angles)


class Sinusoid(Reference):
    """The paper's angles α, β, γ, each A sin(2π f t + φ) with one frequency: R = Rx(α) Ry(β) Rz(γ), body → world."""

    amplitude: NonNegativeVector = quantity((0.5, 0.5, 0.5), "rad", "amplitude of α, β, γ")
    frequency: NonNegative = quantity(0.5, "Hz", "frequency")
    phase: Vector = quantity((0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0), "rad", "phase of α, β, γ")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        return motion_of_waves(time, np.array(self.amplitude), np.full(3, self.frequency), np.array(self.phase))


class Lissajous(Reference):
    """The paper's angles, each A sin(2π f t + φ), with three incommensurate frequencies: the motion never repeats.

    The attitude is R = Rx(α) Ry(β) Rz(γ), body → world: α about x, then β about the turned y, then γ about the turned
    z, which is that of the body. Parameters are in the order α, β, γ.
    """

    amplitude: NonNegativeVector = quantity((0.5, 0.5, 0.5), "rad", "amplitude of α, β, γ")
    frequency: NonNegativeVector = quantity(
        tuple(round(0.3 * np.sqrt(n), 6) for n in (2.0, 3.0, 5.0)), "Hz", "frequency of α, β, γ"
    )
    phase: Vector = quantity((0.0, 0.0, 0.0), "rad", "phase of α, β, γ")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        return motion_of_waves(time, np.array(self.amplitude), np.array(self.frequency), np.array(self.phase))
