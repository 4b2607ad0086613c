"""Eq. (1) and (2) in the paper's angles against MuJoCo's ball joint, which knows no angles, and finite differences."""

from copy import copy

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigs import RigidBody, mjcf, mounted, one_line, quaternions, wrist_of
from spherical_wrist.errors import ModelError, WristError
from spherical_wrist.paper.angle_chart import (
    SINGULAR,
    SingularChartError,
    angle_accelerations,
    angle_rates,
    angles_of_attitude,
    attitude_of_angles,
    body_acceleration,
    body_rate,
    condition,
    matrix_of_angles,
    other_family,
    rate_jacobian,
    rate_jacobian_derivative,
    wrapped,
)
from spherical_wrist.paper.angle_dynamics import LARGEST_CONDITION, AngleDynamics, body_torque, generalised_torque
from spherical_wrist.reference.angles import motion_of_angles
from spherical_wrist.wrist import Wrist

WRISTS = {
    "shipped": Wrist.load(),
    "asymmetric": wrist_of(mjcf()),
    "mounted": wrist_of(mounted(mjcf())),
    "with armature": wrist_of(mjcf(joint='armature="3e-4"')),
    "half weightless": wrist_of(mjcf().replace('name="tool"', 'name="tool" gravcomp="0.7"')),
    "half weightless by its motors": wrist_of(
        mjcf(joint='actuatorgravcomp="true"').replace('name="tool"', 'name="tool" gravcomp="0.7"')
    ),
    "elsewhere": wrist_of(mjcf().replace("<option", '<option gravity="1.0 -2.0 -9.0"')),
}
each_wrist = pytest.mark.parametrize("wrist", WRISTS.values(), ids=WRISTS)
regular = st.tuples(st.floats(-7.0, 7.0), st.floats(-1.5, 1.5), st.floats(-7.0, 7.0)).map(np.array)


def states(count, seed, beta=1.4):
    """Random angles on both sides of the singularity, with |cos β| ≥ cos(beta), rates and accelerations."""
    random = np.random.default_rng(seed)
    angles = random.uniform(-np.pi, np.pi, (count, 3))
    angles[:, 1] = random.uniform(-beta, beta, count) + np.pi * random.integers(0, 2, count)
    return angles, random.normal(0.0, 10.0, (count, 3)), random.normal(0.0, 100.0, (count, 3))


def place(data, angles, rates):
    """Puts MuJoCo's ball joint where the angles are, by SciPy's rotations and with E written as its axes."""
    turn = Rotation.from_euler("XYZ", angles)
    beta, gamma = Rotation.from_euler("Y", angles[1]), Rotation.from_euler("Z", angles[2])
    axes = [(beta * gamma).inv().apply([1, 0, 0]), gamma.inv().apply([0, 1, 0]), np.array([0, 0, 1])]
    data.qpos[:] = turn.as_quat(scalar_first=True)
    data.qvel[:] = np.transpose(axes) @ rates


def close(actual, expected, tolerance=1e-9):
    """To a tolerance relative to the largest component."""
    expected = np.asarray(expected)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())


def slope(function, at, along, step=1e-5):
    """The directional derivative by central differences, fourth order."""
    near = function(at + step * along) - function(at - step * along)
    far = function(at + 2.0 * step * along) - function(at - 2.0 * step * along)
    return (8.0 * near - far) / (12.0 * step)


@each_wrist
def test_eq_1_gives_the_torque_of_mujocos_inverse_dynamics(wrist):
    """Eq. (1) with G and D, at random states on both sides of the singularity: Q = Eᵀ τ."""
    motor, data = AngleDynamics.of(wrist), mujoco.MjData(wrist.model)
    angles, rates, accelerations = states(50, seed=1)
    torque = motor.torque(angles, rates, accelerations)
    for i in range(50):
        place(data, angles[i], rates[i])
        data.qacc[:] = body_acceleration(angles[i], rates[i], accelerations[i])
        mujoco.mj_inverse(wrist.model, data)
        needed = data.qfrc_inverse - wrist.model.jnt_actgravcomp * data.qfrc_gravcomp  # which the actuators add
        close(body_torque(angles[i], torque[i]), needed)
        close(torque[i], generalised_torque(angles[i], needed))
        close(motor.torque(angles[i], rates[i], accelerations[i]), torque[i], 1e-14)


