"""Wrists within larger models: parts found by name, other joints held, a mount that is turned."""

import re

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import MOTORS, bits, mjcf, mounted, one_line, states, wrist_of
from spherical_wrist import Experiment, simulate
from spherical_wrist.dynamics import evaluate
from spherical_wrist.errors import ModelError
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import interpreted_engine
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.wrist import Names, Wrist

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <option integrator="RK4" timestep="0.001"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1" pos="0 0 -1"/>
    <body name="arm" pos="0.1 0 0.5" euler="0.3 -0.4 0.2">
      <joint name="lift" type="slide" axis="0 0 1" ref="0.2"/>
      <joint name="swing" type="hinge" axis="0 1 0" stiffness="3"/>
      <geom type="capsule" size="0.04 0.1" mass="2"/>
      <body name="rotor" pos="0.02 0 -0.1" euler="0.5 0.1 -0.7">
        <joint name="shoulder" type="ball" pos="0.001 0.002 -0.001" damping="2e-4"/>
        <geom type="ellipsoid" size="0.06 0.03 0.02" mass="0.4" pos="0.01 0 0"/>
        <site name="mark" pos="0.03 0 0"/>
        <body name="jaw" pos="0 0.01 -0.08" euler="0.2 0 0.1">
          <joint name="jaw" type="hinge" axis="1 0 0" armature="1e-4"/>
          <geom type="capsule" size="0.004 0.02" mass="0.05" pos="0.003 0 0"/>
          <site name="end" pos="0 0 -0.04"/>
          <body name="second" pos="0 0 -0.03">
            <joint name="finger" type="ball"/>
            <geom size="0.004" mass="0.01"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="cable"><joint joint="jaw" coef="1"/><joint joint="lift" coef="0.1"/></fixed>
  </tendon>
  <equality>
    <joint joint1="jaw" joint2="swing"/>
    <tendon tendon1="cable"/>
  </equality>
  <actuator>
    <position name="hoist" joint="lift" kp="100"/>
    <motor name="b" joint="shoulder" gear="0 1 0"/>
    <motor name="pull" tendon="cable"/>
    <motor name="a" joint="shoulder" gear="2 0 0" ctrlrange="-0.1 0.1"/>
    <motor name="spare" joint="shoulder" gear="1 1 1"/>
    <motor name="c" joint="shoulder" gear="0 0 -1"/>
    <position name="servo" joint="shoulder" gear="0 0 1" kp="1"/>
  </actuator>
  <sensor><jointpos joint="jaw"/><tendonpos tendon="cable"/><ballquat joint="shoulder"/></sensor>
  <keyframe><key name="home" qpos="0.3 0.1 1 0 0 0 0.2 1 0 0 0"/></keyframe>
</mujoco>"""
NAMES = Names("shoulder", ("a", "b", "c"), "end")


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    return tmp_path / "arm.xml"


def whole():
    """The whole arm where it starts, without the constraints and springs that act on the joints that are held."""
    model = mujoco.MjModel.from_xml_string(ARM)
    return model, mujoco.MjData(model), model.joint("shoulder")


def test_the_wrist_of_an_arm_has_the_arms_own_inertia_and_bias():
    """M q̈ + c = τ with the rates and accelerations of all other joints zero: the ball's rows and columns."""
    wrist = wrist_of(ARM, NAMES)
    timing, engine = Timing.of(1.0, 1e-3, 1e-3), interpreted_engine()
    nominal = NominalModel(wrist, timing, engine)
    model, data, joint = whole()
    q, v = joint.qposadr[0], joint.dofadr[0]
    for attitude, rate in states(20):
        mujoco.mj_resetData(model, data)
        data.qpos[q : q + 4], data.qvel[v : v + 3] = attitude, rate
        mujoco.mj_forward(model, data)
        M = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        expected = M[v : v + 3, v : v + 3], data.qfrc_bias[v : v + 3] - data.qfrc_passive[v : v + 3]
        H, N = np.empty((3, 3)), np.empty(3)
        evaluate(nominal.handles, attitude, rate, H, N)
        np.testing.assert_allclose(H, expected[0], rtol=1e-12, atol=1e-16)
        np.testing.assert_allclose(N, expected[1], rtol=1e-11, atol=1e-14)


