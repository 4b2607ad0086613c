"""Sensors: statistics of their faults, delays in samples, and what the controller is told; against SciPy and NumPy.

Statistical bounds have a stated probability of failing for a fair generator; with the seeds fixed they always pass.
"""

import re

import mujoco
import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation, Slerp

from rigs import OPTIONAL, RigidBody, bits, one_line
from spherical_wrist import Experiment, simulate
from spherical_wrist.control import LawState, ModelBasedLaw
from spherical_wrist.disturbance import Noise
from spherical_wrist.errors import WristError
from spherical_wrist.parameters import Vector
from spherical_wrist.reference import Lissajous
from spherical_wrist.sensing import Ideal
from spherical_wrist.sensing.measure import measure, rounded, sensor_of
from spherical_wrist.sensing.samples import Samples
from spherical_wrist.wrist import Wrist

FALSE_ALARM = 1e-6
"""Probability that a fair generator fails one of the tests below, all its comparisons together."""

PERIOD = 1e-3


class Witness(ModelBasedLaw):
    """Computed torque that keeps what it was shown in its state, which is recorded one instant later."""

    has_surface = True

    class State(LawState):
        desired_rate: Vector = 0.0
        feed_forward: Vector = 0.0
        N: Vector = 0.0
        desired_attitude: tuple[float, float, float, float] = (0.0,) * 4
        time: float = 0.0
        H: tuple[Vector, Vector, Vector] = ((0.0,) * 3,) * 3
        rate: Vector = 0.0
        attitude: tuple[float, float, float, float] = (0.0,) * 4
        period: float = 0.0

    Kp: float = 400.0
    Kv: float = 40.0

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            torque = signal.N[i]
            for j in range(3):
                wanted = parameters.Kp * signal.error[j] + parameters.Kv * signal.rate_error[j]
                torque += signal.H[i, j] * (signal.feed_forward[j] + wanted)
                state.H[i, j] = signal.H[i, j]
            command.torque[i] = torque
            command.surface[i] = signal.error[i]
            command.slope[i] = signal.rate_error[i]
            state.desired_rate[i] = signal.desired_rate[i]
            state.feed_forward[i] = signal.feed_forward[i]
            state.N[i] = signal.N[i]
            state.rate[i] = signal.rate[i]
        for i in range(4):
            state.desired_attitude[i] = signal.desired_attitude[i]
            state.attitude[i] = signal.attitude[i]
        state.time = signal.time
        state.period = signal.period


def run(sensing, law="computed_torque", duration=2.0, interpreted=False, **more):
    """A run with these sensors; otherwise ideal and undisturbed where nothing else is said."""
    given = {"disturbance": 0, "mass_scale": 1, "sensing": sensing, "law": law, "duration": duration, **more}
    return simulate(Experiment(**given), interpreted=interpreted)


def shown(series):
    """Return the signals shown to a witness at every instant but the last, by name."""
    layout = Witness.state_layout()
    state = series.law_state[1:].copy().view(layout)[:, 0]
    return {name: state[name] for name in layout.names}


def rotations(quaternions):
    return Rotation.from_quat(quaternions, scalar_first=True)


def turned(true, seen):
    """log(q⁻¹ q_m), (n, 3)."""
    return (rotations(true).inv() * rotations(seen)).as_rotvec()


def states(count, period=PERIOD, seed=0):
    """A smooth tumbling motion at control instants: attitudes (n, 4) and rates (n, 3)."""
    time = np.arange(count) * period
    random = np.random.default_rng(seed)
    size, speed, phase = random.uniform(0.3, 0.8, 3), random.uniform(2.0, 9.0, 3), random.uniform(0.0, 6.0, 3)
    attitude = Rotation.from_rotvec(size * np.sin(time[:, None] * speed + phase)).as_quat(scalar_first=True)
    return attitude, np.cos(time[:, None] * speed + phase)


