"""The nominal model against the closed form of a rigid body on a ball joint, and against MuJoCo's own pipeline."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import GRAVITY, RigidBody, mjcf, states, wrist_of
from spherical_wrist.dynamics import MOTION, evaluate
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import compiled_engine, interpreted_engine
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.reference import Lissajous, Sinusoid
from spherical_wrist.wrist import Wrist

TIMING = Timing.of(10.0, 1e-3, 1e-3)
WRISTS = {"shipped": Wrist.load(), "asymmetric": wrist_of(mjcf())}
ENGINES = {"interpreted": interpreted_engine, "compiled": compiled_engine}
each_wrist = pytest.mark.parametrize("wrist", WRISTS.values(), ids=WRISTS)
each_engine = pytest.mark.parametrize("make_engine", ENGINES.values(), ids=ENGINES)


def motion(attitude, rate, acceleration):
    packed = np.zeros(1, MOTION)
    packed["attitude"], packed["rate"], packed["acceleration"] = attitude, rate, acceleration
    return packed


def model_torque(wrist, engine, attitude, rate, acceleration):
    """The torque for one instant of a motion."""
    torque, H = np.empty((1, 3)), np.empty((3, 3))
    model = NominalModel(wrist, TIMING, engine)  # its handles are addresses: it must outlive them
    engine.inverse_dynamics(model.handles, engine.records(motion(attitude, rate, acceleration)), H, torque)
    return H, torque[0]


def close(actual, expected):
    """To 1e-12 of the largest component."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@each_wrist
def test_inertia_and_bias_are_the_rigid_bodys(wrist):
    """H = I_o, the same at every attitude; N = ω × I_o ω − r_c × m Rᵀ g + D ω."""
    body = RigidBody.of(wrist)
    handles = NominalModel(wrist, TIMING, interpreted_engine()).handles
    for q, w in states(20):
        H, N = np.empty((3, 3)), np.empty(3)
        evaluate(handles, tuple(q), tuple(w), H, N)
        close(H, body.inertia)
        close(N, body.bias(q, w))


@each_engine
@each_wrist
def test_the_torque_of_a_motion_is_the_rigid_bodys(wrist, make_engine):
    engine, body = make_engine(), RigidBody.of(wrist)
    accelerations = np.random.default_rng(2).normal(0.0, 50.0, (20, 3))
    for (q, w), a in zip(states(20), accelerations, strict=True):
        H, torque = model_torque(wrist, engine, q, w, a)
        close(H, body.inertia)
        close(torque, body.inertia @ a + body.bias(q, w))


@each_engine
@each_wrist
def test_the_torque_of_a_motion_is_that_of_mujocos_inverse_dynamics(wrist, make_engine):
    data = mujoco.MjData(wrist.model)
    for q, w in states(10, seed=3):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, w, 5.0 * w[::-1]
        mujoco.mj_inverse(wrist.model, data)
        close(model_torque(wrist, make_engine(), q, w, 5.0 * w[::-1])[1], data.qfrc_inverse)


@each_wrist
def test_inertia_and_bias_are_those_of_mujocos_forward_dynamics(wrist):
    data, handles = mujoco.MjData(wrist.model), NominalModel(wrist, TIMING, interpreted_engine()).handles
    for q, w in states(10, seed=4):
        data.qpos[:], data.qvel[:] = q, w
        mujoco.mj_forward(wrist.model, data)
        full = np.empty((3, 3))
        mujoco.mj_fullM(wrist.model, data, full)
        H, N = np.empty((3, 3)), np.empty(3)
        evaluate(handles, tuple(q), tuple(w), H, N)
        close(H, full)
        close(N, data.qfrc_bias - data.qfrc_passive)


def test_everything_that_the_nominal_model_knows_of_is_in_the_model():
    """Armature adds to H; a spring, gravity compensation and damping to N: as in MuJoCo's forward dynamics."""
    ball = '<geom type="sphere" size="0.01" mass="0.1"/>'
    tool = f'<body name="t" pos="0 0 -0.05" gravcomp="0.7">{ball}<site name="tip"/></body>'
    wrist = wrist_of(mjcf(tool, joint='armature="3e-4" stiffness="0.02"'))
    handles = NominalModel(wrist, TIMING, interpreted_engine()).handles
    data = mujoco.MjData(wrist.model)
    for q, w in states(5, seed=6):
        data.qpos[:], data.qvel[:] = q, w
        data.ctrl[:] = 0.1, -0.2, 0.3
        mujoco.mj_forward(wrist.model, data)
        H, N = np.empty((3, 3)), np.empty(3)
        evaluate(handles, tuple(q), tuple(w), H, N)
        np.testing.assert_allclose(H @ data.qacc + N, data.ctrl, atol=1e-12)
        np.testing.assert_allclose(H - RigidBody.of(wrist).inertia, 3e-4 * np.eye(3), atol=1e-15)


