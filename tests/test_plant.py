"""A perturbation must change the plant's dynamics by just what physics says, and the nominal model not at all."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import GRAVITY, RigidBody, mjcf, states, wrist_of
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import Perturbation, perturbed
from spherical_wrist.wrist import Wrist

FIXED = '<inertial pos="0.01 0 0" mass="0.1" diaginertia="1e-4 2e-4 2.5e-4" euler="0.3 0.2 0.1"/>'
WRISTS = {
    "shipped": Wrist.load(),
    "asymmetric": wrist_of(mjcf()),
    "inertia given": wrist_of(
        mjcf(f'<body pos="0 0 -.05" euler=".1 .2 .3">{FIXED}<site name="tip" pos="0 .01 -.05"/></body>')
    ),
    "massless tip": wrist_of(mjcf('<body pos="0 0.02 -0.1" euler="1 0 0"><site name="tip"/></body>')),
    "tip in a frame": wrist_of(
        mjcf('<body pos="0 0 -.05"><geom type="sphere" size=".01" mass=".1"/>'
             '<frame pos="0.01 0 -0.03" euler="0.2 0 0"><site name="tip" pos="0 0 -0.05"/></frame></body>')
    ),
    "bounded masses": wrist_of(mjcf(compiler='boundmass="0.06" boundinertia="1e-5"')),
    "inertia from all geoms": wrist_of(mjcf(compiler='inertiafromgeom="true"')),
}  # fmt: skip
each_wrist = pytest.mark.parametrize("nominal", WRISTS.values(), ids=WRISTS)


def dynamics(wrist, attitude, rate):
    """MuJoCo's inertia matrix, bias and passive torque at a state."""
    data, H = mujoco.MjData(wrist.model), np.empty((3, 3))
    data.qpos[:], data.qvel[:] = attitude, rate
    mujoco.mj_forward(wrist.model, data)
    mujoco.mj_fullM(wrist.model, data, H)
    return H, data.qfrc_bias.copy(), data.qfrc_passive.copy()


def close(actual, expected, relative=1e-12):
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=relative * np.abs(expected).max())


def in_body(attitude, vector):
    return Rotation.from_quat(attitude, scalar_first=True).inv().apply(vector)


@each_wrist
def test_no_perturbation_is_no_change(nominal):
    plant = perturbed(nominal, Perturbation())
    for q, w in states(5):
        for before, after in zip(dynamics(nominal, q, w), dynamics(plant, q, w), strict=True):
            np.testing.assert_array_equal(before, after)
    assert np.array_equal(plant.lever, nominal.lever)
    assert np.array_equal(plant.motors, nominal.motors)


@pytest.mark.parametrize("scale", [0.5, 1.25, 3.0])
@each_wrist
def test_mass_scale_scales_inertia_and_bias_alone(nominal, scale):
    plant = perturbed(nominal, Perturbation(mass_scale=scale))
    for q, w in states(5):
        (H, bias, passive), changed = dynamics(nominal, q, w), dynamics(plant, q, w)
        close(changed[0], scale * H)
        close(changed[1], scale * bias)
        np.testing.assert_array_equal(changed[2], passive)


@each_wrist
def test_payload_is_a_point_mass_at_the_tip(nominal):
    """H grows by m (r² 1 − r rᵀ), gravity by −r × m g, the Coriolis torque by ω × ΔH ω."""
    mass, r = 0.03, nominal.lever
    plant = perturbed(nominal, Perturbation(payload=mass))
    added = mass * (r @ r * np.eye(3) - np.outer(r, r))
    for q, w in states(5):
        (H, bias, passive), changed = dynamics(nominal, q, w), dynamics(plant, q, w)
        # a point cannot be compiled: the sphere that stands for it may have an inertia of 1e-11 kg m²
        np.testing.assert_allclose(changed[0], H + added, atol=1e-11)
        expected = bias + np.cross(w, added @ w) - np.cross(r, mass * in_body(q, GRAVITY))
        np.testing.assert_allclose(changed[1], expected, atol=1e-11 * (w @ w))
        np.testing.assert_array_equal(changed[2], passive)


