"""Pulse responses of the closed loop, and the worst disturbance, against linear systems that are built here."""

from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from rigs import RigidBody, one_line
from sampling import some
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.control import PD, Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment as Described
from spherical_wrist.inspection.replay import replay
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.pulse_responses import NotLinearError, SettledLoop, remainder
from spherical_wrist.prepare.worst_torque import cached_worst_torque, worst_torque
from spherical_wrist.simulation.runner import Runner

POSE = (0.3, 0.2, -0.4)
HELD = {"reference": {"name": "hold", "rotation": POSE}, "disturbance": {"amplitude": 0.004}, "mass_scale": 1.0}
LATE = {"sensing": {"delay": 2e-3}, "actuation": {"lag": 3e-3}}


@pytest.fixture(scope="module")
def cache():
    return RunCache()


class LinearPD:
    """PD control of a rigid body about POSE, sampled at 1 kHz: exact sampling of the linearised equations of motion.

    State (θ, ω), θ the body-frame rotation from the pose; beside it, the last measurements and the motors' torque.
    """

    def __init__(self, nominal, delay=0, lag=0.0):
        body, law = RigidBody.of(nominal), PD()
        pose = Rotation.from_rotvec(POSE)

        def gravity(turn):
            return body.gravity((pose * Rotation.from_rotvec(turn)).as_quat(scalar_first=True))

        stiffness = np.column_stack([(gravity(h) - gravity(-h)) / 2e-5 for h in 1e-5 * np.eye(3)])
        flow = np.zeros((9, 9))  # θ, ω, torque
        flow[0:3, 3:6] = np.eye(3)
        flow[3:6] = np.linalg.inv(body.inertia) @ np.hstack([-stiffness, -body.damping * np.eye(3), np.eye(3)])
        self.step = expm(1e-3 * flow)[:6]
        self.gains = np.hstack([stiffness - np.diag(law.P), -np.diag(law.D)])
        self.lever = pose.as_matrix() @ np.cross(np.eye(3), nominal.lever).T  # tip displacement by θ: R (θ × lever)
        self.lag, self.delay = lag, delay

    def run(self, count, command=None, torque=None, attitude=None, rate=None):
        """Command, tip and measured state after pulses of one period at the start."""
        zero = np.zeros(3)
        x, level, late = np.zeros(6), zero, [np.zeros(6)] * (self.delay + 1)
        outputs = []
        for k in range(count):
            late = [x.copy(), *late[:-1]]
            measured = late[-1] + np.concatenate([zero if k or each is None else each for each in (attitude, rate)])
            u = self.gains @ measured
            outputs.append(np.concatenate([u, self.lever @ x[:3], measured]))
            wanted = u + (zero if k or command is None else command)
            decay = np.exp(-1e-3 / self.lag) if self.lag else 0.0
            mean = wanted + (level - wanted) * (1.0 - decay) * self.lag / 1e-3  # over the period
            level = wanted + (level - wanted) * decay
            x = self.step @ np.concatenate([x, mean + (zero if k or torque is None else torque)])
        outputs = np.array(outputs)
        return outputs[:, :3], outputs[:, 3:6], outputs[:, 6:9], outputs[:, 9:]


@pytest.mark.parametrize(
    ("late", "delay", "lag"),
    [({}, 0, 0.0), (LATE, 2, 3e-3), ({"physics_period": 5e-4}, 0, 0.0)],
    ids=["ideal", "late", "substeps"],
)
def test_pulse_responses_are_those_of_the_linearised_equations_of_motion(nominal, cache, late, delay, lag):
    loop, linear = SettledLoop(Experiment(law="pd", **HELD, **late), cache), LinearPD(nominal, delay, lag)
    torque, attitude, rate = loop.torque_responses(), loop.attitude_responses(), loop.rate_responses()
    for axis, unit in enumerate(np.eye(3)):
        n = len(torque.tip)
        expected = [
            (torque.command, linear.run(n, command=unit)[0]),
            (torque.tip, linear.run(n, torque=unit)[1]),
            (attitude.measured, linear.run(n, attitude=unit)[2]),
            (attitude.tip, linear.run(n, attitude=unit)[1]),
            (rate.measured, linear.run(n, rate=unit)[3]),
            (rate.tip, linear.run(n, rate=unit)[1]),
        ]
        for found, wanted in expected:
            slack = 2e-5 * np.abs(found).max()
            np.testing.assert_allclose(found[:n, :, axis], wanted[: len(found)], rtol=0.0, atol=slack)


