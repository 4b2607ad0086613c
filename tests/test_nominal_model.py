"""The controller's model against MuJoCo's forward dynamics, of random wrists with everything that acts on a joint."""

import mujoco
import numpy as np
import pytest

from random_wrists import FEATURES, random_mjcf
from rigs import MOTORS, TOOL, mjcf, states, wrist_of
from sampling import count
from spherical_wrist import Experiment, simulate
from spherical_wrist.dynamics import evaluate
from spherical_wrist.errors import ModelError
from spherical_wrist.experiment.perturbation import Perturbation
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import interpreted_engine
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import PlantModel, perturbed
from spherical_wrist.wrist import Names, Wrist

OFF = mujoco.mjtDisableBit
TIMING = Timing.of(10.0, 1e-3, 1e-3)
SEEDS = range(count(2 * len(FEATURES), 200))


class Oracle:
    """MuJoCo's forward dynamics of a whole MJCF, at states of its ball joint."""

    def __init__(self, text: str, *, constrained: bool = False) -> None:
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.iterations, self.model.opt.tolerance = 200, 0.0
        if not constrained:
            self.model.opt.disableflags |= OFF.mjDSBL_CONSTRAINT | OFF.mjDSBL_CONTACT
        joint = self.model.joint("w")
        self.q, self.v = (slice(int(a[0]), int(a[0]) + n) for a, n in ((joint.qposadr, 4), (joint.dofadr, 3)))

    def at(self, attitude, rate, controls):
        """Data at a state, all other joints at rest."""
        data = mujoco.MjData(self.model)
        data.qpos[self.q], data.qvel[self.v], data.ctrl[:3] = attitude, rate, controls
        mujoco.mj_forward(self.model, data)
        return data

    def needed(self, data, motors):
        """H and N of the ball's rows: M q̈ = τ + torques that no control makes, with all other joints held."""
        M = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, M)
        others = data.qfrc_passive + data.qfrc_actuator - data.qfrc_bias
        return M[self.v, self.v], motors - others[self.v]


def believed(wrist):
    """H and N of the controller, as a function of the state."""
    model = NominalModel(wrist, TIMING, interpreted_engine())

    def evaluated(attitude, rate):
        H, N = np.empty((3, 3)), np.empty(3)
        evaluate(model.handles, tuple(attitude), tuple(rate), H, N)
        return H, N

    return evaluated


def close(actual, expected, size):
    """To 1e-9 of the largest torque."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-9 * np.abs(size).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_the_controllers_model_is_what_mujocos_dynamics_need(seed):
    """H q̈ + N is the motors' torque; where constraints and sticky contacts act, theirs is all that is missing."""
    text, _ = random_mjcf(seed)
    wrist, free, full = wrist_of(text), Oracle(text), Oracle(text, constrained=True)
    model, plant = believed(wrist), physics_model(wrist, 1e-3)
    for attitude, rate in states(3, seed):
        controls = np.random.default_rng(seed).normal(0.0, 0.2, 3)
        motors, (H, N) = wrist.motors @ controls, model(attitude, rate)
        data = free.at(attitude, rate, controls)
        mass, rest = free.needed(data, motors)
        close(H, mass, mass)
        close(N, rest, [*N, *motors])
        if free.model.nv > 3:
            continue  # other joints, which would not stay at rest
        close(H @ data.qacc + N, motors, [*N, *motors])
        data = full.at(attitude, rate, controls)
        missing = data.qfrc_constraint + data.qfrc_adhesion
        close(H @ data.qacc + N, motors + missing, [*N, *motors, *missing])
        stepped = mujoco.MjData(plant)
        stepped.qpos[:], stepped.qvel[:], stepped.ctrl[:] = attitude, rate, controls
        plant.opt.iterations, plant.opt.tolerance = 200, 0.0
        mujoco.mj_forward(plant, stepped)
        close(stepped.qacc, data.qacc, data.qacc)


@pytest.mark.parametrize("feature", FEATURES)
def test_every_feature_acts_on_some_of_the_wrists(feature):
    """Without it the dynamics are others: no feature is a name only."""
    seeds = [seed for seed in SEEDS if feature in random_mjcf(seed)[1]]
    controls, (attitude, rate) = np.array([0.1, -0.2, 0.3]), states(1, seed=8)[0]
    for seed in seeds:
        found = []
        for text in (random_mjcf(seed)[0], random_mjcf(seed, without=feature)[0]):
            oracle = Oracle(text, constrained=True)
            data = oracle.at(attitude, rate, controls)
            mass, rest = oracle.needed(data, np.zeros(3))
            found.append(np.vstack([mass, rest, data.qfrc_constraint[oracle.v]]))
        if np.abs(found[1] - found[0]).max() > 1e-6:
            return
    pytest.fail(f"it changes none of {len(seeds)} wrists")


COMPENSATED = [
    wrist_of(mjcf(TOOL.replace("<body", '<body gravcomp="0.8"'), compiler='autolimits="true"')),
    wrist_of(mjcf(joint='actuatorgravcomp="true"').replace('name="rotor"', 'name="rotor" gravcomp="1.1"')),
    wrist_of(mjcf().replace('name="rotor"', 'name="rotor" gravcomp="1"').replace("<option", '<option density="900"')),
]


