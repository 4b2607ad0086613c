"""Motors: resolution, lag, cogging, and the coils of a spherical motor, against closed forms, NumPy and energy."""

import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import signal, stats
from scipy.integrate import quad
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from rigs import MOTORS, RigidBody, bits, directions, finished, loop, mjcf, one_line, quaternions, wrist_of
from spherical_wrist import Experiment, simulate
from spherical_wrist.actuation import Ideal, Realistic, SphericalMotor
from spherical_wrist.actuation.cogging import cogging_torque
from spherical_wrist.actuation.coils import allocate, coil_torque, condition, fill_map, gram
from spherical_wrist.actuation.description import spread
from spherical_wrist.actuation.drive import aim, drive_of, set_torque_command, step_motors
from spherical_wrist.actuation.reach import utilisation
from spherical_wrist.control import Law
from spherical_wrist.errors import WristError
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.loop.engine import compiled_engine
from spherical_wrist.prepare.plant import Perturbation, perturbed
from spherical_wrist.reference import Hold
from spherical_wrist.wrist import Wrist

FALSE_ALARM = 1e-6
"""Probability that a fair generator fails one of the statistical tests, all its comparisons together."""

PERIOD = 1e-3
ONES = np.ones(3)


class Playback(Law):
    """Torques that jump about: the same for every wrist."""

    scale: float = 0.01

    @staticmethod
    def step(signal, parameters, state, command):
        k = round(signal.time / signal.period)
        command.torque[0] = parameters.scale * ((k * 7919) % 13 - 6.0) / 6.0
        command.torque[1] = parameters.scale * ((k * 104729) % 11 - 5.0) / 5.0
        command.torque[2] = parameters.scale * ((k * 1299709) % 7 - 3.0) / 3.0


class Limp(Law):
    """No torque at all."""

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = 0.0


def run(actuation, law="computed_torque", duration=1.0, interpreted=False, **more):
    """A run with these motors; otherwise ideal and undisturbed where nothing else is said."""
    given = {"disturbance": 0, "mass_scale": 1, "actuation": actuation, "law": law, "duration": duration, **more}
    return simulate(Experiment(**given), interpreted=interpreted)


def rotations(quaternions):
    return Rotation.from_quat(quaternions, scalar_first=True)


def drive(actuation, seed=0, motors=None, limit=np.inf, period=PERIOD, step=PERIOD):
    """A drive as plain Python steps it."""
    made = drive_of(actuation, np.eye(3) if motors is None else motors, -limit * ONES, limit * ONES, period, step, seed)
    return made._replace(settings=made.settings.view(np.recarray)[0])


HOME, REST = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@given(
    attitude=quaternions(),
    torque=st.tuples(*[st.floats(-0.3, 0.3)] * 3),
    actuation=st.sampled_from([Ideal(), SphericalMotor(), SphericalMotor(failed=(3,), failure_known=True)]),
)
def test_a_torque_is_cut_where_it_takes_more_than_all_of_a_limit(attitude, torque, actuation):
    motors = drive(actuation, motors=np.array([[1.0, 0.2, 0.0], [0.0, 0.8, 0.0], [0.0, 0.3, -1.0]]), limit=0.2)
    aim(motors, tuple(attitude), REST, -motors.settings.ahead, np.empty(3))
    cut = set_torque_command(motors, torque, np.empty(3))
    packed = motors._replace(settings=np.array([motors.settings], motors.settings.dtype))
    [share] = utilisation(packed, np.array([attitude]), np.array([torque]))
    assume(abs(share - 1.0) > 1e-9)
    assert cut == (share > 1.0)


# --- torque resolution -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("interpreted", [False, True])
def test_a_resolution_rounds_every_motors_torque(interpreted):
    """The law's torque is never further than half a step from what is made, axis by axis."""
    step, duration = 7e-4, 0.05 if interpreted else 1.0
    found = run({"torque_quantum": step}, Playback(), duration, interpreted, reference="hold")
    asked = run("ideal", Playback(), duration, interpreted, reference="hold").torque
    steps = found.torque / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.abs(found.torque - asked).max() <= 0.5 * step * (1.0 + 1e-9)
    assert np.abs(found.torque - asked).max() > 0.4 * step
    assert found.commanded_torque.tobytes() == found.torque.tobytes()


