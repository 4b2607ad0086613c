"""Joint, motors and tip site of a wrist in an MJCF model, found by name or as the only candidates."""

from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ModelError, UnknownNameError, listed
from spherical_wrist.wrist.mjcf import ADVICE

JOINT, OBJECT, TRANSMISSION = mujoco.mjtJoint, mujoco.mjtObj, mujoco.mjtTrn

AXES = 3


class Names(NamedTuple):
    """Names in an MJCF file, for models with several candidates.

    Attributes:
        joint: the ball joint; needed if the model has several.
        motors: the three motors on it; needed if it has more.
        tip: the site of the tool tip; needed if none of several is called ``tip``.
        hinges: three hinges to be turned into the ball joint; see :mod:`spherical_wrist.wrist.hinges`.
    """

    joint: str | None = None
    motors: tuple[str, str, str] | None = None
    tip: str | None = None
    hinges: tuple[str, str, str] | None = None


UNNAMED = Names()
"""No names: the model has one candidate for each part."""

SITE = '<site name="tip" pos="…"/>'
ELSEWHERE = "acts on something else"
MOST = 12
"""Most names of a model that a message lists as valid."""


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return the name of an element, or its number in angle brackets if it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"<{index}>"


def ball_joint(model: mujoco.MjModel, wanted: str | None) -> int:
    """Find the index of the wrist's joint.

    Raises:
        ModelError: the model has no ball joint, several and none is named, or the named one is none of them.
    """
    kinds = [JOINT(kind).name.removeprefix("mjJNT_").lower() for kind in model.jnt_type]
    joints = {name_of(model, OBJECT.mjOBJ_JOINT, j): kind for j, kind in enumerate(kinds)}
    balls = [joint for joint, kind in joints.items() if kind == "ball"]
    if not balls:
        found = listed([f"{joint} ({kind})" for joint, kind in joints.items()] or ["none"])
        free = _free_name(model)
        raise ModelError(
            f'no ball joint (its joints: {found}): a wrist has <joint name="{free}" type="ball"/> in the body that '
            f"turns, three motors on it, {_motor(free)} and the like for y and z, and {SITE} in a body that it moves"
            + ("; or name three hinges that meet in a point: --hinges A,B,C" if kinds.count("hinge") >= AXES else "")
        )
    if wanted is None and len(balls) > 1:
        raise ModelError(f"ball joints {_choice(balls)}: name the wrist's: --joint NAME")
    chosen = balls[0] if wanted is None else wanted
    if chosen not in joints:
        unknown_name("joint", chosen, balls)
    if joints[chosen] != "ball":
        raise ModelError(f"joint {chosen!r} is a {joints[chosen]}; its ball joints: {_choice(balls)}")
    return list(joints).index(chosen)


def torque_motors(model: mujoco.MjModel, joint: int, wanted: Sequence[str] | None) -> list[int]:
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
        if len(plain) > AXES:
            where = name_of(model, OBJECT.mjOBJ_JOINT, joint)
            found = _choice([actuators[a] for a in plain])
            raise ModelError(
                f"{len(plain)} torque motors on joint {where!r}, namely {found}: name the wrist's three: --motors A,B,C"
            )
        raise ModelError(_motors_missing(model, joint, len(plain), actuators, faults))
    if len(wanted) != AXES or len(set(wanted)) != AXES:
        raise ModelError(f"motors {', '.join(wanted)}: three different ones are needed")
    for each in wanted:
        if each not in actuators:
            unknown_name("motor", each, actuators)
        if fault := faults[actuators.index(each)]:
            raise ModelError(f"actuator {each!r} {fault}: three torque motors on the joint are needed")
    return sorted(actuators.index(each) for each in wanted)


