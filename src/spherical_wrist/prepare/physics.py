"""MuJoCo models for the loop, without unused stages."""

import mujoco

from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.wrist import REFUSALS, Wrist


def physics_model(wrist: Wrist, timestep: float) -> mujoco.MjModel:
    """Compile a wrist for the loop: the same dynamics, without unused work.

    Visual geometry is left out, welded bodies are merged unless something acts on one of them, sensors are not
    evaluated, and the stages for contacts and constraints are disabled if the model has none. An invalid state is kept:
    MuJoCo's automatic reset is disabled.

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
    """Compile a description, which is changed, as :func:`physics_model` does, but without the trial step.

    Raises:
        ModelError: MuJoCo refuses the model.
    """
    spec.compiler.discardvisual = True
    spec.compiler.fusestatic = not _acts_on_bodies(spec)
    spec.option.timestep = timestep
    try:
        model = spec.compile()
    except REFUSALS:  # inertia may have to come from visual geometry
        spec.compiler.discardvisual = False
        model = _compiled(spec)
    disable_unused_stages(model)
    return model


def _acts_on_bodies(spec: mujoco.MjSpec) -> bool:
    """Return True if something acts on single bodies, which then must not be merged with others.

    Gravity compensation and drag depend on the mass of their body, and MuJoCo makes contacts and equality constraints
    as soft as it suggests.
    """
    option = spec.option
    touching = any(geom.contype or geom.conaffinity for geom in spec.geoms) or spec.pairs or spec.flexes
    lifted = any(body.gravcomp for body in spec.bodies)
    return bool(touching or lifted or spec.equalities or option.density or option.viscosity)


def disable_unused_stages(model: mujoco.MjModel) -> None:
    """Disable the stages of a step that a model does not need, and the automatic reset of an invalid state.

    Sleep is disabled too: a wrist that MuJoCo lets sleep would not move, whatever its motors do.
    """
    off, on = mujoco.mjtDisableBit, mujoco.mjtEnableBit
    model.opt.enableflags &= ~(on.mjENBL_SLEEP | on.mjENBL_ENERGY | on.mjENBL_FWDINV)
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
    """Step a model once through the Python bindings, which raise errors that would end the process in compiled code.

    Raises:
        ModelError: MuJoCo cannot step it.
    """
    try:
        mujoco.mj_step(model, data)
    except mujoco.FatalError as error:
        raise ModelError(f"MuJoCo cannot step the wrist: {one_line(error)}") from None