def sampled(sensing, attitudes, rates, period=PERIOD, seed=0):
    """Return the measurements of given states, sample by sample, without a loop."""
    count = len(attitudes)
    faults = Samples(sensing, period, seed).draw(period * np.arange(count)).view(np.recarray)
    made = sensor_of(sensing, period)
    sensor = made._replace(settings=made.settings.view(np.recarray)[0])
    seen_attitudes, seen_rates = np.empty((count, 4)), np.empty((count, 3))
    for k in range(count):
        measure(sensor, faults[k], k, tuple(attitudes[k]), tuple(rates[k]))
        seen_attitudes[k], seen_rates[k] = sensor.settings.attitude, sensor.settings.rate
    return seen_attitudes, seen_rates, faults


# --- noise and bias --------------------------------------------------------------------------------------------------


def assert_white(noise, deviation):
    """(n, m) numbers are Gaussian of this standard deviation, zero mean, white, and independent from column to column.

    Mean and correlations against the normal distribution, variance against χ², shape against Kolmogorov–Smirnov's.
    """
    count, width = noise.shape
    lags, pairs = range(1, 6), [(i, j) for i in range(width) for j in range(i)]
    comparisons = 3 * width + len(lags) * width + len(pairs)
    each = FALSE_ALARM / comparisons
    bound = stats.norm.isf(each / 2.0) / np.sqrt(count)
    unit = noise / deviation
    assert np.abs(unit.mean(axis=0)).max() < bound
    squares = (unit**2).sum(axis=0)
    assert stats.chi2.ppf(each / 2.0, count) < squares.min()
    assert squares.max() < stats.chi2.isf(each / 2.0, count)
    for column in unit.T:
        assert stats.kstest(column, "norm").pvalue > each
        for lag in lags:
            assert abs(np.mean(column[lag:] * column[:-lag])) < 1.01 * bound
    for i, j in pairs:
        assert abs(np.mean(unit[:, i] * unit[:, j])) < bound


def test_noise_is_white_and_independent_on_the_axes_of_attitude_and_rate():
    found = run({"attitude_noise": 2e-3, "rate_noise": 3e-2}, duration=20.0)
    attitude = turned(found.attitude, found.measured_attitude)
    rate = found.measured_rate - found.rate
    assert_white(np.hstack([attitude / 2e-3, rate / 3e-2]), 1.0)


def test_noise_of_attitude_acts_in_the_body_frame():
    """q ⊗ exp(ν), and not exp(ν) ⊗ q: with the noise that was drawn, exactly."""
    attitudes, rates = states(50)
    sensing = Ideal(attitude_noise=0.1)
    seen, _, faults = sampled(sensing, attitudes, rates)
    expected = rotations(attitudes) * Rotation.from_rotvec(faults.attitude_noise)
    assert (expected.inv() * rotations(seen)).magnitude().max() < 1e-14
    wrong = Rotation.from_rotvec(faults.attitude_noise) * rotations(attitudes)
    assert (wrong.inv() * rotations(seen)).magnitude().max() > 1e-2


def test_bias_is_added_to_the_rate_and_to_nothing_else():
    found = run({"rate_bias": (0.01, -0.02, 0.03)})
    np.testing.assert_allclose(found.measured_rate - found.rate, np.tile([0.01, -0.02, 0.03], (2000, 1)), atol=1e-15)
    assert found.measured_attitude.tobytes() == found.attitude.tobytes()
    assert np.abs(found.error).max() > 1e-4  # the law believed it


def test_faults_of_the_sensors_and_the_disturbance_are_independent():
    """One seed makes both; neither the numbers nor the correlations give that away."""
    experiment = {"disturbance": {"name": "noise", "bandwidth": 200.0}, "duration": 20.0, "mass_scale": 1}
    found = simulate(Experiment(law="computed_torque", sensing={"rate_noise": 1e-2}, **experiment))
    alone = simulate(Experiment(law="computed_torque", **experiment))
    assert found.disturbance.tobytes() == alone.disturbance.tobytes()
    noise = (found.measured_rate - found.rate) / 1e-2
    load = found.disturbance / np.sqrt(np.mean(found.disturbance**2, axis=0))
    bound = stats.norm.isf(FALSE_ALARM / (2 * 9 * 11)) / np.sqrt(len(noise))
    for lag in range(-5, 6):
        correlation = noise.T @ np.roll(load, lag, axis=0) / len(noise)
        assert np.abs(correlation).max() < bound
    drawn = Noise().shape(np.random.default_rng(0))(np.arange(5.0))
    assert not np.isin(np.round(noise[:20], 9), np.round(drawn, 9)).any()


