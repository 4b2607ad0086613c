"""Lyapunov's function along a run, and the switching gain that its decrease requires, eq. (36)–(43)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.paper.lyapunov.mismatch import mismatch
from spherical_wrist.simulation.run import Run

Flags = npt.NDArray[np.bool_]

ROUNDING = 1e-12
"""Tolerance of eq. (42) and (43) as a fraction of K_i, so that η may be the margin itself."""


class TimeSpan(NamedTuple):
    """First and last control instant [s] of an interval."""

    start: float
    end: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Lyapunov:
    """Lyapunov's argument, eq. (36)–(43), evaluated along a run with n control instants.

    V = ½ Sᵀ H S with the plant's inertia H. Eq. (36), Sᵀ (Ḣ − 2 N) S = 0, holds on a ball joint term by term: in the
    body frame Ḣ = 0, and the Coriolis torque N(ω) ω = ω × H ω has the skew matrix N(ω) = −[H ω]×. Eq. (37) reduces
    to V̇ = Sᵀ H Ṡ = Sᵀ (τ* − τ) = Sᵀ (Δ − K sw(S / φ)), eq. (39), as ``mismatch`` defines them. With ``sign`` and
    K_i ≥ |Δ_i| + η_i on every axis, eq. (42), V̇ ≤ −Σ η_i |S_i|, eq. (43), at every control instant; within a boundary
    layer the switching part is less than K, and eq. (43) need not hold: there S rests where K sw(S / φ) balances Δ, and
    V̇ is about zero, positive half of the time. With a layer, use ``failing_fraction_outside``.

    Between control instants the torque is held while S moves on: sampled ``sign`` switching may satisfy eq. (43) at
    every instant and yet not make V smaller from one to the next. ``sampled_rate`` is the measured change of V.

    Attributes:
        time: control instants [s], (n,).
        period: control period [s].
        surface: sliding surface S [rad/s], (n, 3).
        K: switching gain per axis [N·m], (3,).
        phi: boundary layer [rad/s], (3,); zero for ``sign``.
        eta: η per axis [N·m], (3,).
        mismatch: Δ [N·m], (n, 3), for H̃ Ṡ + Ñ S of eq. (39).
        inertial: (H − Ĥ) a_r [N·m], (n, 3), its share for H̃ Ṡ of eq. (40).
        value: V [J], (n,).
        rate: V̇ [W] just after each control instant, from the plant's terms, (n,).
        sampled_rate: mean of V̇ over each period by numerical differentiation, (V(t + T) − V(t)) / T [W], (n − 1,).
        mean_rate: the same from the plant's terms: mean of V̇ at the period's two ends [W], (n − 1,).
    """

    time: Array
    period: float
    surface: Array
    K: Array
    phi: Array
    eta: Array
    mismatch: Array
    inertial: Array
    value: Array
    rate: Array
    sampled_rate: Array
    mean_rate: Array

    @property
    def required_gain(self) -> Array:
        """K_u = |Δ_i| + η_i [N·m], (n, 3), the least gain that eq. (42) allows."""
        return np.abs(self.mismatch) + self.eta

    @property
    def sufficient_gain(self) -> Array:
        """K_u of eq. (41) [N·m], (n, 3): the two shares of Δ in magnitude, plus η; by eq. (40) never the smaller."""
        return np.abs(self.inertial) + np.abs(self.mismatch - self.inertial) + self.eta

    @property
    def covered(self) -> Flags:
        """True if K is at least the gain that eq. (42) requires, per axis, (n, 3)."""
        return np.less_equal(self.required_gain, self.K * (1.0 + ROUNDING))

    @property
    def covered_fraction(self) -> Array:
        """Fraction of the control instants at which K is sufficient, per axis, (3,)."""
        fraction: Array = self.covered.mean(axis=0)
        return fraction

    @property
    def all_covered_fraction(self) -> float:
        """Fraction of the control instants at which K is sufficient on all axes at once."""
        return float(self.covered.all(axis=1).mean())

    @property
    def margin(self) -> Array:
        """K − max |Δ| [N·m], (3,): the largest η with which eq. (42) holds in the whole run; negative if none does."""
        margin: Array = self.K - np.abs(self.mismatch).max(axis=0)
        return margin

    @property
    def allowed_rate(self) -> Array:
        """−Σ η_i |S_i| [W], (n,), the right side of eq. (43)."""
        allowed: Array = -np.abs(self.surface) @ self.eta
        return allowed

    @property
    def fails(self) -> Flags:
        """True if eq. (43) fails just after a control instant, (n,), beyond rounding."""
        return np.asarray(self._excess > 0.0)

    @property
    def failing_fraction(self) -> float:
        """Fraction of the control instants at which eq. (43) fails."""
        return float(self.fails.mean())

    @property
    def outside(self) -> Flags:
        """True if some axis is outside its boundary layer, (n,); with ``sign``, everywhere except on S = 0."""
        return np.asarray(np.max(np.abs(self.surface) - self.phi, axis=1) > 0.0)

    @property
    def failing_fraction_outside(self) -> float:
        """Fraction of all the control instants at which eq. (43) fails outside the boundary layer."""
        return float((self.fails & self.outside).mean())

    @property
    def sampled_failing_fraction(self) -> float:
        """Fraction of the periods over which V fell by less than eq. (43) requires at their start, or grew."""
        return float(np.mean(self.sampled_rate - self.allowed_rate[:-1] > self._rounding[:-1]))

    @property
    def worst(self) -> tuple[float, float] | None:
        """Time [s] and size [W] of the largest violation of eq. (43); None if there is none."""
        if not self.fails.any():
            return None
        at = int(np.argmax(self._excess))
        return float(self.time[at]), float(self.rate[at] - self.allowed_rate[at])

    @property
    def first_failure(self) -> TimeSpan | None:
        """First interval in which eq. (43) fails; None if there is none."""
        failing = np.flatnonzero(self.fails)
        if not len(failing):
            return None
        after = np.flatnonzero(~self.fails[failing[0] :])
        end = failing[0] + after[0] - 1 if len(after) else len(self.fails) - 1
        return TimeSpan(float(self.time[failing[0]]), float(self.time[end]))

    @property
    def _rounding(self) -> Array:
        rounding: Array = ROUNDING * (np.abs(self.surface) @ self.K)
        return rounding

    @property
    def _excess(self) -> Array:
        """Excess of V̇ over the limit of eq. (43) [W], minus rounding."""
        return self.rate - self.allowed_rate - self._rounding


def monitor(run: Run, eta: npt.ArrayLike = 0.0) -> Lyapunov:
    """Evaluate Lyapunov's argument along a run of any law with a surface and a switching part K sw(S / φ).

    Args:
        run: the run, with every control instant.
        eta: η [N·m], one number or one per axis. Zero requires only that V does not grow.

    Raises:
        ParameterError: η is not valid, the law has no sliding surface or no switching gain, or the run has not every
            control instant.
    """
    margins = np.asarray(eta, dtype=np.float64)
    if margins.shape not in ((), (3,)) or not (np.isfinite(margins) & (margins >= 0.0)).all():
        raise ParameterError(
            f"eta = {one_line(repr(eta), 80)} [N·m]: one number, or three (one per axis), ≥ 0 is needed"
        )
    found, S = mismatch(run), run.surface
    value = 0.5 * _dot(S, S @ found.H.T)
    rate = _dot(S, found.after)
    return Lyapunov(
        time=run.time,
        period=run.experiment.control_period,
        surface=S,
        K=found.K,
        phi=found.phi,
        eta=np.broadcast_to(margins, 3).copy(),
        mismatch=found.total,
        inertial=found.inertial,
        value=value,
        rate=rate,
        sampled_rate=np.diff(value) / run.experiment.control_period,
        mean_rate=0.5 * (rate[:-1] + _dot(S[1:], found.before)),
    )


def _dot(a: Array, b: Array) -> Array:
    products: Array = np.einsum("ki,ki->k", a, b)
    return products
