"""Constraints that act on the plant alone: which, for how long and how much, against MuJoCo's own lists of them."""

import re
from collections import defaultdict

import mujoco
import numpy as np
import pytest

from rigs import TOOL, mjcf
from spherical_wrist import Experiment
from spherical_wrist.loop.constraints import STATES
from spherical_wrist.loop.engine import compiled_engine, interpreted_engine
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.simulation.rollouts import roll_out

TIP = '<geom name="ball" type="sphere" size="0.01" pos="0 0 -0.1" mass="0" contype="1"/>'
TOUCHING = mjcf(TOOL + TIP).replace(
    "<worldbody>",
    '<worldbody><geom name="wall" type="box" size="0.01 0.5 0.5" pos="0.055 0 0.3" conaffinity="1"/>'
    '<geom type="box" size="0.5 0.01 0.5" pos="0 0.07 0.3" conaffinity="1"/>',
)
LEASH = (
    '<tendon><spatial name="leash" limited="true" range="0 0.15"><site site="anchor"/><site site="tip"/></spatial>'
    "</tendon>"
)
ROWS = {
    "range": mjcf(joint='limited="true" range="0 0.5"'),
    "weld": mjcf(more='<equality><weld body1="rotor" solref="0.05 1"/></equality>'),
    "weld of a name": mjcf(more='<equality><weld name="glue" body1="tool" solref="0.5 1"/></equality>'),
    "contacts": TOUCHING,
    "leash, by a sparse matrix": mjcf(more=LEASH)
    .replace('<body name="rotor"', '<site name="anchor" pos="0.1 0 0.3"/><body name="rotor"')
    .replace("<option", '<option jacobian="sparse"'),
    "all": TOUCHING.replace('type="ball"', 'type="ball" limited="true" range="0 0.6"').replace(
        "<actuator>", '<equality><connect body1="tool" anchor="0 0 0.05" solref="0.3 1"/></equality><actuator>'
    ),
}
DURATION = 1.5
NAMES = {
    mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT: "limit of joint 'w'",
    mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON: "limit of tendon 'leash'",
}


def ran(tmp_path, text, engine=None, **given):
    """The closed loop after a run of a wrist, and the log of the run."""
    (tmp_path / "wrist.xml").write_text(text)
    perfect = {"mass_scale": 1.0, "disturbance": {"level": 0.0}, "law": "computed_torque", "duration": DURATION}
    experiment, logs, loops = Experiment(model=tmp_path / "wrist.xml", **(perfect | given)), [], []

    def keep(loop, logged):
        loops.append(loop)
        logs.append(logged.log.copy())

    [result] = roll_out([lambda: experiment], RunCache(engine or compiled_engine()), keep=keep)
    if isinstance(result, Exception):
        raise result
    return loops[-1], logs[-1]


