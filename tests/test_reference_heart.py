"""The beating heart: where the tip is, what the motion is made of, when the heart beats."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import periodogram
from scipy.spatial.transform import Rotation

from rigs import one_line
from spherical_wrist import Experiment, simulate
from spherical_wrist.errors import ParameterError
from spherical_wrist.kinematics import tip_position
from spherical_wrist.reference import BeatingHeart, Reference
from spherical_wrist.reference.heart_rhythm import HIGH_BAND, LOW_BAND

TIMES = np.arange(0.0, 30.0, 0.01)
CASES = [
    BeatingHeart(),
    BeatingHeart(premature=0.3, deviation=0.05, twist=1.5, seed=4),
    BeatingHeart(lever=0.031, heartbeat=(9.0, 7.0), breath=3.0, modulation=1.0),
]


def beat_times(heart, duration):
    """Return the times t > 0 of whole numbers of beats: by interpolation, then by Newton's method."""
    grid = np.arange(0.0, duration, 0.02)
    beats = heart.beats(grid).value
    whole = np.arange(1.0, np.floor(beats[-1]))
    time = np.interp(whole, beats, grid)
    for _ in range(3):
        reached = heart.beats(time)
        time = time - (reached.value - whole) / reached.rate
    return time


@pytest.mark.parametrize("heart", CASES)
def test_the_tip_goes_where_the_heart_goes(heart):
    """In millimetres, in the plane tangent to the tip's sphere; exactly, however large."""
    motion = heart.motion(TIMES)
    tip = 1e3 * tip_position(motion["attitude"], np.zeros(3), np.eye(3), np.array([0.0, 0.0, -heart.lever]))
    np.testing.assert_allclose(tip[:, :2], heart.displacement(TIMES), atol=1e-11)
    assert (tip[:, 2] < 0.0).all()
    assert np.ptp(tip[:, 0]) > 5.0


def test_small_motions_tilt_by_displacement_over_lever():
    heart = BeatingHeart(heartbeat=0.02, breath=0.03, lever=0.2)
    tool = Rotation.from_quat(heart.motion(TIMES)["attitude"], scalar_first=True).apply([0.0, 0.0, -1.0])
    angle = np.arcsin(np.linalg.norm(tool[:, :2], axis=1))
    np.testing.assert_allclose(angle, np.linalg.norm(heart.displacement(TIMES), axis=1) * 1e-3 / 0.2, atol=1e-9)


def test_the_tool_tilts_by_the_shortest_way_and_spins_about_itself():
    heart = BeatingHeart(twist=0.4, deviation=0.0, modulation=0.3)
    tilted = Rotation.from_quat(heart.replaced(twist=0.0).motion(TIMES)["attitude"], scalar_first=True)
    np.testing.assert_allclose(tilted.as_rotvec()[:, 2], 0.0, atol=1e-15)
    spun = (tilted.inv() * Rotation.from_quat(heart.motion(TIMES)["attitude"], scalar_first=True)).as_rotvec()
    np.testing.assert_allclose(spun[:, :2], 0.0, atol=1e-14)
    only_beat = heart.replaced(breath=0.0, heartbeat=(1.0, 0.0))
    np.testing.assert_allclose(spun[:, 2], 0.4 * only_beat.displacement(TIMES)[:, 0], atol=1e-13)


def test_displacement_is_respiration_and_a_heartbeat_that_it_modulates():
    """The formula of the docstring, written again."""
    heart = BeatingHeart(
        deviation=0.0,
        heart_rate=1.3,
        breath_rate=0.21,
        breath=(1.5, 2.5),
        heartbeat=(3.0, 5.0),
        harmonics=(2.0, 0.0, 1.0),
        modulation=0.4,
    )
    r = np.sin(2 * np.pi * 0.21 * TIMES)
    phase = 2 * np.pi * 1.3 * TIMES
    x = 1.5 * r + 3.0 * (1 + 0.4 * r) * (2 * np.cos(phase) + np.cos(3 * phase)) / 3
    y = 2.5 * r + 5.0 * (1 + 0.4 * r) * (2 * np.sin(phase) + np.sin(3 * phase)) / 3
    np.testing.assert_allclose(heart.displacement(TIMES), np.stack([x, y], axis=1), atol=1e-11)


