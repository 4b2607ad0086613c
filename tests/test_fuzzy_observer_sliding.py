"""Our law: its filters against closed forms, what it learns of the input, what each part is worth, what it promises."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation

import spherical_wrist as sw
from sampling import long, some
from spherical_wrist import Experiment, simulate
from spherical_wrist.comparison.ablation import FIGURES, WHOLE, ablation
from spherical_wrist.comparison.ablation_picture import ablation_picture
from spherical_wrist.comparison.ablation_table import ablation_table, to_dict
from spherical_wrist.control import FuzzyObserverSliding, Law
from spherical_wrist.control.contract import SIGNAL
from spherical_wrist.control.fused_state import FusedState, Noise, fuse
from spherical_wrist.control.fuzzy_observer_sliding import cleanness
from spherical_wrist.control.input_identification import Identified, drive, identify
from spherical_wrist.control.surface_observer import gains
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.loop.outcome import Status
from spherical_wrist.picture_style import WIDTHS
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.needed_torque import needed_variation

T = 1e-3
OURS = "fuzzy_observer_sliding"


def record(state):
    """A state of a law by name, before the first step."""

    class Remembering(Law):
        State = state

    return Remembering().packed_state().view(Remembering.state_layout()).view(np.recarray)[0]


# --- the observer


def transition(decay):
    """A period of the observer without input, in Ŝ, T δ̂ and T² ĝ."""
    return np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, np.exp(-decay * T)]])


@pytest.mark.parametrize(
    ("real", "pair", "damping", "decay"), [(300, 500, 0.4, 1200), (900, 100, 1.0, 1), (50, 60, 0.7, 20)]
)
def test_the_gains_place_the_poles(real, pair, damping, decay):
    correction = np.array(gains(real, pair, damping, decay, T))[:, None]
    A = transition(decay)
    found = np.linalg.eigvals((np.eye(3) - correction @ [[1.0, 0.0, 0.0]]) @ A)
    other = np.exp(T * pair * (-damping + 1j * np.sqrt(1.0 - damping**2)))
    np.testing.assert_allclose(np.poly(found), np.poly([np.exp(-real * T), other, other.conjugate()]).real, atol=1e-12)


def test_without_decay_and_with_a_triple_pole_it_is_the_g_h_k_filter():
    """Of Brookner (1998): 1 − p³, 3/2 (1 − p²)(1 − p), (1 − p)³."""
    p = np.exp(-310.0 * T)
    expected = (1.0 - p**3, 1.5 * (1.0 - p**2) * (1.0 - p), (1.0 - p) ** 3)
    np.testing.assert_allclose(gains(310.0, 310.0, 1.0, 1e-9, T), expected, rtol=1e-6)


# --- the fusion


def sample_of(error, rate_error):
    """A signal of a wrist whose desired attitude is at rest."""
    signal = np.zeros(1, SIGNAL).view(np.recarray)[0]
    signal.period, signal.error, signal.rate_error, signal.rate = T, error, rate_error, -np.array(rate_error)
    return signal


def test_a_turning_error_and_a_biased_gyroscope_are_found():
    """Of an error of half a radian that turns about a changing axis, and an attitude sensor without noise."""
    state, noise = record(FusedState), Noise((1e-3,) * 3, 1e-3, 0.05, 1e-4, 2.0)
    bias = np.array([0.02, -0.01, 0.03])
    off, left = Rotation.from_rotvec([0.3, -0.3, 0.2]), {}
    for k in range(3001):
        rate = 0.8 * np.array([np.cos(2.0 * k * T), np.sin(3.0 * k * T), np.cos(3.0 * k * T + 1.0)])
        error = off.as_rotvec()
        fuse(sample_of(error, rate - bias), state, 1 if k else 0, noise)
        left[k] = np.abs(np.array(state.bias) - bias).max()
        middle = 0.8 * np.array(
            [np.cos(2.0 * (k + 0.5) * T), np.sin(3.0 * (k + 0.5) * T), np.cos(3.0 * (k + 0.5) * T + 1.0)]
        )
        off = Rotation.from_rotvec(T * middle) * off  # body frame: d/dt (q⁻¹ q_d) = ½ ė (q⁻¹ q_d)
    assert left[0] == pytest.approx(0.03)
    assert left[1000] < 1e-3
    assert left[3000] < 3e-4
    np.testing.assert_allclose(state.error, error, atol=1e-6)
    np.testing.assert_allclose(state.rate_error, rate, atol=1e-3)


@pytest.mark.parametrize("attitude", [3e-5, 3e-4, 3e-3])
def test_noise_is_measured_and_averaged_as_by_the_best_filter(attitude):
    """Of a wrist that stands still, with a bias that walks: the errors are those of SciPy's Riccati equation."""
    sigma, walk = 1e-3, 1e-4
    state, noise = record(FusedState), Noise((sigma,) * 3, 3e-3, 1e-2, walk, 2.0)
    random, bias, errors, measured = np.random.default_rng(3), np.full(3, 5e-3), [], []
    for k in range(12_000):
        bias += walk * np.sqrt(T) * random.normal(size=3)
        error = attitude * random.normal(size=3)
        fuse(sample_of(error, sigma * random.normal(size=3) - bias), state, 1 if k else 0, noise)
        errors.append([*state.error, *(np.array(state.bias) - bias)])
        measured.append(state.attitude_noise[0])
    F, Q = np.array([[1.0, T], [0.0, 1.0]]), np.diag([(T * sigma) ** 2, T * walk**2])
    before = solve_discrete_are(F.T, np.array([[1.0], [0.0]]), Q, [[attitude**2]])
    after = before - np.outer(before[:, 0], before[0]) / (before[0, 0] + attitude**2)
    found = np.sqrt(np.mean(np.square(errors[6000:]), axis=0))
    assert np.mean(measured[6000:]) == pytest.approx(attitude, rel=0.05)
    assert np.mean(found[:3]) == pytest.approx(np.sqrt(after[0, 0]), rel=0.3)
    assert np.mean(found[3:]) == pytest.approx(np.sqrt(after[1, 1]), rel=0.3)
    assert np.mean(found[:3]) < 0.3 * attitude


