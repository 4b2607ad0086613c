"""Joint, motors and tip site of a wrist in an MJCF model, found by name or as the only candidates."""

from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ModelError, UnknownNameError
from spherical_wrist.wrist.mjcf import ADVICE

Array = npt.NDArray[np.float64]
JOINT, OBJECT, TRANSMISSION = mujoco.mjtJoint, mujoco.mjtObj, mujoco.mjtTrn

AXES = 3


class Names(NamedTuple):
    """Names in an MJCF file, for models with several candidates.

    Attributes:
        joint: the ball joint; needed if the model has several.
        motors: the three motors on it; needed if it has more.
        tip: the site of the tool tip; needed if none of several is called ``tip``.
    """

    joint: str | None = None
    motors: tuple[str, str, str] | None = None
    tip: str | None = None


UNNAMED = Names()
"""No names: the model has one candidate for each part."""


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return the name of an element, or its number in angle brackets if it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"<{index}>"


def ball_joint(model: mujoco.MjModel, wanted: str | None, name: str) -> int:
    """Find the index of the wrist's joint.

    Raises:
        ModelError: the model has no ball joint, several and none is named, or the named one is none of them.
    """
    kinds = [JOINT(kind).name.removeprefix("mjJNT_").lower() for kind in model.jnt_type]
    joints = {name_of(model, OBJECT.mjOBJ_JOINT, j): kind for j, kind in enumerate(kinds)}
    balls = [joint for joint, kind in joints.items() if kind == "ball"]
    if not balls:
        listed = ", ".join(f"{joint} ({kind})" for joint, kind in joints.items()) or "none"
        raise ModelError(f'model {name!r} has no ball joint (its joints: {listed}): a wrist has <joint type="ball"/>')
    if wanted is None and len(balls) > 1:
        raise ModelError(f"model {name!r} has ball joints {', '.join(balls)}: name the wrist's: --joint NAME")
    chosen = balls[0] if wanted is None else wanted
    if chosen not in joints:
        _unknown("joint", chosen, balls, name)
    if joints[chosen] != "ball":
        raise ModelError(f"model {name!r}: joint {chosen!r} is a {joints[chosen]}; its ball joints: {', '.join(balls)}")
    return list(joints).index(chosen)


def torque_motors(model: mujoco.MjModel, joint: int, wanted: Sequence[str] | None, name: str) -> list[int]:
    """Find the indices of the three motors.

    Raises:
        ModelError: not exactly three plain torque motors act on the joint and none are named, or the named ones are
            no such motors.
    """
    everyone = range(model.nactuator)  # fewer than controls, of which an actuator may have several
    actuators = [name_of(model, OBJECT.mjOBJ_ACTUATOR, a) for a in everyone]
    faults = [_fault(model, a, joint) for a in everyone]
    plain = [a for a in everyone if not faults[a]]
    if wanted is None:
        if len(plain) == AXES:
            return plain
        where = name_of(model, OBJECT.mjOBJ_JOINT, joint)
        if len(plain) > AXES:
            found = ", ".join(actuators[a] for a in plain)
            raise ModelError(
                f"model {name!r} has {len(plain)} torque motors on joint {where!r} ({found}): "
                "name the wrist's three: --motors A,B,C"
            )
        others = "; ".join(f"{actuators[a]} {faults[a]}" for a in everyone if faults[a])
        raise ModelError(
            f"model {name!r} has {len(plain)} of three torque motors that joint {where!r} needs"
            + (f" ({others})" if others else "")
            + f'; add <motor joint="{where}" gear="1 0 0"/> and the like for y and z'
        )
    if len(wanted) != AXES or len(set(wanted)) != AXES:
        raise ModelError(f"model {name!r}: motors {', '.join(wanted)}: three different ones are needed")
    for each in wanted:
        if each not in actuators:
            _unknown("motor", each, actuators, name)
        if fault := faults[actuators.index(each)]:
            raise ModelError(f"model {name!r}: actuator {each!r} {fault}: three torque motors on the joint are needed")
    return sorted(actuators.index(each) for each in wanted)


