"""Randomness of an experiment: does its result depend on the seed?"""

from collections.abc import Callable
from typing import Any

import numpy as np

from spherical_wrist.experiment.description import Experiment


def is_random(experiment: Experiment) -> bool:
    """Return True if something in an experiment is drawn with its seed.

    Sensors and motors declare the parameters that make them random. Of references and disturbances, which users write
    as well, it is seen from whether they use the generator that they are given.
    """
    if experiment.sensing.is_random or experiment.actuation.is_random:
        return True
    load = experiment.disturbance
    idle = load.built_for_loop or (load.level == 0.0 if load.amplitude is None else load.amplitude == 0.0)
    return _draws(experiment.reference.drawn) or (not idle and _draws(load.shape))


def _draws(function: Callable[[np.random.Generator], Any]) -> bool:
    generator = np.random.default_rng(0)
    before = generator.bit_generator.state
    function(generator)
    return bool(generator.bit_generator.state != before)
