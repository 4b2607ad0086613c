"""Torque that the plant of an experiment needs for its motion, and how much that varies.

A command that follows the motion and balances a slow disturbance varies by as much; a loop that oscillates, or passes
on noise, by more. Unlike the chattering of plain computed torque, which lags behind a plant that is heavier than its
model, this holds for every plant.
"""

import numpy as np

from spherical_wrist.experiment.description import Experiment
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.plant import perturbed


def needed_variation(experiment: Experiment, cache: RunCache) -> float:
    """Compute the total variation per second [N·m/s], mean over the axes, of the torque that the motion needs.

    By inverse dynamics of the plant, with its payload, without dry friction, along the reference in the steady window.

    Args:
        experiment: experiment; its law, sensors, motors and disturbance do not count.
        cache: cache of this thread.
    """
    nominal, plant = cache.wrist(experiment.wrist_file), experiment.perturbation
    timing, steady = experiment.timing(nominal), experiment.measurement(nominal).steady_from
    drawn = experiment.drawn_reference

    def computed() -> float:
        time = timing.instants(0, timing.samples)
        model = NominalModel(perturbed(nominal, plant), timing, cache.engine)
        torque = model.torque(drawn, time[time >= steady])
        return float(np.abs(np.diff(torque, axis=0)).mean()) / timing.control_period

    state = experiment.reference.state()
    return cache.value(("needed", experiment.wrist_file, drawn, state, plant, timing, steady), computed)
