"""Reaching time of the sliding surface: the bound of eq. (18)–(22), and the time of a run.

The paper has one scalar s with s ṡ ≤ −ζ |s|, eq. (18). Here H Ṡ = Δ − K sw(S / φ) couples the axes through M = H⁻¹. As
long as |S_i| has not come down to the boundary layer, sw is at least σ there (1 for ``sign`` and ``saturation``, tanh 1
for ``tanh``) and at most 1 in size elsewhere, so that

    d/dt |S_i| ≤ −η_i,    η_i = M_ii (σ K_i − |Δ_i|) − Σ_{j≠i} |M_ij| (K_j + |Δ_j|)    [rad/s²],

which eq. (19)–(20) integrate to t_i ≤ (|S_i(0)| − φ_i) / η_i, eq. (21) for S(0) > 0 and (22) for S(0) < 0, where η_i is
positive. With a perfect model and a diagonal H it is K_i / H_ii. With ``sign`` (φ = 0) there is a second bound, which
survives coupling: V = ½ Sᵀ H S has V̇ ≤ −Σ (K_i − |Δ_i|) |S_i| ≤ −κ √(2 V / h), κ the smallest K_i − |Δ_i| and h the
largest eigenvalue of H; hence S = 0 on all axes by t ≤ √(2 V(0) h) / κ. The smaller of the two counts.

Within a boundary layer S = 0 itself is approached exponentially, if at all: no bound exists, and only the arrival at
|S_i| = φ_i is given. The bounds are for continuous time; sampled with period T, an arrival is seen up to T late.
Everything that the model-based part supplies beyond H a_r + N counts in |Δ|, even the PD term of eq. (34) where it
drives S to zero; this makes the bounds of ``sliding_computed_torque`` loose.
"""

from typing import NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.paper.lyapunov.mismatch import mismatch
from spherical_wrist.simulation.run import Run


class Reaching(NamedTuple):
    """Reaching time of a run, and its bound; per axis, infinite if the surface is never reached or there is no bound.

    Attributes:
        measured: first control instant [s] at which S has changed sign, or |S| ≤ φ with a boundary layer, (3,).
        bound: eq. (21)–(22) [s], (3,). A run may exceed it by one control period, the time to see the arrival.
        eta: η [rad/s²], (3,), with the largest |Δ| until the last axis arrived.
        mismatch: that largest |Δ| [N·m], (3,).
    """

    measured: Array
    bound: Array
    eta: Array
    mismatch: Array


def reaching(run: Run) -> Reaching:
    """Measure the time in which a run reached its sliding surface, from its start, and compute its bound.

    Raises:
        ParameterError: the law has no sliding surface or no switching gain, or the run has not every control instant.
    """
    found, S = mismatch(run), run.surface
    arrived = (np.abs(S) <= found.phi) | (S * S[0] <= 0.0)
    first = np.where(arrived.any(axis=0), arrived.argmax(axis=0), len(S))
    measured = np.where(first < len(S), run.time[np.minimum(first, len(S) - 1)], np.inf)
    largest = np.abs(found.total[: max(1, first.max())]).max(axis=0)
    eta = reaching_rate(found.H, found.K, largest, found.edge)
    bound = reaching_bound(S[0], found.H, found.K, largest, found.phi, found.edge)
    return Reaching(measured, bound, eta, largest)


def reaching_rate(H: Array, K: Array, mismatch: Array, edge: float = 1.0) -> Array:
    """Compute η [rad/s²], (3,): the least rate at which each |S_i| falls; negative if K is too small.

    Args:
        H: inertia matrix of the plant [kg·m²], (3, 3).
        K: switching gain per axis [N·m], (3,).
        mismatch: largest |Δ| per axis [N·m], (3,).
        edge: σ, the switching function at the edge of its boundary layer.
    """
    M = np.linalg.inv(H)
    own = np.diag(M)
    coupled = (np.abs(M) - np.diag(np.abs(own))) @ (K + mismatch)
    rate: Array = own * (edge * K - mismatch) - coupled
    return rate


def reaching_bound(
    surface: Array, H: Array, K: Array, mismatch: Array, phi: Array | float = 0.0, edge: float = 1.0
) -> Array:
    """Bound the time [s], (3,), in which each axis reaches its surface or layer, eq. (21)–(22); infinite without bound.

    Args:
        surface: S(0) [rad/s], (3,).
        H: inertia matrix of the plant [kg·m²], (3, 3).
        K: switching gain per axis [N·m], (3,).
        mismatch: largest expected |Δ| per axis [N·m], (3,).
        phi: boundary layer [rad/s]; zero for ``sign``.
        edge: σ, the switching function at the edge of its boundary layer: tanh 1 for ``tanh``, else 1.
    """
    eta = reaching_rate(H, K, mismatch, edge)
    way = np.maximum(np.abs(surface) - phi, 0.0)
    bound = np.divide(way, eta, out=np.full(3, np.inf), where=eta > 0.0)
    kappa = float((K - mismatch).min())
    if kappa > 0.0 and not np.any(phi):
        together = np.sqrt(surface @ H @ surface * np.linalg.eigvalsh(H)[-1]) / kappa
        bound = np.minimum(bound, together)
    return np.where(way > 0.0, bound, 0.0)
