"""References and disturbances from a user's own file: loaded like laws, checked, replayable from the command line."""

import shlex

import numpy as np
import pytest

from rigs import one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digest_of
from spherical_wrist.errors import ParameterError, RecordingError, WristError
from spherical_wrist.experiment.command import command_of
from spherical_wrist.parameters import Member
from spherical_wrist.reference import Lissajous

SPIRAL = '''
import numpy as np
from spherical_wrist.reference import Reference, motion_of
from spiral_helper import AXIS

class Spiral(Reference):
    """A turn about one axis, growing: θ(t) = g t sin(2π f t)."""

    growth: float = 0.05
    frequency: float = 0.5

    def motion(self, time):
        w = 2 * np.pi * self.frequency
        angle = self.growth * time * np.sin(w * time)
        rate = self.growth * (np.sin(w * time) + time * w * np.cos(w * time))
        acceleration = self.growth * (2 * w * np.cos(w * time) - time * w**2 * np.sin(w * time))
        half = 0.5 * angle[:, None]
        attitude = np.hstack([np.cos(half), np.sin(half) * AXIS])
        return motion_of(attitude, rate[:, None] * AXIS, acceleration[:, None] * AXIS)
'''
KICK = """
import numpy as np
from spherical_wrist.disturbance import Disturbance

class Kick(Disturbance):
    at: float = 0.5

    def shape(self, random):
        sign = random.choice([-1.0, 1.0], 3)
        return lambda time: np.where(np.abs(time - self.at) < 0.05, 1.0, 0.0)[:, None] * sign
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "spiral.py").write_text(SPIRAL)
    (tmp_path / "spiral_helper.py").write_text("import numpy as np\nAXIS = np.array([0.6, 0.0, 0.8])\n")
    (tmp_path / "kick.py").write_text(KICK)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def own(**more):
    return Experiment(
        reference={"name": "spiral.py:Spiral", "growth": 0.1},
        disturbance={"name": "kick.py:Kick", "amplitude": 0.01},
        law="computed_torque",
        mass_scale=1.0,
        **{"duration": 1.0, **more},
    )


def test_they_are_followed_and_suffered(folder):
    run = simulate(own())
    angle = 0.1 * run.time * np.sin(np.pi * run.time)
    np.testing.assert_allclose(run.desired_attitude[:, 1], np.sin(0.5 * angle) * 0.6, atol=1e-15)
    pushed = np.abs(run.time - 0.5) < 0.05
    np.testing.assert_array_equal(np.abs(run.disturbance), np.repeat(0.01 * pushed[:, None], 3, axis=1))
    calm = np.abs(run.error[~pushed & (run.time < 0.45)])
    assert calm.max() < 1e-5 < np.abs(run.error[pushed]).max()


def test_the_command_makes_the_same_experiment_from_anywhere(folder, tmp_path_factory, monkeypatch):
    experiment = own()
    words = shlex.split(command_of(experiment))
    assert f"{folder / 'spiral.py'}:Spiral" in words
    assert f"{folder / 'kick.py'}:Kick" in words
    record(simulate(experiment), folder / "run.rrd")
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    with pytest.raises(RecordingError, match="reference and disturbance"):
        assert load_recording(folder / "run.rrd").experiment
    again = load_recording(folder / "run.rrd", trust=True).experiment
    assert again.reference.name == "spiral"
    assert simulate(again).error.tobytes() == simulate(experiment).error.tobytes()


def test_a_campaign_knows_them(folder):
    file = folder / "c.toml"
    file.write_text(
        'laws = ["pd"]\nsamples = 2\n[experiment]\nreference = "spiral.py:Spiral"\ndisturbance = "kick.py:Kick"\n'
        "[vary]\nmass_scale = [1.0]\n"
    )
    before = digest_of(Campaign.from_toml(file))
    (folder / "spiral_helper.py").write_text("import numpy as np\nAXIS = np.array([1.0, 0.0, 0.0])\n")
    (folder / "spiral.py").write_text(SPIRAL + "\n")
    assert digest_of(Campaign.from_toml(file)) != before


WRONG = {
    "no such file": ("reference", "nowhere.py:Spiral", "", "no such file"),
    "no such class": ("reference", "mine.py:Spirale", SPIRAL, "'Spiral'"),
    "another kind": ("reference", "mine.py:Kick", KICK, "no subclass of spherical_wrist.reference.Reference"),
    "does not run": ("reference", "mine.py:Spiral", SPIRAL + "\n1 / 0", "ZeroDivisionError"),
    "raises": ("reference", "mine.py:Spiral", SPIRAL.replace("half =", "half = nothing +"), "NameError"),
    "raises later": ("reference", "mine.py:Spiral", SPIRAL.replace("angle =", "[][0]; angle ="), "IndexError"),
    "returns nothing": ("reference", "mine.py:Spiral", SPIRAL.replace("return motion_of", "motion_of"), "motion_of"),
    "no unit quaternion": ("reference", "mine.py:Spiral", SPIRAL.replace("np.cos(half),", "2 * np.cos(half),"), "unit"),
    "not finite": (
        "reference",
        "mine.py:Spiral",
        SPIRAL.replace("rate[:, None]", "np.log(-1-rate[:, None])"),
        "rate at",
    ),
    "wrong rate": (
        "reference",
        "mine.py:Spiral",
        SPIRAL.replace("rate[:, None]", "2 * rate[:, None]"),
        "its rate is not",
    ),
    "wrong acceleration": (
        "reference",
        "mine.py:Spiral",
        SPIRAL.replace("acceleration[:, None]", "0 * time[:, None]"),
        "its acceleration is not",
    ),
    "unknown parameter": ("reference", {"name": "mine.py:Spiral", "growht": 1.0}, SPIRAL, "'growth'"),
    "disturbance raises": ("disturbance", "mine.py:Kick", KICK.replace("random.choice", "random.choose"), "choose"),
    "disturbance of wrong shape": ("disturbance", "mine.py:Kick", KICK.replace("[:, None] * sign", ""), "shape"),
    "disturbance not finite": ("disturbance", "mine.py:Kick", KICK.replace("1.0, 0.0", "np.nan, 0.0"), "not finite"),
}


@pytest.mark.parametrize(("part", "given", "text", "said"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_with_them_is_said_in_one_line(folder, part, given, text, said):
    (folder / "mine.py").write_text(text)
    with np.errstate(all="ignore"), pytest.raises(WristError, match=said) as error:
        simulate(Experiment(**{part: given, "duration": 1.0}))
    assert part in one_line(error.value)


def test_a_motion_may_jump_now_and_then(folder):
    text = SPIRAL.replace("rate[:, None]", "(rate + 3 * (np.abs(time - 0.5) < 0.01))[:, None]")
    (folder / "mine.py").write_text(text)
    assert simulate(Experiment(reference="mine.py:Spiral", duration=1.0)).outcome.status == "completed"


def test_the_package_s_own_are_not_slowed_down(monkeypatch):
    """They are not guarded: their own tests check them."""
    monkeypatch.setattr("spherical_wrist.prepare.user_part_checks._CheckedMotion", pytest.fail)
    simulate(Experiment(duration=0.1))


def test_members_are_not_mixed_up_with_the_family(folder):
    Experiment(reference="spiral.py:Spiral")
    assert Lissajous.files == Member.files == {}
    with pytest.raises(ParameterError, match="unknown reference"):
        Experiment(reference="spiral")


@pytest.mark.parametrize(
    "end", ["raise SystemExit(0)", "import sys; sys.exit('done')", "class Odd(BaseException): pass\nraise Odd"]
)
def test_a_file_that_would_end_the_process_is_an_error_of_one_line(folder, end):
    (folder / "ends.py").write_text(end)
    with pytest.raises(ParameterError) as caught:
        Experiment(reference="ends.py:Ends")
    assert "ends.py" in one_line(caught.value)


HOOKS = {
    "reference": ("motion(self, time)", "drawn(self, random)", "model_post_init(self, context)"),
    "disturbance": ("shape(self, random)", "torque(self, peak, random, worst=None)", "model_post_init(self, context)"),
    "law": ("model_post_init(self, context)", "derived(self)", "packed(self, period)"),
}
"""Methods of a user's part that this package calls, besides the step of a law."""
ENDS = ("sys.exit(0)", "raise Odd", "raise RuntimeError('no')")