def _fault(model: mujoco.MjModel, actuator: int, joint: int) -> str:
    """Say why an actuator is no torque motor on the joint, in words that follow its name; empty if it is one."""
    kind, target = TRANSMISSION(model.actuator_trntype[actuator]), model.actuator_trnid[actuator, 0]
    if kind == TRANSMISSION.mjTRN_JOINTINPARENT and target == joint:
        return "has its axis in the parent's frame (use joint= instead of jointinparent=)"
    if kind not in (TRANSMISSION.mjTRN_JOINT, TRANSMISSION.mjTRN_SO3) or target != joint:
        return "acts on something else"
    if model.actuator_dyntype[actuator] != mujoco.mjtDyn.mjDYN_NONE:
        return "has dynamics of its own (the experiment's actuation has a lag)"
    if (
        kind == TRANSMISSION.mjTRN_SO3
        or model.actuator_gaintype[actuator] != mujoco.mjtGain.mjGAIN_FIXED
        or model.actuator_biastype[actuator] != mujoco.mjtBias.mjBIAS_NONE
    ):
        return "is a servo, not a plain motor"
    return ""


def motor_matrix(model: mujoco.MjModel, motors: Sequence[int], name: str) -> tuple[Array, Array, Array]:
    """Compute the matrix G of τ = G u (3, 3), and the smallest and largest controls (3,), ±inf without a limit.

    Raises:
        ModelError: the axes of the motors do not span the space.
    """
    gain = model.actuator_gainprm[motors, 0]
    matrix = (model.actuator_gear[motors, :3] * gain[:, None]).T.copy()
    if abs(np.linalg.det(matrix)) < 1e-9 * np.linalg.norm(matrix) ** 3:
        raise ModelError(f"model {name!r}: the gears of the three motors must span all three axes; {ADVICE}")
    bounds = np.full((AXES, 2), (-np.inf, np.inf))
    limited = model.actuator_ctrllimited[motors].astype(bool)
    bounds[limited] = model.actuator_ctrlrange[motors][limited]
    force = model.actuator_forcelimited[motors].astype(bool)
    by_force = np.sort(model.actuator_forcerange[motors] / gain[:, None], axis=1)
    bounds[force, 0] = np.maximum(bounds, by_force)[force, 0]
    bounds[force, 1] = np.minimum(bounds, by_force)[force, 1]
    return matrix, bounds[:, 0].copy(), bounds[:, 1].copy()


def tip_site(model: mujoco.MjModel, body: int, wanted: str | None, name: str) -> int:
    """Find the index of the tip site: the named one, else the one called ``tip``, else the only one that moves.

    Raises:
        ModelError: there is no such site on the bodies that the joint moves.
    """
    weld = model.body_weldid
    moving = [s for s in range(model.nsite) if weld[model.site_bodyid[s]] == weld[body]]
    names = {name_of(model, OBJECT.mjOBJ_SITE, s): s for s in moving}
    if wanted is not None and wanted not in names:
        if mujoco.mj_name2id(model, OBJECT.mjOBJ_SITE, wanted) >= 0:
            listed = ", ".join(names) or "none"
            raise ModelError(
                f"model {name!r}: site {wanted!r} is not on a body that the ball joint moves (sites there: {listed})"
            )
        _unknown("site", wanted, names, name)
    if wanted is None and "tip" not in names and len(moving) != 1:
        listed = f"none of {', '.join(names)} is called 'tip': name it: --tip SITE" if names else "it has no site"
        where = name_of(model, OBJECT.mjOBJ_BODY, body)
        raise ModelError(
            f"model {name!r}: the tool tip is a site on a body that the ball joint moves, and {listed}"
            + ("" if names else f'; add <site name="tip" pos="…"/> to body {where!r} or one that it carries')
        )
    return names["tip" if wanted is None and "tip" in names else wanted or next(iter(names))]


def _unknown(kind: str, wanted: str, valid: Sequence[str] | dict[str, int], name: str) -> NoReturn:
    raise ModelError(f"model {name!r}: {UnknownNameError(kind, wanted, valid)}")
