"""Three concentric hinges turned into a ball joint, with their motors.

At the initial position let a_i be the axes of the hinges in the frame of the body that the first of them turns, A their
matrix (columns), and b_i the rows of A⁻¹. Then the rate is ω = A θ̇, so θ̇_i = b_i · ω, and by the power of the hinges,
Σ τ_i θ̇_i = T · ω, torques τ_i about the hinges are the torque

    T = Σ τ_i b_i

on the body. So the motor of hinge i gets the gear b_i times its own; for orthogonal axes b_i = a_i. Dampers d_i and
armatures are the matrix Σ d_i b_i b_iᵀ; a ball has one number, so it is exact if that is a multiple of the identity.

This holds at the initial position. From there, a ball differs from a gimbal: its motors turn with the body, it has no
attitude at which an axis is lost, and everything from the first hinge's body on turns as one.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ModelError, listed
from spherical_wrist.wrist.parts import AXES, JOINT, OBJECT, TRANSMISSION, motor_fault, name_of, unknown_name

WRAP, EQUALITY, LIMITED = mujoco.mjtWrap, mujoco.mjtEq, mujoco.mjtLimited

LARGEST_MISS = 1e-5
"""Distance [m] up to which the axes of three hinges meet in one point: models are written with a few digits."""

SMALLEST_VOLUME = 1e-3
"""Smallest volume of the parallelepiped of three unit axes that span the space; 1 for orthogonal ones."""


class HingedWrist(NamedTuple):
    """Description in which three hinges are a ball joint.

    Attributes:
        spec: the description, without the model's sensors and keyframes.
        joint: name of the ball joint.
        warnings: a sentence for everything that the ball has not, or has in another way, than the hinges.
        missing: sentence on the motors that the hinges lack; without motors the description is of no further use than
            to find out what else is missing.
    """

    spec: mujoco.MjSpec
    joint: str
    warnings: tuple[str, ...] = ()
    missing: str = ""


class _Hinges(NamedTuple):
    """The three hinges at the initial position.

    Attributes:
        model: the model, compiled.
        joints: their indices, from the one nearest the world outwards.
        names: their names, in the same order.
        motors: index of the motor of each.
        dual: rows b_i, in the frame of the first one's body.
    """

    model: mujoco.MjModel
    joints: list[int]
    names: list[str]
    motors: list[int]
    dual: Array

    def matrix(self, values: Array) -> Array:
        """Return Σ v_i b_i b_iᵀ of one number for each hinge."""
        return np.asarray(self.dual.T @ np.diag(values) @ self.dual)


def ball_from_hinges(
    spec: mujoco.MjSpec, model: mujoco.MjModel, wanted: Sequence[str], motors: Sequence[str] | None
) -> HingedWrist:
    """Copy a description, with three hinges turned into a ball joint at the point in which their axes meet.

    Args:
        spec: description of the whole model.
        model: the same, compiled.
        wanted: names of the three hinges.
        motors: names of their three motors; None if each has one.

    Raises:
        ModelError: they are not three hinges of one chain that meet in a point and span the space; or they have
            springs, or are coupled with others; or a motor is unknown.
    """
    joints = _joints(model, wanted)
    names = [name_of(model, OBJECT.mjOBJ_JOINT, joint) for joint in joints]
    _check_alone(model, joints)
    centre, dual = _geometry(model, joints, names)
    found, missing = _motors(model, joints, names, motors)
    spec, ball = spec.copy(), ",".join(wanted)
    kept, *others = (spec.joints[joint] for joint in joints)
    actuators = list(spec.actuators)
    for each in (
        *spec.keys,
        *spec.sensors,
        *(actuators[a] for a in set(_actuators_on(model, joints)) - set([] if missing else found)),
    ):
        spec.delete(each)
    for other in others:
        spec.delete(other)
    kept.name, kept.type, kept.pos = ball, JOINT.mjJNT_BALL, centre
    kept.limited = kept.actfrclimited = LIMITED.mjLIMITED_FALSE
    kept.range, kept.actfrcrange = np.zeros(2), np.zeros(2)
    if missing:
        return HingedWrist(spec, ball, missing=missing)
    for motor, row, joint in zip(found, dual, joints, strict=True):
        actuator = actuators[motor]
        actuator.trntype, actuator.target = TRANSMISSION.mjTRN_JOINT, ball
        _limit(actuator, model, motor, joint)
        actuator.gear = [*(model.actuator_gear[motor, 0] * row), 0.0, 0.0, 0.0]
        actuator.damping, actuator.armature = np.zeros_like(actuator.damping), 0.0
    hinges = _Hinges(model, joints, names, found, dual)
    kept.damping = [np.trace(hinges.matrix(_damping(hinges))) / AXES, *np.zeros(len(kept.damping) - 1)]
    kept.armature = np.trace(hinges.matrix(_armature(hinges))) / AXES
    kept.frictionloss = float(_friction(hinges)[0]) if _same_friction(hinges) else 0.0
    kept.actgravcomp = bool(model.jnt_actgravcomp[joints].all())
    return HingedWrist(spec, ball, tuple(_remarks(hinges)))


def _joints(model: mujoco.MjModel, wanted: Sequence[str]) -> list[int]:
    """Find the hinges, from the one nearest the world outwards."""
    if len(set(wanted)) != AXES:
        raise ModelError(f"hinges {', '.join(wanted)}: three different ones are needed")
    named = {mujoco.mj_id2name(model, OBJECT.mjOBJ_JOINT, j): j for j in range(model.njnt)}
    joints = {name: j for name, j in named.items() if name}
    hinges = [name for name, j in joints.items() if JOINT(model.jnt_type[j]) == JOINT.mjJNT_HINGE]
    if len(hinges) < AXES:
        raise ModelError(
            f"it has {len(hinges)} hinges with a name ({listed(hinges or ['none'])}), and three make a ball: give each "
            "of the wrist's three a name in the file"
        )
    for each in wanted:
        if each not in joints:
            unknown_name("hinge", each, hinges)
        if each not in hinges:
            kind = JOINT(model.jnt_type[joints[each]]).name.removeprefix("mjJNT_").lower()
            raise ModelError(f"joint {each!r} is a {kind}; its hinges: {listed(hinges)}")
    found = sorted(joints[each] for each in wanted)  # MuJoCo numbers them from the world outwards
    for inner, outer in pairwise(found):
        body = int(model.jnt_bodyid[outer])
        while body > model.jnt_bodyid[inner]:
            body = int(model.body_parentid[body])
        if body != model.jnt_bodyid[inner]:
            first, second = (name_of(model, OBJECT.mjOBJ_JOINT, joint) for joint in (inner, outer))
            raise ModelError(f"hinge {second!r} is not carried by hinge {first!r}: three in one chain are needed")
    return found


def _geometry(model: mujoco.MjModel, joints: list[int], names: list[str]) -> tuple[Array, Array]:
    """Return the common point of the axes, and the rows b_i, in the frame of the first hinge's body."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    axes, anchors = data.xaxis[joints], data.xanchor[joints]
    if abs(np.linalg.det(axes)) < SMALLEST_VOLUME:
        angles = np.degrees(np.arccos(np.clip(np.abs(axes @ axes.T), 0.0, 1.0)))
        pairs = [f"{names[i]} and {names[j]} are {angles[i, j]:.1f}° apart" for i, j in ((0, 1), (0, 2), (1, 2))]
        apart = angles[0, 2] < min(angles[0, 1], angles[1, 2])  # roll, pitch, roll: straight, it is singular
        advice = (
            f"turn the body of hinge {names[1]!r} in the file about that hinge, by 90° at best, for the wrist to begin "
            "where it is not straight"
            if apart
            else "choose other hinges, or turn their bodies in the file so that they do"
        )
        raise ModelError(
            f"the axes of hinges {listed(names)} do not span all directions at the initial position: "
            f"{listed(pairs)}; {advice}"
        )
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]  # projections along the axes
    centre = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, anchors))
    misses = np.linalg.norm(np.einsum("nij,nj->ni", across, centre - anchors), axis=1)
    if misses.max() > LARGEST_MISS:
        passed = listed([f"{name} by {1e3 * miss:.3g} mm" for name, miss in zip(names, misses, strict=True)])
        raise ModelError(f"the axes of three hinges must meet in one point; they miss the nearest one: {passed}")
    body = model.jnt_bodyid[joints[0]]
    turn = data.xmat[body].reshape(3, 3)
    return turn.T @ (centre - data.xpos[body]), _cleaned(np.linalg.inv(axes.T) @ turn)


