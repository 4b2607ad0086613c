"""The wrist that comes with the package, what makes a model a wrist, and motors that point anywhere."""

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import MOTORS, TOOL, finished, loop, mjcf, mounted, one_line, wrist_of
from spherical_wrist.control import ComputedTorque
from spherical_wrist.errors import ModelError
from spherical_wrist.kinematics import rotated, tip_position
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.wrist import Wrist, default_model
from spherical_wrist.wrist.mjcf import read_spec
from spherical_wrist.wrist.model_sizes import SIZES

ATTITUDES = Rotation.random(50, rng=np.random.default_rng(8))


# --- the shipped model


def test_the_shipped_model_is_in_its_file():
    assert default_model().name == "wrist.xml"
    assert default_model().parent.name == "models"


def test_every_element_has_a_name(nominal):
    model = nominal.model
    for kind, count in (
        ("body", model.nbody), ("jnt", model.njnt), ("geom", model.ngeom), ("site", model.nsite), ("cam", model.ncam),
        ("light", model.nlight), ("mat", model.nmat), ("tex", model.ntex), ("sensor", model.nsensor),
        ("key", model.nkey), ("actuator", model.nu),
    ):  # fmt: skip
        accessor = getattr(model, kind)
        names = [accessor(i).name for i in range(count)]
        assert count > 0, kind
        assert all(names), kind
        assert len(set(names)) == count, kind


def test_it_has_one_ball_joint_and_nothing_else_that_moves(nominal):
    model = nominal.model
    assert model.nq == 4
    assert model.nv == 3
    assert list(model.jnt_type) == [mujoco.mjtJoint.mjJNT_BALL]
    assert model.neq == model.ntendon == model.na == model.nmocap == 0
    assert not model.jnt_limited.any()


def test_its_motors_push_along_the_body_axes_within_their_limits(nominal):
    """Torque limits of the dVRK's pitch, yaw and roll axes."""
    assert np.array_equal(nominal.motors, np.eye(3))
    assert list(nominal.upper) == [0.25, 0.20, 0.33]
    assert list(nominal.lower) == [-0.25, -0.20, -0.33]
    names = [nominal.model.actuator(i).name for i in range(3)]
    assert names == ["torque_x", "torque_y", "torque_z"]


@pytest.mark.parametrize("axis", range(3))
def test_a_motor_accelerates_the_body_about_its_own_axis_at_any_attitude(nominal, axis):
    """H ω̇ = u without gravity and at rest: MuJoCo's answer, not our own."""
    data, H = mujoco.MjData(nominal.model), np.empty((3, 3))
    for q in ATTITUDES[:5].as_quat(scalar_first=True):
        forces = []
        for control in (0.0, 0.15, 10.0):
            data.qpos[:], data.ctrl[:] = q, control * np.eye(3)[axis]
            mujoco.mj_forward(nominal.model, data)
            mujoco.mj_fullM(nominal.model, data, H)
            forces.append(H @ data.qacc)
        np.testing.assert_allclose(forces[1] - forces[0], 0.15 * np.eye(3)[axis], atol=1e-14)
        np.testing.assert_allclose(forces[2] - forces[0], nominal.upper[axis] * np.eye(3)[axis], atol=1e-14)


def test_it_is_integrated_by_rk4_at_one_millisecond_under_gravity(nominal):
    assert nominal.model.opt.timestep == 1e-3
    assert nominal.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert list(nominal.model.opt.gravity) == [0.0, 0.0, -9.81]


