"""References: rates and accelerations by finite differences, shapes by other formulas.

The beating heart and recorded motions have tests of their own beside these.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import one_line
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import unit_of
from spherical_wrist.reference import (
    BeatingHeart,
    Chirp,
    Hold,
    Lissajous,
    Recorded,
    Reference,
    Sinusoid,
    Step,
    Suture,
)

CASES = [
    *(member() for member in Reference.members.values()),
    Sinusoid(amplitude=(0.1, 1.2, 0.7), frequency=1.5, phase=(0.4, -1.0, 2.0)),
    Sinusoid(frequency=0.0),
    Lissajous(amplitude=(3.0, 1.4, 2.0), frequency=(0.9, 1.3, 0.2), phase=(0.0, 1.0, -2.0)),
    Step(rotation=(-2.0, 2.0, 1.0), start=0.0, length=2.0),
    Hold(rotation=(0.0, 0.0, 0.0)),
    Hold(rotation=(0.0, 0.0, np.pi)),
    BeatingHeart(premature=0.5, coupling=0.4, seed=3),
    BeatingHeart(heart_rate=0.6, deviation=0.1, modulation=1.0, harmonics=(0.2, 1.0), twist=1.0, lever=0.03, seed=8),
    Chirp(sweep="linear", length=8.0, final=2.0),
    Chirp(start=3.0, final=0.1, length=5.0, amplitude=(1.0, 1.3, 2.5), phase=0.0),
    Chirp(start=0.7, final=0.7),
    Suture(arc=3.0, axis=(0.0, -2.0, 0.3), approach=(1.0, 1.0, -2.0), pause=0.0, drive=0.7, back=1.9),
    Recorded(scale=0.4, speed=1.7, smoothing=0.05, blend=1.0),
    Recorded(after="repeat", speed=2.0, blend=0.3),
]
TIMES = np.sort(np.random.default_rng(5).uniform(0.01, 12.0, 400))
FILE_LENGTH = 5.0
WORDS = {"file", "times", "columns", "time_unit", "arm", "after", "sweep", "seed"}
NUMBERS = {"scale", "speed", "axis", "harmonics", "modulation", "low_to_high", "premature", "coupling"}
WITHOUT_UNIT = WORDS | NUMBERS


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A motion that some of the cases play back."""
    time = np.arange(0.0, FILE_LENGTH + 1e-9, 0.01)
    path = tmp_path_factory.mktemp("reference") / "motion.csv"
    rows = np.column_stack([time, Lissajous().motion(time)["attitude"]])
    np.savetxt(path, rows, delimiter=",", header="time,qw,qx,qy,qz", comments="", fmt="%.17g")
    return path


@pytest.fixture(params=CASES, ids=lambda reference: reference.name)
def reference(request, file):
    return request.param.replaced(file=file) if isinstance(request.param, Recorded) else request.param


def turned(motion):
    return Rotation.from_quat(motion["attitude"], scalar_first=True)


def test_rate_is_the_derivative_of_the_attitude(reference):
    h = 2e-6
    before, now, after = (reference.motion(TIMES + shift) for shift in (-h, 0.0, h))
    rate = (turned(before).inv() * turned(after)).as_rotvec() / (2.0 * h)
    scale = 1.0 + np.abs(now["rate"]).max() + np.abs(now["acceleration"]).max()
    np.testing.assert_allclose(now["rate"], rate, atol=1e-7 * scale)


def test_acceleration_is_the_derivative_of_the_rate(reference):
    h = 2e-6
    before, now, after = (reference.motion(TIMES + shift) for shift in (-h, 0.0, h))
    acceleration = (after["rate"] - before["rate"]) / (2.0 * h)
    scale = 1.0 + np.abs(now["rate"]).max() + np.abs(now["acceleration"]).max()
    np.testing.assert_allclose(now["acceleration"], acceleration, atol=1e-7 * scale)


def test_quaternions_are_of_unit_norm_and_do_not_jump(reference):
    """Not even from q to −q, which would be the same attitude, but a jump in every plot."""
    step = 1e-3
    motion = reference.motion(np.arange(0.0, 12.0, step))
    np.testing.assert_allclose(np.linalg.norm(motion["attitude"], axis=1), 1.0, atol=1e-14)
    fastest = np.linalg.norm(motion["rate"], axis=1).max()
    jumps = np.linalg.norm(np.diff(motion["attitude"], axis=0), axis=1)
    assert jumps.max() <= 0.5 * fastest * step * 1.01 + 1e-12


def test_acceleration_is_continuous(reference):
    """A quarter of the sampling step has a quarter of the largest change from sample to sample; a jump would stay."""
    coarse, fine = (
        np.abs(np.diff(reference.motion(np.arange(-1.0, 12.0, step))["acceleration"], axis=0)).max()
        for step in (1e-3, 2.5e-4)
    )
    assert fine <= 0.3 * coarse + 1e-9