def test_the_noise_is_found_while_the_estimate_is_far_off():
    """It says nothing of the filter's own error: here of a bias that it was told cannot be."""
    state, noise = record(FusedState), Noise((1e-3,) * 3, 3e-3, 0.0, 0.0, 2.0)
    random = np.random.default_rng(4)
    for k in range(4000):
        fuse(sample_of(3e-4 * random.normal(size=3), np.full(3, 0.1)), state, 1 if k else 0, noise)
    assert np.abs(state.error).min() > 3e-3
    np.testing.assert_allclose(state.attitude_noise, 3e-4, rtol=0.1)


# --- the rules


def test_the_noise_of_an_estimated_rate_slows_the_loop():
    """By how far √2 σ_a over the time between two attitudes lies between clean and noisy, in decades."""
    law, signal = FuzzyObserverSliding(), sample_of(np.zeros(3), np.zeros(3))
    assert cleanness(signal, law, 1.0) == 1.0
    signal.rate_age = 0.5e-3  # attitudes 1 ms apart
    middle = np.sqrt(law.clean * law.noisy)
    expected = {0.0: 1.0, law.clean: 1.0, middle: 0.5, law.noisy: 0.0, 10.0 * law.noisy: 0.0}
    found = [cleanness(signal, law, noise * T / np.sqrt(2.0)) for noise in expected]
    np.testing.assert_allclose(found, list(expected.values()), atol=1e-12)
    abrupt = law.replaced(noisy=law.clean)
    found = [cleanness(signal, abrupt, noise * T / np.sqrt(2.0)) for noise in (0.99 * law.clean, 1.01 * law.clean)]
    assert found == [1.0, 0.0]


# --- the identification


@pytest.mark.parametrize(("gain", "delay"), [(1.0, 0.0), (2.0, 0.0), (1.0, 0.6), (1.8, 0.8)])
def test_gain_and_delay_of_an_integrator_are_learnt(gain, delay):
    """An exact plant Ṡ = −γ w, w a period later in part, under random commands, of which nothing is known."""
    state = record(Identified)
    correction = gains(300.0, 300.0, 1.0, 300.0, T)
    L, A = np.array(correction) / [1.0, T, T**2], transition(300.0)
    scale = np.array([1.0, T, T**2])
    random, surface, estimate = np.random.default_rng(5), 0.0, np.zeros(3)
    older = w = 0.0
    for _ in range(4000):
        oldest, older, w = older, w, 5.0 * random.normal()
        acted = (1.0 - delay) * w + delay * older
        surface -= T * gain * acted
        d = state.delay[0]
        whole = int(d)
        newer, behind = (w, older) if whole == 0 else (older, oldest)
        believed, before = (1.0 - d % 1) * newer + d % 1 * behind, behind
        estimate = A @ (estimate * scale) / scale
        estimate[0] -= T * state.gain[0] * believed
        drive(state, 0, believed, before, np.exp(-0.3), T)
        innovation = surface - estimate[0]
        identify(state, 0, innovation, 1e-4, 1.0, 1.0, 1e-3, 1e-3, 0.0, correction, T)
        estimate += L * innovation
    assert state.gain[0] == pytest.approx(gain, rel=0.05)
    assert state.delay[0] == pytest.approx(delay, abs=0.1)