@pytest.mark.parametrize("sizes", [(7, 7, 7, 7, 2), (1,) * 30, (30,), (16, 14), (3, 0, 27)], ids=str)
def test_the_same_faults_are_drawn_in_pieces(sizes):
    sensing = Ideal(attitude_noise=1e-3, rate_noise=1e-3, delay=2.5e-3, loss=0.4)
    time = PERIOD * np.arange(30)
    whole = Samples(sensing, PERIOD, 5).draw(time)
    pieces, source, first = [], Samples(sensing, PERIOD, 5), 0
    for size in sizes:
        pieces.append(source.draw(time[first : first + size]))
        first += size
    assert np.concatenate(pieces).tobytes() == whole.tobytes()
    assert Samples(sensing, PERIOD, 6).draw(time).tobytes() != whole.tobytes()


# --- resolution ------------------------------------------------------------------------------------------------------


def test_resolution_rounds_every_component_of_the_log():
    """To the nearest multiple: never further than half a step, as often here as there, and Δ²/12 in the mean square."""
    step = 1e-3
    found = run({"attitude_quantum": step}, duration=20.0)
    true, seen = rotations(found.attitude).as_rotvec(), rotations(found.measured_attitude).as_rotvec()
    np.testing.assert_allclose(seen / step, np.round(seen / step), atol=1e-9)
    error = (seen - true) / step
    assert np.abs(error).max() <= 0.5 * (1.0 + 1e-9)
    for column in error.T:  # the motion is smooth, and not drawn: what is small is the distance, not its probability
        assert stats.kstest(column + 0.5, "uniform").statistic < 0.01
    np.testing.assert_allclose(np.mean(error**2, axis=0), 1.0 / 12.0, rtol=0.02)
    # rotation vectors that differ by δ are attitudes at most |δ| apart
    assert np.linalg.norm(turned(found.attitude, found.measured_attitude), axis=1).max() <= 0.5 * np.sqrt(3.0) * step
    assert np.linalg.norm(error, axis=1).max() > 0.8


@pytest.mark.parametrize("value", [0.0, 0.49, -0.49, 0.51, -0.51, 7.2, -1e30, 3.1e15])
def test_rounding(value):
    assert rounded(value, 0.5) == 0.5 * np.floor(value / 0.5 + 0.5)
    assert abs(rounded(value, 0.5) - value) <= 0.25


def test_a_resolution_too_fine_to_count_changes_nothing():
    """Steps of 1e-19 rad: the number of steps is beyond what an integer of the machine can hold."""
    fine, ideal = run({"attitude_quantum": 1e-19}, duration=0.5), run("ideal", duration=0.5)
    np.testing.assert_allclose(fine.error, ideal.error, atol=1e-12)


# --- delay -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("periods", "period"), [(1, 1e-3), (2, 1e-3), (7, 3e-4), (9, 1e-3), (250, 1e-3)])
def test_a_whole_delay_is_a_shift_bit_for_bit(periods, period):
    """Before anything else can have arrived, it is the start that is seen."""
    attitudes, rates = states(400, period)
    seen, seen_rates, _ = sampled(Ideal(delay=periods * period), attitudes, rates, period)
    shown = np.maximum(0, np.arange(400) - periods)
    assert seen.tobytes() == attitudes[shown].tobytes()
    assert seen_rates.tobytes() == rates[shown].tobytes()


@pytest.mark.parametrize("delay", [0.0021, 0.007, 0.009])
def test_a_delay_is_whole_however_it_was_rounded(delay):
    """0.0021 / 0.0003 is 6.999999999999999 or 7.000000000000001: both are seven periods."""
    period = delay / 7.0
    for given in (delay, np.nextafter(delay, 1.0), np.nextafter(delay, 0.0)):
        settings = sensor_of(Ideal(delay=given), period).settings[0]
        assert (settings["whole"], settings["fraction"]) == (7, 0.0)