def test_motion_is_a_function_of_time_alone(reference):
    """Asked for one instant, for all, or for all in another order: the same bits."""
    whole = reference.motion(TIMES)
    shuffled = np.random.default_rng(0).permutation(len(TIMES))
    assert np.array_equal(reference.motion(TIMES[shuffled]), whole[shuffled])
    assert np.array_equal(reference.motion(TIMES[17:18]), whole[17:18])
    pieces = [reference.motion(TIMES[first : first + 33]) for first in range(0, len(TIMES), 33)]
    assert np.array_equal(np.concatenate(pieces), whole)
    assert np.array_equal(reference.motion(TIMES[::3]), whole[::3])
    assert len(reference.motion(np.empty(0))) == 0


def test_nothing_is_drawn_where_nothing_is_random(reference):
    if not isinstance(reference, BeatingHeart):
        assert reference.drawn(np.random.default_rng(1)) is reference


def about(axis, angle):
    """Rotation matrices about a coordinate axis, from their definition."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.tile(np.eye(3), (len(angle), 1, 1))
    matrix[:, i, i], matrix[:, i, j], matrix[:, j, i], matrix[:, j, j] = c, -s, s, c
    return matrix


@pytest.mark.parametrize("reference", [c for c in CASES if isinstance(c, Sinusoid | Lissajous)], ids=repr)
def test_waves_are_the_papers_angles(reference):
    """R = Rx(α) Ry(β) Rz(γ) with sinusoidal angles; SciPy finds the angles again where they are unique."""
    frequency = np.broadcast_to(reference.frequency, 3)
    angles = np.array(reference.amplitude) * np.sin(2.0 * np.pi * TIMES[:, None] * frequency + reference.phase)
    matrix = about(0, angles[:, 0]) @ about(1, angles[:, 1]) @ about(2, angles[:, 2])
    attitude = turned(reference.motion(TIMES))
    np.testing.assert_allclose(attitude.as_matrix(), matrix, atol=1e-13)
    if np.max(reference.amplitude) < 1.5:
        np.testing.assert_allclose(attitude.as_euler("XYZ"), angles, atol=1e-12)


def test_one_axis_alone_turns_about_that_axis():
    for axis in range(3):
        amplitude = 0.7 * np.eye(3)[axis]
        motion = Sinusoid(amplitude=tuple(amplitude), frequency=0.8, phase=0.0).motion(TIMES)
        omega = 2.0 * np.pi * 0.8
        np.testing.assert_allclose(motion["rate"], np.outer(np.cos(omega * TIMES), omega * amplitude), atol=1e-12)


STEP = Step(rotation=(0.4, -0.3, 0.2), start=0.5, length=0.8)


def test_step_rests_at_both_ends():
    ends = np.array([0.0, 0.2, 0.5, 1.3, 1.5, 100.0])
    motion = STEP.motion(ends)
    np.testing.assert_allclose(turned(motion).as_rotvec()[:3], 0.0, atol=1e-15)
    np.testing.assert_allclose(turned(motion).as_rotvec()[3:], np.tile(STEP.rotation, (3, 1)), atol=1e-15)
    np.testing.assert_allclose(motion["rate"], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion["acceleration"], 0.0, atol=1e-12)


def test_step_is_the_minimum_jerk_polynomial():
    """The quintic that the six conditions on position, rate and acceleration at both ends leave."""
    powers = np.arange(6)
    start = [powers == 0, powers == 1, 2 * (powers == 2)]
    end = [np.ones(6), powers, powers * (powers - 1)]
    quintic = np.linalg.solve(np.array([*start, *end], float), [0, 0, 0, 1, 0, 0])
    s = np.linspace(0.0, 1.0, 41)
    motion = STEP.motion(STEP.start + s * STEP.length)
    way, v = np.polynomial.Polynomial(quintic), np.array(STEP.rotation)
    np.testing.assert_allclose(turned(motion).as_rotvec(), np.outer(way(s), v), atol=1e-13)
    np.testing.assert_allclose(motion["rate"], np.outer(way.deriv(1)(s), v) / STEP.length, atol=1e-12)
    np.testing.assert_allclose(motion["acceleration"], np.outer(way.deriv(2)(s), v) / STEP.length**2, atol=1e-11)


def test_hold_holds():
    motion = Hold(rotation=(0.3, -0.2, 1.0)).motion(TIMES)
    np.testing.assert_allclose(turned(motion).as_rotvec(), np.tile((0.3, -0.2, 1.0), (len(TIMES), 1)), atol=1e-14)
    assert not motion["rate"].any()
    assert not motion["acceleration"].any()


@pytest.mark.parametrize("member", Reference.members.values(), ids=lambda member: member.name)
def test_every_parameter_is_documented_and_has_a_unit(member):
    for name, field in member.model_fields.items():
        assert field.description, name
        assert unit_of(member, name) or name in WITHOUT_UNIT, name


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Step(length=0.0), "length"),
        (lambda: Step(start=-1.0), "start"),
        (lambda: Step(strat=1.0), "start"),
        (lambda: Sinusoid(frequency=-0.5), "frequency"),
        (lambda: Sinusoid(amplitude=(0.1, 0.2)), "three"),
        (lambda: Lissajous(phase=np.nan), "phase"),
        (lambda: Hold(rotation=np.inf), "rotation"),
        (lambda: Suture(axis=0.0), "axis"),
        (lambda: Suture(drive=0.0), "drive"),
        (lambda: Chirp(start=0.0), "start"),
        (lambda: Chirp(sweep="square"), "'exponential' or 'linear'"),
    ],
)
def test_bad_parameters_are_named_in_one_line(make, said):
    with pytest.raises(ParameterError) as caught:
        make()
    assert said in one_line(caught.value)


SUTURE = Suture(arc=1.2, axis=(0.0, 3.0, 4.0), approach=(0.4, -0.2, 0.1), drive=2.0, pause=0.5, back=1.0)
PERIOD = 4.0


def needle_angle(time):
    """The angle about the needle's axis, which must be the only thing that moves."""
    local = Rotation.from_rotvec(SUTURE.approach).inv() * turned(SUTURE.motion(time))
    vectors = local.as_rotvec()
    np.testing.assert_allclose(np.cross(vectors, (0.0, 0.6, 0.8)), 0.0, atol=1e-14)
    return vectors @ (0.0, 0.6, 0.8)


