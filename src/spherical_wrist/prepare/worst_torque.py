"""Largest tip error that a bounded disturbance can cause, by the linear response of the loop, and its waveform.

Torque d_j on the joint during control period j displaces the tip at instant K by x_K = Σ_j h_{K−j} d_j, with h_k the
response k periods after a unit pulse. Along a unit vector n, and for |d_j| ≤ 1 on every axis i,

    max n·x_K = Σ_k Σ_i |n·h_{k,i}|,   attained by   d_{K−k,i} = sgn(n·h_{k,i}).

This peak-to-peak gain is the l1 norm of the response (Dahleh and Diaz-Bobillo, *Control of Uncertain Systems*, 1995,
section 2.3). The largest displacement is that along the best n. The bound holds for torques that are constant over a
control period, and for loops that are linear.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.disturbance import GRACE, Constant, Torque
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.pulse_responses import SettledLoop

ATTAINED = 0.999
"""Part of the gain that a waveform attains, which is cut off before that."""

NOTHING = 1e-7
"""Response relative to the largest one that counts as none: torque about an axis on which the tip lies."""


class WorstTorque(NamedTuple):
    """Worst disturbance of a loop.

    Attributes:
        gain: largest displacement of the tip per N·m of bound on the torque of every axis [m/(N·m)].
        direction: direction of that displacement in the world, (3,).
        levels: torque of unit size in the control periods before that, the last period first, (n, 3).
    """

    gain: float
    direction: Array
    levels: Array

    def torque(self, period: float, last: int) -> Torque:
        """Return the waveform as a function of time [s], repeated, with a peak of the displacement at an instant.

        Args:
            period: control period [s].
            last: number of that control instant.
        """

        def torque(time: Array) -> Array:
            instant = np.floor((time + GRACE) / period).astype(np.int64)
            found: Array = self.levels[np.mod(last - 1 - instant, len(self.levels))]
            return found

        return torque


def worst_torque(response: Array) -> WorstTorque:
    """Compute the worst disturbance from the response of the tip.

    The gain is a convex function of the direction. It is evaluated all around the circle in which the tip moves; from
    the best point, waveform and direction of what it makes are improved in turn, which can only raise the gain.

    Args:
        response: displacement of the tip [m] k control periods after a pulse of 1 N·m, (n, 3, 3): k, output, axis.
    """
    plane = np.linalg.svd(response.transpose(1, 0, 2).reshape(3, -1), full_matrices=False)[0][:, :2]
    angle = np.linspace(0.0, np.pi, 180, endpoint=False)
    around = np.cos(angle)[:, None] * plane[:, 0] + np.sin(angle)[:, None] * plane[:, 1]
    direction = around[np.argmax([np.abs(_along(each, response)).sum() for each in around])]
    for _ in range(100):
        moved = np.einsum("koi,ki->o", response, np.sign(_along(direction, response)))
        size = float(np.linalg.norm(moved))
        if size == 0.0 or np.allclose(moved / size, direction, rtol=0.0, atol=1e-12):
            break
        direction = moved / size
    along = _along(direction, response)
    parts = np.abs(along)
    gain = float(parts.sum())
    levels = np.where(parts > NOTHING * parts.max(), np.sign(along), 0.0)[1:]  # row 0 is the instant of the pulse
    reached = parts[1:].sum(axis=1).cumsum()
    return WorstTorque(gain, direction, levels[: 1 + int(np.searchsorted(reached, ATTAINED * gain))])


def _along(direction: Array, response: Array) -> Array:
    """Return the response along a direction, (n, 3 axes)."""
    found: Array = np.einsum("o,koi->ki", direction, response)
    return found


def cached_worst_torque(experiment: Experiment, cache: RunCache, stop: Callable[[], bool] = lambda: False) -> Torque:
    """Return the disturbance of unit size that is worst for the loop of an experiment, about its first attitude.

    Args:
        experiment: experiment; all of it counts except the disturbance, the errors at the start and the duration.
        cache: cache of this thread.
        stop: polled a few times a second; returns True to stop.

    Raises:
        NotLinearError: the loop has no linear response.
        StoppedError: ``stop`` returned True.
    """
    nothing = (0.0, 0.0, 0.0)
    loop = experiment.replaced(
        disturbance=Constant(level=0.0), duration=experiment.control_period, steady_from=None,
        initial_error=nothing, initial_rate_error=nothing,
    )  # fmt: skip

    def computed() -> WorstTorque:
        return worst_torque(SettledLoop(loop, cache, stop=stop).torque_responses().tip)

    worst = cache.value(("worst", loop, experiment.reference.state()), computed)
    last = experiment.timing(cache.wrist(experiment.wrist_file)).samples - 1
    return worst.torque(experiment.control_period, last)
