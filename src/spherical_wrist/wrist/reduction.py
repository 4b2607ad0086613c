"""Reduction of a larger model to its wrist: all other joints are held at their initial positions.

In MuJoCo's initial configuration ``qpos0`` the displacement of every joint is zero by definition, so a body stays there
when its joint is removed. With q̈ = q̇ = 0 of all others, the wrist's own equation of motion is the ball joint's rows and
columns of the whole model's: the same H and N.
"""

from collections.abc import Collection, Iterator

import mujoco
import numpy as np

JOINT, WRAP, EQUALITY = mujoco.mjtJoint, mujoco.mjtWrap, mujoco.mjtEq


def reduced(spec: mujoco.MjSpec, model: mujoco.MjModel, joint: int, motors: Collection[int]) -> mujoco.MjSpec:
    """Copy a description with one joint and its motors only.

    All other joints are held, and other actuators, sensors and keyframes are removed. Pairs of bodies that MuJoCo does
    not check for contacts, because one carries the other, stay unchecked.

    Args:
        spec: description of the whole model.
        model: the same, compiled.
        joint: index of the joint that stays.
        motors: indices of the actuators that stay.
    """
    spec = spec.copy()
    kept = spec.joints[joint]
    for body_1, body_2 in list(_carried(model)):
        first, second = (_named(spec.bodies[body]) for body in (body_1, body_2))
        spec.add_exclude(bodyname1=first, bodyname2=second)
    for key in list(spec.keys):
        spec.delete(key)
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    for index, actuator in enumerate(list(spec.actuators)):
        if index not in motors:
            spec.delete(actuator)
    for equality in list(spec.equalities):
        if equality.type in (EQUALITY.mjEQ_JOINT, EQUALITY.mjEQ_TENDON):
            spec.delete(equality)
    for tendon in list(spec.tendons):
        if any(part.type == WRAP.mjWRAP_JOINT for part in tendon.path):
            spec.delete(tendon)
    for other in list(spec.joints):
        if other.id != kept.id:
            spec.delete(other)
    return spec


def _carried(model: mujoco.MjModel) -> Iterator[tuple[int, int]]:
    """Yield pairs of bodies, a moving one and one that it carries on a joint.

    MuJoCo does not check them for contacts, but would once the first is held, because it then counts as the world.
    """
    weld = model.body_weldid
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        return
    for child in np.unique(weld[weld > 0]):
        parent = weld[model.body_parentid[child]]
        if parent > 0:
            for body_1 in np.flatnonzero(weld == parent):
                yield from ((int(body_1), int(body_2)) for body_2 in np.flatnonzero(weld == child))


def _named(body: mujoco.MjsBody) -> str:
    body.name = body.name or f"body {body.id}"
    return str(body.name)
