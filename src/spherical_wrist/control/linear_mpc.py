"""Linear model predictive control: the best torques of the next periods within the limits of the motors."""

from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from spherical_wrist.control.box_qp import solve_box
from spherical_wrist.control.contract import Array, Bound, Command, LawStatus, Signal
from spherical_wrist.control.kalman_observer import Estimate, KalmanLaw, estimate
from spherical_wrist.control.past_commands import arrive, project, send
from spherical_wrist.control.riccati import riccati
from spherical_wrist.parameters import Positive, quantity

HORIZON = 16
"""Periods for which torques are planned; the cost of all later ones is that of the regulator without limits."""

_Plan = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class LinearMPC(KalmanLaw):
    """Linear MPC: τ = N + H (q̈_d + c₀ + δ̂), c₀ the first of the accelerations that are best within the motors' limits.

    H [kg·m²] and N [N·m], body frame, are the nominal model's, q̈_d [rad/s²] the feed-forward, δ̂ [rad/s²] the
    disturbance that the Kalman filter of ``kalman_observer`` estimates with e and ė. Per axis and period, with
    x = (e, ė, c₋) and c₋ the acceleration before, the law minimises over c₀ … c₁₅ [rad/s²]

        J = Σ e_j² + (c_j − c_{j−1})² / ω⁶ + x₁₆' S x₁₆,   −τ_max ≤ N + H (q̈_d + c_j + δ̂) ≤ τ_max,

    on ë = −c, held for a period; what is weighed is the change of torque, not torque.

    Derivation (Rawlings, Mayne and Diehl, 2017): this is the problem of their Model Predictive Control, chapters 1, 2,
    made free of offset by a δ̂ in prediction and limits (Pannocchia and Rawlings, 2003). S solves the Riccati equation
    of the same cost without limits and without end, so that, where no limit is met on the way, c₀ = K x of that
    regulator is the solution, by Bellman's principle; it is found by running the regulator through the horizon. For
    short periods it leaves three Butterworth poles of bandwidth ω. Where a limit is met, the problem is a quadratic
    program in a box, solved to 1e-10 of its width by ``box_qp``. S, K and the program's matrices come from SciPy for
    the control period, when the law is prepared; there is nothing but arithmetic in the loop.

    Preview: what is previewed is the error, through the commands that are still on their way when samples and torques
    are late (``past_commands``), and the disturbance. The reference needs none: computed torque has taken it out of the
    error's dynamics; only the limits know it, and they take N + H q̈_d for constant over the 16 periods.

    Assumptions: nominal inertia; products of inertia small where a limit is met, because the axes are planned apart.
    Stability: without limits that of the regulator and the filter, by the separation theorem. With limits on the input
    alone there always is a plan; that the cost falls is certain only where the regulator meets no limit after the
    horizon (there, section 2.4), which from a large error it does: no proof is claimed for those.

    Defaults by ``wrist design``; the filter believes in the noise of realistic sensors.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(2.5e-5, 3.8e-5)

    class State(Estimate):
        """State of the filter, memory of the commands, and the plan."""

        plan: _Plan = quantity(((0.0,) * HORIZON,) * 3, "rad/s²", "planned accelerations c, the next first")

    bandwidth: Positive = quantity(
        139.6, "1/s", "bandwidth ω of the regulator: 1/ω⁶ is the weight of a change of c", searched=(20.0, 500.0)
    )

    def designed(self, period: float) -> dict[str, Array]:
        """Return the gain of the filter, and the arrays of :func:`program`."""
        return {**super().designed(period), **program(period * self.bandwidth)}

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        first = state.running < 0.5
        late, periods = arrive(signal, state)
        for i in range(3):
            estimate(signal, parameters.filter, state, i, late, periods, first)
        w = planned(signal, parameters, state, 0, late), planned(signal, parameters, state, 1, late)
        send(signal, (w[0], w[1], planned(signal, parameters, state, 2, late)), command, state)


def planned(signal: Signal, parameters: Any, state: Any, axis: int, late: float) -> float:
    """Plan the next periods of one axis, and return w [rad/s²] of the first."""
    T, H = signal.period, signal.H
    rate, mismatch, growth = state.rate_error[axis], state.mismatch[axis], state.growth[axis]
    turned, gained = project(state, axis, rate, mismatch, growth, late, T)
    balanced = mismatch + growth * (late + 0.5) * T
    # in units of T and rad/s²
    start = ((state.error[axis] + turned) / (T * T), (rate + gained) / T, state.past[axis, 0] - balanced)
    needed = signal.N[axis] + H[axis, axis] * balanced
    for j in range(3):
        needed += H[axis, j] * signal.feed_forward[j]
    lower = (-signal.torque_limit[axis] - needed) / H[axis, axis]
    upper = (signal.torque_limit[axis] - needed) / H[axis, axis]
    plan = state.plan[axis]
    if follow(parameters.regulator, start, lower, upper, plan):
        solve_box(parameters.hessian, parameters.gradient, start, lower, upper, plan)
    return float(plan[0] + balanced)


def follow(gain: Array, start: tuple[float, float, float], lower: float, upper: float, plan: Any) -> bool:
    """Write the plan of the regulator without limits, cut at them; return True if one was met.

    Args:
        gain: K (3,).
        start: x, in units of T and rad/s².
        lower: lower limit of c [rad/s²].
        upper: upper limit.
        plan: c (n,), written.
    """
    e, de, c = start
    met = False
    for j in range(len(plan)):
        c = gain[0] * e + gain[1] * de + gain[2] * c
        met = met or not lower <= c <= upper
        plan[j] = min(upper, max(lower, c))
        e, de = e + de - 0.5 * c, de - c
    return met


@lru_cache(maxsize=64)
def program(angle: float) -> dict[str, Array]:
    """Return the regulator K (3,), and hessian G (16, 16) and gradient F (16, 3) of the program ½ c'G c + c'F x.

    Args:
        angle: ω T.

    Raises:
        LawError: see :func:`.riccati.riccati`.
    """
    # x = (e, ė, c) and c⁺ − c, in units of 1/ω; the weight of the change of c is then that of 1/ω² in 1/ω⁶
    Q, h = np.diag([1.0, 0.0, 0.0]), angle
    A = np.array([[1.0, h, -0.5 * h * h], [0.0, 1.0, -h], [0.0, 0.0, 1.0]])
    B = np.array([[-0.5 * h * h], [-h], [1.0]])
    change, S = riccati(A, B, Q, np.array([[h**-2.0]]), "bandwidth")
    units = np.array([1.0, 1.0 / h, 1.0 / (h * h)])  # of 1/ω from those of T, as in step
    change, S, R = (change[0] * units) * h * h, S * np.outer(units, units), h**-6.0
    # x_j = free_j x + forced_j c, c_j − c_{j−1} = step_j c − (c₋ for j = 0)
    hold = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    free, forced = np.eye(3), np.zeros((3, HORIZON))
    G, F = np.zeros((HORIZON, HORIZON)), np.zeros((HORIZON, 3))
    for j in range(HORIZON):
        step = np.eye(HORIZON)[j] - (np.eye(HORIZON)[j - 1] if j else 0.0)
        G += forced.T @ Q @ forced + R * np.outer(step, step)
        F += forced.T @ Q @ free
        if j == 0:
            F[0, 2] -= R
        free, forced = hold @ free, hold @ forced + np.outer([-0.5, -1.0, 1.0], np.eye(HORIZON)[j])
    G += forced.T @ S @ forced
    F += forced.T @ S @ free
    return {"regulator": np.array([0.0, 0.0, 1.0]) - change, "hessian": G / R, "gradient": F / R}
