"""Constraints that acted on the plant alone in a run: which, for how long, and with how much torque."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.loop.constraints import CONSTRAINTS, STATE, STATES, Constraints
from spherical_wrist.wrist import name_of

Key = tuple[int, ...]
KIND, OBJECT, OFF = mujoco.mjtConstraint, mujoco.mjtObj, mujoco.mjtDisableBit
FRICTION = {int(KIND.mjCNSTR_FRICTION_DOF), int(KIND.mjCNSTR_FRICTION_TENDON)}
CONTACTS = {int(kind) for kind in KIND.__members__.values() if "CONTACT" in kind.name}

MOST = 4
"""Most constraints that are named in one run."""


def constraints_of(model: mujoco.MjModel, data: mujoco.MjData) -> Constraints:
    """Create the notes of one run on the constraints of its plant; without any if they are disabled.

    The dry friction of the joint is known, so only torques beyond it count.
    """
    sums = np.zeros(1, CONSTRAINTS)
    sums["stride"] = 1
    if model.opt.disableflags & OFF.mjDSBL_CONSTRAINT:
        return Constraints(np.empty(0), sums, np.zeros(1, STATE))
    if not model.opt.disableflags & OFF.mjDSBL_FRICTIONLOSS:
        sums["friction"] = model.dof_frictionloss
    return Constraints(data.qfrc_constraint, sums, np.zeros(STATES + 1, STATE))


class Acting(NamedTuple):
    """Constraint that acted.

    Attributes:
        name: name of the constraint.
        states: number of noted states at which it acted.
        torque: largest norm of its torque on the joint [N·m] at those states.
    """

    name: str
    states: int
    torque: float


@warnings_kept_in_data()
def acting_constraints(model: mujoco.MjModel, constraints: Constraints) -> list[Acting]:
    """Find the constraints that acted at the noted states of a run, the longest first.

    Args:
        model: model of the plant.
        constraints: notes of the run.
    """
    data, torques = mujoco.MjData(model), dict[Key, list[float]]()
    for state in constraints.states[: int(constraints.sums["kept"][0])]:
        for key, torque in _torques(model, data, state):
            torques.setdefault(key, []).append(torque)
    largest = dict(_torques(model, data, constraints.states[STATES])) if torques else {}
    acting = [Acting(_name(model, key), len(all_), max(*all_, largest.get(key, 0.0))) for key, all_ in torques.items()]
    return sorted(acting, key=lambda each: (-each.states, -each.torque))


def _torques(model: mujoco.MjModel, data: mujoco.MjData, state: Any) -> Iterator[tuple[Key, float]]:
    """Yield the norm of the torque [N·m] of every constraint that acts at a state; dry friction is left out."""
    data.qpos[:], data.qvel[:] = state["attitude"], state["rate"]
    data.ctrl[:], data.qfrc_applied[:] = state["control"], state["applied"]
    mujoco.mj_forward(model, data)
    force = data.efc_force
    rows = np.flatnonzero(force)
    if mujoco.mj_isSparse(model):
        jacobian = np.zeros((data.nefc, model.nv))
        mujoco.mju_sparse2dense(jacobian, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        jacobian = data.efc_J.reshape(-1, model.nv)
    torques = dict[Key, Array]()
    terms = force[rows, None] * jacobian[rows]
    for kind, index, term in zip(data.efc_type[rows].tolist(), data.efc_id[rows].tolist(), terms, strict=True):
        if kind not in FRICTION:
            key = _contact(data.contact[index], kind) if kind in CONTACTS else (kind, index)
            torques[key] = torques[key] + term if key in torques else term
    if model.flg_adhesion and data.qfrc_adhesion.any():
        torques[()] = data.qfrc_adhesion
    for key, torque in torques.items():
        yield key, math.hypot(*torque)


def _contact(contact: mujoco.MjContact, kind: int) -> Key:
    """Return the key of a contact: two geoms, and two flexes."""
    return kind, *contact.geom.tolist(), *contact.flex.tolist()


def _name(model: mujoco.MjModel, key: Key) -> str:
    """Name a constraint by its key; the sticking of contacts has an empty one."""
    if not key:
        return "adhesion of contacts"
    kind, index, *others = key
    if kind in CONTACTS:
        other, *flexes = others
        return f"contact of {_side(model, index, flexes[0])} with {_side(model, other, flexes[1])}"
    if kind == KIND.mjCNSTR_LIMIT_JOINT:
        return f"limit of joint {name_of(model, OBJECT.mjOBJ_JOINT, index)!r}"
    if kind == KIND.mjCNSTR_LIMIT_TENDON:
        return f"limit of tendon {name_of(model, OBJECT.mjOBJ_TENDON, index)!r}"
    what = mujoco.mjtEq(model.eq_type[index]).name.removeprefix("mjEQ_").lower()
    if named := mujoco.mj_id2name(model, OBJECT.mjOBJ_EQUALITY, index):
        return f"{what} constraint {named!r}"
    owner = OBJECT(model.eq_objtype[index])
    first = name_of(model, owner, int(model.eq_obj1id[index]))
    return f"{what} constraint of {owner.name.removeprefix('mjOBJ_').lower()} {first!r}"


def _side(model: mujoco.MjModel, geom: int, flex: int) -> str:
    """Name one side of a contact: a flex, or a geom, else its body."""
    if geom < 0:
        return f"flex {name_of(model, OBJECT.mjOBJ_FLEX, flex)!r}"
    if name := mujoco.mj_id2name(model, OBJECT.mjOBJ_GEOM, geom):
        return f"geom {name!r}"
    return f"body {name_of(model, OBJECT.mjOBJ_BODY, int(model.geom_bodyid[geom]))!r}"


def constraint_warnings(model: mujoco.MjModel, constraints: Constraints, period: float, periods: int) -> Iterator[str]:
    """Yield a sentence for every constraint that acted in a run, or for a few of the longest.

    Times and torques are estimates if the states where constraints acted were too many to keep all of them.

    Args:
        model: model of the plant.
        constraints: notes of the run.
        period: control period [s].
        periods: number of control periods of the run.
    """
    count, kept, stride = (int(constraints.sums[name][0]) for name in ("count", "kept", "stride"))
    if not count:
        return
    acting = acting_constraints(model, constraints)
    about = "about " if stride > 1 else ""
    for each in acting[:MOST]:
        share = each.states / kept * count
        yield (
            f"{each.name} acted on the plant for {about}{share * period:.3g} s, {100.0 * share / periods:.3g} % of the "
            f"run, with up to {about}{each.torque:.2g} N·m: the controller's model has no constraints"
        )
    if len(acting) > MOST:
        yield f"{len(acting) - MOST} more constraints acted on the plant, for shorter times"
