"""Rivals with an observer or a regulator: their poles, gains and plans against closed forms and SciPy."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad_vec
from scipy.linalg import expm
from scipy.optimize import lsq_linear

from rigs import state_of
from spherical_wrist import Experiment, simulate
from spherical_wrist.control import INDI, LQG, RISE, L1Adaptive, LinearADRC, LinearMPC
from spherical_wrist.control.box_qp import SWEEPS, solve_box
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.control.indi import poles
from spherical_wrist.control.kalman_observer import kalman_gain
from spherical_wrist.control.linear_feedback import critically_damped
from spherical_wrist.control.linear_mpc import HORIZON, program
from spherical_wrist.control.lqg import regulator_gain
from spherical_wrist.errors import LawError
from spherical_wrist.loop.engine import interpreted_step
from test_laws import SWITCHING
from test_rivals import MOTORS, feed_forward, linear, made, moderate, stopped

T = 1e-3
bandwidths = st.floats(1.0, 900.0)

# --- poles


def closed_loop_poles(law, late):
    """Poles of a law on ë = −w, its samples ``late`` whole periods old, which it knows."""
    a, b, c, d = linear(law, (1.0, 1.0, 1.0), 0, late * T)
    A, B, C = np.array([[1.0, T], [0.0, 1.0]]), np.array([[-0.5 * T * T], [-T]]), np.eye(2)
    for _ in range(late):
        n = len(A)
        A = np.block([[A, np.zeros((n, 2))], [C, np.zeros((2, 2))]])
        B, C = np.vstack([B, np.zeros((2, 1))]), np.hstack([np.zeros((2, n)), np.eye(2)])
    return np.linalg.eigvals(np.block([[A + B @ d @ C, B @ c], [b @ C, a]]))


def assert_has_poles(law, expected, late):
    """Every expected pole is one of the closed loop's, as a root of the same multiplicity is found by rounding."""
    found = closed_loop_poles(law, late)
    for pole in set(np.round(expected, 12)):
        copies = np.sum(np.isclose(expected, pole, atol=1e-12))
        assert np.sum(np.abs(found - pole) < 3e-4 ** (1.0 / copies) * 0.2) >= copies, (pole, found)
    assert np.abs(found).max() < 1.0 + 1e-6


@given(bandwidths)
def test_critically_damped_feedback_puts_both_poles_where_it_says(bandwidth):
    k0, k1 = critically_damped(bandwidth, T)
    A = np.array([[1.0, T], [0.0, 1.0]]) - np.outer([0.5 * T * T, T], [k0, k1])
    np.testing.assert_allclose(np.poly(A), np.poly(np.full(2, np.exp(-bandwidth * T))), atol=1e-12)


@pytest.mark.parametrize("late", [0, 1, 3])
@pytest.mark.parametrize("output", ["rate", "attitude"])
def test_adrc_has_the_poles_of_its_two_bandwidths_however_late(output, late):
    law = LinearADRC(bandwidth=70.0, observer_bandwidth=300.0, output=output)
    observer = {"rate": 2, "attitude": 3}[output]
    assert_has_poles(law, [np.exp(-0.07)] * 2 + [np.exp(-0.3)] * observer, late)


@pytest.mark.parametrize("late", [0, 2])
def test_l1_adaptive_has_the_poles_of_its_reference_and_its_filter(late):
    """With a deadbeat adaptation nothing else is left of it."""
    assert_has_poles(L1Adaptive(bandwidth=70.0, filter_bandwidth=160.0), [np.exp(-0.07)] * 2 + [np.exp(-0.16)], late)


@pytest.mark.parametrize("late", [0, 2])
@pytest.mark.parametrize("damping_ratio", [0.6, 1.5])
def test_indi_is_a_disturbance_observer_with_its_filter(damping_ratio, late):
    """In its linear form the filter and the feedback are in cascade: the poles of both, and no others."""
    law = INDI(bandwidth=30.0, filter_bandwidth=200.0, damping_ratio=damping_ratio)
    of_filter = np.exp(T * np.roots([1.0, 2.0 * damping_ratio * 200.0, 200.0**2]))
    np.testing.assert_allclose([1.0, *-np.array(poles(0.2, damping_ratio))], np.real(np.poly(of_filter)), atol=1e-12)
    assert_has_poles(law, [np.exp(-0.03)] * 2 + list(of_filter), late)


