"""The adaptive mechanism: its law against NumPy, its Lyapunov function, its bounds, and its record."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.control.adaptive_fuzzy_sliding_computed_torque import AdaptiveFuzzySlidingComputedTorque, adapt
from spherical_wrist.errors import ParameterError

NAME = "adaptive_fuzzy_sliding_computed_torque"


def strengths(error, rate):
    """Firing strengths ζ of the 21 rules, naively: products of triangles."""

    def triangles(x, count):
        peaks = np.linspace(-1.0, 1.0, count)
        return np.maximum(0.0, 1.0 - np.abs(np.clip(x, -1.0, 1.0) - peaks) * (count - 1) / 2.0)

    return np.outer(triangles(error, 7), triangles(rate, 3))


@pytest.mark.parametrize(("error", "rate"), [(0.0, 0.0), (0.13, -0.4), (-2.0, 0.7), (1.0, 5.0), (-0.999, -1.0)])
def test_the_weights_of_the_rules_that_fire_change_by_their_strength(error, rate):
    weights = np.full((7, 3), 5.0)
    adapt(weights, error, rate, 0.01, 0.0, 10.0)
    assert weights == pytest.approx(5.0 + 0.01 * strengths(error, rate), abs=1e-15)


def test_weights_are_projected_onto_their_bounds():
    weights = np.full((7, 3), 5.0)
    adapt(weights, 0.1, 0.1, 1e6, 0.5, 8.0)
    assert weights.max() == 8.0
    adapt(weights, 0.1, 0.1, -1e6, 0.5, 8.0)
    assert weights.min() == 0.5


def test_a_run_integrates_the_law_of_the_docstring():
    """θ(k+1) = proj(θ(k) + T γ ζ(e, ė) e (λ e + ė)), recomputed from the recorded errors."""
    run = simulate(Experiment(law=NAME, duration=0.3, initial_error=(0.01, -0.02, 0.03)))
    law = AdaptiveFuzzySlidingComputedTorque()
    theta = np.tile(np.ravel(law.rules), 3).reshape(3, 7, 3)
    for k in range(len(run)):
        np.testing.assert_allclose(run.law_state[k].reshape(3, 7, 3), theta, rtol=0.0, atol=1e-12)
        for i in range(3):
            e, de = run.error[k, i], run.rate_error[k, i]
            zeta = strengths(e / law.error_scale[i], de / law.rate_scale[i])
            theta[i] += 1e-3 * law.adaptation * zeta * e * (law.slope * e + de)
        theta = np.clip(theta, law.lowest, law.highest)
    assert np.ptp(run.law_state, axis=0).max() > 0.5


def test_the_lyapunov_function_of_the_docstring_decreases():
    """One axis as in the derivation, with a continuous-time integration and no disturbance."""
    law, H = AdaptiveFuzzySlidingComputedTorque(), 3.94e-4
    lam, gain = law.slope, law.K[0] / (H * law.phi[0])
    c, a1, target = gain * lam, law.Kv[0] + gain, 6.0
    A = np.array([[0.0, 1.0], [-(law.Kp[0] + c * target), -a1]])
    # P b = (λ, 1) fixes the right column; the top left entry is the one that makes Q diagonal
    P = np.array([[a1 * lam + law.Kp[0] + c * target, lam], [lam, 1.0]])
    Q = -(A.T @ P + P @ A)
    assert np.linalg.eigvalsh(P).min() > 0.0
    assert np.linalg.eigvalsh(Q).min() > 0.0
    assert solve_continuous_lyapunov(A.T, -Q) == pytest.approx(P, rel=1e-9)
    x, theta, dt, values = np.array([0.02, -0.1]), np.full((7, 3), 3.0), 1e-6, []
    for _ in range(20_000):
        e, de = x
        zeta = strengths(e / law.error_scale[0], de / law.rate_scale[0])
        values.append(x @ P @ x + c / law.adaptation * ((theta - target) ** 2).sum())
        x = x + dt * np.array([de, -law.Kp[0] * e - a1 * de - c * (theta * zeta).sum() * e])
        theta = theta + dt * law.adaptation * zeta * e * (lam * e + de)
    assert max(np.diff(values)) < 1e-9 * values[0]
    assert values[-1] < values[0]


def test_adaptation_reduces_the_error_under_a_disturbance_without_chattering():
    adaptive, fixed = (simulate(Experiment(law=law)).metrics for law in (NAME, "fuzzy_sliding_computed_torque"))
    assert adaptive.rms_error_rad < 0.8 * fixed.rms_error_rad
    assert adaptive.chattering_Nm_per_s < 1.05 * fixed.chattering_Nm_per_s


def test_without_an_error_nothing_is_learned():
    run = simulate(Experiment(law=NAME, disturbance=0, mass_scale=1))
    assert np.ptp(run.law_state, axis=0).max() < 1e-5


def test_the_weights_are_recorded_bit_for_bit(tmp_path):
    run = simulate(Experiment(law=NAME, duration=0.5), record_every=3)
    record(run, tmp_path / "a.rrd")
    back = load_recording(tmp_path / "a.rrd")
    assert back.law_state.shape == (167, 63)
    assert back.law_state.tobytes() == run.law_state.tobytes()


def test_laws_without_state_record_none():
    assert "law_state" not in simulate(Experiment(law="pd", duration=0.01)).channels


def test_rules_beyond_the_bounds_are_refused():
    with pytest.raises(ParameterError, match="highest = 5"):
        AdaptiveFuzzySlidingComputedTorque(highest=5.0)