def test_the_spectrum_has_respiration_harmonics_and_sidebands():
    """Lines at f_r, and at k f_h and k f_h ± f_r of the relative size m/2; nothing else."""
    heart = BeatingHeart(deviation=0.0, heart_rate=1.3, breath_rate=0.3, modulation=0.2)
    time = np.arange(0.0, 100.0, 0.02)
    lines = 2.0 * np.abs(np.fft.rfft(heart.displacement(time)[:, 0])) / len(time)
    frequency = np.fft.rfftfreq(len(time), 0.02)

    def line(at):
        return lines[np.argmin(np.abs(frequency - at))]

    assert line(0.3) == pytest.approx(2.0)
    expected = [0.3]
    for k, weight in enumerate(heart.harmonics, start=1):
        size = 4.0 * weight / sum(heart.harmonics)
        assert line(1.3 * k) == pytest.approx(size)
        assert line(1.3 * k - 0.3) == pytest.approx(0.1 * size)
        assert line(1.3 * k + 0.3) == pytest.approx(0.1 * size)
        expected += [1.3 * k, 1.3 * k - 0.3, 1.3 * k + 0.3]
    elsewhere = np.abs(frequency[:, None] - expected).min(axis=1) > 1e-3
    assert lines[elsewhere].max() < 1e-9


@pytest.mark.parametrize(
    ("rate", "deviation", "low_to_high"), [(1.5, 0.02, 0.5), (1.0, 0.05, 2.0), (0.6, 0.05, 0.0), (0.75, 0.13, 1.0)]
)
@pytest.mark.parametrize("seed", [0, 1])
def test_intervals_have_the_standard_deviation_that_is_asked_for(rate, deviation, low_to_high, seed):
    heart = BeatingHeart(heart_rate=rate, deviation=deviation, low_to_high=low_to_high, seed=seed)
    intervals = np.diff(beat_times(heart, 2000.0))
    assert intervals.mean() == pytest.approx(1.0 / rate, rel=0.01)
    assert intervals.std() == pytest.approx(deviation, rel=0.05)


@pytest.mark.parametrize("low_to_high", [0.25, 1.0, 4.0])
def test_the_bands_share_the_variability_as_asked(low_to_high):
    heart = BeatingHeart(heart_rate=1.5, low_to_high=low_to_high, seed=2)
    beats = beat_times(heart, 2000.0)
    even = np.arange(10.0, 1990.0, 0.25)
    intervals = CubicSpline(0.5 * (beats[1:] + beats[:-1]), np.diff(beats))
    frequency, power = periodogram(intervals(even), fs=4.0)
    low, high = (power[(frequency > a) & (frequency < b)].sum() for a, b in (LOW_BAND, HIGH_BAND))
    assert low / high == pytest.approx(low_to_high, rel=0.15)
    assert (low + high) / power[1:].sum() > 0.95


def test_without_variability_the_heart_is_a_clock():
    heart = BeatingHeart(deviation=0.0, heart_rate=1.25)
    np.testing.assert_allclose(np.diff(beat_times(heart, 20.0)), 0.8, atol=1e-12)


@pytest.mark.parametrize("probability", [0.05, 0.2, 0.5])
def test_premature_beats_come_as_often_as_asked_and_a_pause_follows(probability):
    """In multiples of the interval, a normal beat comes after 1, a premature one after c, the next after 2 − c."""
    heart = BeatingHeart(deviation=0.0, heart_rate=1.0, premature=probability, coupling=0.6, seed=5)
    intervals = np.diff(beat_times(heart, 4000.0))
    early, late = np.abs(intervals - 0.6) < 1e-9, np.abs(intervals - 1.4) < 1e-9
    assert (early | late | (np.abs(intervals - 1.0) < 1e-9)).all()
    assert np.array_equal(late[1:], early[:-1])
    pairs = len(intervals) / 2
    spread = np.sqrt(pairs * 2 * probability * (1 - 2 * probability))
    assert abs(early.sum() - 2 * probability * pairs) <= 4.0 * spread + 1.0


