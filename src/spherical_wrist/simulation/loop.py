"""The closed loop: error → nominal H, N → law → torque → physics → log, once per control period.

One source, two ways to run it: as it stands (for a debugger or a notebook), or compiled by ``compiler``. It therefore
uses plain loops over scalars, and nothing that cannot be compiled.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco import mj_step

from spherical_wrist.actuation.drive import Drive, ask, make, motor_torque
from spherical_wrist.dynamics import Array, Nominal
from spherical_wrist.sensing.measure import Sensor, measure
from spherical_wrist.simulation.instant import model_ahead, sense
from spherical_wrist.so3 import Quaternion, Vector3, attitude_error, rate_error

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
        ("measured_attitude", "f8", 4),
        ("measured_rate", "f8", 3),
        ("commanded_torque", "f8", 3),
        ("condition", "f8"),
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
    sensor: Sensor,
    drive: Drive,
    settings: Any,
    desired: Any,
    seen: Any,
    ahead: Any,
    samples: Any,
    disturbance: Array,
    signal: Any,
    command: Any,
    log: Any,
    states: Array,
    currents: Array,
) -> Progress:
    """Runs ``len(desired)`` control periods from the plant's present state.

    Args:
        law: step function ``(signal, parameters, state, command)``.
        parameters: the law's packed parameters.
        state: the law's state, kept from call to call.
        plant: what is stepped.
        nominal: what the law is given H and N of.
        sensor: between the plant's state and the law.
        drive: between the law's torque and the plant's motors.
        settings: a SETTINGS record.
        desired: the reference as MOTION (n,) at the control instants.
        seen: the reference at the times of the samples in force (n,): what the law's errors are formed with.
        ahead: the reference at the instants for which model and feed-forward are evaluated (n,).
        samples: the faults of the samples, SAMPLE (n,).
        disturbance: torque on the joint [N·m] during each physics step (n · substeps, 3).
        signal: a SIGNAL record, working memory.
        command: a COMMAND record, working memory.
        log: array of LOG (n,), written.
        states: the law's state before each step (n, size of the state), written.
        currents: coil currents at the end of each period (n, coils) [A], written.
    """
    measured, motors = sensor.settings, drive.settings
    for k in range(len(desired)):
        p, w = plant.qpos, plant.qvel
        q = (p[0], p[1], p[2], p[3])
        rate = (w[0], w[1], w[2])
        view = look(signal, settings, k, q, rate, sensor, samples[k], seen[k])
        attitude, turning, age = view.attitude, view.rate, view.age
        model_ahead(signal, settings.rate_scale, nominal, attitude, turning, seen[k], ahead[k], view.horizon)
        for i in range(states.shape[1]):
            states[k, i] = state[i]
        for i in range(3):
            command.torque[i] = command.surface[i] = command.slope[i] = np.nan
        law(signal, parameters, state, command)
        u = command.torque
        if not (np.isfinite(u[0]) and np.isfinite(u[1]) and np.isfinite(u[2])):
            return Progress(k, NO_TORQUE)
        row = log[k]
        row.saturated = ask(drive, u, attitude, turning, age, plant.ctrl)
        record(row, signal, command, motor_torque(motors.motors, plant.ctrl), motors.condition)
        if measured.perfect < 0.5:
            record_truth(row, q, rate, desired[k])
        for step in range(k * settings.substeps, (k + 1) * settings.substeps):
            for i in range(3):
                plant.applied[i] = disturbance[step, i]
            if motors.perfect < 0.5:
                make(drive, (p[0], p[1], p[2], p[3]), w, plant.ctrl, plant.applied)
                made = motor_torque(motors.motors, plant.ctrl)
                for i in range(3):  # the mean over the period
                    before = row.torque[i] if step > k * settings.substeps else 0.0
                    row.torque[i] = before + made[i] / settings.substeps
            mj_step(plant.model, plant.data)
        for j in range(currents.shape[1]):
            currents[k, j] = drive.level[j]
        for kind in range(BAD_POSITION, BAD_CONTROL + 1):
            if plant.warnings[kind] > 0:
                return Progress(k + 1, UNSTABLE)
        speed = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        if not np.isfinite(speed):
            return Progress(k + 1, UNSTABLE)
        if speed > settings.rate_limit:
            return Progress(k + 1, TOO_FAST)
    return Progress(len(desired), RUNNING)


class View(NamedTuple):
    """What the controller sees at a control instant.

    Attributes:
        attitude: measured.
        rate: measured [rad/s].
        age: what is known of the age of both [s].
        horizon: how far ahead of them the law wants its model [s].
    """

    attitude: Quaternion
    rate: Vector3
    age: float
    horizon: float


def look(
    signal: Any, settings: Any, k: int, q: Quaternion, rate: Vector3, sensor: Sensor, sample: Any, seen: Any
) -> View:
    """Takes the sample of control instant k of this call, and writes what is measured, desired and the errors.

    Args:
        signal: written.
        settings: a SETTINGS record.
        k: number of the instant.
        q: true attitude.
        rate: true rate [rad/s].
        sensor: takes the sample.
        sample: its faults, a SAMPLE record.
        seen: the reference, as MOTION, at the time of the sample in force.
    """
    measured = sensor.settings
    attitude, turning, age, rate_age = q, rate, 0.0, 0.0
    if measured.perfect < 0.5:
        measure(sensor, sample, settings.first + k, q, rate)
        m, v = measured.attitude, measured.rate
        attitude, turning, age = (m[0], m[1], m[2], m[3]), (v[0], v[1], v[2]), sample.age
        age, rate_age = age * measured.timestamped, measured.rate_age * measured.timestamped
    sense(signal, settings, k, attitude, turning, seen, rate_age)
    return View(attitude, turning, age, settings.ahead + age if settings.ahead > 0.0 else 0.0)


def record(row: Any, signal: Any, command: Any, torque: Any, condition: float) -> None:
    """Writes one row of the log, what is measured for the truth, and ``torque`` for what the motors deliver."""
    for i in range(4):
        row.attitude[i] = row.measured_attitude[i] = signal.attitude[i]
    for i in range(3):
        row.rate[i] = row.measured_rate[i] = signal.rate[i]
        row.error[i] = signal.error[i]
        row.rate_error[i] = signal.rate_error[i]
        row.surface[i] = command.surface[i]
        row.slope[i] = command.slope[i]
        row.torque[i] = row.commanded_torque[i] = torque[i]
    row.condition = condition


def record_truth(row: Any, attitude: Any, rate: Any, desired: Any) -> None:
    """Writes the true state and the true errors over those that the sensors gave."""
    d, v = desired.attitude, desired.rate
    target = (d[0], d[1], d[2], d[3])
    e = attitude_error(attitude, target)
    de = rate_error(attitude, rate, target, (v[0], v[1], v[2]))
    for i in range(4):
        row.attitude[i] = attitude[i]
    for i in range(3):
        row.rate[i] = rate[i]
        row.error[i] = e[i]
        row.rate_error[i] = de[i]
