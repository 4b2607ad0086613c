"""Three concentric hinges turned into a ball joint, against MuJoCo's own model with the hinges."""

import json
import re

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import TOOL, mjcf, one_line, wrist_of
from spherical_wrist import Experiment, simulate
from spherical_wrist.errors import ModelError
from spherical_wrist.inspection.replay import replay
from spherical_wrist.wrist import Names

ABC = ("a", "b", "c")
HINGES = Names(hinges=ABC)


AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
DAMPED = 'damping="2e-4"'


def hinged(axes=AXES, joint=DAMPED, motors='gear="{gear}"', gears=(1, 1, 1), extra=""):
    """The wrist of :func:`rigs.mjcf`, on three hinges on one body that meet where its ball is, off along each axis."""
    ball, centre = '<joint name="w" type="ball" pos="0.002 -0.001 0.003" damping="2e-4" />', [0.002, -0.001, 0.003]
    places = [np.add(centre, 0.01 * (i + 1) * np.asarray(axis)) for i, axis in enumerate(axes)]
    words = [" ".join(map(repr, np.asarray(row, float).tolist())) for row in (*axes, *places)]
    joints = "".join(
        f'<joint name="{name}" axis="{words[i]}" pos="{words[i + 3]}" {joint}/>' for i, name in enumerate(ABC)
    )
    on = "".join(
        f'<motor name="m{name}" joint="{name}" {motors.format(gear=gear)}/>'
        for name, gear in zip(ABC, gears, strict=True)
    )
    text = mjcf(motors=on, more=extra)
    assert ball in text
    return text.replace(ball, joints)


def test_a_run_on_orthogonal_hinges_is_that_on_the_ball(tmp_path):
    (tmp_path / "ball.xml").write_text(mjcf())
    (tmp_path / "hinges.xml").write_text(hinged())
    given = {"law": "fuzzy_integral_sliding", "duration": 0.5}
    run = simulate(Experiment(model=tmp_path / "hinges.xml", hinges="a, b,c", **given))
    assert run.experiment.hinges == ABC
    assert not [warning for warning in run.warnings if "hinge" in warning]
    ball = simulate(Experiment(model=tmp_path / "ball.xml", **given))
    for name in ("attitude", "torque", "tip"):
        np.testing.assert_allclose(getattr(run, name), getattr(ball, name), atol=1e-12, err_msg=name)
    assert run.metrics.max_error_rad < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_it_has_the_inertia_gravity_and_motors_of_the_hinges(seed):
    """At rest at the initial position, for axes that are not orthogonal: M = Aᵀ H A, bias = Aᵀ N, gear u = Aᵀ G u."""
    random = np.random.default_rng(seed)
    axes = Rotation.random(rng=random).as_matrix() + random.uniform(-0.4, 0.4, (3, 3))
    gears = random.uniform(-3.0, 3.0, 3)
    text = hinged(axes, joint='damping="0"', gears=gears).replace('name="rotor"', 'name="rotor" euler="0.4 -1.1 0.7"')
    model = mujoco.MjModel.from_xml_string(text)
    data, M = mujoco.MjData(model), np.empty((3, 3))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    wrist = wrist_of(text, HINGES)
    body = data.xmat[model.jnt_bodyid[0]].reshape(3, 3)
    A = body.T @ data.xaxis.T
    at_rest, H = mujoco.MjData(wrist.model), np.empty((3, 3))
    mujoco.mj_forward(wrist.model, at_rest)
    mujoco.mj_fullM(wrist.model, at_rest, H)
    np.testing.assert_allclose(A.T @ H @ A, M, atol=1e-15)
    np.testing.assert_allclose(A.T @ at_rest.qfrc_bias, data.qfrc_bias, atol=1e-14)
    np.testing.assert_allclose(A.T @ wrist.motors, np.diag(gears), atol=1e-13)
    np.testing.assert_allclose(wrist.anchor, data.xpos[1] + body @ [0.002, -0.001, 0.003], atol=1e-14)
    np.testing.assert_allclose(wrist.anchor + wrist.mount @ wrist.lever, data.site("tip").xpos, atol=1e-14)


def test_limits_are_those_of_the_motors_and_of_the_torque_about_each_hinge():
    """A gear of 2 doubles the torque, and one of -0.5 turns the limits round; the narrower of two limits holds."""
    joint = 'damping="2e-4" actuatorfrcrange="-0.3 0.2"'
    motors = 'gear="{gear}" ctrlrange="-0.5 0.5" forcerange="-0.12 0.9"'
    wrist = wrist_of(hinged(joint=joint, motors=motors, gears=(1, 2, -0.5)), HINGES)
    np.testing.assert_allclose(wrist.lower, [-0.12, -0.12, -0.12])
    np.testing.assert_allclose(wrist.upper, [0.2, 0.1, 0.5])
    np.testing.assert_array_equal(wrist.motors, np.diag([1.0, 2.0, -0.5]))
    assert not wrist.model.jnt_actfrclimited.any()
    assert wrist.warnings == ()


