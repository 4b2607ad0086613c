"""What an agent sees: what a control law sees, and no more.

======================  =======  =======================================================================================
numbers                 unit     meaning, at the control instant for which the next action is chosen
======================  =======  =======================================================================================
error_x … _z            rad      measured attitude error e = log(q⁻¹ q_d), body frame
rate_error_x … _z       rad/s    measured rate error ė = R_e ω_d − ω, body frame
rate_x … _z             rad/s    measured rate ω, body frame
gravity_x … _z                   direction of gravity in the measured body frame; zero without gravity
desired_rate_x … _z     rad/s    ω_d, desired frame
feed_forward_x … _z     rad/s²   R_e ω̇_d − ω × R_e ω_d, half a control period ahead where the law looks ahead
``previous_…``                   the last action, zero at the start
======================  =======  =======================================================================================

They are what the sensors of the experiment say: noise, resolution, bias, delay and losses included. With the masses of
the nominal model they are all that computed torque needs. Masses, disturbance and true errors of the plant are hidden;
the true errors are in ``info``. All numbers are float64, like those of the laws: errors of the best laws are 10⁻⁶ of
the motion, and a law that is computed from an observation is that law to the last few bits. Libraries that learn in
float32 convert them.

Bounds are finite. A run counts as diverged from 1000 rad/s on; numbers beyond the bounds, which no other run reaches,
are cut there.
"""

from math import isfinite
from typing import Any

import numpy as np

from spherical_wrist.control.contract import SIGNAL
from spherical_wrist.dynamics import MOTION
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.simulation.addresses import records, table
from spherical_wrist.simulation.closed_loop import RATE_LIMIT
from spherical_wrist.simulation.instant import predict
from spherical_wrist.simulation.loop import look
from spherical_wrist.so3 import Vector3, rotate

AXES = ("x", "y", "z")
QUANTITIES = {
    "error": ("rad", 3.1416),
    "rate_error": ("rad/s", 2.0 * RATE_LIMIT),
    "rate": ("rad/s", RATE_LIMIT),
    "gravity": ("", 1.0),
    "desired_rate": ("rad/s", RATE_LIMIT),
    "feed_forward": ("rad/s²", 2.0 * RATE_LIMIT * RATE_LIMIT),
}
"""Unit and bound of each vector that is seen."""

NAMES = tuple(f"{name}_{axis}" for name in QUANTITIES for axis in AXES)
UNITS = tuple(unit for unit, _ in QUANTITIES.values() for _ in AXES)
BOUNDS = np.repeat([bound for _, bound in QUANTITIES.values()], len(AXES))
SEEN = len(NAMES)
"""How many numbers are seen, without the previous action."""


def observe(row: Any, plant: Any, settings: Any, observation: Any) -> None:
    """Writes what is seen at the present control instant, by taking its sample as the loop will take it; compiled.

    The sample is taken on a copy of the sensors, so that the loop takes the same one again. Where the state is not
    finite any more, the last observation stays.

    Args:
        row: a ROW record.
        plant: what is looked at.
        settings: a SETTINGS record, whose first instant is the present one.
        observation: written, (18 and the numbers of an action,).
    """
    p, w, k = plant.qpos, plant.qvel, row.offset
    for i in range(3):
        if not (isfinite(p[i]) and isfinite(p[i + 1]) and isfinite(w[i])):
            return
    parts, inputs, scratch = row.run.parts, row.run.inputs, records(row.scratch, SENSOR)
    scratch[0] = records(parts.sensor.settings, SENSOR)[0]
    sensor, signal = Sensor(scratch[0], table(parts.sensor.history)), records(parts.signal, SIGNAL)[0]
    sample, seen = records(inputs.samples, SAMPLE)[k], records(inputs.seen, MOTION)[k]
    ahead = records(inputs.ahead, MOTION)[k]
    view = look(signal, settings, 0, (p[0], p[1], p[2], p[3]), (w[0], w[1], w[2]), sensor, sample, seen)
    predict(signal, view.attitude, view.rate, seen, ahead, view.horizon)
    q, g = view.attitude, row.gravity
    down = rotate((q[0], -q[1], -q[2], -q[3]), (g[0], g[1], g[2]))
    put(observation, 0, signal.error)
    put(observation, 3, signal.rate_error)
    put(observation, 6, signal.rate)
    put(observation, 9, down)
    put(observation, 12, signal.desired_rate)
    put(observation, 15, signal.feed_forward)


def put(observation: Any, first: int, vector: Vector3) -> None:
    """Writes a vector within its bounds from a place on."""
    for i in range(3):
        bound = BOUNDS[first + i]
        observation[first + i] = min(bound, max(-bound, vector[i]))