@pytest.mark.parametrize("law", some(sorted(Law.members), 3))
def test_every_law_of_the_package_has_a_response_that_decays(cache, law):
    found = SettledLoop(Experiment(law=law), cache).torque_responses()
    assert max(map(remainder, found)) < 1e-3
    assert np.abs(found.tip).max() > 0.0
    np.testing.assert_array_equal(found.tip[0], 0.0)  # a torque moves nothing at once


def test_a_longer_delay_that_nobody_knows_is_as_long_a_delay(cache):
    """Delay is delay, in the description or beside it, where the law does not use its size: the pose is at rest."""
    base = {**HELD, "law": "pd"}
    told = SettledLoop(Experiment(**base, sensing={"delay": 2.5e-3, "timestamped": False}), cache).torque_responses()
    beside = SettledLoop(
        Experiment(**base, sensing={"delay": 1e-3, "timestamped": False}), cache, unknown_delay=1.5e-3
    ).torque_responses()
    np.testing.assert_allclose(beside.command, told.command, atol=1e-6 * np.abs(told.command).max())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"law": {"name": "sliding_mode", "switching": "sign"}}, "pose"),
        ({"law": {"name": "pd", "P": 500.0, "D": 0.0}}, "settle"),
        ({"law": "fuzzy_integral_sliding", "sensing": {"delay": 0.02, "timestamped": False}}, "settle"),
    ],
    ids=["switching", "gains too high", "delay too long"],
)
def test_a_loop_without_a_linear_response_is_one_line(cache, changes, said):
    with pytest.raises(NotLinearError) as error:
        SettledLoop(Experiment(**changes), cache).torque_responses()
    assert said in one_line(error.value)
    assert repr(Described(**changes).law.name) in str(error.value)


# --- the worst disturbance


def test_the_worst_of_all_sign_patterns_is_found():
    """Responses of three periods in a plane, all 2⁹ patterns tried; and one axis: the sum of absolute values."""
    random = np.random.default_rng(4)
    patterns = np.array(list(product((-1.0, 1.0), repeat=9))).reshape(-1, 3, 3)
    for _ in range(20):
        plane = np.linalg.qr(random.normal(size=(3, 3)))[0][:, :2]
        response = np.concatenate([np.zeros((1, 3, 3)), np.einsum("op,kpi->koi", plane, random.normal(size=(3, 2, 3)))])
        found = worst_torque(response)
        reached = np.linalg.norm(np.einsum("koi,nki->no", response[1:], patterns), axis=1)
        assert found.gain == pytest.approx(reached.max(), rel=1e-9)
        own = np.einsum("koi,ki->o", response[1:], found.levels)
        assert np.linalg.norm(own) == pytest.approx(found.gain, rel=1e-9)
        np.testing.assert_allclose(own / found.gain, found.direction, atol=1e-9)
    decaying = np.zeros((200, 3, 3))
    decaying[1:, 1, 0] = (-0.9) ** np.arange(199)
    found = worst_torque(decaying)
    assert found.gain == pytest.approx(10.0, rel=1e-6)
    assert np.array_equal(np.abs(found.levels), np.outer(np.ones(len(found.levels)), [1.0, 0.0, 0.0]))
    assert 0.9 ** len(found.levels) < 1e-3  # 99.9 % of it


def test_a_tip_that_no_torque_moves_has_no_worst_disturbance():
    found = worst_torque(np.zeros((50, 3, 3)))
    assert found.gain == 0.0
    assert not found.levels.any()