@pytest.mark.parametrize("kind", HOOKS)
def test_a_part_that_would_end_the_process_is_an_error_of_one_line(folder, wrist, kind):
    family = kind.capitalize()
    home = {"law": "control"}.get(kind, kind)
    for number, (hook, end) in enumerate((hook, end) for hook in HOOKS[kind] for end in ENDS):
        (folder / f"ends{number}.py").write_text(
            f"import sys\nfrom spherical_wrist.{home} import {family}\n\nclass Odd(BaseException): pass\n\n"
            f"class Ends({family}):\n    size_of_it: float = 1.0\n\n    def {hook}:\n        {end}\n\n"
            "    @staticmethod\n    def step(signal, parameters, state, command):\n        command.torque[:] = 0.0\n"
        )
        size = ["--set", "disturbance.amplitude=0.01"] if kind == "disturbance" else []
        code, out, err = wrist("run", "--set", f"{kind}.name='ends{number}.py:Ends'", *size, "--no-recording")
        assert (code, out, err.count("\n")) == (2, "", 1), (hook, end, err)
        assert "ends" in err


@pytest.mark.parametrize("end", ENDS)
def test_a_step_that_would_end_the_process_is_an_error_of_one_line(folder, wrist, end):
    (folder / "ends.py").write_text(
        "import sys\nfrom spherical_wrist.control import Law\n\nclass Odd(BaseException): pass\n\n"
        f"class Ends(Law):\n    @staticmethod\n    def step(signal, parameters, state, command):\n        {end}\n"
    )
    code, out, err = wrist("run", "--law", "ends.py:Ends", "--no-recording")
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert "raised" in err


def test_bytecode_is_no_python_file(folder):
    import py_compile

    compiled = py_compile.compile(str(folder / "spiral.py"), str(folder / "a.py:x.pyc"), doraise=True)
    with pytest.raises(ParameterError, match="not a Python file"):
        Experiment(reference=f"{compiled}:Spiral")