def test_the_sinus_node_keeps_its_time_through_premature_beats():
    """Beats before and after a premature one come when they would have come without it, variability included."""
    calm = BeatingHeart(deviation=0.06, seed=6)
    normal, hasty = beat_times(calm, 300.0), beat_times(calm.replaced(premature=0.5), 300.0)
    np.testing.assert_allclose(hasty[1::2], normal[1::2], atol=1e-9)
    early = calm.beats(hasty[0::2]).value
    np.testing.assert_allclose(early, 2.0 * np.arange(len(early)) + 0.6, atol=1e-9)


@pytest.mark.parametrize("rate", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("low_to_high", [0.0, 0.5, 1e9])
@pytest.mark.parametrize("seed", range(4))
def test_a_heart_never_beats_backwards(rate, low_to_high, seed):
    heart = BeatingHeart(
        heart_rate=rate, deviation=0.1 / rate, low_to_high=low_to_high, premature=0.5, coupling=0.3, seed=seed
    )
    assert heart.beats(np.arange(0.0, 600.0, 0.01)).rate.min() > 0.0


def test_premature_beats_do_not_depend_on_what_else_is_asked_for():
    """Nor on how late it is: the draw belongs to the beat."""
    heart = BeatingHeart(premature=0.25, seed=9)
    late = 1e6 + np.arange(0.0, 60.0, 0.01)
    mixed = np.concatenate([late, TIMES, [3e7]])
    assert np.array_equal(heart.motion(mixed)[: len(late)], heart.motion(late))
    assert np.array_equal(heart.motion(mixed)[len(late) : -1], heart.motion(TIMES))
    intervals = np.diff(np.interp(np.arange(1.5e6 + 4, 1.5e6 + 80), heart.beats(late).value, late))
    assert (intervals < 0.5).any()


@pytest.mark.parametrize("parameters", [{"premature": 0.2, "deviation": 0.0}, {"premature": 0.0, "deviation": 0.02}])
def test_the_seed_decides(parameters):
    """Premature beats and variability alike."""
    heart = BeatingHeart(**parameters)
    motions = [heart.replaced(seed=seed).motion(TIMES) for seed in (0, 1, 1)]
    assert np.array_equal(motions[1], motions[2])
    assert not np.array_equal(motions[0], motions[1])
    assert np.array_equal(heart.motion(TIMES), motions[0])


@pytest.mark.parametrize("seed", range(3))
def test_a_beat_comes_at_the_start(seed):
    assert BeatingHeart(deviation=0.05, premature=0.5, seed=seed).beats(np.zeros(1)).value[0] == 0.0


def test_a_seed_is_drawn_where_none_is_given():
    first, again, other = (BeatingHeart().drawn(np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == again != other
    assert first.seed is not None
    given = BeatingHeart(seed=7)
    assert given.drawn(np.random.default_rng(1)) is given


def test_the_experiments_seed_decides_where_the_reference_has_none():
    def desired(**changes):
        given = {"law": "pd", "duration": 0.05, "disturbance": 0, "reference": {"name": "beating_heart", **changes}}
        return [simulate(Experiment(**given, seed=seed)).desired_attitude for seed in (0, 0, 1)]

    first, again, other = desired()
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    first, _, other = desired(seed=3)
    assert np.array_equal(first, other)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"heartbeat": 100.0}, "lever"),
        ({"lever": 0.005}, "longer lever"),
        ({"deviation": 0.2}, "deviation"),
        ({"heart_rate": 0.1}, "heart_rate"),
        ({"premature": 0.6}, "premature"),
        ({"coupling": 0.1}, "coupling"),
        ({"modulation": 1.1}, "modulation"),
        ({"harmonics": []}, "harmonics"),
        ({"harmonics": (0.0, 0.0)}, "harmonics"),
        ({"breath": (1.0, 2.0, 3.0)}, "breath"),
        ({"seed": -1}, "seed"),
    ],
)
def test_what_no_heart_does_is_refused_in_one_line(wrong, said):
    with pytest.raises(ParameterError) as caught:
        Reference.resolve({"name": "beating_heart", **wrong}, default="hold")
    assert said in one_line(caught.value)
