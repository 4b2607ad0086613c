"""Constraints that act on the plant alone, noted while the loop runs: how long, how much, and at which states.

MuJoCo's constraints are limits, equality constraints, contacts, and dry friction. The controller's model has none. The
loop sees their sum, a torque on the joint. Which ones they were is found later, by evaluating the noted states.
"""

from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array

CONSTRAINTS = np.dtype(
    [("friction", "f8", 3), ("count", "i8"), ("stride", "i8"), ("kept", "i8"), ("largest", "f8")], align=True
)
"""Sums over control periods: dry friction per axis [N·m], below which nothing is noted; number of periods in which a
constraint acted; every how many of them one state is kept; number of states kept; largest torque, squared [N²·m²]."""
STATE = np.dtype([("attitude", "f8", 4), ("rate", "f8", 3), ("control", "f8", 3), ("applied", "f8", 3)], align=True)
"""State of the plant, motor controls, and torque applied to the joint [N·m], where a constraint acted."""

STATES = 128
"""Most states that are kept. If there are more, every second one is dropped, so that they stay evenly spread."""

ROUNDING = 1e-9
"""Torque [N·m] that counts as none."""


class Constraints(NamedTuple):
    """Constraints of the plant.

    Attributes:
        torque: view of ``data.qfrc_constraint`` (3,); empty for a plant without constraints.
        sums: CONSTRAINTS record, updated.
        states: STATE (``STATES`` + 1,), updated; the last one is that of the largest torque.
    """

    torque: Array
    sums: Any
    states: Any


def note_constraints(constraints: Constraints, plant: Any) -> None:
    """Note that constraints acted in a control period, if they did.

    Args:
        constraints: updated.
        plant: plant after the last physics step of the period.
    """
    sums, states, torque = constraints.sums, constraints.states, constraints.torque
    acting, squared = False, 0.0
    for i in range(3):
        acting = acting or abs(torque[i]) > sums.friction[i] + ROUNDING
        squared += torque[i] * torque[i]
    if not acting:
        return
    if squared > sums.largest:
        sums.largest = squared
        write_state(states[STATES], plant)
    if sums.count % sums.stride == 0 and sums.kept == STATES:
        sums.kept //= 2
        sums.stride *= 2
        for k in range(sums.kept):
            copy_state(states[2 * k], states[k])
    if sums.count % sums.stride == 0:
        write_state(states[sums.kept], plant)
        sums.kept += 1
    sums.count += 1


def write_state(state: Any, plant: Any) -> None:
    """Write the state of a plant to a STATE record."""
    for i in range(4):
        state.attitude[i] = plant.qpos[i]
    for i in range(3):
        state.rate[i] = plant.qvel[i]
        state.control[i] = plant.ctrl[i]
        state.applied[i] = plant.applied[i]


def copy_state(source: Any, target: Any) -> None:
    """Copy a STATE record."""
    for i in range(4):
        target.attitude[i] = source.attitude[i]
    for i in range(3):
        target.rate[i] = source.rate[i]
        target.control[i] = source.control[i]
        target.applied[i] = source.applied[i]