def test_payload_of_the_shipped_wrist_in_numbers():
    """20 g at 115 mm below the ball: 2.645e-4 kg m² across, none about the tool, 22.6 mN m when horizontal."""
    nominal = WRISTS["shipped"]
    plant = perturbed(nominal, Perturbation(payload=0.02))
    horizontal = Rotation.from_rotvec([0.5 * np.pi, 0.0, 0.0]).as_quat(scalar_first=True)
    (H, bias, _), changed = (dynamics(wrist, horizontal, np.zeros(3)) for wrist in (nominal, plant))
    np.testing.assert_allclose(np.diag(changed[0] - H), [2.645e-4, 2.645e-4, 0.0], atol=1e-11)
    np.testing.assert_allclose(changed[1] - bias, [0.02 * 9.81 * 0.115, 0.0, 0.0], atol=1e-12)


def test_payload_and_mass_scale_together_do_not_scale_the_payload():
    nominal = WRISTS["asymmetric"]
    both = RigidBody.of(perturbed(nominal, Perturbation(mass_scale=2.0, payload=0.03)))
    alone = RigidBody.of(nominal)
    assert both.mass == pytest.approx(2.0 * alone.mass + 0.03, rel=1e-12)
    np.testing.assert_allclose(both.moment, 2.0 * alone.moment + 0.03 * nominal.lever, atol=1e-15)


@pytest.mark.parametrize("shift", [(0.002, 0.0, 0.0), (0.0, -0.003, 0.001)])
@each_wrist
def test_com_shift_moves_every_body_in_its_own_frame(nominal, shift):
    """By the parallel-axis theorem: Δ(m c) = Σ m_i s_i, ΔH = Σ m_i (…) s_i the shift in the body frame."""
    model, plant = nominal.model, perturbed(nominal, Perturbation(com_shift=shift))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    before = RigidBody.of(nominal)
    moment, inertia = before.moment.copy(), before.inertia.copy()
    for i in range(1, model.nbody):
        if model.body_weldid[i] == model.body_weldid[nominal.body]:
            s, c = data.xmat[i].reshape(3, 3) @ shift, data.xipos[i] - data.xanchor[0]
            moved = c + s
            moment += model.body_mass[i] * s
            inertia += model.body_mass[i] * (moved @ moved * np.eye(3) - np.outer(moved, moved))
            inertia -= model.body_mass[i] * (c @ c * np.eye(3) - np.outer(c, c))
    for q, w in states(5):
        H, bias, _ = dynamics(plant, q, w)
        close(H, inertia)
        close(bias, np.cross(w, inertia @ w) - np.cross(moment, in_body(q, GRAVITY)))
    assert np.abs(inertia - before.inertia).max() > 1e-3 * before.inertia.max()


def spin(plant, rate, steps, torque=(0.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0), timestep=1e-3):
    """Rates of the free plant after every step, and its last attitude."""
    model = physics_model(plant, timestep)
    data, rates = mujoco.MjData(model), [np.array(rate, float)]
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = attitude, rate, torque
    for _ in range(steps):
        mujoco.mj_step(model, data)
        rates.append(data.qvel.copy())
    return np.array(rates), data.qpos.copy()


@pytest.mark.parametrize("added", [0.0, 1e-4, 9e-4])
def test_damping_decays_a_spin_at_its_rate(added):
    """ω = ω₀ exp(−(D₀ + D) t / I) about the tool's axis, where gravity has no torque."""
    nominal = WRISTS["shipped"]
    plant = perturbed(nominal, Perturbation(damping=added))
    inertia = RigidBody.of(nominal).inertia[2, 2]
    rates, _ = spin(plant, (0.0, 0.0, 8.0), 1000)
    time = np.arange(1001) * 1e-3
    expected = 8.0 * np.exp(-(1e-4 + added) * time / inertia)
    np.testing.assert_allclose(rates[:, 2], expected, rtol=1e-8)


@each_wrist
def test_damping_adds_to_that_of_the_joint(nominal):
    plant = perturbed(nominal, Perturbation(damping=3e-3))
    for q, w in states(3):
        (H, bias, passive), changed = dynamics(nominal, q, w), dynamics(plant, q, w)
        np.testing.assert_array_equal(changed[0], H)
        np.testing.assert_array_equal(changed[1], bias)
        np.testing.assert_allclose(changed[2], passive - 3e-3 * w, rtol=1e-12)