def _cleaned(matrix: Array) -> Array:
    """Return a matrix with entries that are whole numbers but for rounding made exact."""
    whole = np.round(matrix)
    return np.where(np.abs(matrix - whole) < 1e-12, whole, matrix) + 0.0


def _check_alone(model: mujoco.MjModel, joints: list[int]) -> None:
    """Check that the hinges have no springs and no curved damping, and that nothing couples them.

    Raises:
        ModelError: one has, or something does.
    """
    for joint in joints:
        who = f"hinge {name_of(model, OBJECT.mjOBJ_JOINT, joint)!r}"
        if np.any(model.jnt_stiffness[joint]):
            raise ModelError(f"{who} has a spring, and that of a ball is another one: remove stiffness from it")
        for actuator in _actuators_on(model, [joint]):
            if model.actuator_dampingpoly[actuator].any():
                raise ModelError(f"{who} has damping that is no multiple of the rate, which a ball cannot have")
        if model.dof_dampingpoly[model.jnt_dofadr[joint]].any():
            raise ModelError(f"{who} has damping that is no multiple of the rate, which a ball cannot have")
        for equality in range(model.neq):
            ends = model.eq_obj1id[equality], model.eq_obj2id[equality]
            if model.eq_type[equality] == EQUALITY.mjEQ_JOINT and joint in ends:
                name = name_of(model, OBJECT.mjOBJ_EQUALITY, equality)
                raise ModelError(f"{who} is coupled by the equality constraint {name!r}: remove it")
        for tendon in range(model.ntendon):
            first, count = model.tendon_adr[tendon], model.tendon_num[tendon]
            path = range(first, first + count)
            if any(model.wrap_type[i] == WRAP.mjWRAP_JOINT and model.wrap_objid[i] == joint for i in path):
                name = name_of(model, OBJECT.mjOBJ_TENDON, tendon)
                raise ModelError(f"{who} is coupled by the tendon {name!r}: remove it, and give each hinge a motor")


