"""Closed loop: error → nominal H, N → law → torque → physics → log, once per control period.

The same source runs interpreted (in a debugger or a notebook) and compiled (by ``compiler``). It therefore uses plain
loops over scalars, and only what can be compiled.
"""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco import mj_step

from spherical_wrist import channels
from spherical_wrist.actuation.drive import Drive, aim, motor_torque, set_torque_command, step_motors
from spherical_wrist.arrays import Array
from spherical_wrist.dynamics import Nominal
from spherical_wrist.loop.constraints import Constraints, note_constraints
from spherical_wrist.loop.instant import write_errors, write_model
from spherical_wrist.sensing.measure import Sensor, measure
from spherical_wrist.so3 import Quaternion, Vector3, attitude_error, rate_error

LOG, LAW_CHANNELS = channels.LOG, channels.LAW_CHANNELS
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
RUNNING, TOO_FAST, UNSTABLE, NO_TORQUE, RAISED = 0, 1, 2, 3, 4
BAD_POSITION = int(mujoco.mjtWarning.mjWARN_BADQPOS)
BAD_CONTROL = int(mujoco.mjtWarning.mjWARN_BADCTRL)


class Plant(NamedTuple):
    """Plant model, and views of the data that the loop reads or writes.

    Attributes:
        model: MjModel, or its address.
        data: MjData, or its address.
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
    """Progress of one call of the loop.

    Attributes:
        logged: number of control instants logged.
        status: reason for stopping early; ``RUNNING`` if all inputs were used. The loop ends with the exception of a
            law that raises; its caller writes ``RAISED``.
    """

    logged: int
    status: int


def close_loop(
    law: Any,
    parameters: Array,
    state: Array,
    plant: Plant,
    constraints: Constraints,
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
    """Run ``len(desired)`` control periods from the present state of the plant.

    Args:
        law: step function ``(signal, parameters, state, command)``.
        parameters: the law's packed parameters.
        state: the law's packed state, updated.
        plant: plant, stepped.
        constraints: what acts on the plant alone, updated.
        nominal: nominal model, which gives H and N.
        sensor: sensors, which give the law the measured state.
        drive: motors, which turn the law's torque into the torque on the plant.
        settings: SETTINGS record.
        desired: reference at the control instants, MOTION (n,).
        seen: reference at the times of the samples that the law gets, MOTION (n,); the law's errors use it.
        ahead: reference at the times for which model and feed-forward are evaluated, MOTION (n,).
        samples: sensor faults, SAMPLE (n,).
        disturbance: torque on the joint [N·m] during each physics step (n · substeps, 3).
        signal: SIGNAL record, working memory.
        command: COMMAND record, working memory.
        log: LOG (n,), written.
        states: the law's state before each step (n, size of the state), written.
        currents: coil currents at the end of each period (n, coils) [A], written.
    """
    sensing, motors = sensor.settings, drive.settings
    for k in range(len(desired)):
        p, w = plant.qpos, plant.qvel
        q = (p[0], p[1], p[2], p[3])
        rate = (w[0], w[1], w[2])
        sensed = take_sample(signal, settings, k, q, rate, sensor, samples[k], seen[k])
        attitude, measured_rate, age = sensed.attitude, sensed.rate, sensed.age
        write_model(signal, settings.rate_scale, nominal, attitude, measured_rate, seen[k], ahead[k], sensed.horizon)
        aim(drive, attitude, measured_rate, age, signal.torque_limit)
        for i in range(states.shape[1]):
            states[k, i] = state[i]
        clear(command)
        law(signal, parameters, state, command)
        u = command.torque
        if not (np.isfinite(u[0]) and np.isfinite(u[1]) and np.isfinite(u[2])):
            return Progress(k, NO_TORQUE)
        row = log[k]
        row.saturated = set_torque_command(drive, u, plant.ctrl)
        write_log_row(row, signal, command, motor_torque(motors.motors, plant.ctrl), motors.condition)
        if sensing.ideal < 0.5:
            write_true_state(row, q, rate, desired[k])
        for step in range(k * settings.substeps, (k + 1) * settings.substeps):
            for i in range(3):
                plant.applied[i] = disturbance[step, i]
            if motors.ideal < 0.5:
                step_motors(drive, (p[0], p[1], p[2], p[3]), w, plant.ctrl, plant.applied)
                delivered = motor_torque(motors.motors, plant.ctrl)
                for i in range(3):  # mean over the control period
                    before = row.torque[i] if step > k * settings.substeps else 0.0
                    row.torque[i] = before + delivered[i] / settings.substeps
            mj_step(plant.model, plant.data)
        for j in range(currents.shape[1]):
            currents[k, j] = drive.level[j]
        for kind in range(BAD_POSITION, BAD_CONTROL + 1):
            if plant.warnings[kind] > 0:
                return Progress(k + 1, UNSTABLE)
        if len(constraints.torque) > 0:
            note_constraints(constraints, plant)
        speed = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        if not np.isfinite(speed):
            return Progress(k + 1, UNSTABLE)
        if speed > settings.rate_limit:
            return Progress(k + 1, TOO_FAST)
    return Progress(len(desired), RUNNING)


class SensedState(NamedTuple):
    """State that the sensors give the controller at a control instant.

    Attributes:
        attitude: measured attitude.
        rate: measured rate [rad/s].
        age: known age of the sample [s]; 0 if the sensors give no time stamps.
        horizon: time from the sample to the time for which the model is evaluated [s]; 0 for no prediction.
    """

    attitude: Quaternion
    rate: Vector3
    age: float
    horizon: float


def take_sample(
    signal: Any, settings: Any, k: int, q: Quaternion, rate: Vector3, sensor: Sensor, sample: Any, seen: Any
) -> SensedState:
    """Take the sensor sample of a control instant, and write measured state, desired state and errors to the signal.

    Args:
        signal: SIGNAL record, written.
        settings: SETTINGS record.
        k: index of the control instant in this call of the loop.
        q: true attitude.
        rate: true rate [rad/s].
        sensor: sensors, updated.
        sample: sensor faults, SAMPLE record.
        seen: MOTION record of the reference at the time of the sample that the law gets.
    """
    sensing = sensor.settings
    attitude, measured_rate, age, rate_age = q, rate, 0.0, 0.0
    if sensing.ideal < 0.5:
        measure(sensor, sample, settings.first + k, q, rate)
        m, v = sensing.attitude, sensing.rate
        attitude, measured_rate, age = (m[0], m[1], m[2], m[3]), (v[0], v[1], v[2]), sample.age
        age, rate_age = age * sensing.timestamped, sensing.rate_age * sensing.timestamped
    write_errors(signal, settings, k, attitude, measured_rate, seen, rate_age)
    return SensedState(attitude, measured_rate, age, settings.ahead + age if settings.ahead > 0.0 else 0.0)


def write_log_row(row: Any, signal: Any, command: Any, torque: Any, condition: float) -> None:
    """Write one row of the log, with the measured state as the true one and the commanded torque as delivered."""
    for i in range(4):
        row.attitude[i] = row.measured_attitude[i] = signal.attitude[i]
    for i in range(3):
        row.rate[i] = row.measured_rate[i] = signal.rate[i]
        row.error[i] = signal.error[i]
        row.rate_error[i] = signal.rate_error[i]
        row.torque[i] = row.commanded_torque[i] = torque[i]
    row.condition = condition
    for name in unrolled(LAW_CHANNELS):
        for i in range(len(row[name])):
            row[name][i] = command[name][i]


def clear(command: Any) -> None:
    """Write not-a-number into all of a command, so that missing entries of a law show."""
    for i in range(3):
        command.torque[i] = np.nan
    for name in unrolled(LAW_CHANNELS):
        for i in range(len(command[name])):
            command[name][i] = np.nan


def unrolled(names: Any) -> Any:
    """Return names of fields; in compiled code, the loop over them is unrolled, since every field has its own type."""
    return names


def write_true_state(row: Any, attitude: Any, rate: Any, desired: Any) -> None:
    """Replace the measured state and errors of a log row by the true ones."""
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