def test_dry_friction_slows_a_spin_by_the_same_amount_every_second():
    """ω̇ = −F/I about the tool's axis while it turns fast, then it stops and stays."""
    nominal = WRISTS["shipped"]
    inertia, friction = RigidBody.of(nominal).inertia[2, 2], 2e-3
    plant = perturbed(nominal, Perturbation(friction=friction, damping=-1e-4))
    rates, _ = spin(plant, (0.0, 0.0, 10.0), 1000)
    slope = np.diff(rates[:500, 2]) / 1e-3
    np.testing.assert_allclose(slope, -friction / inertia, rtol=1e-6)
    stop = int(10.0 * inertia / friction * 1000)
    assert np.abs(rates[stop + 12 :]).max() < 1e-6


@pytest.mark.parametrize("timestep", [1e-4, 1e-3])
@pytest.mark.parametrize("load", [0.5, 0.9])
def test_dry_friction_sticks_but_for_a_creep_that_is_known(load, timestep):
    """Below its limit MuJoCo's constraint leaves ω̇ = (1 − d) a − d b ω of an acceleration a, b = 2 / (d · 2 ms).

    Its impedance d is that of the mean of the joint's inverse inertias. With d = 0.9999, MuJoCo's ceiling, the creep is
    10⁻⁷ s · τ/I: 3.6e-7 rad/s at 90 % of 1 mN·m, about any axis. A minute of that is a fraction of a law's error.
    """
    nominal = WRISTS["shipped"]
    inverse, friction = 1.0 / np.diag(RigidBody.of(nominal).inertia), 1e-3
    plant = perturbed(nominal, Perturbation(friction=friction, damping=-1e-4))
    rates, _ = spin(plant, np.zeros(3), 300, torque=(0.0, 0.0, load * friction), timestep=timestep)
    assert rates[-1, 2] == pytest.approx(1e-4 * 0.001 * inverse.mean() * load * friction, rel=1e-3)
    assert np.abs(rates).max() < 4e-7


@pytest.mark.parametrize("timestep", [2.5e-4, 1e-3, 5e-3])
def test_dry_friction_gives_way_to_what_is_above_it(timestep):
    """120 % of it moves the wrist with the excess, from the first step on."""
    nominal = WRISTS["shipped"]
    inertia, friction = RigidBody.of(nominal).inertia[2, 2], 5e-3
    plant = perturbed(nominal, Perturbation(friction=friction, damping=-1e-4))
    rates, _ = spin(plant, np.zeros(3), 100, torque=(0.0, 0.0, 1.2 * friction), timestep=timestep)
    np.testing.assert_allclose(rates[:, 2], 0.2 * friction / inertia * timestep * np.arange(101), rtol=1e-9, atol=1e-15)


def test_dry_friction_holds_the_tool_up_and_stops_it_within_milliseconds():
    """Tilted by 0.6 rad the tool stays where it is, about all axes; at half of the friction that takes, it swings."""
    nominal = WRISTS["shipped"]
    tilted = Rotation.from_rotvec([0.6, 0.0, 0.3]).as_quat(scalar_first=True)
    weight = np.abs(dynamics(nominal, tilted, np.zeros(3))[1]).max()
    moved = {}
    for factor in (1.1, 0.5):
        plant = perturbed(nominal, Perturbation(friction=factor * weight))
        _, reached = spin(plant, np.zeros(3), 1000, attitude=tilted)
        turned = Rotation.from_quat(tilted, scalar_first=True).inv() * Rotation.from_quat(reached, scalar_first=True)
        moved[factor] = turned.magnitude()
    assert moved[1.1] < 1e-5
    assert moved[0.5] > 0.2
    plant = perturbed(nominal, Perturbation(friction=5e-3, damping=-1e-4))
    rates, _ = spin(plant, (0.0, 0.0, 1.0), 100)
    stop = int(1.0 * RigidBody.of(nominal).inertia[2, 2] / 5e-3 * 1000)
    assert np.abs(rates[stop + 12 :]).max() < 1e-6