@pytest.mark.parametrize("reference", [Lissajous(), Sinusoid(frequency=1.0)], ids=repr)
def test_peak_torque_is_the_largest_component_that_the_rigid_body_needs(nominal, engine, reference):
    body = RigidBody.of(nominal)
    needed = [
        body.inertia @ m["acceleration"] + body.bias(m["attitude"], m["rate"])
        for m in reference.motion(np.arange(10_000) * 1e-3)[::1]
    ]
    model = NominalModel(nominal, TIMING, engine)
    assert model.peak_torque(reference, TIMING) == pytest.approx(np.abs(needed).max(), rel=1e-12)
    some = np.array([0.0, 3.21, 9.999])
    torque = model.torque(reference, some)
    np.testing.assert_allclose(torque, [needed[0], needed[3210], needed[9999]], atol=1e-14)


TWINS = {
    "shipped": Wrist.load(),
    "asymmetric": WRISTS["asymmetric"],
    "with contacts": wrist_of(
        mjcf('<geom type="sphere" size=".12" mass=".1" contype="1"/><site name="tip" pos="0 0 .1"/>').replace(
            "<worldbody>", '<worldbody><geom type="plane" size="1 1 1" pos="0 0 0.2" conaffinity="1"/>'
        )
    ),
    "with a cone": wrist_of(mjcf(joint='range="0 0.2" limited="true"')),
    "with dry friction": wrist_of(mjcf(joint='frictionloss="0.01"')),
    "with a static stand": wrist_of(
        mjcf().replace("<worldbody>", '<worldbody><body name="stand"><geom type="box" size=".1 .1 .1"/></body>')
    ),
    "with a fixed inertia": wrist_of(
        mjcf(
            '<body><inertial pos="0 .01 -.05" mass=".1" diaginertia="1e-4 2e-4 2.5e-4" euler=".3 .2 .1"/>'
            '<site name="tip"/></body>'
        )
    ),
}


@pytest.mark.parametrize("wrist", TWINS.values(), ids=TWINS)
def test_the_physics_twin_moves_as_the_full_model(wrist):
    """Accelerations at random states, torques and disturbances, although visual geometry and stages are left out."""
    full, twin = wrist.model, physics_model(wrist, 5e-4)
    assert twin.opt.timestep == 5e-4
    for q, w in states(10, seed=7):
        acceleration = []
        for model in (full, twin):
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:] = q, w
            data.ctrl[:], data.qfrc_applied[:] = (0.1, -0.2, 0.3), (0.02, 0.01, -0.05)
            mujoco.mj_forward(model, data)
            acceleration.append(data.qacc.copy())
        np.testing.assert_allclose(
            acceleration[1], acceleration[0], rtol=1e-9, atol=1e-9 * np.abs(acceleration[0]).max()
        )


def test_the_physics_twin_leaves_the_wrist_as_it_is(nominal):
    before = nominal.model.opt.timestep, nominal.model.ngeom, nominal.model.opt.disableflags
    twin = physics_model(nominal, 2e-4)
    assert (nominal.model.opt.timestep, nominal.model.ngeom, nominal.model.opt.disableflags) == before
    assert nominal.spec.option.timestep == before[0]
    assert twin.ngeom < nominal.model.ngeom


def test_a_state_that_went_bad_is_left_as_it_is(nominal, tmp_path, monkeypatch):
    """MuJoCo would put the wrist back to its start and go on as if nothing had happened."""
    monkeypatch.chdir(tmp_path)  # where it then writes its log
    model = physics_model(nominal, 1e-3)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (0.6, 0.8, 0.0, 0.0), (np.nan, 0.0, 0.0)
    mujoco.mj_step(model, data)
    assert data.warning.number.sum() > 0
    assert not np.isfinite(data.qvel).all()
    assert data.time > 0.0


def free_wrist(gravity):
    spec = mujoco.MjSpec.from_string(mjcf())
    spec.joints[0].damping = 0.0 * np.array(spec.joints[0].damping)
    spec.option.gravity = gravity
    return Wrist.of(spec)


@pytest.mark.parametrize("gravity", [np.zeros(3), GRAVITY], ids=["weightless", "heavy"])
def test_a_free_wrist_conserves_what_a_free_rigid_body_does(gravity):
    """5 s of tumbling at 20 rad/s: energy always; angular momentum in the world without gravity."""
    wrist = free_wrist(gravity)
    body, model = RigidBody.of(wrist), physics_model(wrist, 1e-3)
    data = mujoco.MjData(model)
    data.qvel[:] = 20.0 * np.array([0.6, 0.48, 0.64])

    def conserved():
        turn = Rotation.from_quat(data.qpos, scalar_first=True)
        momentum = turn.apply(body.inertia @ data.qvel)
        kinetic = 0.5 * data.qvel @ body.inertia @ data.qvel
        return kinetic, kinetic - turn.apply(body.moment) @ gravity, momentum

    kinetic, energy, momentum = conserved()
    moved = 0.0
    for _ in range(5000):
        mujoco.mj_step(model, data)
        moved = max(moved, np.abs(data.qvel - 20.0 * np.array([0.6, 0.48, 0.64])).max())
    later = conserved()
    assert moved > 5.0  # it tumbles: this is no spin about a principal axis
    assert later[1] == pytest.approx(energy, abs=1e-9 * kinetic)
    if not gravity.any():
        assert later[0] == pytest.approx(kinetic, rel=1e-9)
        np.testing.assert_allclose(later[2], momentum, atol=1e-9 * np.linalg.norm(momentum))
    assert RigidBody.of(wrist).damping == 0.0
