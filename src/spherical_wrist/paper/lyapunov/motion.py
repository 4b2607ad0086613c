"""Motion of a sliding surface along a run: Ṡ from the plant's own dynamics, without numerical differentiation.

With ė = R_e ω_d − ω, exactly d/dt ė = a_d − ω̇, where a_d = R_e ω̇_d − ω × R_e ω_d is the feed-forward, and
d/dt e = J⁻¹(e) ė, where J is the left Jacobian of SO(3): the error rotation exp(e) turns with ė. So, per axis,

    Ṡ = d/dt (λ e + ė) = a_r − ω̇,    a_r = a_d + λ J⁻¹(e) ė + λ̇ e.

ω̇ is computed by the plant's own MuJoCo model from the recorded state, motor torque and disturbance, with its payload,
damping, dry friction and joint limits.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.simulation.run import Run
from spherical_wrist.so3 import feed_forward
from spherical_wrist.wrist import Wrist


class SurfaceMotion(NamedTuple):
    """Motion of S along a run of n control instants; body frame.

    Attributes:
        H: inertia matrix of the plant [kg·m²], (3, 3). In the body frame it is the same at every attitude.
        H_nominal: that of the nominal model [kg·m²], (3, 3).
        steady: acceleration a_r [rad/s²] that keeps S constant, (n, 3).
        after: Ṡ [rad/s²] just after each control instant, under the torque of that instant, (n, 3).
        before: Ṡ [rad/s²] just before instants 1 … n − 1, still under the torque of the instant before, (n − 1, 3).
    """

    H: Array
    H_nominal: Array
    steady: Array
    after: Array
    before: Array


def surface_motion(run: Run) -> SurfaceMotion:
    """Compute the motion of the sliding surface of a run, which must have every control instant and a surface.

    The change of the slope, of laws that tune it, is taken as constant over each period. A disturbance that changes
    within a period, between physics steps, counts with its value at the period's start.
    """
    experiment = run.experiment
    nominal, plant = experiment.nominal(), plant_of(experiment)
    timestep = experiment.timing(nominal).physics_period
    # the last instant has no period of its own in the recording: it gets the change of the previous one
    slope_rate = np.diff(run.slope, axis=0, append=2.0 * run.slope[-1:] - run.slope[-2:-1]) / experiment.control_period
    carried = run.slope * error_derivative(run.error, run.rate_error) + _feed_forward(run)
    steady = carried + slope_rate * run.error
    steady_before = carried[1:] + slope_rate[:-1] * run.error[1:]
    applied = run.torque + run.disturbance
    after = steady - acceleration(plant, timestep, run.attitude, run.rate, applied)
    before = steady_before - acceleration(plant, timestep, run.attitude[1:], run.rate[1:], applied[:-1])
    return SurfaceMotion(inertia(plant), inertia(nominal), steady, after, before)


def error_derivative(error: Array, rate_error: Array) -> Array:
    """Compute d/dt e = J⁻¹(e) ė [rad/s] for e = log(q⁻¹ q_d) and ė, each (n, 3): ė − ½ e × ė + c e × (e × ė).

    c = (1 − ½ |e| cot ½ |e|) / |e|², the inverse left Jacobian of SO(3). To first order in e it is ė − ½ e × ė.
    """
    angle = np.linalg.norm(error, axis=1, keepdims=True)
    small = angle < 1e-3
    half = 0.5 * np.where(small, 1.0, angle)
    # below a milliradian the closed form loses digits, and two terms of its series are exact
    c = np.where(small, (1.0 + angle**2 / 60.0) / 12.0, (1.0 - half / np.tan(half)) / (2.0 * half) ** 2)
    across = np.cross(error, rate_error)
    derivative: Array = rate_error - 0.5 * across + c * np.cross(error, across)
    return derivative


def acceleration(wrist: Wrist, timestep: float, attitude: Array, rate: Array, torque: Array) -> Array:
    """Compute ω̇ [rad/s²], (n, 3), at attitudes (n, 4) and rates (n, 3) under body-frame torques (n, 3) [N·m].

    One ``mj_forward`` per row, about 5 µs. The physics step [s] matters if the model has friction or limits, because
    their softness in MuJoCo depends on it.
    """
    model = physics_model(wrist, timestep)
    data = mujoco.MjData(model)
    found = np.empty((len(rate), 3))
    with warnings_kept_in_data():
        for k in range(len(rate)):
            data.qpos[:] = attitude[k]
            data.qvel[:] = rate[k]
            data.qfrc_applied[:] = torque[k]
            mujoco.mj_forward(model, data)
            found[k] = data.qacc
    return found


def inertia(wrist: Wrist) -> Array:
    """Compute the inertia matrix H [kg·m²], (3, 3), of a wrist about its joint, body frame."""
    data, H = mujoco.MjData(wrist.model), np.empty((3, 3))
    mujoco.mj_forward(wrist.model, data)
    mujoco.mj_fullM(wrist.model, data, H)
    return H


def _feed_forward(run: Run) -> Array:
    """Compute a_d [rad/s²] at the control instants, (n, 3)."""
    motion = run.experiment.drawn_reference.motion(run.time)
    vectors = (run.attitude, run.rate, run.desired_attitude, run.desired_rate, motion["acceleration"])
    columns = [tuple(np.ascontiguousarray(vector.T)) for vector in vectors]
    # plain arithmetic on components: the scalar function takes whole columns as well
    return np.stack(feed_forward(*columns), axis=1)