def test_a_whole_delay_in_the_loop():
    found = run({"delay": 3e-3})
    assert found.measured_attitude[3:].tobytes() == found.attitude[:-3].tobytes()
    assert found.measured_rate[3:].tobytes() == found.rate[:-3].tobytes()
    assert (found.measured_attitude[:3] == found.attitude[0]).all()
    assert (found.attitude[0] != found.attitude[3]).any()


@pytest.mark.parametrize("periods", [0.4, 1.5, 2.75, 3.999])
def test_a_fractional_delay_shows_the_state_between_instants(periods):
    """Of an exact motion, at t − δ, or at the start before that; Slerp would be off by a microradian."""
    time = PERIOD * np.arange(400)
    motion, then = Lissajous().motion(time), np.maximum(0.0, time - periods * PERIOD)
    seen, seen_rates, _ = sampled(Ideal(delay=periods * PERIOD), motion["attitude"], motion["rate"])
    exact = Lissajous().motion(then)
    off = (rotations(exact["attitude"]).inv() * rotations(seen)).magnitude().max()
    geodesic = Slerp(time, rotations(motion["attitude"]))(then).inv() * rotations(exact["attitude"])
    assert off < 1e-9
    assert off < 0.1 * geodesic.magnitude().max()
    for axis in range(3):
        np.testing.assert_allclose(seen_rates[:, axis], np.interp(then, time, motion["rate"][:, axis]), atol=1e-14)


def test_a_fractional_delay_takes_the_short_way_round():
    """A change of a quaternion's sign between two instants does not change the attitude."""
    attitudes, rates = states(40)
    flipped = attitudes * np.where(np.arange(40) % 2, -1.0, 1.0)[:, None]
    seen, _, _ = sampled(Ideal(delay=1.5e-3), attitudes, rates)
    again, _, _ = sampled(Ideal(delay=1.5e-3), flipped, rates)
    assert (rotations(seen).inv() * rotations(again)).magnitude().max() < 1e-14


# --- losses ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("loss", [0.001, 0.1, 0.7])
def test_losses_come_at_their_rate(loss):
    """Their number is binomial; the first sample is never lost."""
    count = 100_000
    for seed in range(3):
        lost = Samples(Ideal(loss=loss), PERIOD, seed).draw(PERIOD * np.arange(count))["lost"]
        assert set(lost) == {0.0, 1.0}
        assert lost[0] == 0.0
        low, high = stats.binom.ppf([FALSE_ALARM / 6.0, 1.0 - FALSE_ALARM / 6.0], count - 1, loss)
        assert low <= lost.sum() <= high


@pytest.mark.parametrize("loss", [0.1, 0.7])
def test_losses_are_independent_of_one_another(loss):
    """Runs of lost samples have geometric lengths: χ² of those of 1, 2, 3 and more."""
    lost = Samples(Ideal(loss=loss), PERIOD, 3).draw(PERIOD * np.arange(100_000))["lost"]
    changes = np.flatnonzero(np.diff(lost))
    lengths = (changes[1:] - changes[:-1])[::2]  # the first change is to a loss, since the first sample arrives
    observed = np.bincount(np.minimum(lengths, 4))[1:]
    chance = [1.0 - loss, loss * (1.0 - loss), loss**2 * (1.0 - loss), loss**3]
    assert stats.chisquare(observed, np.array(chance) * len(lengths)).pvalue > FALSE_ALARM


def test_a_lost_sample_leaves_the_one_before_in_force():
    """Whatever was noisy about it stays; its age grows by a period each time."""
    attitudes, rates = states(500)
    sensing = Ideal(loss=0.4, delay=1.7e-3, attitude_noise=1e-3, rate_noise=1e-2)
    seen, seen_rates, faults = sampled(sensing, attitudes, rates)
    complete, complete_rates, _ = sampled(sensing.replaced(loss=0.0), attitudes, rates)
    held, age = 0, np.empty(500)
    for k in range(500):
        held = held if faults.lost[k] else k
        assert seen[k].tobytes() == complete[held].tobytes()
        assert seen_rates[k].tobytes() == complete_rates[held].tobytes()
        age[k] = k * PERIOD - max(0.0, held * PERIOD - 1.7e-3)
    np.testing.assert_allclose(faults.age, age, atol=1e-15)
    assert age.max() > 5.5e-3