def required(model, attitude, rate):
    """The torque for no acceleration."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = attitude, rate
    mujoco.mj_forward(model, data)
    return data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator


@pytest.mark.parametrize(
    "change",
    [Perturbation(mass_scale=1.5), Perturbation(com_shift=(0.01, 0.0, -0.004)), Perturbation(payload=0.05),
     Perturbation(0.7, (0.002, 0.003, 0.0), 0.02, 0.01, 1e-3)],
    ids=["mass", "centre", "payload", "all"],
)  # fmt: skip
@pytest.mark.parametrize("nominal", COMPENSATED, ids=["passive", "by actuators", "in a fluid"])
def test_gravity_compensation_of_the_plant_is_that_of_the_nominal_wrist(nominal, change):
    """It is the same torque at every attitude, however the plant's masses differ."""
    bare = nominal.spec.copy()
    for body in bare.bodies[1:]:
        body.gravcomp = 0.0
    uncompensated = Wrist.of(bare)
    model = PlantModel(nominal, 1e-3)
    model.perturb(change)
    for attitude, rate in states(4, seed=9):
        lift = required(uncompensated.model, attitude, rate) - required(nominal.model, attitude, rate)
        heavy = required(perturbed(uncompensated, change).model, attitude, rate)
        for plant in (perturbed(nominal, change).model, model.model):
            close(required(plant, attitude, rate), heavy - lift, heavy)


@pytest.mark.parametrize("shape", ["", 'fluidshape="ellipsoid"'], ids=["box of inertia", "ellipsoid"])
@pytest.mark.parametrize("change", [Perturbation(mass_scale=1.5), Perturbation(payload=0.05)], ids=["mass", "payload"])
def test_masses_change_no_drag(change, shape):
    """MuJoCo takes the size of a body from its inertia, but a payload is a point: to MuJoCo, 0.3 µm large."""
    drag = []
    for option in ("", 'density="1000" viscosity="0.1"'):
        nominal = wrist_of(mjcf(TOOL.replace("<geom", f"<geom {shape}")).replace("<option", f"<option {option}"))
        model = PlantModel(nominal, 1e-3)
        model.perturb(change)
        plants = (nominal.model, perturbed(nominal, change).model, model.model)
        drag.append([[required(plant, *state) for state in states(4, seed=9)] for plant in plants])
    before, *after = np.subtract(drag[1], drag[0])
    assert np.abs(before).max() > 1e-3
    for found in after:
        np.testing.assert_allclose(found, before, rtol=0.0, atol=1e-5 * np.abs(before).max())


@pytest.mark.parametrize(
    ("flag", "name"), [("frictionloss", "friction"), ("constraint", "friction"), ("damper", "damping")]
)
def test_a_perturbation_that_the_model_switches_off_is_refused(flag, name):
    nominal = wrist_of(mjcf().replace("<default>", f'<option><flag {flag}="disable"/></option><default>'))
    change = Perturbation(**{name: 0.01})
    for refused in (lambda: perturbed(nominal, change), lambda: PlantModel(nominal, 1e-3).perturb(change)):
        with pytest.raises(ModelError, match=f'{name} = 0.01 would do nothing: the model has <flag {flag}="disable"/>'):
            refused()
    PlantModel(nominal, 1e-3).perturb(Perturbation(mass_scale=1.1))