def test_a_resolution_is_that_of_the_torque_about_the_axis_of_the_motor():
    """Skew motors with gears of 2 and 0.5: multiples of Δ about each axis of their own."""
    motors = np.array([[2.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.0, 0.1, 1.0]]).T
    skew = drive(Ideal(torque_quantum=1e-3), motors=motors)
    control = np.zeros(3)
    for torque in np.random.default_rng(0).normal(0.0, 0.1, (50, 3)):
        set_torque_command(skew, torque, control)
        steps = control * np.linalg.norm(motors, axis=0) / 1e-3
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
        exact = np.linalg.solve(motors, torque) * np.linalg.norm(motors, axis=0)
        assert np.abs(steps * 1e-3 - exact).max() <= 0.5e-3 * (1.0 + 1e-9)


def limits(made, attitude=HOME):
    """The largest torque about each body axis alone, as the law is told."""
    found = np.empty(3)
    aim(made, attitude, REST, 0.0, found)
    return found


def test_limits_of_skew_motors_are_where_the_first_of_them_saturates():
    """By linear programming: the largest t for which ±t e_i is a torque of controls within ±1."""
    motors = np.array([[2.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.0, 0.1, 1.0]]).T
    found = limits(drive(Ideal(), motors=motors, limit=1.0))
    for axis in range(3):
        equal = np.hstack([motors, -np.eye(3)[:, axis : axis + 1]])
        bounds = [(-1.0, 1.0)] * 3 + [(None, None)]
        best = linprog([0.0, 0.0, 0.0, -1.0], A_eq=equal, b_eq=np.zeros(3), bounds=bounds)
        assert found[axis] == pytest.approx(-best.fun, rel=1e-9)
    assert np.isinf(limits(drive(Ideal()))).all()


def test_limits_of_a_spherical_motor_are_where_its_allocation_is_cut():
    """Just below them no current is at its limit, just above one is; and never more than the model's motors give."""
    for attitude in Rotation.random(5, rng=np.random.default_rng(3)).as_quat(scalar_first=True):
        coils = drive(SphericalMotor(), limit=10.0)
        found, control = limits(coils, attitude), np.zeros(3)
        for axis in range(3):
            for share, cut in ((0.999, 0.0), (1.001, 1.0), (-0.999, 0.0), (-1.001, 1.0)):
                assert set_torque_command(coils, share * found[axis] * np.eye(3)[axis], control) == cut
        weak = limits(drive(SphericalMotor(), limit=1e-3), attitude)
        np.testing.assert_allclose(weak, 1e-3, rtol=1e-12)
    broken = drive(SphericalMotor(coils=3, layers=1))  # one ring makes no torque across the tool at home
    assert not limits(broken).any()


class Furious(Law):
    """Far more than a motor can do, and than an integer can count in steps."""

    sign: float = 1.0

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.sign * 1e30


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_huge_torque_is_cut_in_its_own_direction(sign):
    found = run({"torque_quantum": 1.2e-4}, Furious(sign=sign), 0.001, reference="hold")
    np.testing.assert_array_equal(found.torque[0], sign * np.array([0.25, 0.20, 0.33]))
    assert found.saturated[0] == 1.0


# --- lag -------------------------------------------------------------------------------------------------------------


def delivered(wanted, lag, period=PERIOD):
    """Mean over each period of the exact answer of T ẋ = x_wanted − x, from rest, by SciPy's discretisation."""
    # states: the torque, and its integral over the period
    system = (np.array([[-1.0 / lag, 0.0], [1.0, 0.0]]), np.array([[1.0 / lag], [0.0]]), np.eye(2), np.zeros((2, 1)))
    A, B, *_ = signal.cont2discrete(system, period)
    level, means = np.zeros(3), []
    for torque in wanted:
        integral = A[1, 0] * level + B[1, 0] * torque
        level = A[0, 0] * level + B[0, 0] * torque
        means.append(integral / period)
    return np.array(means)


@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("lag", [1e-4, 5e-4, 2e-2])
def test_a_lag_is_the_exact_first_order_answer(lag, substeps):
    """Whatever the physics step: the recorded torque is the mean over the period."""
    found = run({"lag": lag}, Playback(), 0.3, reference="hold", physics_period=PERIOD / substeps)
    ideal = run("ideal", Playback(), 0.3, reference="hold", physics_period=PERIOD / substeps)
    assert found.commanded_torque.tobytes() == ideal.torque.tobytes()
    np.testing.assert_allclose(found.torque, delivered(found.commanded_torque, lag), rtol=1e-9, atol=1e-15)
    assert np.abs(found.torque - found.commanded_torque).max() > 1e-3


