"""Gymnasium environments: the loop of `simulate` behind them, what an agent sees and is paid, and Gymnasium's rules."""

import pickle
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode
from scipy.spatial.transform import Rotation

from rigs import mjcf
from sampling import pairs
from spherical_wrist import Experiment, WristError, simulate
from spherical_wrist.environment import TRACK, register
from spherical_wrist.environment.action import tunable_gains
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.inspection import inspect
from spherical_wrist.inspection.replay import replay
from spherical_wrist.sensing import Realistic
from spherical_wrist.tuning.ranges import tunable

SHORT = {"duration": 0.3}
NOISY = {**HARDWARE["realistic"], "duration": 0.3, "disturbance": {"name": "noise", "level": 0.3}, "seed": 5}
WILD = {
    "experiment": {"duration": 0.05, "sensing": "realistic"},
    "randomize": {"mass_scale": (0.7, 1.5), "seed": (0, 10**6), "initial_error.*": (-0.05, 0.05)},
    "terminate_beyond": {"tip_error_mm": 6.0},
}


def make(**options):
    return gymnasium.make(TRACK, **options)


def episode(env, policy, seed=None):
    """Observations, actions, rewards and infos of one episode; the last observation has no action."""
    observation, info = env.reset(seed=seed)
    seen, acted, paid, told, over = [observation], [], [], [info], False
    while not over:
        acted.append(policy(seen[-1]))
        observation, reward, terminated, truncated, info = env.step(acted[-1])
        seen.append(observation)
        paid.append(reward)
        told.append(info)
        over = terminated or truncated
    return np.array(seen), np.array(acted), np.array(paid), told, (terminated, truncated)


def zeros(env):
    return lambda observation: np.zeros(env.action_space.shape)


def figures(metrics):
    return {name: value for name, value in metrics.items() if value is not None}


@pytest.mark.parametrize(
    ("given", "frame_skip"),
    pairs([SHORT, NOISY, {"law": "pd", "duration": 1.2, "reference": "beating_heart"}], [7, 1]),
)
def test_zero_gains_are_the_run_of_simulate_bit_for_bit(given, frame_skip):
    experiment = Experiment(**given)
    run = simulate(experiment)
    env = make(experiment=experiment, action="gains", frame_skip=frame_skip)
    _, _, _, told, ends = episode(env, zeros(env))
    assert ends == (False, True)
    assert told[-1]["metrics"] == figures(run.metrics)
    assert told[-1]["outcome"] == run.outcome.status
    assert told[-1]["time"] == pytest.approx(run.outcome.time)
    np.testing.assert_array_equal([info["error"] for info in told[:-1]], run.error[::frame_skip])
    np.testing.assert_array_equal([info["rate_error"] for info in told[:-1]], run.rate_error[::frame_skip])
    last = [*range(frame_skip - 1, len(run) - 1, frame_skip), len(run) - 1]
    np.testing.assert_array_equal([info["torque"] for info in told[1:]], run.torque[last])
    tip = 1000.0 * np.linalg.norm(run.tip - run.desired_tip, axis=1)[::frame_skip]
    np.testing.assert_allclose([info["tip_error_mm"] for info in told[:-1]], tip, atol=1e-12)


def test_an_episode_of_many_pieces_is_the_run_too():
    """Inputs are drawn piece by piece; with late samples and losses they reach from one piece into the next."""
    late = Realistic(delay=0.0023, loss=0.1, rate="estimated", rate_filter=0.001)
    noise = {"name": "noise", "level": 0.3}
    experiment = Experiment(sensing=late, disturbance=noise, duration=1.5, physics_period=0.0005, seed=2)
    env = make(experiment=experiment, action="gains", frame_skip=3)
    assert episode(env, zeros(env))[3][-1]["metrics"] == figures(simulate(experiment).metrics)