def test_what_is_learnt_rests_while_nothing_is_news():
    """But for a tenth of the leak, whatever the innovation says."""
    state = record(Identified)
    state.gain[0], state.delay[0] = 1.8, 0.9
    state.gain_response[0], state.delay_response[0] = (0.3, 0.0, 0.0), (0.2, 0.0, 0.0)
    for _ in range(1000):
        identify(state, 0, 0.05, 1e-3, 0.0, 1.0, 1e-3, 1e-3, 0.5 * T, gains(300.0, 300.0, 1.0, 300.0, T), T)
    left = np.exp(-0.05)
    assert (state.gain[0], state.delay[0]) == pytest.approx((1.0 + 0.8 * left, 0.9 * left), rel=1e-4)


# --- the parts


@pytest.fixture(scope="module")
def parts():
    return ablation(FuzzyObserverSliding())


@long
@pytest.mark.parametrize("part", FuzzyObserverSliding.ablations)
def test_each_part_pays(parts, part):
    """Without it, some figure is worse by at least an eighth, or the law is lost."""
    whole, without = parts[WHOLE], parts[part]
    for figure in FIGURES:
        here, there = whole[figure.name], without[figure.name]
        if there is None or (there < 0.88 * here if figure.more else there > 1.125 * here):
            return
    pytest.fail(f"{whole}\n{without}")


def test_rules_and_fusion_pay():
    """Rules where the torque is the worst one, fusion where sensors are noisy: what needs the least time to see."""
    law = FuzzyObserverSliding()
    without = {part: law.replaced(**changes) for part, changes in law.ablations.items()}
    worst = {"disturbance": {"name": "worst"}, "duration": 3.0}
    flat, whole = (simulate(Experiment(law=each, **worst)).metrics for each in (without["rules"], law))
    assert flat.max_tip_error_mm > 1.4 * whole.max_tip_error_mm
    alone, fused = (
        simulate(Experiment(law=each, duration=4.0, **HARDWARE["realistic"])).metrics
        for each in (without["fusion"], law)
    )
    assert alone.rms_tip_error_mm > 1.5 * fused.rms_tip_error_mm
    assert alone.chattering_Nm_per_s > 3.0 * fused.chattering_Nm_per_s


def test_a_law_without_parts_is_refused_in_one_line(wrist):
    with pytest.raises(ParameterError, match="declares no parts"):
        ablation(Law.resolve("pd", default="pd"))
    code, out, err = wrist("ablate", "pd")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert OURS in err


def test_the_picture_and_the_table_of_parts_have_the_figures_and_the_lost_runs():
    law = FuzzyObserverSliding()
    found = {part: {each.name: 1.0 + place for each in FIGURES} for place, part in enumerate([WHOLE, *law.ablations])}
    found["rules"] = {**found["rules"], FIGURES[0].name: None}
    found["fusion"] = {**found["fusion"], FIGURES[-1].name: 0.0}
    table = to_dict(OURS, law, found)
    rows = ablation_table(table).rows
    assert [row[0] for row in rows] == ["whole law", *(f"without {part}" for part in law.ablations)]
    assert (rows[0][1:], rows[3][1]) == ([1.0] * len(FIGURES), "lost")
    for width in WIDTHS.values():
        made = ablation_picture(table, width)
        assert made.get_figwidth() == width
        ends = [line for line in made.axes[0].lines if line.get_marker() in ("o", "x")]
        assert [line.get_marker() for line in ends] == ["x" if row[1] == "lost" else "o" for row in rows]
        assert [line.get_xdata()[0] for line in ends if line.get_marker() == "o"] == [
            row[1] for row in rows if row[1] != "lost"
        ]
        assert made.axes[-1].get_xlim()[0] == 0.0


# --- the promises


def run(**changes):
    """The metrics of a run that must complete."""
    found = simulate(Experiment(law=OURS, **changes), keep_series=False)
    assert found.outcome.status is Status.COMPLETED
    return found.metrics


def plain(**changes):
    return simulate(Experiment(law="computed_torque", **changes), keep_series=False).metrics


REALISTIC = HARDWARE["realistic"]


def noisy(times):
    sensing = {"attitude_noise": 2.9e-4 * times, "rate_noise": 1.1e-3 * times, "rate_bias": (1e-3 * times,) * 3}
    return {**REALISTIC, "sensing": {"name": "realistic", **sensing}}


