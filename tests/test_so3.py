"""Rotations against SciPy, MuJoCo and finite differences."""

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigs import directions, finished, loop, quaternions, vectors
from spherical_wrist.control import PD
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.reference import Lissajous
from spherical_wrist.so3 import (
    advance,
    attitude_error,
    attitude_errors,
    cross,
    feed_forward,
    inverses,
    products,
    quaternion_exp,
    quaternion_log,
    quaternion_product,
    rate_error,
    relative_attitude,
    rotate,
    rotation_vectors,
)


def rotation(q):
    return Rotation.from_quat(q, scalar_first=True)


def skew(v):
    return np.cross(v, np.eye(3)).T


@given(quaternions(), quaternions())
def test_product_is_mujocos_and_scipys(p, q):
    expected = np.empty(4)
    mujoco.mju_mulQuat(expected, p, q)
    product = np.array(quaternion_product(tuple(p), tuple(q)))
    np.testing.assert_allclose(product, expected, atol=1e-15)
    np.testing.assert_allclose(rotation(product).as_matrix(), (rotation(p) * rotation(q)).as_matrix(), atol=1e-14)


@given(quaternions(), quaternions())
def test_relative_attitude_is_the_inverse_times_the_target(q, target):
    there = quaternion_product(tuple(q), relative_attitude(tuple(q), tuple(target)))
    np.testing.assert_allclose(there, target, atol=1e-15)


@given(quaternions(), vectors())
def test_rotate_is_mujocos_and_scipys(q, v):
    expected = np.empty(3)
    mujoco.mju_rotVecQuat(expected, v, q)
    np.testing.assert_allclose(rotate(tuple(q), tuple(v)), expected, atol=1e-13)
    np.testing.assert_allclose(rotate(tuple(q), tuple(v)), rotation(q).apply(v), atol=1e-13)


@given(vectors(), vectors())
def test_cross_is_numpys(a, b):
    np.testing.assert_allclose(cross(tuple(a), tuple(b)), np.cross(a, b), atol=1e-13)


@given(directions(), st.floats(-300.0, 1.5))
@example(np.array([0.0, 0.6, 0.8]), np.log10(1e-4))  # where the series takes over
@example(np.array([0.0, 0.6, 0.8]), np.log10(0.99999e-4))
def test_exp_is_scipys_at_every_size(direction, exponent):
    v = 10.0**exponent * direction
    expected = Rotation.from_rotvec(v).as_quat(scalar_first=True)
    got = np.array(quaternion_exp(tuple(v)))
    np.testing.assert_allclose(got, expected, rtol=1e-14, atol=1e-15)
    if exponent < -8.0:  # sin x = x to rounding: no digit may be lost, however small
        np.testing.assert_allclose(got[1:], 0.5 * v, rtol=1e-15)


@given(directions(), st.floats(1e-3, 6.0))
def test_exp_is_of_unit_norm_and_the_axis_angle_quaternion_of_mujoco(direction, angle):
    expected = np.empty(4)
    mujoco.mju_axisAngle2Quat(expected, direction, angle)
    got = quaternion_exp(tuple(angle * direction))
    np.testing.assert_allclose(got, expected, atol=2e-15)
    assert np.linalg.norm(got) == pytest.approx(1.0, abs=1e-15)


@given(directions(), st.floats(-150.0, np.log10(3.14)))
def test_log_undoes_exp_to_rounding(direction, exponent):
    v = 10.0**exponent * direction
    np.testing.assert_allclose(quaternion_log(quaternion_exp(tuple(v))), v, rtol=1e-13, atol=1e-14 * 10.0**exponent)


@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-300, 1e-200, 1e-162, 1e-160])
def test_log_of_next_to_nothing_is_next_to_nothing(size):
    """Below 1e-150 squares underflow: the answer may lose digits, but never its sign or its order of magnitude."""
    log = quaternion_log(quaternion_exp((size, -size, size)))
    assert np.isfinite(log).all()
    assert np.abs(np.subtract(log, (size, -size, size))).max() <= size


@given(quaternions())
def test_log_is_the_shortest_of_scipy_and_of_either_sign(q):
    log = np.array(quaternion_log(tuple(q)))
    assert np.linalg.norm(log) <= np.pi * (1.0 + 1e-15)
    if abs(q[0]) > 1e-9:
        np.testing.assert_allclose(log, rotation(q).as_rotvec(), atol=1e-13)
        assert quaternion_log(tuple(-q)) == tuple(log)


