"""Disturbances: their size, when they act, and what noise is made of."""

import numpy as np
import pytest
from scipy.signal import chirp, periodogram
from scipy.stats import kstest

from rigs import one_line
from spherical_wrist.disturbance import Chirp, Constant, Disturbance, Noise, Pulse, Sinusoid, Square, Steps, Tremor
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import unit_of

every = pytest.mark.parametrize("member", Disturbance.members.values(), ids=lambda member: member.name)
TIMES = np.arange(20_000) * 1e-3
RANDOM = {Noise, Steps, Tremor}


def worst():
    """Shape of a disturbance that is built for a closed loop."""
    return lambda time: np.where(np.outer(np.floor(time / 0.07), [1, 2, 3]) % 2, 1.0, -1.0)


def torque(disturbance, peak=0.02, seed=1, time=TIMES):
    return disturbance.torque(peak, np.random.default_rng(seed), worst)(time)


@every
def test_level_is_a_fraction_of_the_peak_torque(member):
    unit = torque(member(level=1.0), peak=1.0)
    np.testing.assert_allclose(torque(member(level=0.4), peak=0.02), 0.4 * 0.02 * unit, rtol=1e-14)
    assert np.abs(unit).max() > 0.5
    assert unit.shape == (len(TIMES), 3)


@every
def test_amplitude_is_a_torque_whatever_the_peak_and_the_level(member):
    unit = torque(member(level=1.0), peak=1.0)
    for peak in (0.0, 0.02, 5.0):
        np.testing.assert_allclose(torque(member(amplitude=0.003, level=0.9), peak), 0.003 * unit, rtol=1e-14)


@every
def test_a_level_of_no_torque_at_all_is_refused(member):
    with pytest.raises(ParameterError) as caught:
        torque(member(level=0.25), peak=0.0)
    assert "amplitude" in one_line(caught.value)
    assert not torque(member(level=0.0), peak=0.0).any()


@every
def test_is_a_function_of_time_alone(member):
    """The same bits in chunks, in another order, at another sampling; so a run can be cut or replayed at will."""
    disturbance = member().torque(0.02, np.random.default_rng(3), worst)
    whole = disturbance(TIMES)
    assert np.array_equal(np.concatenate([disturbance(TIMES[:777]), disturbance(TIMES[777:])]), whole)
    assert np.array_equal(disturbance(TIMES[::10]), whole[::10])
    assert np.array_equal(disturbance(TIMES[::-1]), whole[::-1])
    assert disturbance(np.empty(0)).shape == (0, 3)


@every
def test_the_seed_decides(member):
    same, again = torque(member(), seed=7), torque(member(), seed=7)
    assert np.array_equal(same, again)
    assert np.array_equal(same, torque(member(), seed=8)) == (member not in RANDOM)


def test_only_random_shapes_draw_from_the_generator():
    """Otherwise switching a disturbance on would change the sensor noise that is drawn after it."""
    for member in Disturbance.members.values():
        random = np.random.default_rng(0)
        member().torque(1.0, random, worst)
        assert (random.random() == np.random.default_rng(0).random()) == (member not in RANDOM)


def test_constant_is_constant_on_every_axis():
    assert (torque(Constant(level=0.25), peak=0.02) == 0.25 * 0.02).all()


def test_sinusoid_is_the_imaginary_part_of_a_rotation():
    wave = torque(Sinusoid(amplitude=1.0, frequency=1.7, phase=(0.0, 0.5, -2.0)))
    np.testing.assert_allclose(
        wave, np.exp(1j * (2.0 * np.pi * 1.7 * TIMES[:, None] + [0.0, 0.5, -2.0])).imag, atol=1e-11
    )


@pytest.mark.parametrize("period", [1e-3, 1e-4, 2e-3, 1.25e-4])
def test_pulse_edges_fall_exactly_on_samples(period):
    """On at 3 s, off at 3.5 s, every 2 s, counted in whole samples, though k · period is rounded."""
    k = np.arange(round(40.0 / period))
    on = torque(Pulse(amplitude=1.0, start=3.0, width=0.5, period=2.0), time=k * period)
    since, length, width = k - round(3.0 / period), round(2.0 / period), round(0.5 / period)
    expected = (since >= 0) & (since % length < width)
    assert np.array_equal(on, np.repeat(expected[:, None], 3, axis=1).astype(float))


def test_pulses_of_awkward_numbers_have_the_right_edges():
    k = np.arange(40_000)
    on = torque(Pulse(amplitude=1.0, start=0.1, width=0.3, period=0.7), time=k * 1e-3)[:, 1]
    assert np.array_equal(on, ((k >= 100) & ((k - 100) % 700 < 300)).astype(float))