# --- what the controller is told -------------------------------------------------------------------------------------


def ages(sensing, found):
    """Age of the sample in force at every instant, from the faults of the run's seed."""
    lost = Samples(sensing, PERIOD, 0).draw(found.time)["lost"] > 0.5
    held = np.maximum.accumulate(np.where(lost, 0, np.arange(len(found))))
    return found.time - np.maximum(0.0, held * PERIOD - sensing.delay)


@pytest.mark.parametrize("timestamped", [True, False])
@pytest.mark.parametrize("faults", [{"delay": 3.3e-3}, {"loss": 0.3}, {"delay": 2e-3, "loss": 0.2, "rate_noise": 1e-3}])
def test_errors_are_formed_with_the_reference_of_the_samples_time(timestamped, faults):
    """If that is known: e = log(q_m⁻¹ q_d(t − a)), ė = R_e ω_d(t − a) − ω_m. If not, with the reference of now."""
    sensing = Ideal(timestamped=timestamped, **faults)
    found = run(sensing, Witness())
    age = ages(sensing, found) if timestamped else np.zeros(len(found))
    assert not timestamped or age.max() > 3e-3
    motion = Lissajous().motion(found.time - age)
    seen, wanted = rotations(found.measured_attitude), rotations(motion["attitude"])
    np.testing.assert_allclose(found.surface, (seen.inv() * wanted).as_rotvec(), atol=1e-12)
    rate_error = (seen.inv() * wanted).apply(motion["rate"]) - found.measured_rate
    np.testing.assert_allclose(found.slope, rate_error, atol=1e-12)
    told = shown(found)
    assert told["attitude"].tobytes() == found.measured_attitude[:-1].tobytes()
    assert told["rate"].tobytes() == found.measured_rate[:-1].tobytes()
    np.testing.assert_allclose(told["desired_rate"], motion["rate"][:-1], atol=1e-12)
    np.testing.assert_allclose(told["time"], found.time[:-1], atol=1e-12)  # of the instant, not of the sample
    # the errors of the run are the true ones all the same
    now = Lissajous().motion(found.time)
    true = (rotations(found.attitude).inv() * rotations(now["attitude"])).as_rotvec()
    np.testing.assert_allclose(found.error, true, atol=1e-12)


@pytest.mark.parametrize("prediction", [True, False])
@pytest.mark.parametrize("timestamped", [True, False])
def test_the_model_is_predicted_over_the_age_and_the_lag_and_half_a_period(prediction, timestamped):
    """H, N and feed-forward from NumPy, SciPy and MuJoCo, at the state that the sample and its age lead to.

    Without prediction at the sample itself, however old it is.
    """
    sensing = Ideal(delay=4.4e-3, loss=0.2, timestamped=timestamped, rate_noise=1e-2, attitude_noise=1e-3)
    actuation, start = {"name": "ideal", "lag": 1.5e-3}, (0.1, -0.2, 0.15)
    found = run(sensing, Witness(prediction=prediction), 0.3, actuation=actuation, initial_error=start)
    told, age = shown(found), ages(sensing, found) if timestamped else np.zeros(len(found))
    nominal, H = Wrist.load(), np.empty((3, 3))
    data = mujoco.MjData(nominal.model)
    seen, then = Lissajous().motion(found.time - age), Lissajous().motion(found.time + 0.5 * PERIOD + 1.5e-3)
    for k in range(0, len(found) - 1, 7):
        q, rate, desired = rotations(found.measured_attitude[k]), found.measured_rate[k], seen[k]
        if prediction:
            horizon = age[k] + 0.5 * PERIOD + 1.5e-3
            acceleration = carried(q, rate, desired)
            q = q * Rotation.from_rotvec(horizon * rate + 0.5 * horizon**2 * acceleration)
            rate, desired = rate + horizon * acceleration, then[k]
        data.qpos[:], data.qvel[:] = q.as_quat(scalar_first=True), rate
        mujoco.mj_forward(nominal.model, data)
        mujoco.mj_fullM(nominal.model, data, H)
        np.testing.assert_allclose(told["feed_forward"][k], carried(q, rate, desired), atol=1e-9)
        np.testing.assert_allclose(told["N"][k], data.qfrc_bias - data.qfrc_passive, atol=1e-12)
        np.testing.assert_allclose(told["H"][k], H, atol=1e-15)