def test_its_tip_is_where_the_arm_has_it_and_its_motors_are_the_named_ones():
    wrist = wrist_of(ARM, NAMES)
    model, data, joint = whole()
    run = Rotation.random(10, rng=np.random.default_rng(1))
    for attitude in run:
        q = joint.qposadr[0]
        data.qpos[q : q + 4] = attitude.as_quat(scalar_first=True)
        mujoco.mj_kinematics(model, data)
        tip = wrist.anchor + wrist.mount @ attitude.apply(wrist.lever)
        np.testing.assert_allclose(tip, data.site("end").xpos, atol=1e-14)
    np.testing.assert_array_equal(wrist.motors, [[0, 2, 0], [1, 0, 0], [0, 0, -1]])  # in the order of the file
    assert list(wrist.upper) == [np.inf, 0.1, np.inf]
    assert (wrist.model.nq, wrist.model.nv, wrist.model.nu, wrist.model.nkey) == (4, 3, 3, 0)


def test_holding_a_joint_brings_no_contact_that_was_not_there():
    """The rotor overlaps the arm that carries it, where MuJoCo does not look; held, the arm counts as the world."""
    model, data, _ = whole()
    mujoco.mj_forward(model, data)
    held = physics_model(wrist_of(ARM, NAMES), 1e-3)
    after = mujoco.MjData(held)
    mujoco.mj_forward(held, after)
    assert (data.ncon, after.ncon) == (0, 0)
    plain = wrist_of(ARM, NAMES)
    for exclude in list(plain.spec.excludes):
        plain.spec.delete(exclude)
    bare = plain.spec.compile()
    touching = mujoco.MjData(bare)
    mujoco.mj_forward(bare, touching)
    assert touching.ncon > 0  # else the test would prove nothing


def test_a_turned_mount_is_a_turned_gravity(tmp_path):
    """Only gravity tells how a wrist is mounted: turned back against the mount, the motion is the same."""
    turn = Rotation.from_euler("XYZ", [0.4, -1.1, 0.7])  # intrinsic, as MuJoCo's "xyz"
    (tmp_path / "mounted.xml").write_text(mounted(mjcf()))
    gravity = " ".join(map(repr, turn.inv().apply([0.0, 0.0, -9.81]).tolist()))
    (tmp_path / "plain.xml").write_text(mjcf().replace("<option", f'<option gravity="{gravity}"'))
    options = {"duration": 2.0, "payload": 0.01, "com_shift": (1e-3, 0.0, 2e-3), "law": "computed_torque_integral"}
    one, other = (simulate(Experiment(model=tmp_path / f"{name}.xml", **options)) for name in ("mounted", "plain"))
    for name in ("attitude", "rate", "error", "torque"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-11, err_msg=name)
    tips = [run.tip - run.experiment.nominal().anchor for run in (one, other)]
    np.testing.assert_allclose(tips[0], turn.apply(tips[1]), atol=1e-11)
    assert one.metrics.max_tip_error_mm == pytest.approx(other.metrics.max_tip_error_mm, rel=1e-6)


def test_a_law_tracks_on_an_arm_and_everything_is_in_the_experiment(arm):
    names = {"joint": "shoulder", "motors": "a, b,c", "tip": "end"}
    run = simulate(Experiment(model=arm, **names, law="fuzzy_integral_sliding", duration=3.0))
    assert run.experiment.motors == ("a", "b", "c")
    assert run.metrics.max_error_rad < 1e-4
    assert run.description["model"] == arm.name  # where it was concerns nobody
    assert Experiment(**{**run.description, "model": arm}) == run.experiment


WRONG = {
    "joint not said": (Names(), ("shoulder", "finger", "--joint")),
    "joint unknown": (Names("sholder"), ("'sholder'", "'shoulder'")),
    "joint is a hinge": (Names("jaw"), ("hinge", "shoulder", "finger")),
    "motors not said": (Names("shoulder"), ("a, spare and c", "--motors")),
    "no motors there": (
        Names("finger"),
        ('<motor joint="finger"', "0 of three", "hoist, b, pull, a, spare and 2 more act on something else"),
    ),
    "motor unknown": (Names("shoulder", ("a", "b", "d")), ("'d'", "hoist")),
    "motor twice": (Names("shoulder", ("a", "b", "b")), ("three different",)),
    "a servo": (Names("shoulder", ("a", "b", "servo")), ("'servo'", "servo, not a plain motor")),
    "a motor elsewhere": (Names("shoulder", ("a", "b", "pull")), ("'pull'", "something else")),
    "in a plane": (Names("shoulder", ("a", "b", "a")), ("three different",)),
    "tip not said": (Names("shoulder", ("a", "b", "c")), ("mark and end", "--tip")),
    "tip unknown": (Names("shoulder", ("a", "b", "c"), "ende"), ("'ende'", "'end'")),
}