def acted(text, loop, log):
    """For how many control periods every constraint acted, and its largest torque: MuJoCo's lists after each step."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = 1e-3
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = log["attitude"][0], log["rate"][0]
    controls = np.linalg.solve(loop.wrist.motors, log["torque"].T).T
    count, largest = defaultdict(int), defaultdict(float)
    for k, control in enumerate(controls):
        np.testing.assert_allclose(data.qpos, log["attitude"][k], atol=1e-6)
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        found = defaultdict(lambda: np.zeros(data.nefc))
        for row in np.flatnonzero(data.efc_force):
            kind, index = mujoco.mjtConstraint(data.efc_type[row]), int(data.efc_id[row])
            if kind == mujoco.mjtConstraint.mjCNSTR_EQUALITY:
                name = "weld constraint 'glue'" if model.equality(index).name else "constraint of body"
            elif kind in NAMES:
                name = NAMES[kind]
            else:
                name = "geom 'wall'" if model.geom("wall").id in data.contact[index].geom else "body 'world'"
            found[name][row] = data.efc_force[row]
        for name, force in found.items():
            torque = np.empty(3)
            mujoco.mj_mulJacTVec(model, data, torque, force)
            count[name] += 1
            largest[name] = max(largest[name], float(np.linalg.norm(torque)))
    return count, largest


@pytest.mark.parametrize("row", ROWS)
def test_a_run_says_which_constraints_acted_how_long_and_how_much(row, tmp_path):
    """To the spacing of the noted states; where contacts rattle, to 15 % of the time and half of the impacts."""
    loop, log = ran(tmp_path, ROWS[row])
    warnings = [each for each in loop.measured_warnings() if "acted on the plant" in each]
    count, largest = acted(ROWS[row], loop, log)
    assert len(warnings) == len(count) > 0
    rattles = "wall" in ROWS[row]
    for name, periods in count.items():
        [warning] = [each for each in warnings if name in each]
        number = r"(?:about )?([\d.e+-]+)"
        told = re.search(rf"for {number} s, {number} % of the run, with up to {number} N·m", warning)
        seconds, share, torque = map(float, told.groups())
        spacing = 2e-3 * max(1.0, 2.0 * sum(count.values()) / STATES)
        assert seconds == pytest.approx(1e-3 * periods, abs=spacing, rel=0.15 if rattles else None)
        assert share == pytest.approx(100.0 * seconds / DURATION, rel=0.05)
        assert torque < 1.05 * largest[name]
        assert torque > (0.5 if rattles else 0.95) * largest[name]


def test_the_interpreted_loop_notes_the_same(tmp_path):
    told = [
        ran(tmp_path, ROWS["contacts"], engine, duration=0.3)[0].measured_warnings()
        for engine in (compiled_engine(), interpreted_engine())
    ]
    assert told[0] == told[1] != ()


@pytest.mark.parametrize(
    ("text", "given"),
    [
        (mjcf(), {}),
        (mjcf(joint='limited="true" range="0 2"'), {}),
        (TOUCHING.replace('conaffinity="1"', 'conaffinity="2"'), {}),
        (mjcf(more='<equality><weld body1="rotor" active="false"/></equality>'), {}),
        (mjcf(joint='frictionloss="0.002"'), {}),
        (mjcf(joint='limited="true" range="0 2" frictionloss="0.001"'), {"friction": 0.003}),
        (ROWS["range"].replace("<default>", '<option><flag limit="disable"/></option><default>'), {}),
    ],
    ids=[
        "none",
        "wide range",
        "nothing touches",
        "inactive",
        "friction of the model",
        "friction asked for",
        "disabled",
    ],
)
def test_a_run_in_which_none_acted_says_nothing(text, given, tmp_path):
    """Nor is friction a constraint here: that of the model is said once, that of the experiment is asked for."""
    assert ran(tmp_path, text, **given)[0].measured_warnings() == ()


def test_what_acts_besides_friction_is_said(tmp_path):
    loop, _ = ran(tmp_path, ROWS["range"], friction=0.003)
    _, limit = loop.measured_warnings()
    assert limit.startswith("limit of joint 'w' acted on the plant for")


@pytest.mark.parametrize("amplitude", [0.55, 0.9, 1.4])
def test_a_reference_beyond_the_joints_range_is_said(amplitude, tmp_path):
    """A sinusoid of amplitude A about one axis is beyond L for (2/π) acos(L/A) of the time, by up to A − L."""
    sinusoid = {"name": "sinusoid", "amplitude": [amplitude, 0.0, 0.0], "frequency": 1.0}
    loop, _ = ran(tmp_path, ROWS["range"], reference=sinusoid, duration=1.0)
    beyond, *_ = loop.measured_warnings()
    told = re.match(r"the reference leaves the range of joint 'w', 0.5 rad, by up to (\S+) rad for (\S+) % of", beyond)
    assert float(told[1]) == pytest.approx(amplitude - 0.5, rel=5e-3)
    assert float(told[2]) == pytest.approx(200.0 / np.pi * np.arccos(0.5 / amplitude), abs=0.6)


def test_many_constraints_are_cut_to_a_few(tmp_path):
    welds = "".join(f'<weld name="w{i}" body1="rotor" solref="0.05 1"/>' for i in range(9))
    loop, _ = ran(tmp_path, mjcf(more=f"<equality>{welds}</equality>"), duration=0.1)
    *named, rest = loop.measured_warnings()
    assert len(named) == 4
    assert rest == "5 more constraints acted on the plant, for shorter times"


HINGE = TOOL.replace("<geom", '<joint name="bend" type="hinge" stiffness="39"/><geom')


def test_a_finished_run_has_the_warnings_of_the_model_and_of_what_acted(tmp_path):
    loop, _ = ran(tmp_path, mjcf(HINGE, joint='limited="true" range="0 0.5"'), duration=0.3)
    held, beyond, limit = loop.warnings
    assert held == "joint bend is held at the initial position: only ball joint 'w' moves"
    assert beyond.startswith("the reference leaves the range of joint 'w'")
    assert limit.startswith("limit of joint 'w' acted on the plant for")
    assert ran(tmp_path, mjcf(), duration=0.1)[0].warnings == []


def test_a_run_that_is_stopped_says_what_acted_until_then(tmp_path):
    (tmp_path / "wrist.xml").write_text(ROWS["weld"])
    experiment, loops = Experiment(model=tmp_path / "wrist.xml", duration=2.0), []
    roll_out(
        [lambda: experiment], RunCache(compiled_engine()), stop=lambda: bool(loops),
        keep=lambda loop, logged: loops.append(loop), chunk=500,
    )  # fmt: skip
    assert "acted on the plant for about 0.5 s, 100 % of the run" in loops[0].warnings[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ROWS["weld"], "weld constraint of body 'rotor' acted on the plant for"),
        (ROWS["range"], "the reference leaves the range of joint 'w', 0.5 rad, by up to"),
        (mjcf(HINGE), "joint bend is held at the initial position: only ball joint 'w' moves"),
    ],
    ids=["weld", "range", "flexible shaft"],
)
def test_wrist_run_says_it_in_a_line(text, said, tmp_path, wrist):
    (tmp_path / "wrist.xml").write_text(text)
    code, _, err = wrist("run", "--no-recording", "--duration", "0.5", "--model", str(tmp_path / "wrist.xml"))
    assert code == 0
    assert f"wrist: warning: {said}" in err