def _actuators_on(model: mujoco.MjModel, joints: Sequence[int]) -> list[int]:
    kinds = (TRANSMISSION.mjTRN_JOINT, TRANSMISSION.mjTRN_JOINTINPARENT)
    on = [a for a in range(model.nactuator) if TRANSMISSION(model.actuator_trntype[a]) in kinds]
    return [a for a in on if model.actuator_trnid[a, 0] in joints]


def _motors(
    model: mujoco.MjModel, joints: list[int], names: list[str], wanted: Sequence[str] | None
) -> tuple[list[int], str]:
    """Find the motor of each hinge, and say which have none, or several of which none is named.

    Raises:
        ModelError: there is no motor of a name.
    """
    found, faults, chosen = [], [], list(wanted or ())
    actuators = [name_of(model, OBJECT.mjOBJ_ACTUATOR, a) for a in range(model.nactuator)]
    for each in chosen:
        if each not in actuators:
            unknown_name("motor", each, actuators)
    for joint, name in zip(joints, names, strict=True):
        on = [a for a in _actuators_on(model, [joint]) if not chosen or actuators[a] in chosen]
        plain = [a for a in on if not motor_fault(model, a)]
        if len(plain) == 1:
            found.append(plain[0])
        elif plain:
            several = listed([actuators[a] for a in plain])
            faults.append(f"hinge {name!r} has several torque motors ({several}): name one a hinge: --motors A,B,C")
        else:
            others = "; ".join(f"{actuators[a]} {motor_fault(model, a)}" for a in on)
            reason = f" ({others})" if others else " among those that are named" if chosen else ""
            faults.append(f"hinge {name!r} has no torque motor{reason}: {_instead(model, joint, name, on)}")
    return found, "; and ".join(faults)


def _instead(model: mujoco.MjModel, joint: int, name: str, actuators: Sequence[int]) -> str:
    """Return the motor to write, with the limit that a servo has in its place."""
    limits = [model.actuator_forcerange[a] for a in actuators if model.actuator_forcelimited[a]]
    if model.jnt_actfrclimited[joint]:
        limits.append(model.jnt_actfrcrange[joint])
    limit = ' ctrlrange="{:g} {:g}"'.format(*limits[0]) if limits else ""
    return f'write <motor joint="{name}"{limit}/>' + (" in its place" if actuators else "")


def _limit(actuator: mujoco.MjsActuator, model: mujoco.MjModel, motor: int, joint: int) -> None:
    """Write the limit of the torque about a hinge, which MuJoCo ignores on a ball, as one of its motor's force."""
    gear = float(model.actuator_gear[motor, 0])
    if not model.jnt_actfrclimited[joint] or gear == 0.0:
        return
    low, high = sorted(model.jnt_actfrcrange[joint] / gear)
    if model.actuator_forcelimited[motor]:
        low = max(low, model.actuator_forcerange[motor, 0])
        high = min(high, model.actuator_forcerange[motor, 1])
    actuator.forcelimited, actuator.forcerange = LIMITED.mjLIMITED_TRUE, [low, high]