@each_wrist
def test_eq_2_gives_the_acceleration_of_mujocos_forward_dynamics(wrist):
    """Eq. (2) under a random body torque, with G and D."""
    motor, data = AngleDynamics.of(wrist), mujoco.MjData(wrist.model)
    angles, rates, _ = states(50, seed=2)
    applied = np.random.default_rng(3).normal(0.0, 0.3, (50, 3))
    accelerations = motor.acceleration(angles, rates, generalised_torque(angles, applied))
    reached = body_acceleration(angles, rates, accelerations)
    for i in range(50):
        place(data, angles[i], rates[i])
        data.qfrc_applied[:] = applied[i]
        mujoco.mj_forward(wrist.model, data)
        close(reached[i], data.qacc)
        close(accelerations[i], angle_accelerations(angles[i], rates[i], data.qacc))


def test_each_term_of_eq_1_alone_is_that_of_the_rigid_body():
    """H from unit accelerations at rest, B and C from single products of rates, G at rest, D from what is left."""
    wrist = WRISTS["asymmetric"]
    motor, body = AngleDynamics.of(wrist), RigidBody.of(wrist)

    def needed(q, v, a, damping=body.damping):
        """Newton and Euler about the centre of the ball, then onto the axes of the angles."""
        E, rate = rate_jacobian(q), body_rate(q, v)
        spin = body.inertia @ body_acceleration(q, v, a) + np.cross(rate, body.inertia @ rate)
        return E.T @ (spin + body.gravity(attitude_of_angles(q)) + damping * rate)

    nothing = np.zeros(3)
    for q in states(10, seed=4)[0]:
        held = needed(q, nothing, nothing)
        close(motor.gravity_torque(q), held, 1e-12)
        H = np.transpose([needed(q, nothing, unit) - held for unit in np.eye(3)])
        close(motor.inertia_matrix(q), H, 1e-12)
        D = np.transpose([(needed(q, u, nothing) - needed(q, -u, nothing)) / 2.0 for u in np.eye(3)])
        close(motor.damping_matrix(q), D, 1e-12)
        # without damping the rest is even in the rates: squares alone, then products by polarisation
        squares = [needed(q, u, nothing, 0.0) - held for u in np.eye(3)]
        pairs = [(0, 1), (0, 2), (1, 2)]
        mixed = [
            needed(q, np.eye(3)[i] + np.eye(3)[j], nothing, 0.0) - held - squares[i] - squares[j] for i, j in pairs
        ]
        scale = np.abs(H).max()
        np.testing.assert_allclose(motor.centrifugal_matrix(q), np.transpose(squares), atol=1e-12 * scale)
        np.testing.assert_allclose(motor.coriolis_matrix(q), np.transpose(mixed), atol=1e-12 * scale)


@each_wrist
def test_h_of_eq_1_is_symmetric_positive_definite_and_holds_the_kinetic_energy(wrist):
    """Symmetric as the paper says; the smallest eigenvalue is at least the inertia's times 1 − |sin β|."""
    motor = AngleDynamics.of(wrist)
    angles, rates, _ = states(50, seed=5, beta=1.57)
    H = motor.inertia_matrix(angles)
    np.testing.assert_allclose(H, np.swapaxes(H, 1, 2), rtol=0.0, atol=1e-18)
    smallest = np.linalg.eigvalsh(motor.inertia)[0] * (1.0 - np.abs(np.sin(angles[:, 1])))
    eigenvalues = np.linalg.eigvalsh(H)
    assert (eigenvalues[:, 0] > 0.0).all()
    assert (eigenvalues[:, 0] > (1.0 - 1e-6) * smallest).all()
    model = copy(wrist.model)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    for q, v, matrix in zip(angles, rates, H, strict=True):
        place(data, q, v)
        mujoco.mj_forward(model, data)
        assert 0.5 * v @ matrix @ v == pytest.approx(data.energy[1], rel=1e-12)


@each_wrist
def test_eq_36_the_slope_of_h_less_twice_n_is_skew_symmetric(wrist):
    """Eq. (36) holds for the Christoffel N, and that N q̇ is the B and C part of eq. (1); Ḣ by finite differences."""
    motor = AngleDynamics.of(wrist)
    for q, v, s in zip(*states(10, seed=6), strict=True):
        N, turning = motor.velocity_matrix(q, v), slope(motor.inertia_matrix, q, v, 1e-4)
        skew = turning - 2.0 * N
        np.testing.assert_allclose(skew, -skew.T, rtol=0.0, atol=1e-9 * np.abs(N).max())
        assert s @ skew @ s == pytest.approx(0.0, abs=1e-8 * np.abs(N).max() * (s @ s))
        products = np.array([v[0] * v[1], v[0] * v[2], v[1] * v[2]])
        close(N @ v, motor.coriolis_matrix(q) @ products + motor.centrifugal_matrix(q) @ v**2, 1e-12)