def test_an_agent_sees_what_the_law_sees():
    experiment = Experiment(**NOISY)
    run = simulate(experiment)
    env = make(experiment=experiment, action="gains")
    seen = episode(env, zeros(env))[0]
    names = env.unwrapped.observation_names
    assert len(names) == len(env.unwrapped.observation_units) == seen.shape[1]
    column = {name[:-2]: names.index(name) for name in names if name.endswith("_x")}
    part = {name: seen[:-1, first : first + 3] for name, first in column.items()}
    np.testing.assert_array_equal(part["rate"], run.measured_rate)
    body = Rotation.from_quat(run.measured_attitude, scalar_first=True)
    np.testing.assert_allclose(part["gravity"], body.inv().apply([0.0, 0.0, -1.0]), atol=1e-12)
    assert np.abs(part["error"] - run.error).max() > 1e-4, "the noise is missing"
    np.testing.assert_allclose(part["error"] - run.error, 0.0, atol=6e-3)
    assert np.array_equal(part["desired_rate"][0], run.desired_rate[0])


def test_computed_torque_from_the_observation_is_computed_torque():
    """The law in NumPy, from what an agent sees and the nominal model's inertia: the run of the compiled law."""
    law = {"name": "computed_torque", "Kp": 400.0, "Kv": 40.0, "prediction": False}
    experiment = Experiment(law=law, duration=0.5, initial_error=(0.05, -0.02, 0.03))
    env = make(experiment=experiment)
    model = experiment.nominal().model
    inertia, offset = moving_body(model)
    limits = experiment.nominal().upper
    damping = model.dof_damping

    def policy(seen):
        e, de, w, g, _, ff = (seen[i : i + 3] for i in range(0, 18, 3))
        weight = np.cross(offset, g * np.linalg.norm(model.opt.gravity))
        bias = np.cross(w, inertia @ w) - weight + damping * w
        return (inertia @ (ff + 40.0 * de + 400.0 * e) + bias) / limits

    _, _, _, told, _ = episode(env, policy)
    run = simulate(experiment)
    np.testing.assert_allclose([info["torque"] for info in told[1:]], run.torque, atol=1e-9)
    np.testing.assert_allclose([info["error"] for info in told[:-1]], run.error, atol=1e-9)