def test_damping_and_armature_are_carried_over_of_joints_and_motors():
    joint = 'damping="0.01" armature="0.002"'
    wrist = wrist_of(
        hinged(joint=joint, motors='gear="{gear}" damping="0.03" armature="0.004"', gears=(2, -2, 2)), HINGES
    )
    np.testing.assert_allclose(wrist.model.dof_damping, 0.01 + 4 * 0.03)
    np.testing.assert_allclose(wrist.model.dof_armature, 0.002 + 4 * 0.004)
    assert not np.any(wrist.model.actuator_damping)
    assert not np.any(wrist.model.actuator_armature)
    assert wrist.warnings == ()


def test_damping_that_differs_by_direction_becomes_its_mean_and_is_said():
    """The mean over all directions of ω of the power that Σ d_i θ̇_i² takes, per |ω|²."""
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]])
    text = hinged(axes).replace('damping="2e-4"', 'damping="3e-4"', 1)
    wrist = wrist_of(text, HINGES)
    directions = np.random.default_rng(0).normal(size=(200_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    power = np.linalg.solve(axes.T, directions.T).T ** 2 @ [3e-4, 2e-4, 2e-4]
    assert wrist.model.dof_damping[0] == pytest.approx(power.mean(), rel=5e-3)
    [said] = wrist.warnings
    assert "damping of hinges a, b and c (0.0003, 0.0002, 0.0002 N·m·s/rad) differs by direction" in said


def test_dry_friction_is_carried_over_where_a_ball_can_have_it():
    joint = 'frictionloss="1e-3"'
    assert list(wrist_of(hinged(joint=joint), HINGES).model.dof_frictionloss) == [1e-3] * 3
    turned = wrist_of(hinged(Rotation.from_euler("z", 0.3).as_matrix(), joint=joint), HINGES)
    assert not turned.model.dof_frictionloss.any()
    assert "dry friction of hinges a, b and c (0.001, 0.001, 0.001 N·m) is left out" in " ".join(turned.warnings)


def test_ranges_are_left_out_and_said():
    wrist = wrist_of(
        hinged(joint='damping="2e-4" range="-1 1"').replace("<compiler", '<compiler autolimits="true"'), HINGES
    )
    assert not wrist.model.jnt_limited.any()
    assert wrist.warnings == (
        "the range of a, b and c is left out, as a ball has none about an axis: keep the motion within",
    )


ARM = """
<mujoco model="arm">
  <compiler angle="radian" autolimits="true"/>
  <option integrator="implicitfast"/>
  <default>
    <default class="arm">
      <joint axis="0 0 1" armature="0.1" damping="1" range="-2.9 2.9"/>
      <position kp="2000" kv="200" ctrlrange="-2.9 2.9" forcerange="-87 87"/>
      <geom contype="0" conaffinity="0"/>
      <default class="wrist"><joint armature="1e-4" damping="1e-3" range="-2 2"/><motor ctrlrange="-12 12"/></default>
      <default class="finger"><joint type="slide" range="0 0.04"/></default>
    </default>
  </default>
  <worldbody>
    <light pos="0 0 2"/>
    <body name="base" childclass="arm">
      <geom type="cylinder" size="0.06 0.05" mass="2"/>
      <body name="link1" pos="0 0 0.3"><joint name="joint1"/><geom type="capsule" size="0.05 0.1" mass="3"/>
        <body name="link2" quat="0.70710678 0.70710678 0 0"><joint name="joint2" ref="0.3"/>
          <geom type="capsule" size="0.04" fromto="0 0 0 0 0.3 0" mass="2"/>
          <body name="link3" pos="0 0.35 0" quat="0.70710678 -0.70710678 0 0"><joint name="roll" class="wrist"/>
            <geom type="sphere" size="0.02" mass="0.02"/>
            <body name="link4"><joint name="pitch" class="wrist" axis="0 1 0" pos="0 0.02 0"/>
              <geom type="sphere" size="0.02" mass="0.03"/>
              <body name="hand"><joint name="yaw" class="wrist" axis="1 0 0" pos="0.05 0 0"/>
                <geom type="box" size="0.03 0.02 0.04" pos="0 0 0.05" mass="0.5"/>
                <site name="grasp" pos="0 0 0.12"/><site name="camera" pos="0.05 0 0"/>
                <body name="left" pos="0 0 0.09"><joint name="left" class="finger" axis="0 1 0"/>
                  <geom type="box" size="0.01 0.005 0.02" mass="0.01"/></body>
                <body name="right" pos="0 0 0.09"><joint name="right" class="finger" axis="0 -1 0"/>
                  <geom type="box" size="0.01 0.005 0.02" mass="0.01"/></body>
              </body></body></body></body></body></body>
  </worldbody>
  <tendon><fixed name="split"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="left" joint2="right"/></equality>
  <actuator>
    <position class="arm" name="actuator1" joint="joint1"/>
    <position class="arm" name="actuator2" joint="joint2"/>
    <motor class="wrist" name="roll" joint="roll"/>
    <motor class="wrist" name="pitch" joint="pitch"/>
    <motor class="wrist" name="yaw" joint="yaw"/>
    <general class="arm" name="hand" tendon="split" gainprm="0.01" biasprm="0 -100 -10" biastype="affine"/>
  </actuator>
  <sensor><jointpos joint="roll"/><force site="grasp"/></sensor>
  <keyframe><key name="home" qpos="0 0.3 0 0 0 0.04 0.04" ctrl="0 0.3 0 0 0 255"/></keyframe>
</mujoco>
"""
"""An arm as people write them: defaults, position actuators, a gripper, sensors, a keyframe, the default timestep."""


def test_an_arm_runs_with_its_wrist_as_a_ball(wrist, tmp_path):
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "arm.toml").write_text(
        'model = "arm.xml"\nhinges = ["roll", "pitch", "yaw"]\ntip = "grasp"\nduration = 0.5'
    )
    options = ("--model", tmp_path / "arm.xml", "--hinges", "roll,pitch,yaw", "--tip", "grasp", "--duration", "0.5")
    code, out, err = wrist("run", *options, "--law", "fuzzy_integral_sliding", "--json", "-o", tmp_path / "run.rrd")
    assert code == 0, err
    said = json.loads(out)
    assert said["metrics"]["max_error_rad"] < 0.05
    for text in (
        "joints joint1, joint2, left and right are held at the initial position: only ball joint 'roll,pitch,yaw'",
        "link3 and link4 (0.05 kg) between the hinges turn with the ball, as hand does",
        "the range of roll, pitch and yaw is left out",
        "the physics steps are 0.001 s",
    ):
        assert text in " ".join(said["warnings"])
    (tmp_path / "arm.xml").unlink()
    assert replay(tmp_path / "run.rrd").identical


def test_the_first_hinge_carries_what_the_ball_does():
    model = mujoco.MjModel.from_xml_string(ARM)
    data, M = mujoco.MjData(model), np.empty((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    roll = model.joint("roll").dofadr[0]
    wrist = wrist_of(ARM, Names(hinges=("yaw", "roll", "pitch"), tip="grasp"))  # in any order
    at_rest, H = mujoco.MjData(wrist.model), np.empty((3, 3))
    mujoco.mj_forward(wrist.model, at_rest)
    mujoco.mj_fullM(wrist.model, at_rest, H)
    axis = wrist.mount.T @ data.xaxis[model.joint("roll").id]
    assert axis @ H @ axis == pytest.approx(M[roll, roll], abs=1e-12)
    assert axis @ at_rest.qfrc_bias == pytest.approx(data.qfrc_bias[roll], abs=1e-12)
    np.testing.assert_allclose(wrist.anchor, data.xanchor[model.joint("roll").id], atol=1e-9)


SPRING, POLY = 'stiffness="0.1"', 'damping="1e-4 1e-4 0"'
STRAIGHT = hinged(((0, 0, 1), (0, 1, 0), (0, 0, 1)), 'armature="1e-4"')
APART = (
    hinged()
    .replace('pos="0.002 -0.001 0.023', 'pos="0.002 0.004 0.023')
    .replace('pos="0.002 -0.001 0.033', 'pos="0.002 0.004 0.033')
)
REFUSED = {
    "too few": (mjcf(), ABC, ("it has 0 hinges with a name (none)", "give each")),
    "without names": (
        hinged().replace('joint name="a"', "joint").replace('joint="a"', 'site="tip"'),
        ABC, ("it has 2 hinges", "b and c"),
    ),
    "unknown": (hinged(), ("a", "b", "d"), ("unknown hinge 'd'", "valid: a, b, c")),
    "twice": (hinged(), ("a", "b", "b"), ("three different",)),
    "a slide": (ARM, ("roll", "pitch", "left"), ("'left' is a slide", "hinges: joint1, joint2, roll, pitch and yaw")),
    "in two chains": (
        ARM.replace('type="slide" range="0 0.04"', 'range="0 0.04"'), ("roll", "left", "right"),
        ("hinge 'right' is not carried by hinge 'left'",),
    ),
    "far apart": (
        ARM.replace('pos="0.05 0 0"/>\n                <geom', 'pos="0.05 0.1 0"/>\n                <geom'),
        ("roll", "pitch", "yaw"), ("must meet in one point", "roll by 50 mm, pitch by 0 mm and yaw by 50 mm"),
    ),
    "near each other": (APART, ABC, ("a by 2.5 mm", "c by 2.5 mm")),
    "parallel axes": (
        ARM, ("joint1", "roll", "pitch"),
        ("do not span", "joint1 and roll are 0.0° apart", "joint1 and pitch are 90.0°", "choose other hinges"),
    ),
    "roll, pitch, roll": (
        STRAIGHT, ABC,
        ("do not span", "a and c are 0.0° apart", "turn the body of hinge 'b' in the file about that hinge, by 90°"),
    ),
    "a spring": (hinged(joint=SPRING), ABC, ("hinge 'a' has a spring", "remove stiffness")),
    "curved damping": (hinged(joint=POLY), ABC, ("hinge 'a' has damping that is no multiple of the rate",)),
    "coupled by a tendon": (
        hinged(extra='<tendon><fixed name="t"><joint joint="b" coef="1"/><joint joint="c" coef="1"/></fixed></tendon>'),
        ABC, ("hinge 'b' is coupled by the tendon 't'",),
    ),
    "coupled by a constraint": (
        hinged(extra='<equality><joint name="e" joint1="c" joint2="a"/></equality>'),
        ABC, ("is coupled by the equality constraint 'e'",),
    ),
    "no motors": (
        hinged().replace("<actuator>", "<!--").replace("</actuator>", "-->"), ABC,
        ('hinge \'a\' has no torque motor: write <motor joint="a"/>', "; and hinge 'b'", "; and hinge 'c'"),
    ),
    "no motors and no tip": (
        re.sub("<actuator>.*</actuator>", "", hinged()).replace('site name="tip"', 'site name="a"').replace(
            "</body>", '<site name="b"/></body>', 1
        ),
        ABC,
        ("hinge 'a' has no torque motor: write <motor", "; and the tool tip", "none of a and b is called 'tip'"),
    ),
    "servos": (
        ARM.replace('<motor class="wrist" name="yaw"', '<position class="arm" name="yaw"'), ("roll", "pitch", "yaw"),
        ("yaw is a servo", '<motor joint="yaw" ctrlrange="-87 87"/> in its place'),
    ),
    "several motors": (
        hinged().replace("<motor", '<motor name="more" joint="b"/><motor', 1), ABC,
        ("hinge 'b' has several torque motors (more and mb)", "--motors A,B,C"),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "hinges", "told"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_a_ball_is_refused_with_figures(text, hinges, told):
    mujoco.MjModel.from_xml_string(text)
    with pytest.raises(ModelError) as error:
        wrist_of(text, Names(tip="grasp" if text.count("grasp") else None, hinges=hinges))
    for words in told:
        assert words in one_line(error.value)


def test_of_several_motors_the_named_ones_are_taken_and_the_others_said():
    text = hinged().replace("<motor", '<motor name="more" joint="b" gear="3"/><position name="p" joint="a"/><motor', 1)
    wrist = wrist_of(text, Names(hinges=ABC, motors=("ma", "more", "mc")))
    assert sorted(np.abs(wrist.motors).max(axis=0)) == [1.0, 1.0, 3.0]
    assert wrist.warnings == ("on the hinges, actuators are left out: p and mb; only the three motors act on the ball",)
    with pytest.raises(ModelError, match="unknown motor 'mx'"):
        wrist_of(text, Names(hinges=ABC, motors=("ma", "mx", "mc")))
    with pytest.raises(ModelError, match="hinge 'b' has no torque motor among those that are named"):
        wrist_of(text, Names(hinges=ABC, motors=("ma", "mc", "mc")))


def test_a_ball_and_hinges_are_one_too_many():
    with pytest.raises(ModelError, match="--joint or --hinges"):
        wrist_of(mjcf(TOOL), Names(joint="w", hinges=ABC))


def test_a_model_without_a_ball_says_that_hinges_may_do():
    with pytest.raises(ModelError, match=r"no ball joint.*name three hinges that meet in a point: --hinges A,B,C"):
        wrist_of(hinged())
