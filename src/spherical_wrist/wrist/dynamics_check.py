"""Checks of a model's dynamics: features that the controller's model cannot have are refused or said in a warning.

The inertia matrix and the bias of the nominal model are functions of attitude and rate. So nothing with a state of its
own may act on the joint, and the motors must do as they are told. Constraints and contacts act on the plant alone; a
run says which did, for how long, and how much.
"""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from spherical_wrist.errors import ModelError, listed
from spherical_wrist.wrist.parts import OBJECT, name_of

OFF = mujoco.mjtDisableBit


def check_motors(model: mujoco.MjModel, motors: Sequence[int], name: str) -> None:
    """Check that the three motors act, without delay.

    Args:
        model: the whole model, compiled.
        motors: indices of the wrist's motors.
        name: name of the model in messages.

    Raises:
        ModelError: actuation or a motor is disabled, or a motor has a delay or a plugin.
    """
    if model.opt.disableflags & OFF.mjDSBL_ACTUATION:
        raise ModelError(
            f'model {name!r} disables all motors by <flag actuation="disable"/>: remove it, or write "enable"'
        )
    for motor in motors:
        who, group = name_of(model, OBJECT.mjOBJ_ACTUATOR, motor), int(model.actuator_group[motor])
        if 0 <= group < 31 and model.opt.disableactuator & (1 << group):
            raise ModelError(
                f"model {name!r} disables motor {who!r}: it is in group {group}, and actuatorgroupdisable of <option> "
                "has that group; remove it there"
            )
        if model.actuator_delay[motor] > 0.0:
            raise ModelError(
                f"model {name!r}: motor {who!r} has a delay of {model.actuator_delay[motor]:g} s, which the controller "
                "would not know of; remove delay= and give the experiment a lag or an age of the samples instead: "
                "--set actuation.lag=SECONDS, --set sensing.delay=SECONDS"
            )
        if model.actuator_plugin[motor] >= 0:
            raise ModelError(f"model {name!r}: motor {who!r} is driven by a plugin: write a plain <motor>")


def check_passive(model: mujoco.MjModel, name: str) -> None:
    """Check that the passive torques on the joint depend on attitude and rate alone.

    Args:
        model: the reduced model, compiled.
        name: name of the model in messages.

    Raises:
        ModelError: a spring yields.
    """
    if model.nplastic:
        raise ModelError(
            f"model {name!r} has a spring that yields (springyield), which the controller's model cannot follow: "
            "remove springyield from the wrist's joint, tendons and flexes"
        )


def remarks(whole: mujoco.MjModel, joint: int, motors: Sequence[int], model: mujoco.MjModel) -> Iterator[str]:
    """Yield a sentence for everything in a model that a run treats in another way than MuJoCo would.

    Args:
        whole: the whole model, compiled.
        joint: index of the wrist's joint in it.
        motors: indices of the wrist's motors in it.
        model: the reduced model, compiled.
    """
    held = [_joint(whole, j) for j in range(whole.njnt) if j != joint]
    if held:
        yield f"{_counted('joint', held)} held at the initial position: only {_ball(whole, joint)} moves"
    dropped = [name_of(whole, OBJECT.mjOBJ_ACTUATOR, a) for a in _acting(whole, joint) if a not in motors]
    if dropped:
        yield f"{_counted('actuator', dropped)} left out: only the three motors act on {_ball(whole, joint)}"
    if whole.jnt_actfrcrange[joint].any() and not whole.jnt_actfrclimited[joint]:
        yield f"MuJoCo ignores actuatorfrcrange of {_ball(whole, joint)}: give each motor a forcerange"
    if not model.opt.disableflags & OFF.mjDSBL_FRICTIONLOSS:
        if loss := float(np.max(model.dof_frictionloss)):
            yield f"dry friction of the joint (frictionloss {loss:g} N·m) acts on the plant; the controller knows none"
        if loss := float(np.max(model.tendon_frictionloss, initial=0.0)):
            yield f"dry friction of tendons (frictionloss {loss:g} N) acts on the plant; the controller knows none"


def _ball(model: mujoco.MjModel, joint: int) -> str:
    return f"ball joint {name_of(model, OBJECT.mjOBJ_JOINT, joint)!r}"


def _joint(model: mujoco.MjModel, joint: int) -> str:
    """Name a joint; one without a name by its body."""
    named = mujoco.mj_id2name(model, OBJECT.mjOBJ_JOINT, joint)
    return named or f"of body {name_of(model, OBJECT.mjOBJ_BODY, int(model.jnt_bodyid[joint]))!r}"


def _counted(kind: str, names: Sequence[str]) -> str:
    return f"{kind} {names[0]} is" if len(names) == 1 else f"{kind}s {listed(names)} are"


def _acting(model: mujoco.MjModel, joint: int) -> list[int]:
    """List the actuators that act on a joint although their control is zero: servos, dampers, armatures, muscles."""
    data = mujoco.MjData(model)
    q, v = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
    data.qpos[q : q + 4] = 0.8, 0.36, 0.48, 0.0  # an attitude at which nothing happens to be aligned
    mujoco.mj_fwdPosition(model, data)
    moment = np.zeros((model.nout, model.nv))
    mujoco.mju_sparse2dense(moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    found = []
    for actuator in range(model.nactuator):
        first = model.actuator_outadr[actuator]
        rows = moment[first : first + model.actuator_outnum[actuator], v : v + 3]
        passive = (
            model.actuator_gaintype[actuator] != mujoco.mjtGain.mjGAIN_FIXED
            or model.actuator_biastype[actuator] != mujoco.mjtBias.mjBIAS_NONE
            or model.actuator_plugin[actuator] >= 0
            or model.actuator_armature[actuator] > 0.0
            or model.actuator_damping[actuator] > 0.0
            or model.actuator_dampingpoly[actuator].any()
        )
        if passive and rows.any():
            found.append(actuator)
    return found
