"""The sliding-mode law, eq. (16)–(25), and the time in which it reaches its surface."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs import RigidBody, mjcf, vectors
from spherical_wrist import Experiment, simulate
from spherical_wrist.control import SlidingMode
from spherical_wrist.loop.outcome import Status
from spherical_wrist.paper.lyapunov import reaching, reaching_bound
from spherical_wrist.paper.lyapunov.reaching import reaching_rate
from spherical_wrist.prepare.plant import plant_of
from test_laws import SWITCHING, signals, steps

T = 1e-3
SLIDING = {"K": (0.04, 0.06, 0.02), "slope": 22.0, "phi": (0.2, 0.3, 0.7)}
PERFECT = {"disturbance": 0, "mass_scale": 1}


def law(**changes):
    return {"name": "sliding_mode", **changes}


def inertia(experiment):
    """H of the plant from the sum over its bodies."""
    return RigidBody.of(plant_of(experiment)).inertia


# --- the law


@pytest.mark.parametrize("switching", SWITCHING)
@pytest.mark.parametrize("gains", [{}, SLIDING], ids=["default", "per axis"])
def test_sliding_mode_is_equations_17_24_and_25(switching, gains):
    """S of eq. (17) with n = 2; Û − K sgn(s) of eq. (24) with s = −S, as e = desired − actual."""
    one, given_signals = SlidingMode(switching=switching, **gains), signals(100, seed=12)
    commands, _ = steps(one, given_signals)
    for signal, command in zip(given_signals, commands, strict=True):
        s = -(one.slope * signal["error"] + signal["rate_error"])
        equivalent = signal["H"] @ (signal["feed_forward"] + one.slope * signal["rate_error"]) + signal["N"]
        expected = equivalent - np.array(one.K) * SWITCHING[switching](s / np.array(one.phi))
        np.testing.assert_allclose(command["torque"], expected, rtol=1e-11, atol=1e-14)
        np.testing.assert_allclose(command["surface"], -s, rtol=1e-12)
        np.testing.assert_allclose(command["slope"], one.slope)
    assert tuple(one.boundary_layer) == one.phi


def test_torque_of_an_axis_has_one_value_on_each_side_of_its_surface_equation_16():
    """τ⁺ where S_i > 0, τ⁻ where S_i < 0, eq. (16): 2 K_i apart on the switched axis, the same on the others."""
    one = SlidingMode(switching="sign", **SLIDING)
    for axis in range(3):
        pair = np.repeat(signals(1, seed=axis), 2)
        pair["rate_error"][:, axis] = -one.slope * pair["error"][:, axis] + np.array([1e-9, -1e-9])
        above, below = steps(one, pair)[0]["torque"]
        assert above - below == pytest.approx(2.0 * np.array(one.K) * (np.arange(3) == axis), abs=1e-9)


def test_on_a_perfect_model_the_equivalent_part_keeps_the_surface_equation_24():
    """With K next to nothing, Û alone: S stays where it starts, while the errors decay along it."""
    start = {"initial_error": (0.0, 0.0, 0.2), "initial_rate_error": (0.0, 0.0, 1.0), "duration": 0.3}
    run = simulate(Experiment(law=law(K=1e-12, slope=20.0), reference="hold", **PERFECT, **start))
    assert run.surface[0] == pytest.approx([0.0, 0.0, 5.0])
    # λ ė taken at each instant and held: the drift is of the order λ T of what ė covers
    assert np.abs(run.surface - run.surface[0]).max() < 5.0 * 20.0 * T
    assert abs(run.rate_error[-1, 2]) < 0.02 * run.rate_error[0, 2]


def test_surface_is_d_dt_plus_lambda_of_the_error_equation_17():
    """S = (d/dt + λ) e, e differentiated numerically on a run about one axis, where ė is d/dt e."""
    start = {"initial_error": (0.0, 0.0, 0.3), "duration": 0.4}
    hold = {"name": "hold", "rotation": (0, 0, 0.4)}
    run = simulate(Experiment(law=law(slope=30.0), reference=hold, **PERFECT, **start))
    derivative = (run.error[2:] - run.error[:-2]) / (2.0 * T)
    assert run.surface[0, 2] == pytest.approx(9.0)
    # the torque turns sharply where the layer is entered: second order in T elsewhere
    assert run.surface[1:-1] == pytest.approx(derivative + 30.0 * run.error[1:-1], abs=0.03)


def test_on_the_surface_the_error_decays_exponentially_equation_23():
    """Eq. (23) has the error zero at once; on S = 0 it is ė = −λ e on all of SO(3), so exp(−λ t)."""
    slope = 25.0
    one = law(switching="saturation", slope=slope, K=0.15, phi=1.0)
    run = simulate(Experiment(law=one, initial_error=(0.5, -0.4, 0.6), duration=0.5, **PERFECT))
    arrived = int(np.ceil(reaching(run).measured.max() / T)) + 30
    while_decaying = slice(arrived, arrived + 60)
    assert np.abs(run.surface[while_decaying]).max() < 0.02 * slope * np.abs(run.error[arrived]).max()
    expected = run.error[arrived] * np.exp(-slope * (run.time[while_decaying] - run.time[arrived]))[:, None]
    assert run.error[while_decaying] == pytest.approx(expected, abs=0.03 * np.abs(run.error[arrived]).max())


@pytest.mark.parametrize("switching", SWITCHING)
@pytest.mark.parametrize("mass_scale", [0.5, 1.0, 1.5])
def test_large_initial_errors_are_taken_home(mass_scale, switching):
    run = simulate(Experiment(law=law(switching=switching), mass_scale=mass_scale, initial_error=(1.0, -0.6, 0.9)))
    assert run.outcome.status is Status.COMPLETED
    assert run.metrics.max_error_rad < 3e-3


@pytest.mark.parametrize("mass_scale", [0.5, 1.0, 1.5])
def test_defaults_do_not_chatter_and_beat_the_papers_baseline(mass_scale):
    ours, baseline, plain = (
        simulate(Experiment(law=name, mass_scale=mass_scale)).metrics
        for name in ("sliding_mode", "sliding_computed_torque", "computed_torque")
    )
    assert ours.rms_error_rad < 0.4 * baseline.rms_error_rad
    assert ours.chattering_Nm_per_s < 1.1 * plain.chattering_Nm_per_s


def test_defaults_stay_well_below_the_control_rate():
    """Bandwidth K/(φ H) T of the layer on a plant of half the mass."""
    one, H = SlidingMode(), np.diag(inertia(Experiment(mass_scale=0.5)))
    share = np.array(one.K) / (np.array(one.phi) * H) * T
    assert (share < 0.9).all()
    assert share.max() < 1.1 * share.min(), "the same on every axis"


# --- reaching the surface

STARTS = [
    {"initial_error": (0.2, -0.1, 0.15)},
    {"initial_error": (-0.3, 0.02, -0.1), "initial_rate_error": (1.0, -2.0, 4.0)},
    {"initial_error": (0.05, 0.05, 0.05), "initial_rate_error": (-6.0, 6.0, 5.0)},
]


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("mass_scale", [0.5, 1.0, 1.25, 1.5])
def test_sign_reaches_the_surface_within_the_bound_of_equations_21_and_22(mass_scale, start):
    """One control period late at most: an arrival is seen at the control instant after it."""
    experiment = Experiment(law=law(switching="sign", slope=30.0), mass_scale=mass_scale, duration=1.0, **start)
    found = reaching(simulate(experiment))
    assert np.isfinite(found.bound).all()
    assert (found.eta > 0.0).all()
    assert (found.measured <= found.bound + T).all()
    assert (found.measured > 0.1 * found.bound).all(), "a bound that says something"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_on_a_perfect_model_the_bound_is_the_time_itself_equations_18_to_22(sign):
    """d|S|/dt = −K/H, integrated as in eq. (19)–(20): |S(0)| H/K, for S(0) > 0 eq. (21), for S(0) < 0 eq. (22).

    The errors start with ė = −λ e + S, e along the axis z about which the wrist alone turns.
    """
    one = law(switching="sign", K=0.02, slope=5.0)
    start = {"initial_error": (0.0, 0.0, 0.0), "initial_rate_error": (0.0, 0.0, sign * 6.0)}
    rest = {"name": "hold", "rotation": (0.0, 0.0, 0.0)}
    experiment = Experiment(law=one, reference=rest, duration=0.5, **PERFECT, **start)
    run = simulate(experiment)
    found, expected = reaching(run), 6.0 * inertia(experiment)[2, 2] / 0.02
    assert found.measured[2] == pytest.approx(expected, abs=T)
    assert found.bound[2] == pytest.approx(expected, rel=0.05)
    assert found.measured[:2].tolist() == found.bound[:2].tolist() == [0.0, 0.0]
    # eq. (18): ½ d/dt s² ≤ −ζ |s| at every instant of the way, with ζ = η
    way = slice(0, int(found.measured[2] / T) - 1)
    slope = 0.5 * np.diff(run.surface[:, 2] ** 2)[way] / T
    middle = 0.5 * (np.abs(run.surface[1:, 2]) + np.abs(run.surface[:-1, 2]))[way]
    assert (slope <= -found.eta[2] * middle * (1.0 - 1e-3)).all()


def test_arrival_is_the_first_sample_beyond_the_surface():
    run = simulate(Experiment(law=law(switching="sign", slope=30.0), duration=1.0, **STARTS[1]))
    found = reaching(run)
    for axis in range(3):
        side = np.sign(run.surface[:, axis]) == np.sign(run.surface[0, axis])
        assert found.measured[axis] == run.time[np.argmin(side)]


def test_gain_below_the_mismatch_gives_no_bound():
    run = simulate(Experiment(law=law(switching="sign", K=0.002), duration=0.5, **STARTS[0]))
    found = reaching(run)
    assert (found.eta < 0.0).all()
    assert np.isinf(found.bound).all()
    assert np.isinf(found.measured).any()


@pytest.mark.parametrize("switching", ["saturation", "tanh"])
def test_boundary_layer_is_entered_within_its_bound_and_before_the_surface_would_be(switching):
    """The way is shorter by φ; tanh, which pushes with less than K outside the layer, has the longer bound."""
    start, phi = STARTS[1], (0.3, 0.3, 0.5)
    layered, plain = (
        reaching(simulate(Experiment(law=law(switching=name, slope=30.0, phi=phi), duration=1.0, **start)))
        for name in (switching, "sign")
    )
    assert (layered.measured <= layered.bound + T).all()
    assert (layered.measured < plain.measured).all()
    full = reaching(simulate(Experiment(law=law(switching="saturation", slope=30.0, phi=phi), duration=1.0, **start)))
    assert (layered.bound > full.bound).all() == (switching == "tanh")


@pytest.mark.parametrize("switching", ["saturation", "tanh"])
def test_within_the_layer_the_surface_itself_is_not_reached(switching):
    """Against a constant torque d, S rests at φ atanh(d/K) or φ d/K instead of at 0."""
    d, K, phi = 0.004, 0.05, 0.3
    disturbance = {"name": "constant", "amplitude": d}
    one = law(switching=switching, K=K, phi=phi)
    run = simulate(Experiment(law=one, reference="hold", disturbance=disturbance, mass_scale=1, duration=3.0))
    rest = phi * (np.arctanh(d / K) if switching == "tanh" else d / K)
    assert np.abs(run.surface[-1]) == pytest.approx(np.full(3, rest), rel=1e-3)
    assert np.abs(run.error[-1]) == pytest.approx(np.full(3, rest / SlidingMode().slope), rel=1e-3)


def test_a_coupled_inertia_has_a_bound_too(tmp_path):
    """A wrist without symmetry, whose H has all its products of inertia."""
    file = tmp_path / "skew.xml"
    file.write_text(mjcf())
    one = law(switching="sign", K=0.1, slope=30.0)
    experiment = Experiment(law=one, model=file, mass_scale=1.1, duration=1.0, **STARTS[1])
    assert np.abs(inertia(experiment) - np.diag(np.diag(inertia(experiment)))).max() > 1e-6
    found = reaching(simulate(experiment))
    assert np.isfinite(found.bound).all()
    assert (found.measured <= found.bound + 2 * T).all()


@given(vectors(1.0), vectors(5.0), vectors(1.0), st.floats(0.0, 0.99), st.floats(1.5, 3.0))
def test_bound_holds_for_the_worst_mismatch_that_it_allows_equations_19_and_20(root, start, push, share, gain):
    """H Ṡ = Δ − K sgn S integrated in small steps, for any H and the Δ, within its largest, that holds S back most."""
    H = 1e-3 * (np.eye(3) + 3.0 * np.outer(root, root))
    K = 0.1 * np.array([1.0, gain, gain])
    largest = share * K * np.abs(push)
    bound = reaching_bound(start, H, K, largest)
    S, M, step, reached = start.copy(), np.linalg.inv(H), 2e-4, np.where(start == 0.0, 0.0, np.inf)
    for k in range(2000):
        S = S + step * M @ (largest * np.sign(S) - K * np.sign(S))
        reached = np.minimum(reached, np.where(np.sign(S) != np.sign(start), (k + 1) * step, np.inf))
    told = bound < 2000 * step
    assert (reached[told] <= bound[told] * (1.0 + 1e-9) + 3 * step).all()


def test_coupled_axes_are_bound_together_where_they_are_not_one_by_one_equation_43():
    """V̇ ≤ −κ Σ |S_i|, eq. (43) with η = κ: S = 0 by √(2 V(0) h) / κ; with a boundary layer there is no such bound."""
    H = 1e-3 * (np.eye(3) + 3.0 * np.outer([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]))
    K, largest, start = np.array([0.1, 0.1, 0.2]), np.array([0.03, 0.02, 0.01]), np.array([0.2, -2.0, 1.0])
    rate = reaching_rate(H, K, largest)
    assert (rate > 0.0).tolist() == [False, False, True]
    together = np.sqrt(start @ H @ start * 10e-3) / 0.07
    assert reaching_bound(start, H, K, largest) == pytest.approx([together, together, 1.0 / rate[2]])
    layered = reaching_bound(start, H, K, largest, phi=0.3)
    assert layered == pytest.approx([0.0, np.inf, 0.7 / rate[2]]), "the first axis starts within its layer"


def test_bound_of_a_single_axis_in_closed_form_equations_21_and_22():
    """(|S(0)| − φ) H / (σ K − |Δ|) for either sign of S(0)."""
    H, K, largest = np.diag([1e-3, 2e-3, 4e-3]), np.array([0.1, 0.2, 0.3]), np.array([0.05, 0.02, 0.0])
    for start in (np.array([2.0, -3.0, 4.0]), np.array([-2.0, 3.0, -4.0])):
        expected = (np.array([2.0, 3.0, 4.0]) - 0.5) * np.diag(H) / (0.75 * K - largest)
        assert reaching_bound(start, H, K, largest, 0.5, 0.75) == pytest.approx(expected)


def test_rate_of_reaching_takes_the_worst_of_the_coupling():
    """η_i against the smallest fall of |S_i| over all signs of S and all corners of Δ, by trying them all."""
    H = 1e-3 * np.array([[1.0, 0.2, 0.1], [0.2, 1.5, -0.3], [0.1, -0.3, 0.8]])
    K, largest, M = np.array([0.1, 0.2, 0.15]), np.array([0.01, 0.02, 0.03]), np.linalg.inv(H)
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    falls = [-s * (M @ (largest * c - K * s)) for s in corners for c in corners]
    assert reaching_rate(H, K, largest) == pytest.approx(np.min(falls, axis=0))
