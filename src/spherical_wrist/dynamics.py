"""Inertia matrix and bias of the nominal model, and inverse dynamics of a reference.

Interpreted, these functions call MuJoCo's Python bindings. Compiled into the closed loop, the same names are the C
functions of libmujoco, and ``model`` and ``data`` are addresses.
"""

from typing import Any, NamedTuple

import numpy as np
from mujoco import (
    mj_comPos,
    mj_flex,
    mj_fullM,
    mj_fwdVelocity,
    mj_kinematics,
    mj_makeM,
    mj_tendon,
)

from spherical_wrist.arrays import Array
from spherical_wrist.so3 import Quaternion, Vector3

MOTION = np.dtype([("attitude", "f8", 4), ("rate", "f8", 3), ("acceleration", "f8", 3)], align=True)
"""Reference at one instant: attitude q_d, rate ω_d [rad/s] and acceleration ω̇_d [rad/s²], both in the desired frame."""


class Nominal(NamedTuple):
    """Nominal model, and views of the data that the loop reads or writes.

    Attributes:
        model: MjModel, or its address.
        data: MjData, or its address.
        qpos: view of ``data.qpos`` (4,).
        qvel: view of ``data.qvel`` (3,).
        bias: view of ``data.qfrc_bias`` (3,).
        passive: view of ``data.qfrc_passive`` (3,).
    """

    model: Any
    data: Any
    qpos: Array
    qvel: Array
    bias: Array
    passive: Array


def pointer(array: Array) -> Any:
    """Return the argument of a MuJoCo function for an array: the array itself; in compiled code, its address."""
    return array


def evaluate(nominal: Nominal, attitude: Quaternion, rate: Vector3, H: Array, N: Array) -> None:
    """Write H (3, 3) and N (3,) of the nominal model at a state.

    H is ``mj_fullM``: rigid bodies, and armature of joint, motors and tendons. N is ``qfrc_bias`` (Coriolis,
    centrifugal, gravity) minus ``qfrc_passive`` (springs, dampers, gravity compensation, fluid), so that the torque
    H ω̇ + N gives the acceleration ω̇ where no constraint is active.
    """
    for i in range(4):
        nominal.qpos[i] = attitude[i]
    for i in range(3):
        nominal.qvel[i] = rate[i]
    mj_kinematics(nominal.model, nominal.data)
    mj_comPos(nominal.model, nominal.data)
    mj_flex(nominal.model, nominal.data)
    mj_tendon(nominal.model, nominal.data)
    mj_makeM(nominal.model, nominal.data)
    mj_fwdVelocity(nominal.model, nominal.data)
    mj_fullM(nominal.model, nominal.data, pointer(H))
    for i in range(3):
        N[i] = nominal.bias[i] - nominal.passive[i]


def inverse_dynamics(nominal: Nominal, motion: Any, H: Array, torque: Array) -> None:
    """Write the torques (n, 3) [N·m] that make the nominal model follow ``motion``, MOTION (n,)."""
    for k in range(len(motion)):
        q, w = motion[k].attitude, motion[k].rate
        evaluate(nominal, (q[0], q[1], q[2], q[3]), (w[0], w[1], w[2]), H, torque[k])
        for i in range(3):
            for j in range(3):
                torque[k, i] += H[i, j] * motion[k].acceleration[j]
