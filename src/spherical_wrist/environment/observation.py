"""Observations: exactly the signals that a control law gets.

======================  =======  =======================================================================================
numbers                 unit     meaning, at the control instant of the next action
======================  =======  =======================================================================================
error_x … _z            rad      measured attitude error e = log(q⁻¹ q_d), body frame
rate_error_x … _z       rad/s    measured rate error ė = R_e ω_d − ω, body frame
rate_x … _z             rad/s    measured rate ω, body frame
gravity_x … _z                   direction of gravity in the measured body frame; zero without gravity
desired_rate_x … _z     rad/s    ω_d, desired frame
feed_forward_x … _z     rad/s²   R_e ω̇_d − ω × R_e ω_d, half a control period ahead if the law predicts
``previous_…``                   the last action, zero at the start
======================  =======  =======================================================================================

They are the outputs of the experiment's sensors, with noise, resolution, bias, delay and lost samples. Computed torque
needs only these and the masses of the nominal model. Masses, disturbance and true errors of the plant are not observed;
the true errors are in ``info``. All numbers are float64, as in the laws: the errors of the best laws are 10⁻⁶ of the
motion, and a law computed from an observation agrees with the built-in law to the last few bits. Libraries that learn
in float32 convert them.

Bounds are finite. A run has diverged at 1000 rad/s; numbers beyond the bounds, which only such a run reaches, are
clipped.
"""

from math import isfinite
from typing import Any

import numpy as np

from spherical_wrist.channels import XYZ
from spherical_wrist.control.contract import SIGNAL
from spherical_wrist.dynamics import MOTION
from spherical_wrist.loop.addresses import records, table
from spherical_wrist.loop.instant import predict
from spherical_wrist.loop.loop import take_sample
from spherical_wrist.prepare.closed_loop import RATE_LIMIT
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.so3 import Vector3, rotate

AXES = XYZ
QUANTITIES = {
    "error": ("rad", 3.1416),
    "rate_error": ("rad/s", 2.0 * RATE_LIMIT),
    "rate": ("rad/s", RATE_LIMIT),
    "gravity": ("", 1.0),
    "desired_rate": ("rad/s", RATE_LIMIT),
    "feed_forward": ("rad/s²", 2.0 * RATE_LIMIT * RATE_LIMIT),
}
"""Unit and bound of each observed vector."""

NAMES = tuple(f"{name}_{axis}" for name in QUANTITIES for axis in AXES)
UNITS = tuple(unit for unit, _ in QUANTITIES.values() for _ in AXES)
BOUNDS = np.repeat([bound for _, bound in QUANTITIES.values()], len(AXES))
MEASURED_SIZE = len(NAMES)
"""Size of an observation without the previous action."""


def observe(record: Any, plant: Any, settings: Any, observation: Any) -> None:
    """Write the observation at the present control instant. Compiled.

    The sensor sample is taken with a copy of the sensors, so that the loop takes the same sample again. If the state is
    not finite, the last observation stays.

    Args:
        record: EPISODE_RECORD record.
        plant: plant.
        settings: SETTINGS record, whose first instant is the present one.
        observation: observation (18 + size of an action,); its first 18 numbers are written.
    """
    p, w, k = plant.qpos, plant.qvel, record.offset
    for i in range(3):
        if not (isfinite(p[i]) and isfinite(p[i + 1]) and isfinite(w[i])):
            return
    parts, inputs, copied = record.run.parts, record.run.inputs, records(record.sensor_copy, SENSOR)
    copied[0] = records(parts.sensor.settings, SENSOR)[0]
    sensor, signal = Sensor(copied[0], table(parts.sensor.history)), records(parts.signal, SIGNAL)[0]
    sample, seen = records(inputs.samples, SAMPLE)[k], records(inputs.seen, MOTION)[k]
    ahead = records(inputs.ahead, MOTION)[k]
    sensed = take_sample(signal, settings, 0, (p[0], p[1], p[2], p[3]), (w[0], w[1], w[2]), sensor, sample, seen)
    predict(signal, sensed.attitude, sensed.rate, seen, ahead, sensed.horizon)
    q, g = sensed.attitude, record.gravity
    down = rotate((q[0], -q[1], -q[2], -q[3]), (g[0], g[1], g[2]))
    write_clipped(observation, 0, signal.error)
    write_clipped(observation, 3, signal.rate_error)
    write_clipped(observation, 6, signal.rate)
    write_clipped(observation, 9, down)
    write_clipped(observation, 12, signal.desired_rate)
    write_clipped(observation, 15, signal.feed_forward)


def write_clipped(observation: Any, first: int, vector: Vector3) -> None:
    """Write a vector, clipped to its bounds, from index ``first`` on."""
    for i in range(3):
        bound = BOUNDS[first + i]
        observation[first + i] = min(bound, max(-bound, vector[i]))