def test_nothing_touches_and_the_tool_is_clear_of_the_base_up_to_a_tilt_of_1_2_rad(nominal):
    model, data = nominal.model, mujoco.MjData(nominal.model)
    base, tool = model.body("base").id, model.body("tool").id
    fixed = [g for g in range(model.ngeom) if model.geom_bodyid[g] == base]
    moving = [g for g in range(model.ngeom) if model.geom_bodyid[g] == tool]
    assert fixed
    assert moving
    for azimuth in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
        for angle in (0.6, 1.2):
            turn = Rotation.from_rotvec(angle * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
            data.qpos[:] = turn.as_quat(scalar_first=True)
            mujoco.mj_forward(model, data)
            assert data.ncon == 0
            gaps = [mujoco.mj_geomDistance(model, data, a, b, 0.05, None) for a in fixed for b in moving]
            assert min(gaps) > 1e-3


def test_its_sensors_measure_the_state(nominal):
    """Attitude and rate of the joint and of the imu, the tip in the world, and gravity alone at the ball's centre."""
    model, data = nominal.model, mujoco.MjData(nominal.model)
    turn, rate = ATTITUDES[3], np.array([1.0, -2.0, 3.0])
    q = turn.as_quat(scalar_first=True)
    data.qpos[:], data.qvel[:] = q, rate
    mujoco.mj_forward(model, data)
    for name in ("wrist_attitude", "imu_attitude"):
        assert abs(data.sensor(name).data @ q) == pytest.approx(1.0, abs=1e-14)
    for name in ("wrist_rate", "imu_gyro"):
        np.testing.assert_allclose(data.sensor(name).data, rate, atol=1e-14)
    np.testing.assert_allclose(data.sensor("imu_accelerometer").data, turn.inv().apply([0.0, 0.0, 9.81]), atol=1e-12)
    np.testing.assert_allclose(data.sensor("tip_position").data, turn.apply([0.0, 0.0, -0.115]), atol=1e-15)


def test_its_numbers_are_those_of_the_readme(nominal):
    """Moving mass, centre of mass and inertia as models/README.md derives them."""
    data, H = mujoco.MjData(nominal.model), np.empty((3, 3))
    mujoco.mj_forward(nominal.model, data)
    mujoco.mj_fullM(nominal.model, data, H)
    rotor = nominal.model.body("rotor").id
    np.testing.assert_allclose(H, 1e-4 * np.diag([3.93715, 3.93768, 1.44701]), atol=1e-9)
    np.testing.assert_allclose(data.subtree_com[rotor], [0.0, 0.0, -7.24467e-3], atol=1e-8)
    assert nominal.model.body_subtreemass[rotor] == pytest.approx(0.450, abs=1e-9)
    assert [nominal.model.body(i).name for i in nominal.moving] == ["rotor", "tool"]
    np.testing.assert_allclose(nominal.anchor, 0.0, atol=1e-15)
    np.testing.assert_allclose(nominal.lever, [0.0, 0.0, -0.115], atol=1e-15)


# --- where the tip is


@pytest.mark.parametrize("text", [None, mjcf(), mounted(mjcf())], ids=["shipped", "asymmetric", "mounted"])
def test_tip_position_is_where_mujoco_has_the_site(text):
    wrist = Wrist.load() if text is None else wrist_of(text)
    data, found = mujoco.MjData(wrist.model), []
    attitudes = ATTITUDES.as_quat(scalar_first=True)
    for q in attitudes:
        data.qpos[:] = q
        mujoco.mj_kinematics(wrist.model, data)
        found.append(data.site("tip").xpos.copy())
    np.testing.assert_allclose(tip_position(attitudes, wrist.anchor, wrist.mount, wrist.lever), found, atol=1e-15)


def test_rotated_is_scipys():
    v = np.array([0.3, -0.2, 0.9])
    np.testing.assert_allclose(rotated(ATTITUDES.as_quat(scalar_first=True), v), ATTITUDES.apply(v), atol=1e-15)


# --- loading


def motor(gear, joint="w", **attributes):
    more = " ".join(f'{name}="{value}"' for name, value in attributes.items())
    return f'<motor joint="{joint}" gear="{gear}" {more}/>'


HINGE = '<body><joint type="hinge"/><geom size=".01"/></body>'
NO_BALL = mjcf().replace('type="ball"', 'type="{}"')
BAD = {
    "hinge": (NO_BALL.format("hinge"), "ball"),
    "slide": (NO_BALL.format("slide"), "ball"),
    "free": (NO_BALL.format("free"), "ball"),
    "no joint": ('<mujoco><worldbody><body><geom size=".1"/></body></worldbody></mujoco>', "ball"),
    "two balls": (mjcf(TOOL + HINGE.replace("hinge", "ball")), "ball"),
    "no motor": (mjcf(motors=""), "motor"),
    "two motors": (mjcf(motors=motor("1 0 0") + motor("0 1 0")), "motor"),
    "four motors": (mjcf(motors=MOTORS + motor("1 1 1")), "motor"),
    "position actuator": (
        mjcf(motors=motor("1 0 0") + motor("0 1 0") + '<position joint="w" gear="0 0 1" kp="1"/>'),
        "motor",
    ),
    "velocity actuator": (mjcf(motors=motor("1 0 0") + motor("0 1 0") + '<velocity joint="w" gear="0 0 1"/>'), "motor"),
    "slow motor": (
        mjcf(motors=motor("1 0 0") + motor("0 1 0") + '<general joint="w" gear="0 0 1" dyntype="filter"/>'),
        "motor",
    ),
    "motor in the parent": (mjcf(motors=MOTORS.replace("joint=", "jointinparent=", 1)), "motor"),
    "gears in a plane": (mjcf(motors=motor("1 0 0") + motor("0 1 0") + motor("1 1 0")), "axes"),
    "dead motor": (mjcf(motors=motor("1 0 0") + motor("0 1 0") + motor("0 0 0")), "axes"),
    "no tip": (mjcf('<geom size=".1"/>'), "tip"),
    "tip on a static body": (
        mjcf('<geom size=".1"/>').replace("<worldbody>", '<worldbody><body name="base"><site name="tip"/></body>'),
        "tip",
    ),
    "massless": (mjcf('<site name="tip"/>').replace('mass="0.4"', 'mass="0"'), "mass"),
    "unknown attribute": (mjcf().replace("<body ", '<body colour="red" ', 1), "colour"),
    "missing mesh": (mjcf(more='<asset><mesh name="m" file="nowhere.stl"/></asset>'), "nowhere"),
    "not XML": ("once upon a time", ""),
    "half an XML": ("<mujoco><worldbody>", ""),
    "empty": ("", ""),
    "not MJCF": ("<html><body/></html>", ""),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_what_is_no_wrist_is_refused_in_one_line_that_names_file_and_fault(tmp_path, text, said):
    file = tmp_path / "mine.xml"
    file.write_text(text)
    with pytest.raises(ModelError) as caught:
        Wrist.load(file)
    message = one_line(caught.value)
    assert "mine.xml" in message
    assert said in message


ACTUATOR = '<actuator><motor joint="w" nsample="100000000" delay="0.1"/></actuator>'
HUGE = {
    "elements": '<worldbody><replicate count="500"><replicate count="500"><site/></replicate></replicate></worldbody>',
    "cells of height fields": '<asset><hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>',
    "pixels of textures": '<asset><texture name="t" type="2d" builtin="flat" width="20000" height="20000"/></asset>',
    "points of flexible bodies": '<worldbody><body name="b"><flexcomp name="f" count="999 999 9"/></body></worldbody>',
    "parts of a built-in mesh": '<asset><mesh name="m" builtin="cone" params="100000000 0.5"/></asset>',
    "bytes of memory": '<size memory="900G"/>',
    "contacts or constraints": '<size nconmax="2e9"/>',
    "numbers of its stack": '<size nstack="2000000000"/>',
    "values of user data": '<size nuserdata="200000000"/>',
    "user values of each element": '<size nuser_geom="&#49;000000000"/>',
    "key frames": '<size nkey="100000000"/>',
    "values of sensors": '<sensor><user dim="1000000000"/></sensor>',
    "samples of delays": ACTUATOR,
    "pixels of a camera": '<worldbody><camera name="c" resolution="30000 30000"/></worldbody>',
    "pixels of a rendered image": '<visual><global offwidth="100000" offheight="100000"/></visual>',
    "pixels of shadows": '<visual><quality shadowsize="1000000"/></visual>',
    "iterations of a solver": '<option iterations="2000000000"/>',
}


@pytest.mark.parametrize("size", SIZES, ids=lambda size: size.quantity)
def test_a_size_that_would_fill_memory_or_time_is_refused_before_mujoco_reads_it(tmp_path, size):
    [(quantity, section)] = [item for item in HUGE.items() if size.quantity.startswith(item[0])]
    (tmp_path / "mine.xml").write_text(mjcf(more=section))
    (tmp_path / "part.xml").write_text(f"<mujocoinclude>{section}</mujocoinclude>")
    (tmp_path / "including.xml").write_text(mjcf(more='<include file="part.xml"/>'))
    for name in ("mine.xml", "including.xml"):
        with pytest.raises(ModelError, match=rf"{name}' asks for [\d,]+ {quantity}.*: make it {size.most:,} or less"):
            read_spec(tmp_path / name)


def test_what_is_attached_again_and_again_is_counted_as_often(tmp_path):
    """Twenty models, each with the next one twice: a million of the last."""
    named = '<asset><model name="n" file="{}.xml"/></asset>'
    twice = f'{named}<worldbody><body><attach model="n" body="b" prefix="{{}}"/></body></worldbody>'
    for k in range(20):
        inner = '<body name="b"/>' if k == 19 else ""
        text = "".join(twice.format(k + 1, side) for side in "lr")
        (tmp_path / f"{k}.xml").write_text(f"<mujoco><worldbody>{inner}</worldbody>{'' if k == 19 else text}</mujoco>")
    with pytest.raises(ModelError, match=r"asks for [\d,]{9,} elements"):
        read_spec(tmp_path / "0.xml")


def test_models_in_use_are_far_below_the_bounds(tmp_path):
    usual = (
        '<worldbody><replicate count="20" offset="0 0 0.1"><geom size="0.01"/></replicate></worldbody>'
        '<size memory="64M"/><option iterations="200"/><visual><global offwidth="3840" offheight="2160"/></visual>'
        '<asset><texture type="cube" builtin="gradient" name="t" width="512"/></asset>'
    )
    (tmp_path / "mine.xml").write_text(mjcf(more=usual))
    assert Wrist.load(tmp_path / "mine.xml").model.ngeom > 20


def test_sizes_that_are_commented_out_or_usual_are_taken(tmp_path):
    usual = '<asset><hfield name="h" nrow="100" ncol="200" size="1 1 1 1"/></asset>'
    (tmp_path / "mine.xml").write_text(mjcf(more=f"<!-- {HUGE['cells of height fields']} -->{usual}"))
    assert Wrist.load(tmp_path / "mine.xml").model.nhfielddata == 20_000


@pytest.mark.parametrize("name", ["nowhere.xml", "."])
def test_a_file_that_is_not_there_is_said_to_be_missing(tmp_path, name):
    with pytest.raises(ModelError, match="no such file") as caught:
        Wrist.load(tmp_path / name)
    assert str(tmp_path) in one_line(caught.value)


def test_a_file_of_bytes_is_refused(tmp_path):
    (tmp_path / "mine.xml").write_bytes(bytes(range(256)))
    with pytest.raises(ModelError):
        Wrist.load(tmp_path / "mine.xml")


def test_the_template_of_these_tests_is_a_wrist(tmp_path):
    """Otherwise every refusal above might be for another reason; loaded as text and as a path."""
    (tmp_path / "mine.xml").write_text(mjcf())
    for path in (tmp_path / "mine.xml", str(tmp_path / "mine.xml")):
        assert Wrist.load(path).model.nv == 3


def test_a_wrist_with_a_mesh_beside_its_file_can_be_stepped(tmp_path):
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "tool.obj").write_text(
        "v 0 0 0\nv .01 0 0\nv 0 .01 0\nv 0 0 -.05\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    asset = '<asset><mesh name="tool" file="tool.obj"/></asset>'
    body = '<body><geom type="mesh" mesh="tool" mass="0.05"/><site name="tip" pos="0 0 -0.05"/></body>'
    file = tmp_path / "mine.xml"
    file.write_text(mjcf(body, compiler='meshdir="assets"', more=asset))
    wrist = Wrist.load(file)
    inertias = []
    for model in (wrist.model, physics_model(wrist, 1e-3)):
        data, H = mujoco.MjData(model), np.empty((3, 3))
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, H)
        inertias.append(H)
    np.testing.assert_allclose(inertias[1], inertias[0], rtol=1e-9, atol=1e-14)


# --- motors


LIMITS = {
    "none": ({}, -np.inf, np.inf),
    "control": ({"ctrlrange": "-2 3"}, -2.0, 3.0),
    "force": ({"forcerange": "-0.5 0.7"}, -0.5, 0.7),
    "force is tighter": ({"ctrlrange": "-2 3", "forcerange": "-0.5 0.7"}, -0.5, 0.7),
    "control is tighter": ({"ctrlrange": "-0.2 0.3", "forcerange": "-0.5 0.7"}, -0.2, 0.3),
    "one of each": ({"ctrlrange": "-2 0.3", "forcerange": "-0.5 0.7"}, -0.5, 0.3),
}


@pytest.mark.parametrize(("attributes", "lower", "upper"), LIMITS.values(), ids=LIMITS)
def test_limits_on_control_and_force_are_merged(attributes, lower, upper):
    wrist = wrist_of(mjcf(motors=motor("1 0 0") + motor("0 1 0", **attributes) + motor("0 0 1")))
    assert list(wrist.lower) == [-np.inf, lower, -np.inf]
    assert list(wrist.upper) == [np.inf, upper, np.inf]


def test_force_limits_of_a_motor_with_gain_are_limits_of_its_control():
    """A gain of −2 turns the control round: force −0.5 … 0.7 is control −0.35 … 0.25."""
    general = '<general joint="w" gear="0 0 1" gainprm="-2" forcerange="-0.5 0.7"/>'
    wrist = wrist_of(mjcf(motors=motor("1 0 0") + motor("0 1 0") + general))
    np.testing.assert_allclose([wrist.lower[2], wrist.upper[2]], [-0.35, 0.25], rtol=1e-15)
    np.testing.assert_allclose(wrist.motors, np.diag([1.0, 1.0, -2.0]))


GEARS = {
    "permuted": [(0, 1, 0), (0, 0, 1), (1, 0, 0)],
    "negative": [(-1, 0, 0), (0, 1, 0), (0, 0, -1)],
    "scaled": [(5, 0, 0), (0, 0.1, 0), (0, 0, 1)],
    "all of it": [(0, 0, -3), (0.5, 0, 0), (0, -1, 0)],
    "askew": [(1, 0.2, 0), (-0.5, 1, 0.3), (0.1, -0.4, -2)],
}


def with_gears(gears, limit=None):
    spec = mujoco.MjSpec.from_file(str(default_model()))
    for actuator, gear in zip(spec.actuators, gears, strict=True):
        actuator.gear[:3] = gear
        actuator.ctrllimited = actuator.forcelimited = limit is not None
        actuator.ctrlrange = actuator.forcerange = (-(limit or 1.0), limit or 1.0)
    return Wrist.of(spec)


@pytest.mark.parametrize("gears", GEARS.values(), ids=GEARS)
def test_a_wrist_with_other_motors_tracks_just_as_well(nominal, engine, gears):
    """The same torque on the body, through controls of another size, order and sign."""
    expected = finished(loop(ComputedTorque(), nominal, engine))
    wrist = with_gears(gears)
    np.testing.assert_allclose(wrist.motors, np.transpose(gears))
    run = finished(loop(ComputedTorque(), wrist, engine))
    np.testing.assert_allclose(run.torque, expected.torque, atol=1e-12)
    np.testing.assert_allclose(run.attitude, expected.attitude, atol=1e-12)
    assert np.abs(expected.error).max() < 1e-5


@pytest.mark.parametrize("gears", GEARS.values(), ids=GEARS)
def test_the_mapping_to_torque_is_what_mujoco_applies(gears):
    wrist = with_gears(gears)
    data, control = mujoco.MjData(wrist.model), np.array([0.3, -0.2, 0.7])
    data.qpos[:], data.ctrl[:] = ATTITUDES[0].as_quat(scalar_first=True), control
    mujoco.mj_forward(wrist.model, data)
    np.testing.assert_allclose(wrist.motors @ control, data.qfrc_actuator, atol=1e-15)


def test_limits_bind_each_motor_and_not_each_axis(engine):
    """Controls stay within ±0.004, so that the logged torque is G times controls in that box."""
    wrist = with_gears(GEARS["askew"], limit=0.004)
    run = finished(loop(ComputedTorque(), wrist, engine))
    controls = np.linalg.solve(wrist.motors, run.torque.T).T
    assert np.abs(controls).max() == pytest.approx(0.004, rel=1e-12)
    cut = (np.abs(controls) > 0.004 * (1.0 - 1e-9)).any(axis=1)
    assert 0 < cut.sum() < len(run)
    assert np.array_equal(cut, run.saturated == 1.0)


AFTER_MEMORY_RAN_OUT = """
import resource, sys
from pathlib import Path
from spherical_wrist.errors import ModelError
from spherical_wrist.wrist.model_sizes import SIZES
from spherical_wrist.wrist.mjcf import compiled, read_spec

used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 2**26, used + 2**26))
for _ in range(3):
    try:
        compiled(read_spec(Path(sys.argv[1])), "large")
    except ModelError as error:
        print(error)
    read_spec(Path(sys.argv[2]))
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="limits memory as Linux does")
def test_a_model_is_read_after_another_had_no_room(tmp_path):
    """MuJoCo's bindings would hang at the warning that the second one has a number that is none."""
    field = '<asset><hfield name="h" nrow="4000" ncol="4000" size="1 1 1 1"/></asset>'
    for name, added in (("large", field), ("nan", '<option gravity="nan 0 0"/>')):
        (tmp_path / f"{name}.xml").write_text(mjcf().replace("<worldbody>", f"{added}<worldbody>"))
    files = [str(tmp_path / f"{name}.xml") for name in ("large", "nan")]
    command = [sys.executable, "-c", AFTER_MEMORY_RAN_OUT, *files]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=tmp_path, check=True)
    assert answer.stdout.count("MuJoCo cannot say why; there may be too little memory") == 3
    assert answer.stderr == ""