@given(quaternions(), st.floats(0.5, 2.0))
def test_log_does_not_need_a_unit_quaternion(q, scale):
    if abs(q[0]) > 1e-9:
        np.testing.assert_allclose(quaternion_log(tuple(scale * q)), quaternion_log(tuple(q)), atol=1e-14)


@given(directions(), st.floats(-16.0, -2.0), st.sampled_from([1.0, -1.0]))
def test_log_close_to_a_half_turn(direction, exponent, sign):
    angle = np.pi - 10.0**exponent
    q = sign * np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * direction)])
    np.testing.assert_allclose(quaternion_log(tuple(q)), angle * direction, atol=1e-14)


@given(directions(), st.sampled_from([1.0, -1.0]), st.sampled_from([0.0, -0.0]))
def test_log_of_an_exact_half_turn_has_length_pi_along_the_axis(direction, sign, w):
    log = np.array(quaternion_log((w, *(sign * direction))))
    assert np.linalg.norm(log) == pytest.approx(np.pi, abs=1e-14)
    assert abs(log @ direction) == pytest.approx(np.pi, abs=1e-14)


@given(quaternions(), quaternions())
def test_attitude_error_is_mujocos_and_scipys(q, desired):
    expected = np.empty(3)
    mujoco.mju_subQuat(expected, desired, q)
    error = np.array(attitude_error(tuple(q), tuple(desired)))
    if np.linalg.norm(expected) < 3.14:
        np.testing.assert_allclose(error, expected, atol=1e-12)
        np.testing.assert_allclose(error, (rotation(q).inv() * rotation(desired)).as_rotvec(), atol=1e-12)
        np.testing.assert_allclose(attitude_error(tuple(-q), tuple(desired)), error, atol=1e-15)
        np.testing.assert_allclose(attitude_error(tuple(q), tuple(-desired)), error, atol=1e-15)
    np.testing.assert_allclose(  # turning by the error reaches the target, also at a half turn
        (rotation(q) * Rotation.from_rotvec(error)).as_matrix(), rotation(desired).as_matrix(), atol=1e-13
    )


@given(quaternions(), vectors(), quaternions(), vectors())
def test_rate_error_is_the_difference_of_world_rates_seen_from_the_body(q, rate, desired, desired_rate):
    world = rotation(desired).apply(desired_rate) - rotation(q).apply(rate)
    expected = rotation(q).inv().apply(world)
    got = rate_error(tuple(q), tuple(rate), tuple(desired), tuple(desired_rate))
    np.testing.assert_allclose(got, expected, atol=1e-13)
    np.testing.assert_allclose(rate_error(tuple(-q), tuple(rate), tuple(desired), tuple(desired_rate)), got, atol=1e-14)


@given(quaternions(), vectors(5.0), vectors(1.6), vectors(5.0))
def test_rate_error_is_the_derivative_of_the_attitude_error_to_first_order(q, rate, e, desired_rate):
    """Exactly, d/dt e = J(e)⁻¹ ė with the left Jacobian J of SO(3), whose inverse is 1 − [e]×/2 + …, so 1 at e = 0."""
    body, target = rotation(q), rotation(q) * Rotation.from_rotvec(e)

    def error(t):
        moved = body * Rotation.from_rotvec(rate * t)
        aimed = target * Rotation.from_rotvec(desired_rate * t)
        return np.array(attitude_error(moved.as_quat(scalar_first=True), aimed.as_quat(scalar_first=True)))

    de = np.array(rate_error(tuple(q), tuple(rate), tuple(target.as_quat(scalar_first=True)), tuple(desired_rate)))
    angle = np.linalg.norm(e)
    second = 1.0 / 12.0
    if angle > 1e-3:
        second = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    inverse = np.eye(3) - 0.5 * skew(e) + second * skew(e) @ skew(e)
    h = 1e-4
    derivative = (8.0 * (error(h) - error(-h)) - (error(2.0 * h) - error(-2.0 * h))) / (12.0 * h)
    np.testing.assert_allclose(derivative, inverse @ de, atol=1e-7)


@given(quaternions(), vectors(5.0), quaternions(), vectors(5.0), vectors(20.0), vectors(20.0))
def test_feed_forward_is_the_derivative_of_the_carried_rate(q, rate, desired, desired_rate, acceleration, own):
    """Of R_e ω_d by finite differences; how the body itself accelerates does not matter."""

    def carried(t):
        moved = rotation(q) * Rotation.from_rotvec(rate * t + 0.5 * own * t**2)
        aimed = rotation(desired) * Rotation.from_rotvec(desired_rate * t + 0.5 * acceleration * t**2)
        return (moved.inv() * aimed).apply(desired_rate + acceleration * t)

    h = 1e-4
    derivative = (carried(h) - carried(-h)) / (2.0 * h)
    got = feed_forward(tuple(q), tuple(rate), tuple(desired), tuple(desired_rate), tuple(acceleration))
    np.testing.assert_allclose(got, derivative, atol=2e-4)