def carried(q, rate, desired):
    """R_e ω̇_d − ω × R_e ω_d."""
    turn = q.inv() * rotations(desired["attitude"])
    return turn.apply(desired["acceleration"]) - np.cross(rate, turn.apply(desired["rate"]))


# --- rate from attitudes ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("time_constant", [0.0, 4e-3])
@pytest.mark.parametrize(("delay", "loss"), [(0.0, 0.0), (0.0, 0.3), (2e-3, 0.0), (3.3e-3, 0.3)])
def test_an_estimated_rate_is_the_filtered_difference_of_samples(time_constant, delay, loss):
    """In NumPy: first-order low-pass, exactly as old as its samples; settled until two samples are of the motion."""
    noisy = {"attitude_noise": 1e-4, "delay": delay, "loss": loss}
    sensing = Ideal(rate="estimated", rate_filter=time_constant, **noisy)
    found = run(sensing, duration=0.5)
    lost = Samples(sensing, PERIOD, 0).draw(found.time)["lost"] > 0.5
    seen = rotations(found.measured_attitude)
    estimate, last = found.rate[0].copy(), None
    for k in range(len(found)):
        if not lost[k]:
            if last is not None and last * PERIOD >= delay - 1e-12:
                spacing = (k - last) * PERIOD
                difference = (seen[last].inv() * seen[k]).as_rotvec() / spacing
                estimate = estimate + spacing / (spacing + time_constant) * (difference - estimate)
            else:
                then = max(0.0, k * PERIOD - delay)  # settled: on the true rate of that sample
                estimate = [np.interp(then, found.time, found.rate[:, axis]) for axis in range(3)]
            last = k
        np.testing.assert_allclose(found.measured_rate[k], estimate, atol=1e-9)


def test_an_estimated_rate_follows_the_true_one_by_half_a_period_and_the_filters_time_constant():
    """On a motion at a constant angular acceleration a, the estimate is the rate of T/2 + T_f before."""
    time, a = PERIOD * np.arange(200), np.array([0.0, 3.0, 0.0])
    attitudes = Rotation.from_rotvec(0.5 * np.outer(time**2, a)).as_quat(scalar_first=True)
    rates = np.outer(time, a)
    for time_constant in (0.0, 5e-3):
        _, estimate, _ = sampled(Ideal(rate="estimated", rate_filter=time_constant), attitudes, rates)
        behind = (rates - estimate)[150:, 1] / 3.0
        np.testing.assert_allclose(behind, 0.5 * PERIOD + time_constant, atol=1e-9)


@pytest.mark.parametrize("timestamped", [True, False])
def test_an_estimated_rate_is_compared_with_the_reference_of_its_time(timestamped):
    """T/2 and T_f before the attitude, to first order: ė = R_e (ω_d − a ω̇_d) − ω̂."""
    sensing = Ideal(rate="estimated", rate_filter=3e-3, delay=2e-3, timestamped=timestamped)
    found = run(sensing, Witness(), 1.0)
    age, older = (ages(sensing, found), 3.5e-3) if timestamped else (np.zeros(len(found)), 0.0)
    motion, tail = Lissajous().motion(found.time - age), slice(10, None)
    turn = rotations(found.measured_attitude).inv() * rotations(motion["attitude"])
    expected = turn.apply(motion["rate"] - older * motion["acceleration"]) - found.measured_rate
    np.testing.assert_allclose(found.slope[tail], expected[tail], atol=1e-12)
    if timestamped:  # what is compared is alike: a perfect model tracks as if nothing were late
        assert np.abs(found.slope[500:]).max() < 1e-3
        assert found.metrics.rms_error_rad < 2e-4