@pytest.mark.parametrize("late", [0, 2])
def test_filter_and_regulator_of_the_lqg_are_separate(late):
    """The poles are those of A − B k, and of A − L C A: the separation theorem, with samples that are late too."""
    law = LQG(bandwidth=90.0)
    A = transition(T)
    L, C = law.designed(T)["filter"], np.array([[1.0, 0, 0, 0, 0], [0, 1.0, 0, 0, -1.0]])
    regulated = np.linalg.eigvals(A[:2, :2] - np.outer([0.5 * T * T, T], law.designed(T)["regulator"]))
    filtered = np.linalg.eigvals(A - L @ C @ A)
    found = closed_loop_poles(law, late)
    for pole in [*regulated, *filtered]:
        assert np.abs(found - pole).min() < 1e-4, (pole, found)
    assert np.abs([*regulated, *filtered]).max() < 1.0


# --- the Kalman filter and the regulator


def transition(period):
    """exp(A T) of (e, ė, δ, γ, b)."""
    motion = np.zeros((5, 5))
    motion[0, 1] = motion[1, 2] = motion[2, 3] = 1.0
    return expm(period * motion)


@pytest.mark.parametrize("period", [5e-4, 2e-3])
def test_gain_of_the_filter_is_where_the_riccati_recursion_ends(period):
    """With the covariance of the noise by quadrature, and no algebraic equation solved."""
    noise, walks = (3e-4, 2e-3), (20.0, 900.0, 1e-2)
    W = np.diag([0.0, 0.0, *np.square(walks)])
    Q = quad_vec(lambda t: transition(t) @ W @ transition(t).T, 0.0, period)[0]
    A, C, R = transition(period), np.array([[1.0, 0, 0, 0, 0], [0, 1.0, 0, 0, -1.0]]), np.diag(np.square(noise))
    P = np.diag([1e-6, 1e-4, 1e2, 1e5, 1e-4])
    for _ in range(6000):
        L = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        left = np.eye(5) - L @ C
        P = A @ (left @ P @ left.T + L @ R @ L.T) @ A.T + Q
    np.testing.assert_allclose(kalman_gain(period, *noise, *walks), L, rtol=1e-5, atol=1e-9 * np.abs(L).max())


@pytest.mark.parametrize("period", [5e-4, 2e-3])
def test_regulator_has_the_roots_of_the_symmetric_root_locus(period):
    """1 + ω⁴ G(z) G(1/z) = 0 with G the double integrator: (2 − c)² + (ω T)⁴ (2 + c) / 4 = 0 in c = z + 1/z."""
    bandwidth = 150.0
    k0, k1 = regulator_gain(period, bandwidth)
    A = np.array([[1.0, period], [0.0, 1.0]]) - np.outer([0.5 * period**2, period], [k0, k1])
    q = 0.25 * (bandwidth * period) ** 4
    expected = [z for c in np.roots([1.0, q - 4.0, 4.0 + 2.0 * q]) for z in np.roots([1.0, -c, 1.0]) if abs(z) < 1.0]
    np.testing.assert_allclose(np.poly(A), np.real(np.poly(expected)), atol=1e-9)
    np.testing.assert_allclose(regulator_gain(2e-5, 50.0), (2500.0, 50.0 * np.sqrt(2.0)), rtol=2e-3)  # Butterworth