def test_feed_forward_along_a_simulated_motion(nominal, engine):
    """R_e ω_d of a wrist that lags behind its reference, differentiated along the run that was simulated."""
    reference, period = Lissajous(), 1e-4
    start = Start(error=(0.3, -0.2, 0.4), rate_error=(1.0, 0.0, -1.0))
    run = finished(
        loop(PD(), nominal, engine, reference=reference, duration=0.5, period=period, step=period, start=start)
    )
    carried = run.rate_error + run.rate
    derivative = (carried[2:] - carried[:-2]) / (2.0 * period)
    motion = reference.motion(run.time)
    rows = range(1, len(run) - 1, 7)
    got = [
        feed_forward(run.attitude[k], run.rate[k], motion["attitude"][k], motion["rate"][k], motion["acceleration"][k])
        for k in rows
    ]
    assert np.abs(derivative).max() > 5.0
    np.testing.assert_allclose(got, derivative[[k - 1 for k in rows]], atol=2e-4)


@given(quaternions(), vectors(), st.floats(1e-6, 0.1))
def test_advance_without_acceleration_is_mujocos_integration(q, rate, time):
    expected = q.copy()
    mujoco.mju_quatIntegrate(expected, rate, time)
    reached = advance(tuple(q), tuple(rate), (0.0, 0.0, 0.0), time)
    np.testing.assert_allclose(reached.attitude, expected, atol=1e-14)
    assert reached.rate == tuple(rate)


def test_advance_agrees_with_mujocos_integration_of_the_joint(nominal):
    q, rate = np.array([0.5, -0.5, 0.5, 0.5]), np.array([3.0, -1.0, 2.0])
    expected = q.copy()
    mujoco.mj_integratePos(nominal.model, expected, rate, 0.01)
    np.testing.assert_allclose(advance(tuple(q), tuple(rate), (0.0, 0.0, 0.0), 0.01).attitude, expected, atol=1e-15)


@given(quaternions(), directions(), st.floats(-5.0, 5.0), st.floats(-50.0, 50.0), st.floats(0.0, 0.2))
def test_advance_about_a_fixed_axis_is_exact(q, axis, speed, change, time):
    reached = advance(tuple(q), tuple(speed * axis), tuple(change * axis), time)
    turned = rotation(q) * Rotation.from_rotvec((speed * time + 0.5 * change * time**2) * axis)
    np.testing.assert_allclose(rotation(reached.attitude).as_matrix(), turned.as_matrix(), atol=1e-13)
    np.testing.assert_allclose(reached.rate, (speed + change * time) * axis, atol=1e-13)


def test_advance_is_of_second_order():
    """Against q̇ = q ⊗ (0, ω)/2 integrated to 1e-13: half the time, an eighth of the error."""
    q, rate, acceleration = (0.5, -0.5, 0.5, 0.5), (3.0, -1.0, 2.0), (40.0, 80.0, -60.0)

    def error(time):
        def slope(t, attitude):
            w = np.add(rate, np.multiply(t, acceleration))
            return 0.5 * np.array(quaternion_product(tuple(attitude), (0.0, *w)))

        exact = solve_ivp(slope, (0.0, time), q, rtol=1e-13, atol=1e-14).y[:, -1]
        return np.linalg.norm(attitude_error(advance(q, rate, acceleration, time).attitude, tuple(exact)))

    errors = [error(time) for time in (0.04, 0.02, 0.01)]
    assert errors[0] < 0.01
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 8.0, rtol=0.1)


def test_functions_of_arrays_are_those_of_rows():
    random = np.random.default_rng(6)
    p, q = (Rotation.random(50, rng=random).as_quat(scalar_first=True) for _ in "pq")
    p[::3] *= -1.0
    q[0] = p[0]
    pairs = list(zip(p, q, strict=True))
    np.testing.assert_array_equal(products(p, q), [quaternion_product(a, b) for a, b in pairs])
    np.testing.assert_array_equal(products(p[0], q), [quaternion_product(p[0], b) for b in q])
    np.testing.assert_array_equal(products(inverses(p), q), [relative_attitude(a, b) for a, b in pairs])
    np.testing.assert_allclose(rotation_vectors(q), [quaternion_log(b) for b in q], atol=1e-15)
    np.testing.assert_allclose(attitude_errors(p, q), [attitude_error(a, b) for a, b in pairs], atol=1e-15)