def test_a_lag_within_a_period():
    """x(t) = 1 − exp(−t/T): the mean over every physics step, by quadrature."""
    lagging = drive(Ideal(lag=4e-4), step=2.5e-4)
    control, applied = np.zeros(3), np.zeros(3)
    set_torque_command(lagging, (1.0, 0.0, -2.0), control)
    for step in range(4):
        step_motors(lagging, HOME, REST, control, applied)
        mean = quad(lambda t: 1.0 - np.exp(-t / 4e-4), step * 2.5e-4, (step + 1) * 2.5e-4)[0] / 2.5e-4
        np.testing.assert_allclose(control, [mean, 0.0, -2.0 * mean], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(lagging.level, np.array([1.0, 0.0, -2.0]) * (1.0 - np.exp(-1.0 / 0.4)), rtol=1e-12)
    assert not applied.any()


# --- cogging ---------------------------------------------------------------------------------------------------------


def potential(attitude, amplitude, detents):
    """U(θ) = −(A/n) Σ cos(n θ_i), θ = log(q)."""
    return -amplitude / detents * np.cos(detents * rotations(attitude).as_rotvec()).sum(axis=-1)


@given(quaternions(), directions(), st.integers(1, 24))
def test_cogging_does_the_work_of_its_potential(q, axis, detents):
    """−dU/dε along q exp(ε axis), by central differences; not near half a turn, where log is not continuous."""
    angle = rotations(q).magnitude()
    assume(angle < 3.0)
    torque = np.array(cogging_torque(tuple(q), 0.02, detents))
    eps = 1e-5
    ahead, behind = (
        potential((rotations(q) * Rotation.from_rotvec(s * eps * axis)).as_quat(scalar_first=True), 0.02, detents)
        for s in (1.0, -1.0)
    )
    scale = 0.02 * max(1.0, 1.0 / (np.pi - angle))
    assert torque @ axis == pytest.approx(-(ahead - behind) / (2.0 * eps), abs=1e-6 * scale * detents**2)


def test_cogging_takes_as_much_as_it_gives_round_a_closed_path():
    """∮ τ·ω dt = 0 along a loop through all three axes, of which a hundredth of the work would show."""
    turns = np.linspace(0.0, 2.0 * np.pi, 20_001)
    phase = np.array([0.3, 1.1, 2.0])
    path = Rotation.from_rotvec(0.8 * np.sin(turns[:, None] * [1, 2, 3] + phase) * [1.0, 0.9, 1.2])
    steps = (path[:-1].inv() * path[1:]).as_rotvec()
    halfway = path[:-1] * Rotation.from_rotvec(0.5 * steps)
    torques = np.array([cogging_torque(tuple(q), 0.02, 8) for q in halfway.as_quat(scalar_first=True)])
    work = np.einsum("ij,ij->i", torques, steps)
    assert abs(work.sum()) < 1e-5 * np.abs(work).sum()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("detents", [1, 8, 13])
def test_cogging_about_one_axis_is_a_sine_with_its_detents(axis, detents):
    """−A sin(n θ) over the whole turn: n places to rest."""
    angles = np.linspace(-np.pi, np.pi, 4001)[1:-1]
    vectors = np.zeros((len(angles), 3))
    vectors[:, axis] = angles
    attitudes = Rotation.from_rotvec(vectors).as_quat(scalar_first=True)
    torques = np.array([cogging_torque(tuple(q), 3e-3, detents) for q in attitudes])
    np.testing.assert_allclose(torques[:, axis], -3e-3 * np.sin(detents * angles), atol=1e-15)
    assert np.abs(np.delete(torques, axis, axis=1)).max() == 0.0
    rests = ((torques[:-1, axis] > 0.0) & (torques[1:, axis] <= 0.0)).sum()
    assert rests + (np.sin(detents * (np.pi - 1e-3)) < 0.0) == detents  # the one at half a turn is where θ jumps


def test_detents_neither_brake_nor_drive():
    """A free wrist swings in them for five seconds: kinetic, gravitational and cogging energy stay what they were.

    With the torque at the beginning of every step instead of halfway it would gain a third of its energy in ten.
    """
    nominal = Wrist.load()
    plant = perturbed(nominal, Perturbation(damping=-1e-4))
    motors = Ideal(cogging=4e-3, detents=8)
    start = Start(error=(0.1, -0.15, 0.2), rate_error=(-1.0, 0.5, 0.3))
    engine = compiled_engine()
    found = finished(loop(Limp(), plant, engine, reference=Hold(), duration=5.0, start=start, actuation=motors))
    body = RigidBody.of(plant)
    kinetic = 0.5 * np.einsum("ij,jk,ik->i", found.rate, body.inertia, found.rate)
    gravity = 9.81 * rotations(found.attitude).apply(body.moment)[:, 2]
    cogging = potential(found.attitude, 4e-3, 8)
    energy = kinetic + gravity + cogging
    assert np.ptp(kinetic) > 1e-4
    assert np.ptp(energy) < 1e-3 * np.ptp(kinetic)
    assert abs(energy[-1000:].mean() - energy[:1000].mean()) < 1e-5 * np.ptp(kinetic)
    assert not found.torque.any()  # cogging is no torque of the motors


# --- the torque map of a spherical motor -----------------------------------------------------------------------------


def places(motor):
    """Directions of the coils in the world, (N, 3)."""
    longitude, latitude = np.array(spread(motor.coils, motor.layers, motor.latitude)).T
    flat = np.cos(latitude)
    return np.stack([flat * np.cos(longitude), flat * np.sin(longitude), np.sin(latitude)], axis=1)


def flux(directions, order):
    """Φ(u) / k = Re (u_x + i u_y)^m / m."""
    return ((directions[..., 0] + 1j * directions[..., 1]) ** order).real / order


def torque_map(attitudes, motor, strength=None):
    """K (n, 3, N) by central differences of the flux through the coils, each turned with the rotor by ±1e-5 rad."""
    q, coils, eps = rotations(attitudes), places(motor), 1e-5
    strength = np.full(motor.coils, motor.torque_constant) if strength is None else strength
    K = np.empty((len(attitudes), 3, motor.coils))
    for axis in range(3):
        sides = []
        for sign in (1.0, -1.0):
            back = (q * Rotation.from_rotvec(sign * eps * np.eye(3)[axis])).inv()
            sides.append(flux(np.stack([back.apply(s) for s in coils], axis=1), motor.poles // 2))
        K[:, axis] = strength * (sides[0] - sides[1]) / (2.0 * eps)
    return K


def compiled_map(attitude, motor, strength=None):
    """K (3, N) of the package."""
    K = np.empty((3, motor.coils))
    strength = np.full(motor.coils, motor.torque_constant) if strength is None else strength
    fill_map(tuple(attitude), places(motor), strength, motor.poles // 2, K)
    return K


@pytest.mark.parametrize("poles", [4, 6, 8, 14])
@given(quaternions())
def test_the_torque_map_is_the_derivative_of_the_flux(poles, q):
    """Energy i Φ of a current in a coil, turned with the rotor about each of its axes."""
    motor = SphericalMotor(poles=poles)
    np.testing.assert_allclose(compiled_map(q, motor), torque_map(q[None], motor)[0], atol=1e-8)


@given(quaternions(), directions(), st.integers(2, 8))
def test_a_coil_makes_no_torque_about_its_own_axis(q, direction, order):
    torque = np.array(coil_torque(tuple(q), tuple(direction), order))
    axis = rotations(q).inv().apply(direction)
    assert abs(torque @ axis) < 1e-15
    # and none larger than its torque constant, which it has on the equator
    assert np.linalg.norm(torque) <= np.linalg.norm(axis[:2]) ** (order - 1) + 1e-14


@pytest.mark.parametrize("order", [2, 4, 7])
def test_the_torque_constant_is_the_largest_torque(order):
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    around = [coil_torque(HOME, (np.cos(a), np.sin(a), 0.0), order) for a in angles]
    np.testing.assert_allclose(around, np.outer(np.sin(order * angles), [0.0, 0.0, 1.0]), atol=1e-12)


def test_coils_are_spread_in_rings():
    longitude, latitude = np.array(spread(24, 3, 0.6)).T
    np.testing.assert_allclose(latitude.reshape(3, 8), np.repeat([[-0.6], [0.0], [0.6]], 8, axis=1), atol=1e-15)
    np.testing.assert_allclose(np.diff(longitude.reshape(3, 8), axis=1), np.pi / 4.0)
    np.testing.assert_allclose(longitude.reshape(3, 8)[:, 0], [0.0, np.pi / 8.0, 0.0])
    assert {height for _, height in spread(6, 1, 0.6)} == {0.0}
    built = drive_of(SphericalMotor(), np.eye(3), -ONES, ONES, PERIOD, PERIOD, 0)
    np.testing.assert_allclose(built.coils, places(SphericalMotor()), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(built.coils, axis=1), 1.0)


def test_the_default_motor_can_turn_every_way():
    """Condition number and least torque at the current limit over spins and tilts up to 1.4 rad, as documented."""
    motor, random = SphericalMotor(), np.random.default_rng(0)
    tilt, azimuth, spin = random.uniform(0.0, 1.4, 1500), *random.uniform(0.0, 2.0 * np.pi, (2, 1500))
    across = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(1500)], axis=1)
    attitudes = Rotation.from_rotvec(tilt[:, None] * across) * Rotation.from_rotvec(np.outer(spin, [0.0, 0.0, 1.0]))
    worst, least = 0.0, np.inf
    for q in attitudes.as_quat(scalar_first=True):
        K = compiled_map(q, motor)
        worst = max(worst, np.linalg.cond(K))
        least = min(
            least,
            motor.current_limit / np.abs(np.linalg.pinv(K) @ (v := random.normal(size=3))).max() * np.linalg.norm(v),
        )
    assert 3.7 < worst < 3.8
    assert 0.05 < least < 0.06


# --- currents --------------------------------------------------------------------------------------------------------


MAPS = st.builds(
    lambda q, coils, poles, failed: compiled_map(
        q,
        SphericalMotor(coils=coils, poles=poles),
        0.02 * (np.arange(coils) >= failed),
    ),
    quaternions(),
    st.sampled_from([6, 12, 24, 40]),
    st.sampled_from([4, 6, 8]),
    st.integers(0, 3),
)


@given(MAPS, st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array))
def test_currents_are_those_of_least_norm(K, torque):
    """NumPy's pseudo-inverse; they make the torque, and have no part in the null space of the map."""
    number = np.linalg.cond(K)
    assume(number < 1e3)
    current = np.empty(K.shape[1])
    cut = allocate(K, gram(K), tuple(torque), np.inf, current)
    assert not cut
    size = np.linalg.norm(torque) / np.linalg.norm(K, 2)
    np.testing.assert_allclose(current, np.linalg.pinv(K) @ torque, atol=1e-13 * number**4 * size + 1e-15)
    np.testing.assert_allclose(K @ current, torque, atol=1e-13 * number**3)
    null = np.linalg.svd(K)[2][3:]
    assert np.abs(null @ current).max(initial=0.0) <= 1e-13 * number**4 * size + 1e-15


@given(MAPS)
def test_the_condition_number_is_that_of_numpy(K):
    number = np.linalg.cond(K)
    if number < 1e3:
        assert condition(gram(K)) == pytest.approx(number, rel=1e-7)
    else:
        assert condition(gram(K)) > 900.0


@given(MAPS, directions(), st.floats(0.01, 0.5))
def test_a_limit_scales_all_currents_and_keeps_the_direction(K, direction, limit):
    assume(np.linalg.cond(K) < 100.0)
    torque = 50.0 * direction
    current = np.empty(K.shape[1])
    assert allocate(K, gram(K), tuple(torque), limit, current)
    assert np.abs(current).max() == pytest.approx(limit, rel=1e-12)
    made = K @ current
    np.testing.assert_allclose(np.cross(made, direction), 0.0, atol=1e-9 * np.linalg.norm(made))
    assert made @ direction > 0.0


def test_a_map_that_cannot_make_every_torque_makes_none():
    """A single ring at home has torque about the tool alone."""
    K = compiled_map(HOME, SphericalMotor(layers=1))
    assert np.linalg.matrix_rank(K) == 1
    current = np.full(24, 9.0)
    assert allocate(K, gram(K), (0.0, 0.0, 0.01), 2.0, current)
    assert not current.any()
    assert condition(gram(K)) == np.inf
    assert condition(gram(np.zeros((3, 4)))) == np.inf
    assert condition(gram(np.eye(3))) == 1.0
    found = run({"name": "spherical_motor", "layers": 1}, duration=0.001, reference={"name": "hold", "rotation": 0})
    assert found.saturated[0] == 1.0
    assert not found.torque.any()
    assert found.metrics.max_condition_number is None


def coil_run(duration=1.0, **parameters):
    """A run on coils; attitudes for which it found its currents, and its torque maps there."""
    motor = SphericalMotor(**parameters)
    found = run(motor, duration=duration)
    ahead = 0.5 * PERIOD + motor.lag
    then = (rotations(found.attitude) * Rotation.from_rotvec(ahead * found.rate)).as_quat(scalar_first=True)
    return found, motor, then


@pytest.mark.parametrize(
    "parameters", [{}, {"coils": 12, "poles": 6, "latitude": 0.7}, {"failed": [3, 17], "failure_known": True}]
)
def test_currents_of_a_run_are_those_of_numpy(parameters):
    """For the torque that the law asked for, at the attitude halfway through the period."""
    found, motor, then = coil_run(**parameters)
    strength = motor.torque_constant * np.isin(np.arange(motor.coils), motor.failed, invert=True)
    K = np.array([compiled_map(q, motor, strength) for q in then])
    expected = np.einsum("nij,nj->ni", np.linalg.pinv(K), found.commanded_torque)
    np.testing.assert_allclose(found.current, expected, atol=1e-10)
    np.testing.assert_allclose(found.condition, np.linalg.cond(K), rtol=1e-7)
    assert not found.current[:, list(motor.failed)].any()
    assert found.saturated.sum() == 0
    m = found.metrics
    steady = slice(np.searchsorted(found.time, found.measurement.steady_from), None)
    loss = motor.resistance * np.mean(np.sum(found.current[steady] ** 2, axis=1))
    assert m.copper_loss_W == pytest.approx(loss, rel=1e-12)
    assert m.peak_current_A == pytest.approx(np.abs(found.current[steady]).max(), rel=1e-12)
    assert m.max_condition_number == pytest.approx(np.linalg.cond(K)[steady].max(), rel=1e-7)


@pytest.mark.parametrize("substeps", [1, 5])
def test_the_torque_delivered_is_that_of_the_coils_where_the_rotor_really_is(substeps):
    """Σ of the flux's derivatives times currents at the true attitude, whatever the drive believed.

    The rotor's attitude halfway through each physics step, from a run that records every one of them.
    """
    motor = SphericalMotor(failed=[5])
    period = PERIOD * substeps
    found = run(motor, duration=0.1, control_period=period, physics_period=PERIOD, initial_error=(0.2, 0.0, -0.1))
    strength = motor.torque_constant * (np.arange(24) != 5)
    if substeps == 1:
        halfway = rotations(found.attitude) * Rotation.from_rotvec(0.5 * PERIOD * found.rate)
        K = torque_map(halfway.as_quat(scalar_first=True), motor, strength)
        np.testing.assert_allclose(found.torque, np.einsum("nij,nj->ni", K, found.current), atol=1e-9)
    else:  # the mean over the period is that in the middle of it, but for the rotor's acceleration
        middle = rotations(found.attitude) * Rotation.from_rotvec(0.5 * period * found.rate)
        K = torque_map(middle.as_quat(scalar_first=True), motor, strength)
        made = np.einsum("nij,nj->ni", K, found.current)
        assert np.abs(found.torque - made).max() < 0.02 * np.abs(made).max()
    assert np.abs(found.torque - found.commanded_torque).max() > 0.01 * np.abs(found.torque).max()  # coil 5 is missing


def test_one_failed_coil_needs_no_list():
    assert SphericalMotor(failed=3) == SphericalMotor(failed=[3]) == SphericalMotor(failed=np.array([3]))


def test_a_failed_coil_that_is_known_costs_no_torque():
    """And one that is not known costs its share of it, but not its current."""
    known, _, _ = coil_run(failed=[3], failure_known=True)
    unknown, _, _ = coil_run(failed=[3])
    whole, _, _ = coil_run()
    assert np.abs(known.torque - known.commanded_torque).max() < 1e-5
    assert np.abs(unknown.torque - unknown.commanded_torque).max() > 1e-3
    assert np.abs(unknown.current[:, 3]).max() > 0.01
    assert known.metrics.copper_loss_W > whole.metrics.copper_loss_W
    assert known.metrics.max_condition_number > whole.metrics.max_condition_number
    assert unknown.metrics.max_condition_number == pytest.approx(whole.metrics.max_condition_number, rel=0.05)


def test_currents_found_for_the_middle_of_the_period_leave_a_law_its_precision():
    """Currents held over a period, while the field turns on: found for its beginning, 1e-3 rad of error would stay.

    At one physics step a period and at eight, where the ripple of the torque within it is resolved.
    """
    ideal = run("ideal", duration=3.0).metrics.max_error_rad
    assert ideal < 2e-6
    assert run("spherical_motor", duration=3.0).metrics.max_error_rad < 2.0 * ideal
    fine = run("spherical_motor", duration=3.0, physics_period=PERIOD / 8.0).metrics.max_error_rad
    assert fine < 1.1e-5
    late = run("spherical_motor", duration=3.0, physics_period=PERIOD / 8.0, sensing={"delay": 2e-3})
    assert late.metrics.max_error_rad < 3e-5  # the age of a sample is taken into account, where it is known


def test_a_current_limit_that_is_reached_is_flagged_and_keeps_the_direction():
    found = run({"name": "spherical_motor", "current_limit": 0.2}, Playback(scale=0.05), 0.2, reference="hold")
    cut = found.saturated > 0.5
    assert 0.1 < cut.mean() < 1.0
    np.testing.assert_allclose(np.abs(found.current[cut]).max(axis=1), 0.2, rtol=1e-12)
    assert np.abs(found.current[~cut]).max() < 0.2
    asked, made = found.commanded_torque[cut], found.torque[cut]
    aligned = np.einsum("ij,ij->i", asked, made) / np.linalg.norm(asked, axis=1) / np.linalg.norm(made, axis=1)
    assert aligned.min() > 1.0 - 1e-4
    assert (np.linalg.norm(made, axis=1) < np.linalg.norm(asked, axis=1)).all()
    assert found.metrics.saturated_fraction == pytest.approx(cut[100:].mean())


def test_strengths_scatter_as_they_should():
    """Gaussian about one, for every coil and seed alike; a coil that fails leaves the others as they are."""
    drives = [drive_of(Realistic(), np.eye(3), -ONES, ONES, PERIOD, PERIOD, seed) for seed in range(400)]
    unit = (np.array([d.strength for d in drives]) / 0.02 - 1.0) / 0.02
    each = FALSE_ALARM / 3.0
    assert abs(unit.mean()) < stats.norm.isf(each / 2.0) / np.sqrt(unit.size)
    assert stats.chi2.ppf(each / 2.0, unit.size) < (unit**2).sum() < stats.chi2.isf(each / 2.0, unit.size)
    assert stats.kstest(unit.ravel(), "norm").pvalue > each
    np.testing.assert_array_equal(drives[0].believed, 0.02)
    hurt = drive_of(Realistic(failed=[0]), np.eye(3), -ONES, ONES, PERIOD, PERIOD, 0)
    assert hurt.strength[0] == 0.0
    np.testing.assert_array_equal(hurt.strength[1:], drives[0].strength[1:])
    np.testing.assert_array_equal(hurt.believed, 0.02)
    known = drive_of(Realistic(failed=[0], failure_known=True), np.eye(3), -ONES, ONES, PERIOD, PERIOD, 0)
    np.testing.assert_array_equal(known.believed, 0.02 * (np.arange(24) > 0))


def test_uneven_strengths_are_in_the_torque_of_a_run():
    """It is that of the coils as they were drawn from the run's seed, and not as they are believed to be."""
    motor = SphericalMotor(strength_error=0.05)
    found = run(motor, seed=7)
    halfway = rotations(found.attitude) * Rotation.from_rotvec(0.5 * PERIOD * found.rate)
    K = torque_map(halfway.as_quat(scalar_first=True), motor, np.ones(24))
    drawn, other = (drive_of(motor, np.eye(3), -ONES, ONES, PERIOD, PERIOD, seed).strength for seed in (7, 8))
    made = np.einsum("nij,j,nj->ni", K, drawn, found.current)
    np.testing.assert_allclose(found.torque, made, atol=1e-8)
    for wrong in (other, np.full(24, 0.02)):
        assert np.abs(np.einsum("nij,j,nj->ni", K, wrong, found.current) - found.torque).max() > 1e-4
    assert np.abs(found.torque - found.commanded_torque).max() > 1e-4


def test_coils_lag_like_motors():
    """Each current is its exact first-order answer; the map is that of half a period and one lag ahead."""
    found, motor, then = coil_run(0.3, lag=8e-4)
    K = np.array([compiled_map(q, motor) for q in then])
    wanted = np.einsum("nij,nj->ni", np.linalg.pinv(K), found.commanded_torque)
    decay, level = np.exp(-PERIOD / 8e-4), np.zeros(24)
    for k, current in enumerate(wanted):
        level = current + decay * (level - current)
        np.testing.assert_allclose(found.current[k], level, atol=1e-10)


# --- in the loop -----------------------------------------------------------------------------------------------------


def test_motors_without_faults_change_nothing():
    """Parameters of parts that are off included."""
    ideal, found = run("ideal"), run({"detents": 3})
    assert bits(found) == bits(ideal)
    assert not {"commanded_torque", "current", "condition"} & found.channels.keys()
    assert found.metrics == ideal.metrics
    assert ideal.metrics.copper_loss_W is None


@pytest.mark.parametrize("interpreted", [False, True])
def test_faults_too_small_to_count_change_no_bit(interpreted):
    """Cogging of 1e-300 N·m goes through all that motors do, and the torque comes out as it went in."""
    case = {"duration": 0.05, "initial_error": (0.1, 0.2, -0.3), "interpreted": interpreted}
    ideal = run("ideal", "fuzzy_sliding_computed_torque", **case)
    found = run({"cogging": 1e-300}, "fuzzy_sliding_computed_torque", **case)
    assert bits(found).items() >= bits(ideal).items()
    assert found.commanded_torque.tobytes() == found.torque.tobytes()


def test_chattering_is_that_of_the_torque_asked_for():
    found = run({"lag": 2e-2}, Playback(), 1.0, reference="hold")
    steady = found.commanded_torque[500:]
    expected = np.abs(np.diff(steady, axis=0)).sum() / (3.0 * (len(steady) - 1) * PERIOD)
    assert found.metrics.chattering_Nm_per_s == pytest.approx(expected, rel=1e-12)
    assert np.abs(np.diff(found.torque[500:], axis=0)).sum() < 0.2 * np.abs(np.diff(steady, axis=0)).sum()


def test_motors_of_any_gear_make_the_torque_of_the_coils():
    """Skew axes, signs and gains of the model's own motors are where the sum of the coils' torques goes through."""
    skew = (
        '<motor joint="w" gear="2 0 0"/><motor joint="w" gear="0.3 -0.4 0" ctrlrange="-5 5" ctrllimited="true"/>'
        '<motor joint="w" gear="0 0.1 1"/>'
    )
    runs = []
    for motors in (MOTORS, skew):
        wrist = wrist_of(mjcf(motors=motors))
        motor = SphericalMotor(lag=1e-3, cogging=1e-3, failed=[2])
        runs.append(
            finished(loop(Playback(), wrist, compiled_engine(), reference=Hold(), duration=0.2, actuation=motor))
        )
    np.testing.assert_allclose(runs[1].torque, runs[0].torque, atol=1e-12)
    np.testing.assert_allclose(runs[1].attitude, runs[0].attitude, atol=1e-12)
    assert np.abs(runs[0].torque).max() > 1e-3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"torque_quantum": -1.0}, "greater than or equal to 0"),
        ({"lag": float("inf")}, "finite"),
        ({"cogging": 1e-3, "detents": 0}, "greater than or equal to 1"),
        ({"cogging": 1e-3, "detents": 10**30}, "less than or equal to 10000"),
        ({"detents": 2.5}, "integer"),
        ({"coils": 24}, "unknown parameter 'coils'"),
        ({"name": "spherical_motor", "coils": 25}, "25 coils do not spread evenly over 2 layers"),
        ({"name": "spherical_motor", "coils": 2}, "greater than or equal to 3"),
        ({"name": "spherical_motor", "poles": 7}, "multiple of 2"),
        ({"name": "spherical_motor", "failed": [24]}, "there is no coil 24: failed must be numbers from 0 to 23"),
        ({"name": "spherical_motor", "failed": [-1]}, "greater than or equal to 0"),
        ({"name": "spherical_motor", "failed": "3rd"}, "failed = '3rd'"),
        ({"name": "spherical_motor", "coils": 4, "failed": [0, 1]}, "fewer than three coils are left"),
        ({"name": "spherical_motor", "current_limit": 0}, "greater than 0"),
        ({"name": "spherical_motor", "latitude": 1.6}, "less than 1.5"),
        ("sperical_motor", "did you mean 'spherical_motor'"),
    ],
    ids=str,
)
def test_what_cannot_be_a_motor_is_refused_in_one_line(given, said):
    with pytest.raises(WristError, match="actuation") as caught:
        Experiment(actuation=given)
    assert re.search(re.escape(said), one_line(caught.value)), caught.value
