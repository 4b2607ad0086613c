"""References: rates and accelerations by finite differences, shapes by other formulas."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench import one_line
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import unit_of
from spherical_wrist.reference import Hold, Lissajous, Reference, Sinusoid, Step

CASES = [
    *(member() for member in Reference.members.values()),
    Sinusoid(amplitude=(0.1, 1.2, 0.7), frequency=1.5, phase=(0.4, -1.0, 2.0)),
    Sinusoid(frequency=0.0),
    Lissajous(amplitude=(3.0, 1.4, 2.0), frequency=(0.9, 1.3, 0.2), phase=(0.0, 1.0, -2.0)),
    Step(rotation=(-2.0, 2.0, 1.0), start=0.0, length=2.0),
    Hold(rotation=(0.0, 0.0, 0.0)),
    Hold(rotation=(0.0, 0.0, np.pi)),
]
case = pytest.mark.parametrize("reference", CASES, ids=lambda reference: reference.name)
TIMES = np.sort(np.random.default_rng(5).uniform(0.01, 12.0, 400))


def turned(motion):
    return Rotation.from_quat(motion["attitude"], scalar_first=True)


def test_the_known_references_are_there():
    assert {"hold", "step", "sinusoid", "lissajous"} <= set(Reference.members)


@case
def test_rate_is_the_derivative_of_the_attitude(reference):
    h = 2e-5
    before, now, after = (reference.motion(TIMES + shift) for shift in (-h, 0.0, h))
    rate = (turned(before).inv() * turned(after)).as_rotvec() / (2.0 * h)
    scale = 1.0 + np.abs(now["rate"]).max() + np.abs(now["acceleration"]).max()
    np.testing.assert_allclose(now["rate"], rate, atol=1e-7 * scale)


@case
def test_acceleration_is_the_derivative_of_the_rate(reference):
    h = 2e-5
    before, now, after = (reference.motion(TIMES + shift) for shift in (-h, 0.0, h))
    acceleration = (after["rate"] - before["rate"]) / (2.0 * h)
    scale = 1.0 + np.abs(now["rate"]).max() + np.abs(now["acceleration"]).max()
    np.testing.assert_allclose(now["acceleration"], acceleration, atol=1e-7 * scale)


@case
def test_quaternions_are_of_unit_norm_and_do_not_jump(reference):
    """Not even from q to −q, which would be the same attitude, but a jump in every plot."""
    step = 1e-3
    motion = reference.motion(np.arange(0.0, 12.0, step))
    np.testing.assert_allclose(np.linalg.norm(motion["attitude"], axis=1), 1.0, atol=1e-14)
    fastest = np.linalg.norm(motion["rate"], axis=1).max()
    jumps = np.linalg.norm(np.diff(motion["attitude"], axis=0), axis=1)
    assert jumps.max() <= 0.5 * fastest * step * 1.01 + 1e-12


@case
def test_motion_is_a_function_of_time_alone(reference):
    """Asked for one instant, for all, or for all in another order: the same bits."""
    whole = reference.motion(TIMES)
    shuffled = np.random.default_rng(0).permutation(len(TIMES))
    assert np.array_equal(reference.motion(TIMES[shuffled]), whole[shuffled])
    assert np.array_equal(reference.motion(TIMES[17:18]), whole[17:18])
    assert len(reference.motion(np.empty(0))) == 0


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
        assert unit_of(member, name), name


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
    ],
)
def test_bad_parameters_are_named_in_one_line(make, said):
    with pytest.raises(ParameterError) as caught:
        make()
    assert said in one_line(caught.value)