def test_filter_finds_the_bias_of_the_gyroscope():
    """At rest on a right model, the error that it leaves without the bias being known goes, and the bias is found."""
    sensing = {"name": "ideal", "rate_bias": (2e-3, -1e-3, 3e-3)}
    run = simulate(
        Experiment(
            law=LQG(bias_walk=1e-3), reference="hold", disturbance=0, mass_scale=1, sensing=sensing, duration=9.0
        )
    )
    np.testing.assert_allclose(state_of(run).bias[-1], (2e-3, -1e-3, 3e-3), rtol=1e-3)
    assert np.abs(run.error[-1]).max() < 1e-7


@pytest.mark.parametrize("law", [LQG, LinearMPC])
def test_a_large_error_is_not_taken_for_a_bias(law):
    """A return from 0.9 rad about all axes, in which the rate of the log is far from ė."""
    run = simulate(Experiment(law=law(), initial_error=(0.6, -0.4, 0.5), duration=1.0))
    assert np.abs(state_of(run).bias).max() < 5e-3
    assert np.abs(run.error[400:]).max() < 1e-3


@pytest.mark.parametrize("law", [LQG, LinearMPC])
def test_designed_for_the_period_of_the_run(law):
    """At half and twice the period the loop has the same bandwidth: much the same error is left."""
    found = {}
    for period in (5e-4, 1e-3, 2e-3):
        experiment = Experiment(
            law=law(), control_period=period, physics_period=5e-4, disturbance={"name": "sinusoid"}, duration=3.0
        )
        found[period] = simulate(experiment, keep_series=False).metrics.rms_error_rad
    assert 0.2 < found[5e-4] / found[1e-3] < 5.0
    assert 0.2 < found[2e-3] / found[1e-3] < 5.0
    assert np.abs(law().packed(2e-3) - law().packed()).max() > 0.0


@pytest.mark.parametrize("law", [LQG(attitude_noise=1e30), LQG(growth_walk=1e-30), LinearMPC(bandwidth=1e-12)], ids=str)
def test_gains_that_cannot_be_computed_are_refused_in_one_line(law):
    with pytest.raises(LawError, match="more usual"):
        simulate(Experiment(law=law, duration=0.01))


# --- the program of the predictive law


@cache
def matrices():
    arrays = program(0.15)
    return arrays["hessian"], arrays["gradient"], arrays["regulator"]


def minimum(start, lower, upper):
    """The solution by SciPy's active-set method for bounded least squares, |U c + U⁻ᵀ F x| with U'U = G."""
    G, F, _ = matrices()
    U = np.linalg.cholesky(G).T
    return lsq_linear(U, -np.linalg.solve(U.T, F @ start), (lower, upper), method="bvls", tol=1e-14).x


@pytest.mark.parametrize("seed", range(4))
def test_program_within_a_box_is_solved_as_by_scipy(seed):
    G, F, _ = matrices()
    random = np.random.default_rng(seed)
    start = random.normal(size=3) * (300.0, 60.0, 5.0)
    lower, upper = -random.uniform(0.5, 6.0), random.uniform(0.5, 6.0)
    x = np.zeros(HORIZON)
    assert solve_box(G, F, tuple(start), lower, upper, x) < SWEEPS
    np.testing.assert_allclose(x, minimum(start, lower, upper), atol=1e-7)
    slope = G @ x + F @ start  # the conditions of Karush, Kuhn and Tucker
    size = np.abs(F @ start).max()
    assert (np.abs(slope[(x > lower) & (x < upper)]) < 1e-7 * size).all()
    assert (slope[x == lower] > -1e-9).all()
    assert (slope[x == upper] < 1e-9).all()
    assert np.sum((x == lower) | (x == upper)) > 0


def test_without_limits_the_plan_is_that_of_the_regulator():
    """G c = −F x has the same first acceleration, by Bellman's principle: the end of the horizon is not felt."""
    G, F, K = matrices()
    np.testing.assert_allclose(-np.linalg.solve(G, F)[0], K, rtol=1e-8)