def _motors_missing(
    model: mujoco.MjModel, joint: int, count: int, actuators: Sequence[str], faults: Sequence[str]
) -> str:
    """Name the motors that a joint lacks, the other motors, and the lines to add to the file."""
    name = mujoco.mj_id2name(model, OBJECT.mjOBJ_JOINT, joint)
    if not name:  # then no motor can act on it
        body, free = name_of(model, OBJECT.mjOBJ_BODY, int(model.jnt_bodyid[joint])), _free_name(model)
        return (
            f"the ball joint of body {body!r} has no name, so that no motor can act on it: write "
            f'<joint name="{free}" type="ball"/> there, and add {_motor(free)} and the like for y and z to <actuator>'
        )
    found = list(zip(actuators, faults, strict=True))
    elsewhere = [actuator for actuator, fault in found if fault == ELSEWHERE]
    others = [f"{actuator} {fault}" for actuator, fault in found if fault and fault != ELSEWHERE]
    others[MOST:] = [f"{len(others) - MOST} more"] if len(others) > MOST else []
    if elsewhere:
        others.append(f"{listed(elsewhere)} {ELSEWHERE if len(elsewhere) == 1 else 'act on something else'}")
    advice = (
        f'add <motor joint="{name}" gear="…"/>, so that the three gears span all axes'
        if count
        else f"add {_motor(name)} and the like for y and z"
    )
    reasons = f" ({'; '.join(others)})" if others else ""
    return f"{count} of three torque motors that joint {name!r} needs{reasons}: {advice}"


def _fault(model: mujoco.MjModel, actuator: int, joint: int) -> str:
    """Say why an actuator is no torque motor on the joint, in words that follow its name; empty if it is one."""
    kind, target = TRANSMISSION(model.actuator_trntype[actuator]), model.actuator_trnid[actuator, 0]
    if kind == TRANSMISSION.mjTRN_JOINTINPARENT and target == joint:
        return "has its axis in the parent's frame (use joint= instead of jointinparent=)"
    if kind not in (TRANSMISSION.mjTRN_JOINT, TRANSMISSION.mjTRN_SO3) or target != joint:
        return ELSEWHERE
    return motor_fault(model, actuator)


def motor_fault(model: mujoco.MjModel, actuator: int) -> str:
    """Say why an actuator on a joint is no torque motor, in words that follow its name; empty if it is one."""
    if model.actuator_dyntype[actuator] != mujoco.mjtDyn.mjDYN_NONE:
        return "has dynamics of its own (the experiment's actuation has a lag)"
    if (
        model.actuator_trntype[actuator] == TRANSMISSION.mjTRN_SO3
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


def tip_site(model: mujoco.MjModel, body: int, wanted: str | None) -> int:
    """Find the index of the tip site: the named one, else the one called ``tip``, else the only one that moves.

    Raises:
        ModelError: there is no such site on the bodies that the joint moves.
    """
    weld = model.body_weldid
    moving = [s for s in range(model.nsite) if weld[model.site_bodyid[s]] == weld[body]]
    names = {name_of(model, OBJECT.mjOBJ_SITE, s): s for s in moving}
    if wanted is not None and wanted not in names:
        if mujoco.mj_name2id(model, OBJECT.mjOBJ_SITE, wanted) >= 0:
            there = listed(list(names) or ["none"])
            raise ModelError(f"site {wanted!r} is not on a body that the ball joint moves (sites there: {there})")
        unknown_name("site", wanted, names)
    if wanted is None and "tip" not in names and len(moving) != 1:
        if names:
            found = f"none of {_choice(list(names))} is called 'tip': name it: --tip SITE"
        else:
            where = name_of(model, OBJECT.mjOBJ_BODY, body)
            found = f"it has no site: add {SITE} to body {where!r} or one that it carries"
        raise ModelError(f"the tool tip is a site on a body that the ball joint moves, and {found}")
    return names["tip" if wanted is None and "tip" in names else wanted or next(iter(names))]


def _choice(names: Sequence[str]) -> str:
    """List the names of a model that one can be chosen from; those without a name need one."""
    unnamed = any(name.startswith("<") for name in names)
    return listed(names) + (" (give those in angle brackets a name in the file)" if unnamed else "")


def _free_name(model: mujoco.MjModel) -> str:
    """Return a name for the wrist's joint that no joint has yet."""
    return "wrist" if mujoco.mj_name2id(model, OBJECT.mjOBJ_JOINT, "wrist") < 0 else "wrist_ball"


def _motor(joint: str) -> str:
    return f'<motor joint="{joint}" gear="1 0 0"/>'


def unknown_name(kind: str, wanted: str, valid: Sequence[str] | dict[str, int]) -> NoReturn:
    """Raise the error for a name that is none of the model's.

    Raises:
        ModelError: always.
    """
    raise ModelError(str(UnknownNameError(kind, wanted, valid, most=MOST)))