def test_gravity_is_the_slope_of_the_potential():
    wrist = WRISTS["elsewhere"]
    motor = AngleDynamics.of(wrist)
    for q in states(10, seed=7)[0]:
        expected = [
            slope(lambda a: -(matrix_of_angles(a) @ motor.moment) @ motor.gravity, q, u, 1e-3) for u in np.eye(3)
        ]
        close(motor.gravity_torque(q), expected, 1e-10)


@pytest.mark.parametrize("name", ["shipped", "asymmetric"])
def test_eq_2_integrated_in_angles_is_mujocos_trajectory(name):
    """1 s under a body torque, gravity and damping: the chart's ODE and MuJoCo's quaternions by RK4 at 0.1 ms."""
    wrist = WRISTS[name]
    motor, torque = AngleDynamics.of(wrist), np.array([0.004, -0.003, 0.001])
    start, rates = np.array([0.3, -0.4, 0.5]), np.array([1.0, 1.5, -2.0])

    def derivative(_, state):
        q, v = state[:3], state[3:]
        return np.concatenate([v, motor.acceleration(q, v, generalised_torque(q, torque))])

    times, state = np.linspace(0.0, 1.0, 11), np.concatenate([start, rates])
    path = solve_ivp(derivative, (0.0, 1.0), state, "DOP853", times, rtol=1e-11, atol=1e-12)
    assert np.abs(path.y[1]).max() < 1.5  # within the chart
    assert np.ptp(path.y[:3], axis=1).min() > 0.3  # and it moves
    model = copy(wrist.model)
    model.opt.timestep = 1e-4
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    place(data, start, rates)
    data.qfrc_applied[:] = torque
    for q, v in zip(path.y[:3, 1:].T, path.y[3:, 1:].T, strict=True):
        for _ in range(1000):
            mujoco.mj_step(model, data)
        apart = Rotation.from_quat(data.qpos, scalar_first=True).inv() * Rotation.from_euler("XYZ", q)
        assert apart.magnitude() < 1e-9
        close(body_rate(q, v), data.qvel, 1e-9)