def test_faults_of_a_rate_sensor_that_is_not_there_do_nothing():
    there = run({"rate": "estimated", "rate_noise": 0.1, "rate_bias": (1.0, 1.0, 1.0)}, duration=0.5)
    absent = run({"rate": "estimated"}, duration=0.5)
    assert bits(there) == bits(absent)


# --- in the loop -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sensing", [{"rate_filter": 0.1}, {"timestamped": False}, {"rate_filter": 0.1, "delay": 0}])
def test_sensors_without_faults_change_nothing(sensing):
    """Parameters of parts that are off included."""
    ideal = run("ideal", duration=0.5)
    found = run({"name": "ideal", **sensing}, duration=0.5)
    assert bits(found) == bits(ideal)
    assert not {"measured_attitude", "measured_rate"} & found.channels.keys()


@pytest.mark.parametrize("interpreted", [False, True])
def test_faults_too_small_to_count_change_no_bit(interpreted):
    """Attitudes off by 1e-300 rad go through all that sensors do, and come out as they went in."""
    start = {"duration": 0.05, "initial_error": (0.1, 0.2, -0.3), "interpreted": interpreted}
    ideal = run("ideal", "fuzzy_sliding_computed_torque", **start)
    found = run({"attitude_noise": 1e-300}, "fuzzy_sliding_computed_torque", **start)
    assert bits(found).items() >= bits(ideal).items()
    assert found.measured_attitude.tobytes() == found.attitude.tobytes()
    assert found.measured_rate.tobytes() == found.rate.tobytes()


def test_the_seed_decides_about_faults_and_nothing_else():
    first, again, other = (run("realistic", duration=0.5, seed=seed) for seed in (1, 1, 2))
    assert bits(first) == bits(again)
    for name in ("measured_attitude", "measured_rate", "torque", "attitude"):
        assert bits(first)[name] != bits(other)[name]
    assert bits(run("ideal", duration=0.5, seed=1)) == bits(run("ideal", duration=0.5, seed=2))


def test_errors_and_metrics_are_the_true_ones():
    """At rest a bias b is answered with H (Kp e − Kv b) + D b + b × H b = 0: the law believes itself at its aim."""
    law = {"name": "computed_torque", "prediction": False}
    found = run({"rate_bias": 0.1}, law, 5.0, reference="hold")
    body, b = RigidBody.of(Wrist.load()), np.full(3, 0.1)
    expected = (40.0 * b - np.linalg.solve(body.inertia, body.damping * b + np.cross(b, body.inertia @ b))) / 400.0
    np.testing.assert_allclose(found.error[-1], expected, rtol=1e-9)
    assert found.metrics.max_error_rad == pytest.approx(np.linalg.norm(expected), rel=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"attitude_noise": -1e-3}, "greater than or equal to 0"),
        ({"attitude_quantum": "fine"}, "valid number|must be a number"),
        ({"delay": 1.5}, "less than or equal to 1"),
        ({"delay": -1e-3}, "greater than or equal to 0"),
        ({"loss": 1.0}, "less than 1"),
        ({"loss": -0.1}, "greater than or equal to 0"),
        ({"rate": "guessed"}, "'measured' or 'estimated'"),
        ({"rate_bias": (1.0, 2.0)}, "one number, or three"),
        ({"rate_noise": float("nan")}, "finite"),
        ({"atitude_noise": 1e-3}, "did you mean 'attitude_noise'"),
        ("perfect", "'ideal', 'realistic'|ideal, realistic"),
        (3.0, "a name, a table"),
    ],
)
def test_what_cannot_be_a_sensor_is_refused_in_one_line(given, said):
    with pytest.raises(WristError, match="sensing") as caught:
        Experiment(sensing=given)
    assert re.search(said, one_line(caught.value)), caught.value


def test_what_a_run_records_of_its_sensors():
    found = run("realistic", duration=0.1)
    assert {name for name in OPTIONAL if name in found.channels} == {"measured_attitude", "measured_rate"}