@pytest.mark.parametrize("integrator", ["mjINT_RK4", "mjINT_EULER", "mjINT_IMPLICITFAST"])
@pytest.mark.parametrize("mass_scale", [0.1, 1.0])
def test_hard_dry_friction_is_stable(mass_scale, integrator):
    """A load that swings within ±half of a large friction moves a light wrist by microradians, whatever integrates."""
    spec = WRISTS["shipped"].spec.copy()
    spec.option.integrator = getattr(mujoco.mjtIntegrator, integrator)
    plant = perturbed(Wrist.of(spec), Perturbation(mass_scale=mass_scale, friction=0.05))
    model = physics_model(plant, 1e-3)
    data = mujoco.MjData(model)
    for k in range(500):
        data.qfrc_applied[:] = 0.025 * np.sin(0.0314 * k + np.arange(3.0))
        mujoco.mj_step(model, data)
    assert data.warning.number.sum() == 0
    assert 2.0 * np.linalg.norm(data.qpos[1:]) < 2e-5
    assert np.abs(data.qvel).max() < 2e-4


def test_a_models_own_dry_friction_is_left_as_it_is():
    nominal = wrist_of(mjcf(joint='frictionloss="0.01" solreffriction="0.05 1" solimpfriction="0.8 0.9 0.001 0.5 2"'))
    plant = perturbed(nominal, Perturbation(mass_scale=1.1))
    np.testing.assert_array_equal(plant.model.dof_solref, nominal.model.dof_solref)
    np.testing.assert_array_equal(plant.model.dof_solimp, nominal.model.dof_solimp)


def test_dry_friction_adds_to_that_of_the_joint():
    nominal = wrist_of(mjcf(joint='frictionloss="0.01"'))
    plant = perturbed(nominal, Perturbation(friction=0.02))
    np.testing.assert_allclose(plant.model.dof_frictionloss, 0.03, rtol=1e-12)


def arrays(model):
    """Every array of a model, by name."""
    return {
        name: np.array(value)
        for name in dir(model)
        if not name.startswith("_") and isinstance(value := getattr(model, name), np.ndarray)
    }


@pytest.mark.parametrize(
    "change",
    [
        Perturbation(mass_scale=1.25),
        Perturbation(com_shift=(0.001, 0.002, 0.003)),
        Perturbation(payload=0.05),
        Perturbation(friction=0.01),
        Perturbation(damping=0.01),
        Perturbation(2.0, (0.001, 0.0, 0.0), 0.02, 0.001, 0.001),
    ],
    ids=lambda change: "+".join(name for name, was in Perturbation()._asdict().items() if getattr(change, name) != was),
)
def test_the_nominal_wrist_is_untouched_and_the_plant_is_not(change):
    nominal = Wrist.load()
    before, text = arrays(nominal.model), nominal.spec.to_xml()
    assert len(before) > 100
    plant = perturbed(nominal, change)
    after = arrays(nominal.model)
    assert all(np.array_equal(before[name], after[name], equal_nan=before[name].dtype.kind == "f") for name in before)
    assert nominal.spec.to_xml() == text
    assert np.array_equal(
        dynamics(Wrist.of(nominal.spec), (1, 0, 0, 0), (1, 2, 3))[1], dynamics(nominal, (1, 0, 0, 0), (1, 2, 3))[1]
    )
    moved = [spin(wrist, (1.0, 2.0, 3.0), 20)[0][-1] for wrist in (nominal, plant)]
    assert np.abs(moved[1] - moved[0]).max() > 1e-3


def test_a_compiler_that_fixes_the_total_mass_does_not_undo_the_mass_scale():
    """``settotalmass`` is deprecated, but a user's file may have it."""
    with pytest.warns(UserWarning, match="settotalmass"):
        nominal = wrist_of(mjcf(compiler='settotalmass="0.7"'))
    plant = perturbed(nominal, Perturbation(mass_scale=1.25))
    assert RigidBody.of(plant).mass == pytest.approx(1.25 * 0.7, rel=1e-12)