@pytest.mark.parametrize(("names", "told"), WRONG.values(), ids=WRONG)
def test_messages_teach(names, told):
    with pytest.raises(ModelError) as error:
        wrist_of(ARM, names)
    for text in told:
        assert text in one_line(error.value)


def test_the_only_site_is_the_tip_and_the_only_motors_the_motors():
    text = mjcf().replace('name="tip"', 'name="needle"')
    assert np.allclose(wrist_of(text).lever, wrist_of(mjcf()).lever)
    more = text.replace("</body></body>", "</body></body>").replace("</worldbody>", '<site name="tip"/></worldbody>')
    assert np.allclose(wrist_of(more).lever, wrist_of(mjcf()).lever)  # that one is not on the wrist
    hinge = '<body pos="1 0 0"><joint name="door" type="hinge"/><geom size="0.1"/></body></worldbody>'
    other = mjcf(motors=MOTORS + '<motor joint="door"/>').replace("</worldbody>", hinge)
    assert wrist_of(other).model.nu == 3


BALL = '<body pos="1 0 0"><joint name="other" type="ball"/><geom size="0.02" mass="0.1"/></body></worldbody>'
SEVERAL_CONTROLS = {
    "orientation elsewhere": '<orientation joint="other" kp="3.5" kv="0.08"/>',
    "a quaternion elsewhere": '<orientation joint="other" kp="3.5" input="quat"/>',
    "position, speed and torque elsewhere": '<pid joint="other" kp="3.5" input="pos vel ff"/>',
    "orientation on the wrist": '<orientation name="servo" joint="w" kp="3.5"/>',
}


@pytest.mark.parametrize("servo", SEVERAL_CONTROLS.values(), ids=SEVERAL_CONTROLS)
@pytest.mark.parametrize("where", [0, 1, 3], ids=["first", "between", "last"])
def test_other_actuators_may_have_several_controls(servo, where):
    motors = MOTORS.replace("/>", ' ctrlrange="-0.5 0.5"/>\n', 1).replace("/><", "/>\n<").splitlines()
    motors[1] = motors[1].replace("/>", ' ctrlrange="-0.4 0.3"/>')
    alone = wrist_of(mjcf(motors="".join(motors)))
    text = mjcf(motors="".join([*motors[:where], servo, *motors[where:]])).replace("</worldbody>", BALL)
    assert mujoco.MjModel.from_xml_string(text).nu > mujoco.MjModel.from_xml_string(text).nactuator
    wrist = wrist_of(text, Names("w"))
    assert wrist.model.nu == wrist.model.nactuator == 3
    for found, expected in [(wrist.motors, alone.motors), (wrist.lower, alone.lower), (wrist.upper, alone.upper)]:
        np.testing.assert_array_equal(found, expected)
    assert wrist.lower[1] == -0.4
    assert ("left out" in " ".join(wrist.warnings)) == ("servo" in servo)


def test_a_servo_with_several_controls_is_no_motor():
    with pytest.raises(ModelError, match="servo is a servo, not a plain motor"):
        wrist_of(mjcf(motors=MOTORS.split("/>")[0] + "/>" + SEVERAL_CONTROLS["orientation on the wrist"]))


def test_a_law_tracks_beside_a_servo_with_several_controls(tmp_path):
    """The same motion as without it, bit for bit."""
    servo, given = SEVERAL_CONTROLS["orientation elsewhere"], {"joint": "w", "duration": 0.3}
    for name, more in (("one.xml", ""), ("other.xml", servo)):
        (tmp_path / name).write_text(mjcf(motors=more + MOTORS).replace("</worldbody>", BALL))
    one, other = (simulate(Experiment(model=tmp_path / name, **given)) for name in ("one.xml", "other.xml"))
    assert bits(one) == bits(other)
    assert one.metrics.max_error_rad < 0.02