@pytest.mark.parametrize(
    "more",
    [
        mjcf(joint='stiffness="0.02"'),
        mjcf(joint='frictionloss="0.01"'),
        mjcf().replace("<option", '<option density="1000"'),
        mjcf().replace("<option", '<option viscosity="1"'),
        mjcf().replace("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>'),
    ],
    ids=["spring", "dry friction", "water", "honey", "switched off"],
)
def test_a_model_with_more_than_eq_1_knows_is_refused(more):
    with pytest.raises(ModelError, match="take it out of the MJCF") as caught:
        AngleDynamics.of(wrist_of(more))
    one_line(caught.value)


def test_limits_and_contacts_are_not_part_of_eq_1():
    limited = wrist_of(mjcf(joint='range="0 0.2" limited="true"'))
    flags = limited.model.opt.disableflags
    close(AngleDynamics.of(limited).inertia, AngleDynamics.of(WRISTS["asymmetric"]).inertia, 1e-15)
    assert limited.model.opt.disableflags == flags  # and the wrist is left as it was


@given(regular)
@example(np.array([np.pi, 0.0, -np.pi]))
def test_angles_and_attitudes_are_scipys(angles):
    expected = Rotation.from_euler("XYZ", angles)
    np.testing.assert_allclose(matrix_of_angles(angles), expected.as_matrix(), atol=1e-15)
    quaternion = attitude_of_angles(angles)
    assert (Rotation.from_quat(quaternion, scalar_first=True).inv() * expected).magnitude() < 1e-15
    back = angles_of_attitude(quaternion)
    # modulo a turn: where α or γ is π to rounding, either sign is right
    np.testing.assert_allclose(wrapped(back - expected.as_euler("XYZ")), np.zeros(3), atol=1e-13)
    assert (np.abs(back) <= np.pi).all()
    np.testing.assert_allclose(wrapped(angles_of_attitude(-3.0 * quaternion) - back), np.zeros(3), atol=1e-13)


@given(quaternions())
@example(np.array([1.0, 0.0, 1.0, 0.0]) / np.sqrt(2.0))
@example(np.array([1.0, 1.0, -1.0, 1.0]) / 2.0)
@example(np.array([0.0, 1.0, 0.0, 0.0]))
def test_angles_keep_every_attitude_in_both_families(q):
    """To rounding, singular ones included: no attitude is lost, only its angles may be ambiguous."""
    turn, angles = Rotation.from_quat(q, scalar_first=True), angles_of_attitude(q)
    other = other_family(angles)
    for found in (angles, other):
        assert (turn.inv() * Rotation.from_euler("XYZ", found)).magnitude() < 5.0 * SINGULAR
    assert abs(angles[1]) <= np.pi / 2
    assert np.cos(other[1]) <= 1e-15
    assert (np.abs(other) <= np.pi).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("gap", [*10.0 ** -np.arange(1, 19), 0.0])
def test_angles_keep_the_attitude_however_near_the_singularity(side, gap):
    given_angles = np.array([0.3, side * (np.pi / 2 - gap), -1.9])
    turn = Rotation.from_euler("XYZ", given_angles)
    angles = angles_of_attitude(turn.as_quat(scalar_first=True))
    assert (turn.inv() * Rotation.from_euler("XYZ", angles)).magnitude() < (1e-15 if gap > 1e-11 else SINGULAR)
    kept = given_angles[0] + side * given_angles[2]
    assert wrapped(angles[0] + side * angles[2] - kept) == pytest.approx(0.0, abs=1e-14)
    if gap < 1e-13:  # the equal share, with the shorter of two signs
        np.testing.assert_allclose(angles[[0, 2]], [kept / 2, side * kept / 2], atol=1e-14)
        far = angles_of_attitude(attitude_of_angles(np.array([3.0, side * np.pi / 2, side * 2.0])))
        np.testing.assert_allclose(far[[0, 2]], np.array([1.0, side]) * (5.0 / 2 - np.pi), atol=1e-14)


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(np.pi, np.pi), (-np.pi, np.pi), (3.0 * np.pi, np.pi), (0.1, 0.1), (-3.0, -3.0), (4.0, 4.0 - 2.0 * np.pi)],
)
def test_wrapped_is_above_minus_and_up_to_plus_half_a_turn(angle, expected):
    assert wrapped(angle) == pytest.approx(expected, abs=1e-15)
    if abs(angle) < np.pi:
        assert wrapped(angle) == angle


@given(regular, regular, regular)
def test_rates_and_accelerations_are_the_slopes_of_the_attitude(angles, rates, accelerations):
    """ω from R by finite differences, Ė from E, ω̇ from ω along q̇ and q̈; and the inverses."""
    turning = matrix_of_angles(angles).T @ slope(matrix_of_angles, angles, rates, 1e-4)
    omega = body_rate(angles, rates)
    scale = 1.0 + np.abs(rates).max() ** 2
    np.testing.assert_allclose([turning[2, 1], turning[0, 2], turning[1, 0]], omega, atol=1e-9 * scale)
    derivative = rate_jacobian_derivative(angles, rates)
    np.testing.assert_allclose(derivative, slope(rate_jacobian, angles, rates, 1e-4), atol=1e-9 * scale)

    def along(time):
        return body_rate(angles + time * rates + 0.5 * time**2 * accelerations, rates + time * accelerations)

    omega_dot = body_acceleration(angles, rates, accelerations)
    np.testing.assert_allclose(omega_dot, slope(along, 0.0, 1.0, 1e-4), atol=1e-8 * scale)
    steep = condition(angles)
    np.testing.assert_allclose(angle_rates(angles, omega), rates, atol=1e-14 * steep * scale)
    np.testing.assert_allclose(angle_accelerations(angles, rates, omega_dot), accelerations, atol=1e-14 * steep * scale)


def test_rates_and_accelerations_are_those_of_the_references():
    angles, rates, accelerations = states(20, seed=8)
    motion = motion_of_angles(angles, rates, accelerations)
    np.testing.assert_allclose(body_rate(angles, rates), motion["rate"], atol=1e-13)
    np.testing.assert_allclose(body_acceleration(angles, rates, accelerations), motion["acceleration"], atol=1e-11)
    np.testing.assert_allclose(angle_rates(angles, motion["rate"]), rates, atol=1e-12)