def _damping(hinges: _Hinges) -> Array:
    """Return the damping about each hinge [N·m·s/rad], of its joint and its motor."""
    model, dofs = hinges.model, hinges.model.jnt_dofadr[hinges.joints]
    gears = model.actuator_gear[hinges.motors, 0]
    return np.asarray(model.dof_damping[dofs] + model.actuator_damping[hinges.motors] * gears**2)


def _armature(hinges: _Hinges) -> Array:
    """Return the armature about each hinge [kg·m²], of its joint and its motor."""
    model, dofs = hinges.model, hinges.model.jnt_dofadr[hinges.joints]
    gears = model.actuator_gear[hinges.motors, 0]
    return np.asarray(model.dof_armature[dofs] + model.actuator_armature[hinges.motors] * gears**2)


def _friction(hinges: _Hinges) -> Array:
    return np.asarray(hinges.model.dof_frictionloss[hinges.model.jnt_dofadr[hinges.joints]])


def _same_friction(hinges: _Hinges) -> bool:
    """Return True if the dry friction is that of a ball: the same about each axis of the body's frame."""
    friction = _friction(hinges)
    along = np.array_equal(np.sort(np.abs(hinges.dual), axis=1), np.tile([0.0, 0.0, 1.0], (AXES, 1)))
    return bool(np.all(friction == friction[0])) and (along or not friction.any())


def _remarks(hinges: _Hinges) -> Iterator[str]:
    """Yield a sentence for everything that the ball has not, or has in another way, than the hinges."""
    model, names = hinges.model, listed(hinges.names)
    for what, unit, values in (
        ("damping", "N·m·s/rad", _damping(hinges)),
        ("armature", "kg·m²", _armature(hinges)),
    ):
        matrix = hinges.matrix(values)
        mean = float(np.trace(matrix)) / AXES
        if not np.allclose(matrix, mean * np.eye(AXES), rtol=0.0, atol=1e-9 * mean):
            given = ", ".join(f"{value:.3g}" for value in values)
            yield (
                f"the {what} of hinges {names} ({given} {unit}) differs by direction: the ball has the mean, "
                f"{mean:.3g} {unit}"
            )
    if not _same_friction(hinges):
        given = ", ".join(f"{value:.3g}" for value in _friction(hinges))
        yield f"the dry friction of hinges {names} ({given} N·m) is left out: give the plant a friction"
    limited = [name for name, joint in zip(hinges.names, hinges.joints, strict=True) if model.jnt_limited[joint]]
    if limited:
        yield f"the range of {listed(limited)} is left out, as a ball has none about an axis: keep the motion within"
    if (lift := model.jnt_actgravcomp[hinges.joints]).any() and not lift.all():
        yield f"not all of hinges {names} have actuatorgravcomp: gravity is compensated without the motors"
    between, last = _between(hinges)
    if between:
        mass = float(model.body_mass[between].sum())
        bodies = [name_of(model, OBJECT.mjOBJ_BODY, body) for body in between]
        yield (
            f"{listed(bodies)} ({mass:.3g} kg) between the hinges turn{'s' if len(bodies) == 1 else ''} with the "
            f"ball, as {last} does"
        )
    chosen = set(hinges.motors)
    others = [a for a in _actuators_on(model, hinges.joints) if a not in chosen]
    if others:
        is_are = " is" if len(others) == 1 else "s are"
        which = listed([name_of(model, OBJECT.mjOBJ_ACTUATOR, a) for a in others])
        yield f"on the hinges, actuator{is_are} left out: {which}; only the three motors act on the ball"


def _between(hinges: _Hinges) -> tuple[list[int], str]:
    """Return the bodies that some of the hinges turn and others do not, and the name of the outermost hinge's body."""
    model = hinges.model
    first, last = (int(model.jnt_bodyid[hinges.joints[i]]) for i in (0, -1))
    outer = set[int]()
    for body in range(last, model.nbody):
        if body == last or model.body_parentid[body] in outer:
            outer.add(body)
    carried = set[int]()
    for body in range(first, model.nbody):
        if body == first or model.body_parentid[body] in carried:
            carried.add(body)
    return sorted(carried - outer), name_of(model, OBJECT.mjOBJ_BODY, last)
