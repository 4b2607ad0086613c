"""libmujoco as the loop uses it: its C functions by name, and models tuned for the loop."""

import mujoco

from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.libmujoco import warnings_kept_in_data
from spherical_wrist.wrist import REFUSALS, Wrist

ARGUMENTS = {
    "mj_step": 2,
    "mj_kinematics": 2,
    "mj_comPos": 2,
    "mj_crb": 2,
    "mj_comVel": 2,
    "mj_passive": 2,
    "mj_fullM": 3,
    "mj_rne": 4,
}
"""C functions that the compiled loop calls, with their number of arguments, all of them passed as machine words."""


def physics_model(wrist: Wrist, timestep: float) -> mujoco.MjModel:
    """The wrist as the loop steps it: the same dynamics, without what the loop does not read.

    Purely visual geometry is left out, welded bodies are one body, sensors are not evaluated, and the stages for
    contacts and constraints are off where the model has nothing for them. A state that went bad is left as it is
    instead of being reset silently.

    Args:
        wrist: plant or nominal wrist.
        timestep: physics step [s].

    Raises:
        ModelError: MuJoCo refuses the model, or cannot step it.
    """
    model = loop_model(wrist.spec.copy(), timestep)
    try_step(model, mujoco.MjData(model))
    return model


@warnings_kept_in_data()
def loop_model(spec: mujoco.MjSpec, timestep: float) -> mujoco.MjModel:
    """See :func:`physics_model`; the description is changed, and the model not tried yet.

    Raises:
        ModelError: MuJoCo refuses the model.
    """
    spec.compiler.discardvisual = True
    spec.compiler.fusestatic = True
    spec.option.timestep = timestep
    try:
        model = spec.compile()
    except REFUSALS:  # inertia that must come from geometry, all of it visual
        spec.compiler.discardvisual = False
        model = _compiled(spec)
    switch_off(model)
    return model


def switch_off(model: mujoco.MjModel) -> None:
    """Disables the stages of a step that a model has nothing for, and the silent reset of a state that went bad."""
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= off.mjDSBL_SENSOR | off.mjDSBL_AUTORESET
    touching = bool(model.npair or any(model.geom_contype | model.geom_conaffinity))
    if not touching:
        model.opt.disableflags |= off.mjDSBL_CONTACT
    if not (touching or model.neq or model.ntendon or any(model.jnt_limited) or any(model.dof_frictionloss > 0.0)):
        model.opt.disableflags |= off.mjDSBL_CONSTRAINT


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    try:
        return spec.compile()
    except REFUSALS as error:
        raise ModelError(f"MuJoCo cannot compile the wrist: {one_line(error)}") from None


@warnings_kept_in_data()
def try_step(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Steps a model once through the bindings, where an error raises: inside compiled code it would end the process.

    Raises:
        ModelError: MuJoCo cannot step it.
    """
    try:
        mujoco.mj_step(model, data)
    except mujoco.FatalError as error:
        raise ModelError(f"MuJoCo cannot step the wrist: {one_line(error)}") from None