def test_pulse_longer_than_its_period_stays_on():
    on = torque(Pulse(amplitude=1.0, start=1.0, width=3.0, period=2.0))
    assert not on[:1000].any()
    assert on[1000:].all()


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1.25e-4])
def test_square_changes_its_sign_exactly_on_samples(step):
    """The sign of the first half of every period, counted in whole samples; of other numbers, that of the sine."""
    k = np.arange(round(3.0 / step))
    half = round(0.1 / step)
    wave = torque(Square(amplitude=1.0, frequency=5.0, phase=(0.0, np.pi, np.pi / 2.0)), time=k * step)
    for column, shift in zip(wave.T, (0, half, half // 2), strict=True):
        assert np.array_equal(column, np.where(((k + shift) // half) % 2 == 0, 1.0, -1.0))
    awkward = torque(Square(amplitude=1.0, frequency=7.3, phase=1.1))[:, 0]
    sine = np.sin(2.0 * np.pi * 7.3 * TIMES + 1.1)
    clear = np.abs(sine) > 1e-6
    assert np.array_equal(awkward[clear], np.sign(sine[clear]))


def test_chirp_has_equal_times_for_equal_ratios_of_frequency_and_begins_anew():
    """SciPy's logarithmic chirp, sweep after sweep; its instantaneous frequency doubles in length / log2(ratio)."""
    wave = torque(Chirp(amplitude=1.0, start=0.5, final=40.0, length=8.0, phase=(0.0, 0.4, -1.0)))
    since = np.mod(np.arange(len(TIMES)), 8000) * 1e-3
    for column, phase in zip(wave.T, (0.0, 0.4, -1.0), strict=True):
        expected = chirp(since, 0.5, 8.0, 40.0, method="logarithmic", phi=np.rad2deg(phase) - 90.0)
        np.testing.assert_allclose(column, expected, atol=1e-7)
    steady = torque(Chirp(amplitude=1.0, start=3.0, final=3.0))
    np.testing.assert_allclose(steady[:8000, 0], np.sin(6.0 * np.pi * TIMES[:8000]), atol=1e-10)


def test_steps_are_uniform_independent_levels_held_for_their_time():
    held = 50
    wave = torque(Steps(amplitude=1.0, hold=0.05), time=np.arange(100_000) * 1e-3).reshape(-1, held, 3)
    assert (wave == wave[:, :1]).all()
    levels = wave[:, 0]
    assert len(np.unique(levels)) == levels.size  # nothing repeats, also not after a block
    for column in levels.T:
        assert kstest(column, "uniform", (-1.0, 2.0)).pvalue > 1e-3
    pairs = np.hstack([levels[1:], levels[:-1]])
    assert np.abs(np.corrcoef(pairs.T) - np.eye(6)).max() < 0.1


def test_tremor_has_unit_rms_in_its_band_and_nothing_outside():
    wave = torque(Tremor(amplitude=1.0, low=8.0, high=12.0), seed=5, time=SLOW)
    np.testing.assert_allclose(np.sqrt(np.mean(wave**2, axis=0)), 1.0, rtol=0.05)
    frequency, power = periodogram(wave, fs=100.0, window="blackmanharris", axis=0, scaling="density")
    total = power.sum(axis=0)
    assert (power[(frequency < 7.9) | (frequency > 12.1)].sum(axis=0) / total).max() < 1e-6
    for low in (8.0, 9.0, 10.0, 11.0):
        share = power[(frequency >= low) & (frequency < low + 1.0)].sum(axis=0) / total
        np.testing.assert_allclose(share, 0.25, atol=0.05)


SLOW = np.arange(40_000) * 1e-2
NOISE = torque(Noise(amplitude=1.0, bandwidth=20.0), seed=11, time=SLOW)


def test_noise_has_unit_rms_and_no_mean():
    np.testing.assert_allclose(np.sqrt(np.mean(NOISE**2, axis=0)), 1.0, rtol=0.05)
    np.testing.assert_allclose(NOISE.mean(axis=0), 0.0, atol=0.1)


def test_noise_is_gaussian():
    """Shares of samples within one, two, three standard deviations; kurtosis of 64 tones is 3 − 3/128."""
    for size, share in ((1.0, 0.6827), (2.0, 0.9545), (3.0, 0.9973)):
        np.testing.assert_allclose((np.abs(NOISE) < size).mean(axis=0), share, atol=0.02)
    np.testing.assert_allclose((NOISE**4).mean(axis=0), 3.0, atol=0.3)


def test_noise_is_independent_on_the_axes():
    correlation = np.corrcoef(NOISE.T)
    assert np.abs(correlation - np.eye(3)).max() < 0.1


def test_noise_has_a_flat_spectrum_up_to_its_bandwidth_and_nothing_above():
    frequency, power = periodogram(NOISE, fs=100.0, window="blackmanharris", axis=0, scaling="density")
    total = power.sum(axis=0)
    assert (power[frequency > 20.1].sum(axis=0) / total).max() < 1e-6
    for low in (0.0, 5.0, 10.0, 15.0):
        share = power[(frequency >= low) & (frequency < low + 5.0)].sum(axis=0) / total
        np.testing.assert_allclose(share, 0.25, atol=0.05)


def test_bandwidth_scales_the_frequencies():
    fast = torque(Noise(amplitude=1.0, bandwidth=40.0), seed=11, time=SLOW / 2.0)
    np.testing.assert_allclose(fast, NOISE, atol=1e-9)


@every
def test_every_parameter_is_documented(member):
    for name, field in member.model_fields.items():
        assert field.description, name
        assert unit_of(member, name) or name == "level", name


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Constant(level=-0.1), "level"),
        (lambda: Constant(amplitude=-0.1), "amplitude"),
        (lambda: Pulse(width=0.0), "width"),
        (lambda: Pulse(period=0.0), "period"),
        (lambda: Pulse(start=np.nan), "start"),
        (lambda: Noise(bandwidth=np.inf), "bandwidth"),
        (lambda: Noise(bandwith=5.0), "bandwidth"),
        (lambda: Square(frequency=0.0), "frequency"),
        (lambda: Chirp(final=-1.0), "final"),
        (lambda: Steps(hold=0.0), "hold"),
        (lambda: Tremor(low=12.0, high=8.0), "low = 12 Hz must be less than high = 8 Hz"),
        (lambda: Sinusoid(phase=(1.0, 2.0)), "three"),
    ],
)
def test_bad_parameters_are_named_in_one_line(make, said):
    with pytest.raises(ParameterError) as caught:
        make()
    assert said in one_line(caught.value)