def moving_body(model):
    """Inertia about the joint, with the rotor's, and first moment m c of all that the joint moves, from MuJoCo."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.empty((3, 3))
    mujoco.mj_fullM(model, data, inertia)
    joint = int(np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL)[0])
    body = int(model.jnt_bodyid[joint])
    return inertia, model.body_subtreemass[body] * (data.subtree_com[body] - data.xanchor[joint])


def test_an_action_is_a_fraction_of_what_the_motors_can_do():
    limits = Experiment().nominal().upper
    env = make(experiment=SHORT)
    env.reset()
    seen, _, _, _, info = env.step(np.array([1.0, -0.5, 7.0]))
    np.testing.assert_allclose(info["torque"], limits * [1.0, -0.5, 1.0])
    assert seen[-3:].tolist() == [1.0, -0.5, 1.0]


def test_gains_are_scaled_on_a_logarithmic_scale():
    law = {"name": "computed_torque", "Kp": (100.0, 200.0, 300.0), "Kv": 30.0}
    stiff = {"name": "computed_torque", "Kp": (300.0, 600.0, 900.0), "Kv": 10.0}
    env = make(experiment={**SHORT, "law": law}, action="gains", gain_factor=3.0)
    assert env.unwrapped.action_names == ("Kp", "Kv")
    told = episode(env, lambda seen: np.array([1.0, -1.0]))[3]
    expected = figures(simulate(Experiment(**SHORT, law=stiff)).metrics)
    assert told[-1]["metrics"] == pytest.approx(expected, rel=1e-6)


def test_gains_are_those_that_can_be_set_while_the_law_runs():
    default = Experiment().law
    assert tunable_gains(default, 4.0) == ["Kp", "Kv", "K", "slope", "phi", "error_scale", "rate_scale"]
    mamdani = default.replaced(inference="mamdani")
    assert ("output_width" in tunable(default), "output_width" in tunable(mamdani)) == (False, True)  # of mamdani alone
    assert "output_width" not in tunable_gains(mamdani, 4.0)  # its table follows from it
    integral = Experiment(law="computed_torque_integral").law
    assert tunable_gains(integral, 4.0) == ["Kp", "Kv", "Ki"]  # and not torque_limit


def test_the_reward_is_what_it_says():
    experiment = Experiment(**NOISY)
    run = simulate(experiment)
    weights = {"tip": 2.0, "effort": 0.5, "chattering": 0.25, "tip_scale": 0.05}
    env = make(experiment=experiment, action="gains", frame_skip=4, reward=weights)
    paid, told = episode(env, zeros(env))[2:4]
    tip = 1000.0 * np.linalg.norm(run.tip - run.desired_tip, axis=1)
    after = np.append(tip[1:], told[-1]["tip_error_mm"])
    effort = np.linalg.norm(run.torque, axis=1)
    change = np.abs(np.diff(run.command, axis=0, prepend=run.command[:1])).sum(axis=1) / (3.0 * 0.001)
    each = (2.0 / (1.0 + after / 0.05) + 0.5 / (1.0 + effort / 0.1) + 0.25 / (1.0 + change)) / 2.75
    np.testing.assert_allclose(paid, each.reshape(-1, 4).mean(axis=1), rtol=1e-9)


def test_it_ends_where_it_goes_too_far_and_where_it_diverges():
    env = make(terminate_beyond={"tip_error_mm": 2.0})
    told, ends = episode(env, lambda seen: np.array([0.1, 0.0, 0.0]))[3:]
    assert ends == (True, False)
    assert told[-1]["outcome"] == "out_of_bounds"
    assert "tip_error_mm = 2" in told[-1]["reason"]
    assert told[-1]["tip_error_mm"] > 2.0
    assert all(info["tip_error_mm"] <= 2.0 for info in told[:-1])
    seen, _, paid, told, ends = episode(make(), lambda seen: np.ones(3))
    assert ends == (True, False)
    assert told[-1]["outcome"] == "diverged"
    assert "1000 rad/s" in told[-1]["reason"]
    assert np.isfinite(seen).all()
    assert ((paid >= 0.0) & (paid <= 1.0)).all()


def test_what_is_randomized_is_what_is_played():
    env = make(
        experiment={"duration": 0.05},
        action="gains",
        randomize={"mass_scale": (0.5, 1.5), "seed": [0, 99], "reference.amplitude": {"loguniform": [0.1, 0.5]}},
    )
    first, second = (episode(env, zeros(env), seed)[3] for seed in (1, None))
    for told in (first, second):
        assert 0.5 < told[0]["randomized"]["mass_scale"] < 1.5
    assert first[0]["randomized"] != second[0]["randomized"]
    assert env.unwrapped.experiment.mass_scale == second[0]["randomized"]["mass_scale"]
    assert second[-1]["metrics"] == figures(simulate(env.unwrapped.experiment).metrics)
    again = episode(env, zeros(env), 1)[3]
    assert data_equivalence(first, again, exact=True)


@pytest.mark.parametrize("action", ["torque", "gains"])
def test_gymnasium_finds_nothing_wrong(action):
    env = make(experiment=SHORT, action=action, randomize={"seed": (0, 10**6)})
    check_env(env.unwrapped)
    other = gymnasium.make(env.spec)
    assert data_equivalence(env.reset(seed=4), other.reset(seed=4), exact=True)
    revived = pickle.loads(pickle.dumps(env.unwrapped))
    assert data_equivalence(env.reset(seed=4), revived.reset(seed=4), exact=True)


def test_wrappers_and_limits_of_gymnasium():
    env = gymnasium.make(TRACK, experiment=SHORT, action="gains", max_episode_steps=20)
    env = gymnasium.wrappers.RecordEpisodeStatistics(gymnasium.wrappers.NormalizeObservation(env))
    seen, _, paid, told, ends = episode(env, zeros(env))
    assert ends == (False, True)
    assert told[-1]["episode"]["l"] == 20
    assert told[-1]["episode"]["r"] == pytest.approx(paid.sum())
    assert np.isfinite(seen).all()
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().unwrapped.step(np.zeros(3))
    short = make(experiment={"duration": 0.001}).unwrapped
    short.reset()
    short.step(np.zeros(3))
    with pytest.raises(gymnasium.error.ResetNeeded):
        short.step(np.zeros(3))


@pytest.mark.parametrize(("mode", "kind"), pairs(AutoresetMode, [("torque", 7), ("gains", 20)]))
def test_many_wrists_are_as_many_single_ones_bit_for_bit(mode, kind):
    action, frame_skip = kind
    options = {**WILD, "action": action, "frame_skip": frame_skip}
    apart = gymnasium.make_vec(TRACK, 5, "sync", {"autoreset_mode": mode}, **options)
    together = gymnasium.make_vec(TRACK, 5, "vector_entry_point", autoreset_mode=mode, threads=2, **options)
    assert together.metadata["autoreset_mode"] is mode
    assert data_equivalence(apart.reset(seed=3), together.reset(seed=3), exact=True)
    apart.action_space.seed(1)
    ended = 0
    for _ in range(25):
        actions = apart.action_space.sample()
        left, right = apart.step(actions), together.step(actions)
        assert all(data_equivalence(a, b, exact=True) for a, b in zip(left, right, strict=True))
        over = right[2] | right[3]
        ended += over.sum()
        if mode is AutoresetMode.DISABLED and over.any():
            left, right = (each.reset(options={"reset_mask": over.copy()}) for each in (apart, together))
            assert data_equivalence(left, right, exact=True)
    assert ended >= 5, "no episode ended: nothing was tested"
    together.close()


def test_wrappers_of_vector_environments():
    envs = gymnasium.make_vec(TRACK, num_envs=3, **WILD, frame_skip=10)
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(gymnasium.wrappers.vector.NormalizeObservation(envs))
    wrapped.reset(seed=0)
    lengths = []
    for _ in range(20):
        seen, _, terminated, truncated, infos = wrapped.step(wrapped.action_space.sample())
        assert seen.shape == (3, 21)
        lengths += infos["episode"]["l"][terminated | truncated].tolist() if "episode" in infos else []
    assert lengths
    assert set(lengths) <= {1, 2, 3, 4, 5}
    other = gymnasium.make_vec(envs.spec)
    assert data_equivalence(envs.reset(seed=4), other.reset(seed=4), exact=True)


def test_wrists_in_processes_of_their_own():
    options = {"experiment": SHORT, "frame_skip": 10}
    apart = gymnasium.make_vec(TRACK, 2, "async", {"context": "spawn"}, **options)
    together = gymnasium.make_vec(TRACK, 2, **options)
    try:
        assert data_equivalence(apart.reset(seed=1), together.reset(seed=1), exact=True)
        actions = np.full((2, 3), 0.1)
        left, right = apart.step(actions), together.step(actions)
        assert all(data_equivalence(a, b, exact=True) for a, b in zip(left, right, strict=True))
    finally:
        apart.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"action": "torques"}, "did you mean 'torque'?"),
        ({"action": "gains", "gains": ["slop"]}, "did you mean 'slope'?"),
        ({"action": "gains", "gains": "Kp"}, "a list of names"),
        ({"gains": ["Kp"]}, "action = 'gains'"),
        ({"action": "gains", "gain_factor": 1.0}, "must be a number above 1"),
        ({"frame_skip": 0}, "frame_skip = 0"),
        ({"frame_skip": 1.5}, "frame_skip = 1.5"),
        ({"experiment": {"mass_scal": 1.0}}, "did you mean 'mass_scale'?"),
        ({"experiment": "nowhere.toml"}, "cannot be read"),
        ({"experiment": 3}, "a TOML file is needed"),
        ({"randomize": {"mass_scal": (0.5, 1.0)}}, "did you mean 'mass_scale'?"),
        ({"randomize": {"mass_scale": (-1.0, 1.0)}}, "greater than 0"),
        ({"randomize": {"mass_scale": (2.0, 1.0)}}, "not below"),
        ({"randomize": {"law.K": (0.1, 1.0)}}, "the same in every episode"),
        ({"randomize": ["mass_scale"]}, "a table of ranges"),
        ({"reward": {"tips": 1.0}}, "did you mean 'tip'?"),
        ({"reward": {"tip": 0.0, "effort": 0.0, "chattering": 0.0}}, "must be positive"),
        ({"terminate_beyond": {"tip_error": 1.0}}, "did you mean 'tip_error_mm'?"),
        ({"terminate_beyond": 0.5}, "a table is needed"),
    ],
)
def test_wrong_arguments_are_explained_in_one_line(options, message):
    with pytest.raises(WristError, match=message.replace("?", r"\?")) as caught:
        make(**options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("action", [np.zeros(2), np.full(3, np.nan), "full", None])
def test_wrong_actions_are_refused(action):
    env = make(experiment=SHORT).unwrapped
    env.reset()
    with pytest.raises(WristError, match=r"^action = .* numbers"):
        env.step(action)


def test_wrong_arguments_of_many():
    for options in ({"autoreset_mode": "now"}, {"threads": 0}, {"num_envs": 0}):
        with pytest.raises(WristError, match=next(iter(options))):
            gymnasium.make_vec(TRACK, **{"num_envs": 2, "experiment": SHORT, **options})
    envs = gymnasium.make_vec(TRACK, 2, experiment=SHORT)
    with pytest.raises(WristError, match="one for each of 2 environments"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(WristError, match="reset_mask"):
        envs.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.step(np.zeros((2, 3)))


def late(failure):
    """File of a law that fails after 9.5 ms."""
    return (
        "import math\nfrom spherical_wrist.control import Law\n"
        "class Late(Law):\n"
        "    gain: float = 0.1\n"
        "    @staticmethod\n"
        "    def step(signal, parameters, state, command):\n"
        "        for i in range(3):\n"
        "            command.torque[i] = parameters.gain * signal.error[i]\n"
        f"        if signal.time > 0.0095:\n            {failure}\n"
    )


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("failure", ["command.torque[0] = math.nan", "raise ValueError('too late')"])
@pytest.mark.parametrize("frame_skip", [4, 5])  # within a step, or at its first instant
def test_a_law_that_fails_is_named(tmp_path, failure, threads, frame_skip):
    file = tmp_path / "late.py"
    file.write_text(late(failure))
    options = {"experiment": {"law": f"{file}:Late", "duration": 0.1}, "action": "gains", "frame_skip": frame_skip}
    envs = gymnasium.make_vec(TRACK, 2, threads=threads, **options)
    envs.reset()
    for _ in range(2):
        envs.step(np.zeros((2, 1)))
    wrote = "wrote the torque [nan" if "nan" in failure else "raised ValueError: too late"
    _, rewards, terminated, truncated, told = envs.step(np.zeros((2, 1)))
    assert terminated.all()
    assert not truncated.any()
    assert np.isfinite(rewards).all()
    assert list(told["outcome"]) == ["failed"] * 2
    assert all(f"law 'late' at t = 0.01 s {wrote}" in reason for reason in told["reason"])
    envs.reset()
    envs.step(np.zeros((2, 1)))  # both go on with a new episode
    envs.close()


ENDS = {
    "completed": ("pd", "pass", {}),
    "nan": ("mine", "command.torque[0] = math.nan", {}),
    "raises": ("mine", "raise ValueError('too late')", {}),
    "diverges": ("mine", "command.torque[2] = 1e9", {"model": "strong.xml"}),
    "too fast at once": ("pd", "pass", {"initial_rate_error": (0.0, 0.0, 2000.0)}),
}


@pytest.mark.parametrize("way", ENDS)
def test_an_episode_ends_where_the_run_of_its_experiment_does(tmp_path, monkeypatch, way):
    """Status, time, reason and metrics, for whatever ends it; the actions leave the gains as they are."""
    monkeypatch.chdir(tmp_path)
    law, failure, more = ENDS[way]
    if law == "mine":
        law = f"{tmp_path}/late.py:Late"
        Path("late.py").write_text(late(failure))
    Path("strong.xml").write_text(mjcf())  # its motors have no limits
    experiment = Experiment(law=law, duration=0.1, steady_from=0.0, **more)
    run = simulate(experiment)
    env = make(experiment=experiment, action="gains", frame_skip=7)
    *_, told, ends = episode(env, zeros(env))
    assert told[-1]["outcome"] == str(run.outcome.status)
    assert told[-1]["reason"] == run.outcome.reason
    assert told[-1]["time"] == pytest.approx(run.outcome.time, abs=1e-9)
    assert told[-1]["metrics"] == figures(run.metrics)
    assert ends == (run.outcome.status.lost, not run.outcome.status.lost)


def test_what_is_doubtful_about_a_model_is_a_warning_once(tmp_path):
    (tmp_path / "w.xml").write_text(mjcf(joint='frictionloss="1e-4"'))
    env = make(experiment={**SHORT, "model": tmp_path / "w.xml"}, action="gains")
    with pytest.warns(RuntimeWarning, match="frictionloss") as found:
        env.reset()
    env.reset()
    assert [str(each.message) for each in found] == list(Experiment(model=tmp_path / "w.xml").nominal().warnings)


def test_registering_is_quick_and_may_be_repeated():
    register()
    register()
    assert TRACK in gymnasium.registry
    code = (
        "import sys, gymnasium, spherical_wrist.environment\n"
        "heavy = {'numba', 'mujoco', 'scipy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "assert 'spherical_wrist/Track-v0' in gymnasium.registry\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_without_gymnasium_there_is_advice(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.setitem(sys.modules, "gymnasium.envs", None)
    with pytest.raises(WristError, match=r"pip install 'spherical-wrist\[gym\]'"):
        register()


def test_an_option_of_reset_that_there_is_not_is_refused():
    """It would be ignored: the episode would begin as usual."""
    with pytest.raises(WristError, match=r"unknown option 'mass_scale'"):
        make(experiment=SHORT).reset(options={"mass_scale": 2.0})
    together = gymnasium.make_vec(TRACK, 2, experiment=SHORT)
    with pytest.raises(WristError, match=r"unknown option 'masks'.*'reset_mask'"):
        together.reset(options={"masks": [True, False]})
    assert make(experiment=SHORT).reset(options={})


@pytest.mark.parametrize("action", ["torque", "gains"])
def test_an_episode_is_recorded_like_a_run(tmp_path, action):
    """Pieces of inputs, a last step that is shorter, and late samples; actions of zeros are the run of the law."""
    experiment = Experiment(**{**NOISY, "law": "computed_torque_integral", "duration": 0.71})
    env = make(experiment=experiment, action=action, frame_skip=9, record=True)
    with pytest.raises(gymnasium.error.ResetNeeded):
        _ = env.unwrapped.run
    _, _, _, told, _ = episode(env, zeros(env))
    run, again = env.unwrapped.run, simulate(env.unwrapped.experiment)
    assert figures(run.metrics) == told[-1]["metrics"]
    assert list(run.channels) == list(again.channels)
    for name, array in again.channels.items():
        np.testing.assert_array_equal(run.channels[name], array, name)
    assert run.description["law"]["action"] == action
    path = run.save(tmp_path / "agent.rrd")
    inspection = inspect(path)
    inspection.check()
    assert inspection.run.headline().startswith("agent on lissajous, 0.71 s: exceeds 0.1 mm")
    with pytest.raises(WristError, match="cannot be simulated again without the agent"):
        replay(path)


def test_a_part_of_an_episode_and_no_record():
    env = make(experiment=SHORT, record=True, terminate_beyond={"tip_error_mm": 2.0})
    env.reset()
    for _ in range(3):
        env.step(np.zeros(3))
    assert (len(env.unwrapped.run), str(env.unwrapped.run.outcome.status)) == (3, "interrupted")
    env = make(experiment=SHORT)
    env.reset()
    with pytest.raises(WristError, match="record=True"):
        _ = env.unwrapped.run


@pytest.mark.parametrize(
    ("given", "advice"),
    [
        ({"law": "pd"}, "write experiment={'law': 'pd'}"),
        ({"law": "pd", "duration": 2.0, "action": "gains"}, "write experiment={'law': 'pd', 'duration': 2.0}"),
        ({"hardware": "realistic"}, "write experiment={'hardware': 'realistic'}"),
        ({"sensing.delay": 0.002}, "write experiment={'sensing.delay': 0.002}"),
        ({"seed": 3}, r"given to reset\(seed=3\)"),
        ({"mass_scale": (0.7, 1.3)}, r"write randomize={'mass_scale': \(0.7, 1.3\)}"),
        ({"tip_error_mm": 3.0}, "write terminate_beyond={'tip_error_mm': 3.0}"),
        ({"effort": 0.1}, "write reward={'effort': 0.1}"),
        ({"actoin": "gains"}, r"did you mean 'action'\?"),
    ],
)
def test_an_argument_in_the_wrong_place_is_answered_with_the_right_one(given, advice):
    for making in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(WristError, match=advice) as caught:
            making(TRACK, **given)
        assert "\n" not in str(caught.value)
    with pytest.raises(WristError, match="make_vec"):
        make(num_envs=3)