def test_predictive_law_plans_within_the_limits_and_sends_the_first():
    """One step from a large error: its plan is SciPy's solution for the torque that is left beside N + H q̈_d."""
    law = LinearMPC(bandwidth=150.0)
    signal, command = np.zeros(1, SIGNAL), np.full(COMMAND.itemsize // 8, np.nan).view(COMMAND)
    H = np.diag([4e-4, 4e-4, 1.5e-4])
    signal["period"], signal["horizon"], signal["H"], signal["torque_limit"] = T, 0.5 * T, H, MOTORS
    signal["error"], signal["rate_error"], signal["N"] = (0.4, 0.02, -0.3), (0.5, -1.0, 2.0), (0.02, 0.0, -0.03)
    signal["feed_forward"] = (3.0, -2.0, 40.0)
    state = law.packed_state()
    interpreted_step(law)(signal.view(np.recarray)[0], law.packed(), state, command.view(np.recarray)[0])
    plan = state.view(law.state_layout())[0]["plan"]
    needed = feed_forward(signal[0])
    for axis in range(3):
        bounds = (np.array([-1.0, 1.0]) * MOTORS[axis] - needed[axis]) / H[axis, axis]
        start = np.array([signal["error"][0, axis] / T**2, signal["rate_error"][0, axis] / T, 0.0])
        np.testing.assert_allclose(plan[axis], minimum(start, *bounds), atol=1e-6 * np.ptp(bounds))
    np.testing.assert_allclose(command["torque"][0], needed + H @ plan[:, 0], rtol=1e-9)
    assert (np.abs(command["torque"][0]) <= MOTORS * (1.0 + 1e-9)).all()
    assert np.isclose(np.abs(command["torque"][0]), MOTORS).any()


# --- the commands that are remembered


def test_a_torque_beyond_the_motors_is_remembered_as_what_they_give():
    law, given_signals = LinearADRC(), moderate(60, seed=40)
    torques, _, kept = made(law, given_signals)
    cut = 0
    for k, s in enumerate(given_signals):
        delivered = np.clip(torques[k], -MOTORS, MOTORS)
        w = np.linalg.solve(s["H"], delivered - s["N"]) - s["feed_forward"]
        np.testing.assert_allclose(kept.past[k][:, 0], w, rtol=1e-7, atol=1e-7 * np.abs(w).max())
        cut += (delivered != torques[k]).any()
    assert 0 < cut < len(given_signals)


# --- RISE


@pytest.mark.parametrize("switching", SWITCHING)
def test_rise_is_the_law_of_xian(switching):
    law = RISE(
        switching=switching, slope=60.0, K=90.0, integral_rate=20.0, sign_gain=(100, 200, 50), phi=(0.1, 0.9, 0.3)
    )
    given_signals = moderate(40, seed=41)
    torques, surfaces, kept = made(law, given_signals)
    w, phi = np.zeros(3), np.array(law.phi)
    for k, s in enumerate(given_signals):
        S = law.slope * s["error"] + s["rate_error"]
        direction = SWITCHING[switching](S if switching == "sign" else S / phi)
        rest = feed_forward(s) + s["H"] @ (law.slope * s["rate_error"] + law.K * S)
        change = T * s["H"] @ (law.K * law.integral_rate * S + np.array(law.sign_gain) * direction)
        w = stopped(w, change, rest, MOTORS)
        np.testing.assert_allclose(torques[k], rest + w, rtol=1e-10, atol=1e-13)
        np.testing.assert_allclose(surfaces[k], S, rtol=1e-12)
        np.testing.assert_allclose(kept.integral[k], w, rtol=1e-10, atol=1e-14)


def test_rise_tracks_against_a_smooth_disturbance_with_the_sign_only():
    """A sine that plain computed torque is pushed off by leaves nothing but what a sampled sign leaves of it."""
    wave = {"disturbance": {"name": "sinusoid"}, "mass_scale": 1, "duration": 4.0}
    without = {"name": "rise", "sign_gain": 0.0}
    signed = {"name": "rise", "switching": "sign", "sign_gain": 800.0}
    linear_only, found = (simulate(Experiment(law=law, **wave), keep_series=False).metrics for law in (without, signed))
    assert found.rms_error_rad < 0.2 * linear_only.rms_error_rad