def test_suture_drives_the_needle_through_its_arc_and_back():
    np.testing.assert_allclose(
        needle_angle(np.array([0.0, 1.0, 2.0, 2.5, 3.0, 3.5, 4.0])),
        0.6 * np.array([-1.0, 0.0, 1.0, 1.0, 0.0, -1.0, -1.0]),
        atol=1e-14,
    )
    drive = needle_angle(np.linspace(0.0, 2.0, 100))
    s = np.linspace(0.0, 1.0, 100)
    np.testing.assert_allclose(drive, 1.2 * (10 * s**3 - 15 * s**4 + 6 * s**5) - 0.6, atol=1e-13)


def test_suture_rests_in_its_pauses():
    for first in (2.0, 3.5, PERIOD + 2.0):
        motion = SUTURE.motion(np.linspace(first + 1e-9, first + 0.5 - 1e-9, 50))
        assert np.abs(motion["rate"]).max() < 1e-12
        assert np.abs(motion["acceleration"]).max() < 1e-6
        assert np.ptp(motion["attitude"], axis=0).max() < 1e-14


def test_suture_repeats_for_ever():
    once, later = SUTURE.motion(TIMES), SUTURE.motion(TIMES + 1000 * PERIOD)
    np.testing.assert_allclose(later["attitude"], once["attitude"], atol=1e-11)
    np.testing.assert_allclose(later["acceleration"], once["acceleration"], atol=1e-10)


@pytest.mark.parametrize("sweep", ["linear", "exponential"])
@pytest.mark.parametrize(("start", "final"), [(0.2, 5.0), (4.0, 0.05), (1.0, 1.001)])
def test_chirp_sweeps_as_it_says_and_then_stays(sweep, start, final):
    chirp = Chirp(start=start, final=final, length=10.0, sweep=sweep)
    time = np.linspace(0.0, 30.0, 30_001)
    turns = chirp.turns(time)
    np.testing.assert_allclose(turns.rate[[0, -1]], [start, final], rtol=1e-12)
    np.testing.assert_allclose(turns.rate[time >= 10.0], final, rtol=1e-12)
    assert (np.diff(turns.rate[time < 9.9]) * (final - start) > 0.0).all()
    assert turns.rate.min() >= min(start, final) * (1 - 1e-12)
    assert turns.rate.max() <= max(start, final) * (1 + 1e-12)
    steady = time <= 9.0
    path = turns.rate[steady] if sweep == "linear" else np.log(turns.rate[steady])
    np.testing.assert_allclose(np.diff(path, 2), 0.0, atol=1e-12)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (turns.rate[1:] + turns.rate[:-1]) * 1e-3)])
    np.testing.assert_allclose(turns.value, integral, atol=2e-6)
    np.testing.assert_allclose(np.gradient(turns.rate, 1e-3)[1:-1], turns.acceleration[1:-1], atol=6e-3 * final + 1e-3)


def test_chirp_moves_the_papers_angles():
    chirp = Chirp(amplitude=(0.2, 0.1, 0.4), phase=(0.3, -1.0, 2.0))
    angles = turned(chirp.motion(TIMES)).as_euler("XYZ")
    argument = 2.0 * np.pi * chirp.turns(TIMES).value[:, None] + chirp.phase
    np.testing.assert_allclose(angles, np.array(chirp.amplitude) * np.sin(argument), atol=1e-12)