@pytest.mark.parametrize(
    ("changes", "micrometres", "chattering"),
    [
        (REALISTIC, 4.0, 4.3),
        ({**REALISTIC, "reference": "beating_heart"}, 4.3, 5.0),
        ({**REALISTIC, "reference": "suture"}, 4.3, 5.0),
        ({**REALISTIC, "payload": 0.05}, 7.6, 5.0),
        (noisy(10), 41.0, 6.0),
        ({**REALISTIC, "sensing": {"name": "realistic", "rate": "estimated"}}, 40.0, 4.5),
    ],
    ids=["lissajous", "heart", "suture", "payload", "ten times the noise", "no gyroscope"],
)
def test_on_realistic_hardware(changes, micrometres, chattering):
    found = run(**changes)
    assert 1e3 * found.rms_tip_error_mm < micrometres
    assert found.chattering_Nm_per_s < chattering * plain(**changes).chattering_Nm_per_s


@pytest.mark.parametrize("shape", ["constant", "sinusoid"])
@pytest.mark.parametrize("mass", [0.75, 1.0, 1.25])
def test_slow_torques(shape, mass):
    assert run(disturbance={"name": shape}, mass_scale=mass).rms_error_rad < 2.5e-6


ADVERSARY = [
    *({"name": "square", "frequency": f} for f in (5.0, 12.0, 30.0, 60.0, 140.0)),
    *({"name": "sinusoid", "frequency": f} for f in (5.0, 20.0, 70.0, 110.0, 200.0)),
    {"name": "steps", "hold": 0.008},
    {"name": "chirp", "final": 150.0},
    {"name": "worst"},
]


@pytest.mark.parametrize("mass", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("disturbance", some(ADVERSARY, 4), ids=lambda each: "-".join(map(str, each.values())))
def test_no_torque_within_a_quarter_moves_the_tip_far(disturbance, mass):
    assert 1e3 * run(disturbance=disturbance, mass_scale=mass, duration=4.0).max_tip_error_mm < 20.0


@long
@pytest.mark.parametrize(("degree", "disk_margin"), [("surprised", 0.45), ("calm", 0.5)])
def test_the_loops_between_which_the_rules_choose_have_margins(degree, disk_margin):
    """Frozen at one degree, on the nominal plant with late samples."""
    law = FuzzyObserverSliding()
    factor = getattr(law, degree)
    slowed = factor if degree == "calm" else 1.0
    frozen = law.replaced(
        reaching=factor * law.reaching, real_pole=factor * law.real_pole, pair=factor * law.pair, filter_first=0.0,
        filter_second=0.0, decay=slowed * law.decay, integral=slowed * law.integral, **law.ablations["rules"],
    )  # fmt: skip
    late = {"sensing": {"delay": 5e-4}, "actuation": {"lag": 5e-4}, "mass_scale": 1.0}
    [found] = sw.margins([frozen], ranges=False, **late).to_dict()["laws"]
    assert found["disk_margin"] > disk_margin
    assert found["max_sensitivity"] < 2.4


@pytest.mark.parametrize(("mass", "frequency"), some([(0.5, 51.0), (0.5, 67.0), (1.0, 56.0), (1.5, 80.0)], 2))
def test_a_sine_that_lasts_is_not_taken_for_a_delay(mass, frequency):
    """At first it is, and with a wrong delay the loop is not stable where the rules make it fast."""
    lasting = {"name": "sinusoid", "frequency": frequency}
    assert 1e3 * run(disturbance=lasting, mass_scale=mass, duration=8.0).max_tip_error_mm < 20.0


@pytest.mark.parametrize(("mass", "delay"), [(0.5, 1.5e-3), (1.0, 2.25e-3), (1.5, 2.5e-3)])
def test_a_delay_that_nobody_knows_of_is_borne(mass, delay):
    late = {"mass_scale": mass, "sensing": {"delay": delay, "timestamped": False}, "duration": 5.0}
    needed = needed_variation(Experiment(mass_scale=mass, duration=5.0), RunCache())
    assert run(**late).chattering_Nm_per_s < 2.0 * needed


def test_three_times_the_mass_a_payload_and_motors_near_their_limit_are_carried():
    for changes in ({"mass_scale": 3.0}, {"payload": 0.05}, {"payload": 0.05, "mass_scale": 1.0}):
        assert run(**changes).rms_error_rad < 1e-5
    push = {"disturbance": {"name": "constant", "amplitude": 0.95 * 0.2}, "reference": "hold", "mass_scale": 1.0}
    assert run(**push).rms_error_rad < 1e-6


def test_on_a_slender_hand_it_is_better_than_the_best_rival_was():
    found = run(model="slender_hand")
    assert found.rms_error_rad < 1.7e-6
    assert 1e3 * found.rms_tip_error_mm < 0.26


def test_a_large_error_is_taken_home_and_leaves_nothing():
    found = simulate(Experiment(law=OURS, initial_error=(0.4, 0.2, -0.3), mass_scale=1.5, duration=2.0))
    assert np.abs(found.error[300:]).max() < 1e-5