def test_a_site_on_what_does_not_move_is_no_tip():
    text = mjcf().replace("</worldbody>", '<site name="base"/></worldbody>')
    with pytest.raises(ModelError, match="not on a body that the ball joint moves"):
        wrist_of(text, Names(tip="base"))


def test_a_motor_in_the_parents_frame_is_told_apart():
    with pytest.raises(ModelError, match="jointinparent"):
        wrist_of(mjcf(motors=MOTORS.replace("joint=", "jointinparent=", 1)))


def test_a_model_without_a_wrist_tells_what_it_has():
    with pytest.raises(ModelError, match=r"lid \(hinge\)"):
        wrist_of('<mujoco><worldbody><body><joint name="lid"/><geom size=".1"/></body></worldbody></mujoco>')


MISSING = {
    "name": mjcf(motors="").replace('name="w" ', ""),
    "name, tip": mjcf("", motors="").replace('name="w" ', ""),
    "name that is taken, motors": mjcf(motors="")
    .replace('name="w" ', "")
    .replace("</worldbody>", BALL.replace('"other" type="ball"', '"wrist" type="hinge"')),
    "motors": mjcf(motors=""),
    "motors, tip": mjcf("", motors=""),
    "tip": mjcf(""),
}


@pytest.mark.parametrize("text", MISSING.values(), ids=MISSING)
def test_a_model_that_follows_the_advice_is_a_wrist(text):
    """All that is missing is said at once, in MJCF that can be copied."""
    with pytest.raises(ModelError) as error:
        wrist_of(text)
    told = one_line(error.value)
    assert "<0>" not in told
    if joint := re.search(r'<joint name="(\w+)" type="ball"/>', told):
        assert "body 'rotor' has no name" in told
        text = text.replace('<joint type="ball"', f'<joint name="{joint[1]}" type="ball"')
    if motor := re.search(r'<motor joint="\w+" gear="1 0 0"/>', told):
        motors = "".join(motor[0].replace("1 0 0", gear) for gear in ("1 0 0", "0 1 0", "0 0 1"))
        text = text.replace("<actuator>", f"<actuator>{motors}")
    if site := re.search(r'<site name="tip" pos="…"/>', told):
        assert "to body 'rotor'" in told
        text = text.replace("</body>", site[0].replace("…", "0 0 -0.1") + "</body>", 1)
    assert wrist_of(text).lever[2] < -0.05


def test_long_lists_in_messages_are_cut():
    many = "".join(
        f'<body pos="{n} 0 1"><joint name="j{n}" type="ball"/><geom size="0.1"/></body>' for n in range(1, 61)
    )
    servos = "".join(f'<position name="p{n}" joint="j{n}" kp="1"/>' for n in range(1, 61))
    sites = "".join(f'<site name="s{n}"/>' for n in range(60))
    text = mjcf(sites, motors=servos).replace("</worldbody>", many + "</worldbody>")
    full = mjcf(sites, motors=MOTORS + servos).replace("</worldbody>", many + "</worldbody>")
    elastic = mjcf(motors='<position joint="w" kp="1"/>' * 60)
    hinges = text.replace('type="ball"', 'type="hinge"').replace("<position", "<motor").replace('kp="1"', "")
    cases = [
        (text, Names(), "w, j1, j2, j3, j4 and 56 more"),
        (text, Names("k1"), "50 more"),
        (text, Names("w"), "p1, p2, p3, p4, p5 and 55 more act on something else"),
        (text, Names("w"), "none of s0, s1, s2, s3, s4 and 55 more is called 'tip'"),
        (full, Names("w", tip="s99"), "49 more"),
        (full, Names("w", ("a", "b", "c")), "52 more"),
        (elastic, Names(), "48 more"),
        (mjcf(motors=MOTORS * 20), Names(), "and 55 more (give those in angle brackets a name in the file)"),
        (hinges, Names(), "w (hinge), j1 (hinge), j2 (hinge), j3 (hinge), j4 (hinge) and 56 more"),
    ]
    for model, names, told in cases:
        with pytest.raises(ModelError) as error:
            wrist_of(model, names)
        assert told in one_line(error.value)
        assert len(str(error.value)) < 900


def test_the_package_needs_no_names():
    assert Wrist.load().names == Names()
    np.testing.assert_array_equal(Wrist.load().mount, np.eye(3))
