"""Pictures of environments, and environments of wrists that are mounted askew."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.spatial.transform import Rotation

import needs
import spherical_wrist.environment  # noqa: F401 registers them
from rigs import mjcf, mounted
from spherical_wrist import Experiment
from spherical_wrist.errors import ParameterError
from spherical_wrist.prepare.plant import plant_of

TRACK = "spherical_wrist/Track-v0"
SHORT = {"duration": 0.2, "law": "pd", "disturbance": {"amplitude": 0.03}}


@pytest.fixture
def env():
    needs.opengl()
    made = gymnasium.make(TRACK, experiment=SHORT, action="gains", frame_skip=10, render_mode="rgb_array")
    yield made
    made.close()


def green(picture):
    """Pixels that the ghost tints."""
    red, high, blue = (picture[..., channel].astype(int) for channel in range(3))
    return int(((high > red + 25) & (high > blue + 5)).sum())


def test_pictures_show_the_wrist_move_and_its_ghost_where_there_is_an_error(env):
    env.reset(seed=1)
    first = env.render()
    assert (first.shape, first.dtype) == ((480, 640, 3), np.uint8)
    assert green(first) < 200  # on its reference, the wrist hides the ghost
    for _ in range(20):
        _, _, _, _, info = env.step(np.zeros(env.action_space.shape))
    last = env.render()
    assert np.linalg.norm(info["error"]) > 0.02
    assert green(last) > 400
    assert (np.abs(last.astype(int) - first).max(axis=2) > 20).sum() > 2000
    assert (env.render() == last).all()


def test_gymnasium_checks_the_pictures_too():
    needs.opengl()
    check_env(gymnasium.make(TRACK, experiment=SHORT).unwrapped)
    assert gymnasium.make(TRACK, frame_skip=10).metadata["render_fps"] == 100.0


def test_importing_the_package_after_gymnasium_registers_them_and_before_it_does_not_load_it():
    find = f"print({TRACK!r} in gymnasium.registry)"
    for code in (
        f"import gymnasium, spherical_wrist; {find}",
        f"import gymnasium, spherical_wrist.environment; {find}",
    ):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "True\n"
    alone = "import sys, spherical_wrist; print('gymnasium' in sys.modules, 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", alone], capture_output=True, text=True, check=True)
    assert done.stdout == "False False\n"


def test_nothing_is_drawn_unasked():
    env = gymnasium.make(TRACK, experiment=SHORT).unwrapped
    env.reset()
    assert env.render() is None
    with pytest.raises(ParameterError, match="rgb_array"):
        type(env)(render_mode="ansi")


def test_gravity_is_seen_from_a_wrist_that_is_mounted_askew(tmp_path):
    (tmp_path / "mine.xml").write_text(mounted(mjcf()))
    experiment = Experiment(model=tmp_path / "mine.xml", duration=0.2, initial_error=(0.3, -0.2, 0.1))
    env = gymnasium.make(TRACK, experiment=experiment, action="gains").unwrapped
    seen, _ = env.reset(seed=1)
    names = env.observation_names
    told = seen[[names.index(f"gravity_{axis}") for axis in "xyz"]]
    model = plant_of(experiment).model
    attitude = Rotation.from_quat(env._batch.episodes[0].loop.parts.plant.qpos, scalar_first=True)
    mount = Rotation.from_quat(model.body_quat[model.jnt_bodyid[0]], scalar_first=True)
    np.testing.assert_allclose(told, (mount * attitude).inv().apply([0.0, 0.0, -1.0]), atol=1e-12)
