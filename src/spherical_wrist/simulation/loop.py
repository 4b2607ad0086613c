"""The closed loop: error → nominal H, N → law → torque → physics → log, once per control period.

One source, two ways to run it: as it stands (for a debugger or a notebook), or compiled by ``compiler``. It therefore
uses plain loops over scalars, and nothing that cannot be compiled.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco import mj_step

from spherical_wrist.dynamics import Array, Nominal, evaluate
from spherical_wrist.so3 import advance, attitude_error, feed_forward, rate_error

LOG = np.dtype(
    [
        ("attitude", "f8", 4),
        ("rate", "f8", 3),
        ("error", "f8", 3),
        ("rate_error", "f8", 3),
        ("surface", "f8", 3),
        ("slope", "f8", 3),
        ("torque", "f8", 3),
        ("saturated", "f8"),
    ],
    align=True,
)
SETTINGS = np.dtype(
    [
        ("first", "i8"),
        ("period", "f8"),
        ("substeps", "i8"),
        ("ahead", "f8"),
        ("rate_scale", "f8"),
        ("rate_limit", "f8"),
        ("motors", "f8", (3, 3)),
        ("controls", "f8", (3, 3)),
        ("lower", "f8", 3),
        ("upper", "f8", 3),
    ],
    align=True,
)
RUNNING, TOO_FAST, UNSTABLE, NO_TORQUE = 0, 1, 2, 3
BAD_POSITION = int(mujoco.mjtWarning.mjWARN_BADQPOS)
BAD_CONTROL = int(mujoco.mjtWarning.mjWARN_BADCTRL)


class Plant(NamedTuple):
    """The plant and the parts of its data that the loop touches.

    Attributes:
        model: an MjModel, or its address.
        data: its MjData, or its address.
        qpos: view of ``data.qpos`` (4,).
        qvel: view of ``data.qvel`` (3,).
        ctrl: view of ``data.ctrl`` (3,).
        applied: view of ``data.qfrc_applied`` (3,), where the disturbance acts.
        warnings: view of ``data.warning.number``.
    """

    model: Any
    data: Any
    qpos: Array
    qvel: Array
    ctrl: Array
    applied: Array
    warnings: Any


class Progress(NamedTuple):
    """How far a call of the loop came: control instants logged, and why it stopped (``RUNNING``: it did not)."""

    logged: int
    status: int


def close_loop(
    law: Any,
    parameters: Array,
    state: Array,
    plant: Plant,
    nominal: Nominal,
    settings: Any,
    desired: Any,
    ahead: Any,
    disturbance: Array,
    signal: Any,
    command: Any,
    log: Any,
    states: Array,
) -> Progress:
    """Runs ``len(desired)`` control periods from the plant's present state.

    Args:
        law: step function ``(signal, parameters, state, command)``.
        parameters: the law's packed parameters.
        state: the law's state, kept from call to call.
        plant: what is stepped.
        nominal: what the law is given H and N of.
        settings: a SETTINGS record.
        desired: the reference as MOTION (n,) at the control instants.
        ahead: the reference at the instants for which model and feed-forward are evaluated (n,).
        disturbance: torque on the joint [N·m] during each physics step (n · substeps, 3).
        signal: a SIGNAL record, working memory.
        command: a COMMAND record, working memory.
        log: array of LOG (n,), written.
        states: the law's state before each step (n, size of the state), written.
    """
    for k in range(len(desired)):
        p, w = plant.qpos, plant.qvel
        q = (p[0], p[1], p[2], p[3])
        rate = (w[0], w[1], w[2])
        sense(signal, settings, k, q, rate, desired[k])
        model_ahead(signal, settings, nominal, q, rate, desired[k], ahead[k])
        for i in range(states.shape[1]):
            states[k, i] = state[i]
        for i in range(3):
            command.torque[i] = command.surface[i] = command.slope[i] = np.nan
        law(signal, parameters, state, command)
        u = command.torque
        if not (np.isfinite(u[0]) and np.isfinite(u[1]) and np.isfinite(u[2])):
            return Progress(k, NO_TORQUE)
        saturated = apply_torque(u, settings, plant.ctrl)
        record(log[k], signal, command, settings, plant.ctrl, saturated)
        for step in range(k * settings.substeps, (k + 1) * settings.substeps):
            for i in range(3):
                plant.applied[i] = disturbance[step, i]
            mj_step(plant.model, plant.data)
        for kind in range(BAD_POSITION, BAD_CONTROL + 1):
            if plant.warnings[kind] > 0:
                return Progress(k + 1, UNSTABLE)
        speed = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        if not np.isfinite(speed):
            return Progress(k + 1, UNSTABLE)
        if speed > settings.rate_limit:
            return Progress(k + 1, TOO_FAST)
    return Progress(len(desired), RUNNING)


def sense(signal: Any, settings: Any, k: int, q: Any, rate: Any, desired: Any) -> None:
    """Writes what is measured and desired at control instant k, and the tracking errors."""
    d, v = desired.attitude, desired.rate
    target = (d[0], d[1], d[2], d[3])
    e = attitude_error(q, target)
    de = rate_error(q, rate, target, (v[0], v[1], v[2]))
    signal.time = (settings.first + k) * settings.period
    signal.period = settings.period
    for i in range(4):
        signal.attitude[i] = q[i]
        signal.desired_attitude[i] = d[i]
    for i in range(3):
        signal.rate[i] = rate[i]
        signal.desired_rate[i] = v[i]
        signal.error[i] = e[i]
        signal.rate_error[i] = de[i]


def model_ahead(signal: Any, settings: Any, nominal: Nominal, q: Any, rate: Any, desired: Any, ahead: Any) -> None:
    """Writes feed-forward, H and N, at the state predicted for ``settings.ahead`` seconds from now.

    The torque is held over the whole period, so the model is best evaluated for the middle of it. The prediction takes
    the feed-forward of this instant for the acceleration until then.
    """
    d, v, a = desired.attitude, desired.rate, desired.acceleration
    if settings.ahead > 0.0:
        now = feed_forward(q, rate, (d[0], d[1], d[2], d[3]), (v[0], v[1], v[2]), (a[0], a[1], a[2]))
        q, rate = advance(q, rate, now, settings.ahead)
        d, v, a = ahead.attitude, ahead.rate, ahead.acceleration
    then = feed_forward(q, rate, (d[0], d[1], d[2], d[3]), (v[0], v[1], v[2]), (a[0], a[1], a[2]))
    for i in range(3):
        signal.feed_forward[i] = then[i]
    s = settings.rate_scale
    evaluate(nominal, q, (s * rate[0], s * rate[1], s * rate[2]), signal.H, signal.N)


def apply_torque(torque: Any, settings: Any, ctrl: Array) -> float:
    """Writes the motor controls that make ``torque``, within their limits; 1 if a limit cut it, else 0."""
    saturated = 0.0
    for i in range(3):
        wanted = 0.0
        for j in range(3):
            wanted += settings.controls[i, j] * torque[j]
        ctrl[i] = wanted
        if wanted < settings.lower[i]:
            ctrl[i] = settings.lower[i]
            saturated = 1.0
        elif wanted > settings.upper[i]:
            ctrl[i] = settings.upper[i]
            saturated = 1.0
    return saturated


def record(row: Any, signal: Any, command: Any, settings: Any, ctrl: Array, saturated: float) -> None:
    """Writes one row of the log; its torque is what the motors deliver."""
    for i in range(4):
        row.attitude[i] = signal.attitude[i]
    for i in range(3):
        row.rate[i] = signal.rate[i]
        row.error[i] = signal.error[i]
        row.rate_error[i] = signal.rate_error[i]
        row.surface[i] = command.surface[i]
        row.slope[i] = command.slope[i]
        row.torque[i] = 0.0
        for j in range(3):
            row.torque[i] += settings.motors[i, j] * ctrl[j]
    row.saturated = saturated