PID = '<plugin name="pid" joint="w" plugin="mujoco.pid" gear="1 0 0"><config key="kp" value="1"/></plugin>'
OTHERS = MOTORS[MOTORS.index(">") + 1 :]
SPRINGY = '<site name="anchor" pos="0.03 0 0.33"/><body name="rotor"'
REFUSED = {
    "group": (
        mjcf().replace("<option", '<option actuatorgroupdisable="0 4"'),
        "disables motor '<0>': it is in group 0, and actuatorgroupdisable",
    ),
    "one of another group": (
        mjcf(motors=MOTORS.replace("<motor", '<motor name="spin" group="3"', 1)).replace(
            "<option", '<option actuatorgroupdisable="3"'
        ),
        "disables motor 'spin': it is in group 3",
    ),
    "flag": (
        mjcf().replace("<default>", '<option><flag actuation="disable"/></option><default>'),
        'disables all motors by <flag actuation="disable"/>: remove it',
    ),
    "delay": (
        mjcf(motors=MOTORS.replace("<motor", '<motor delay="0.002" nsample="4"')),
        "motor '<0>' has a delay of 0.002 s.* --set actuation.lag=SECONDS, --set sensing.delay=SECONDS",
    ),
    "plugin": (
        mjcf(motors=OTHERS + PID).replace("<mujoco>", '<mujoco><extension><plugin plugin="mujoco.pid"/></extension>'),
        "motor 'pid' is driven by a plugin: write a plain <motor>",
    ),
    "yielding joint": (mjcf(joint='stiffness="1" springyield="0.1"'), "has a spring that yields"),
    "yielding tendon": (
        mjcf(
            more='<tendon><spatial stiffness="3" springyield="0.01"><site site="anchor"/><site site="tip"/></spatial>'
            "</tendon>"
        ).replace('<body name="rotor"', SPRINGY),
        "has a spring that yields",
    ),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_what_the_controller_cannot_know_is_refused(text, message):
    with pytest.raises(ModelError, match=message) as refused:
        wrist_of(text)
    assert "\n" not in str(refused.value)


HELD = '<joint name="{}" type="hinge"/>'
REMARKS = {
    "one hinge": (TOOL.replace("<geom", HELD.format("grip") + "<geom"), "joint grip is held at the initial position"),
    "one without a name": (
        TOOL.replace("<geom", '<joint type="hinge"/><geom'), "joint of body 'tool' is held at the initial position",
    ),
    "nine hinges": (
        TOOL.replace("</body>", "".join(f'<body>{HELD.format(f"finger_{i}")}<geom size="0.01" mass="0.1"/></body>'
                                        for i in range(9)) + "</body>"),
        "joints finger_0, finger_1, finger_2, finger_3, finger_4 and 4 more are held",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "message"), REMARKS.values(), ids=REMARKS)
def test_joints_that_are_held_are_said(body, message):
    [warning] = wrist_of(mjcf(body)).warnings
    assert warning.startswith(message)
    assert warning.endswith("only ball joint 'w' moves")


@pytest.mark.parametrize(
    ("actuator", "said"),
    [
        ('<position name="servo" joint="w" gear="0 0 1" kp="1"/>', True),
        ('<damper name="brake" joint="w" gear="0 1 0" kv="1" ctrlrange="0 1"/>', True),
        ('<motor name="heavy" joint="w" gear="1 0 0" armature="1e-4"/>', True),
        ('<general name="rope" tendon="cable" biastype="affine" biasprm="1 0 0"/>', True),
        ('<motor name="spare" tendon="cable"/>', False),
    ],
    ids=["servo", "damper", "inertia", "rope", "spare"],
)
def test_actuators_that_would_act_without_a_control_are_said_to_be_left_out(actuator, said):
    cable = '<tendon><spatial name="cable"><site site="anchor"/><site site="tip"/></spatial></tendon>'
    motors = "".join(f'<motor name="{axis}" joint="w" gear="{gear}"/>' for axis, gear in
                     {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}.items())  # fmt: skip
    text = mjcf(motors=motors + actuator, more=cable).replace('<body name="rotor"', SPRINGY)
    warnings = wrist_of(text, Names(motors=("x", "y", "z"))).warnings
    assert [warning.split("; ")[0] for warning in warnings if "left out" in warning] == [
        f"actuator {actuator.split(chr(34))[1]} is left out: only the three motors act on ball joint 'w'"
    ] * said


def test_friction_and_limits_that_only_the_plant_knows_of_are_said():
    text = mjcf(joint='frictionloss="0.01" actuatorfrclimited="true" actuatorfrcrange="-1 1"')
    assert wrist_of(text).warnings == (
        "MuJoCo ignores actuatorfrcrange of ball joint 'w': give each motor a forcerange",
        "dry friction of the joint (frictionloss 0.01 N·m) acts on the plant; the controller knows none",
    )
    off = text.replace("<default>", '<option><flag frictionloss="disable"/></option><default>')
    assert len(wrist_of(off).warnings) == 1
    assert not wrist_of(mjcf()).warnings


def test_a_wrist_that_mujoco_would_let_sleep_moves():
    asleep = mjcf().replace('name="rotor"', 'name="rotor" sleep="init"')
    wrist = wrist_of(asleep.replace("<default>", '<option><flag sleep="enable"/></option><default>'))
    model = PlantModel(wrist, 1e-3).model
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.01
    for _ in range(10):
        mujoco.mj_step(model, data)
    awake = physics_model(wrist_of(mjcf()), 1e-3)
    other = mujoco.MjData(awake)
    other.ctrl[:] = 0.01
    for _ in range(10):
        mujoco.mj_step(awake, other)
    np.testing.assert_array_equal(data.qvel, other.qvel)
    assert np.abs(data.qvel).min() > 1e-3


TRACKED = {
    "cable": mjcf(
        more='<tendon><spatial stiffness="20" damping="0.1" springlength="0.01" armature="0.01">'
        '<site site="anchor"/><site site="tip"/></spatial></tendon>'
    ).replace('<body name="rotor"', SPRINGY),
    "lifted by its motors": mjcf(joint='actuatorgravcomp="true"').replace('"rotor"', '"rotor" gravcomp="1"'),
    "inertia of its motors": mjcf(motors=MOTORS.replace("<motor", '<motor armature="1e-3" damping="1e-3"')),
}


@pytest.mark.parametrize("text", TRACKED.values(), ids=TRACKED)
def test_a_law_with_a_perfect_model_tracks(text, tmp_path):
    (tmp_path / "wrist.xml").write_text(text)
    perfect = {"mass_scale": 1.0, "disturbance": {"level": 0.0}}
    run = simulate(Experiment(model=tmp_path / "wrist.xml", law="computed_torque", duration=1.0, **perfect))
    assert run.metrics.max_error_rad < 1e-5