def test_the_waveform_repeats_and_ends_at_its_instant():
    response = np.zeros((4, 3, 3))
    response[1:, 0, 0] = 3.0, -2.0, 1.0
    wave = worst_torque(response).torque(1e-3, last=10)
    assert wave(np.arange(10) * 1e-3)[:, 0].tolist() == [1, 1, -1, 1, 1, -1, 1, 1, -1, 1]
    assert wave(np.array([0.0095, 0.0099]))[:, 0].tolist() == [1.0, 1.0]  # held over the period


@pytest.mark.parametrize(
    "hardware", [{}, {"sensing": {"delay": 5e-4}, "actuation": {"lag": 5e-4}}], ids=["ideal", "late"]
)
@pytest.mark.parametrize("law", some(["slotine_li", "fuzzy_integral_sliding"], 2))
def test_the_worst_disturbance_attains_the_bound_in_the_nonlinear_loop(cache, law, hardware):
    held = Experiment(
        law=law, reference={"name": "hold", "rotation": (0.0, 0.0, 0.0)},
        disturbance={"name": "worst", "amplitude": 0.004}, duration=1.5, steady_from=0.5, **hardware,
    )  # fmt: skip
    bound = 0.004 * worst_torque(SettledLoop(held, cache).torque_responses().tip).gain
    run = simulate(held)
    error = 1e-3 * run.metrics.max_tip_error_mm
    assert 0.95 * bound < error < 1.02 * bound
    last = np.linalg.norm(run.tip[-1] - run.desired_tip[-1])
    assert last > 0.95 * bound
    others = [{"name": name, "amplitude": 0.004} for name in ("constant", "sinusoid", "square", "chirp", "steps")]
    for other in others:
        assert 1e-3 * simulate(held.replaced(disturbance=other)).metrics.max_tip_error_mm < error
    random = np.random.default_rng(0)
    assert np.array_equal(np.abs(np.unique(run.disturbance[:, :2])), [0.004, 0.004])
    for _ in range(3):  # neither is any other waveform within the bound worse
        wave = held.replaced(disturbance={"name": "steps", "amplitude": 0.004, "hold": random.uniform(0.002, 0.05)})
        assert 1e-3 * simulate(wave).metrics.max_tip_error_mm < error


def test_the_worst_disturbance_is_that_of_the_law_and_the_hardware_of_the_run():
    base = Experiment(disturbance={"name": "worst"}, duration=0.4)
    runs = [
        simulate(base.replaced(**changes)).disturbance
        for changes in ({}, {"law": "computed_torque_observer"}, {"sensing": {"delay": 5e-4}}, {"mass_scale": 1.0}, {})
    ]
    assert np.array_equal(runs[0], runs[4])
    assert all(not np.array_equal(runs[0], other) for other in runs[1:4])
    assert np.abs(runs[0]).max() == np.abs(simulate(base.replaced(disturbance=0.25)).disturbance).max()


def test_a_recording_with_the_worst_disturbance_replays_to_the_last_bit(tmp_path):
    ends = Experiment(disturbance={"name": "worst", "level": 0.1}, law="slotine_li", duration=0.3, sensing="realistic")
    path = tmp_path / "worst.rrd"
    record(simulate(ends), path)
    assert replay(path).identical
    pieces = Runner(2).map(lambda item, worker: worker.simulate(item), [ends, ends])
    assert all(np.array_equal(piece.disturbance, load_recording(path).disturbance) for piece in pieces)


def test_without_a_size_or_a_loop():
    nothing = simulate(Experiment(disturbance={"name": "worst", "level": 0.0}, duration=0.05))
    assert not nothing.disturbance.any()
    with pytest.raises(ParameterError) as error:
        Disturbance.members["worst"]().torque(1.0, np.random.default_rng(0))
    assert "closed loop" in one_line(error.value)
    with pytest.raises(NotLinearError) as error:
        simulate(Experiment(law={"name": "sliding_mode", "switching": "sign"}, disturbance={"name": "worst"}))
    assert "pose" in one_line(error.value)


def test_building_it_can_be_stopped(cache):
    with pytest.raises(StoppedError):
        cached_worst_torque(Experiment(law="pd"), cache, lambda: True)
    run = simulate(Experiment(law="pd", mass_scale=1.1, disturbance={"name": "worst"}), stop=lambda: True)
    assert run.outcome.status == "interrupted"