def test_power_is_the_same_in_both_torques():
    """Q · q̇ = τ · ω, which is what tells the generalised torque of eq. (1) from the body torque."""
    angles, rates, torque = states(20, seed=9)
    generalised = generalised_torque(angles, torque)
    power = np.sum(torque * body_rate(angles, rates), axis=1)
    np.testing.assert_allclose(np.sum(generalised * rates, axis=1), power, atol=1e-10)
    np.testing.assert_allclose(body_torque(angles, generalised), torque, rtol=1e-11, atol=1e-10)
    assert np.abs(generalised - torque).max() > 10.0


def test_the_condition_number_is_numpys_and_grows_without_bound():
    angles = states(50, seed=10, beta=1.56)[0]
    np.testing.assert_allclose(condition(angles), [np.linalg.cond(rate_jacobian(q)) for q in angles], rtol=1e-9)
    assert condition(np.array([1.0, 0.0, 2.0])) == 1.0
    for side in (-1.0, 1.0):
        near = condition(np.array([[0.0, side * (np.pi / 2 - gap), 0.0] for gap in (1e-2, 1e-4, 1e-6)]))
        np.testing.assert_allclose(near, [2e2, 2e4, 2e6], rtol=1e-4)
        assert condition(np.array([0.0, side * np.pi / 2, 0.0])) > 1e15


@pytest.mark.parametrize("side", [-np.pi / 2, np.pi / 2, 3.0 * np.pi / 2])
def test_eq_2_holds_to_nine_digits_up_to_its_bound_and_refuses_beyond(side):
    wrist = WRISTS["asymmetric"]
    motor, data = AngleDynamics.of(wrist), mujoco.MjData(wrist.model)
    rates, applied = np.array([1.0, -2.0, 0.5]), np.array([0.1, -0.2, 0.3])
    for gap, refused in [(2.01e-3, False), (1.99e-3, True), (1e-9, True), (0.0, True)]:
        q = np.array([0.4, side - gap, -0.7])
        torque = generalised_torque(q, applied)
        assert (condition(q) > LARGEST_CONDITION) == refused
        if refused:
            for failing in (
                lambda q=q, t=torque: motor.acceleration(q, rates, t),
                lambda q=q, t=torque: body_torque(q, t),
            ):
                with pytest.raises(SingularChartError, match=r"condition number .* must be at most 1e\+03") as caught:
                    failing()
                assert f"β = {q[1]:.9g}" in one_line(caught.value)
                assert isinstance(caught.value, WristError)
            assert np.isfinite(motor.torque(q, rates, rates)).all()  # eq. (1) needs no inverse
            continue
        place(data, q, rates)
        data.qfrc_applied[:] = applied
        mujoco.mj_forward(wrist.model, data)
        acceleration = motor.acceleration(q, rates, torque)
        close(body_acceleration(q, rates, acceleration), data.qacc, 1e-9)
        assert np.abs(acceleration).max() > 50.0 * np.abs(data.qacc).max()  # the chart's, not the wrist's


def test_one_singular_state_among_many_is_named():
    motor = AngleDynamics.of(WRISTS["shipped"])
    angles = np.array([[0.0, 0.1, 0.0], [0.0, 1.5707, 0.0], [0.0, 0.2, 0.0]])
    with pytest.raises(SingularChartError, match=r"β = 1\.5707 .* is 2\.08e\+04"):
        motor.acceleration(angles, np.zeros(3), np.zeros(3))
    with pytest.raises(SingularChartError, match="β = nan"):
        motor.acceleration(np.array([0.0, np.nan, 0.0]), np.zeros(3), np.zeros(3))
    with pytest.raises(SingularChartError):
        angle_rates(np.array([0.0, np.pi / 2, 0.0]), np.ones(3))


def test_a_calm_pass_over_the_singularity_is_violent_in_the_angles():
    """The loop does not use angles: at a body rate of 1 rad/s, α̇ grows as 1 / cos β."""
    rate = np.array([1.0, 0.0, 0.0])
    for gap in (1e-1, 1e-3, 1e-6):
        rates = angle_rates(np.array([0.0, np.pi / 2 - gap, 0.0]), rate)
        assert rates[0] == pytest.approx(1.0 / np.sin(gap), rel=1e-9)
        assert rates[2] == pytest.approx(-1.0 / np.tan(gap), rel=1e-9)
