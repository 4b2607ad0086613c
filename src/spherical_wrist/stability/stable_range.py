"""Deviations from an experiment up to which its loop stays stable: mass, payload, and a delay that nobody knows."""

from collections.abc import Callable, Mapping
from math import exp
from typing import Any, NamedTuple

from spherical_wrist.comparison.crossing import CrossingStatus, first_crossing
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.pulse_responses import NotLinearError, SettledLoop
from spherical_wrist.result_table import Column


class Deviation(NamedTuple):
    """Way to deviate from an experiment.

    Attributes:
        name: key in the results.
        column: column of a table.
        first: first deviation that is tested.
        limit: largest deviation.
        value: value of the parameter at a deviation, from that of the experiment.
        own: value of the experiment.
        changes: changes of the experiment for a value.
        factor: factor for display.
        is_delay: the value is a delay beyond that of the experiment, and no parameter of it.
    """

    name: str
    column: Column
    first: float
    limit: float
    value: Callable[[float, float], float]
    own: Callable[[Experiment], float]
    changes: Callable[[float], Mapping[str, Any]]
    factor: float = 1.0
    is_delay: bool = False


DEVIATIONS = (
    Deviation("smallest_mass_scale", Column("mass from", "×"), 0.05, 3.0, lambda own, by: own * exp(-by),
              lambda experiment: experiment.mass_scale, lambda value: {"mass_scale": value}),
    Deviation("largest_mass_scale", Column("mass to", "×"), 0.05, 3.0, lambda own, by: own * exp(by),
              lambda experiment: experiment.mass_scale, lambda value: {"mass_scale": value}),
    Deviation("largest_payload_kg", Column("payload to", "g"), 0.005, 2.0, lambda own, by: own + by,
              lambda experiment: experiment.payload, lambda value: {"payload": value}, 1e3),
    Deviation("largest_unknown_delay_s", Column("unknown delay", "ms"), 1e-4, 0.05, lambda own, by: by,
              lambda experiment: 0.0, lambda value: {}, 1e3, True),
)  # fmt: skip
"""Deviations, each searched alone. Mass scales go in equal ratios up to a factor of 20, delays up to 50 ms."""

TOLERANCE = 0.02


def stable_up_to(
    deviation: Deviation, experiment: Experiment, cache: RunCache, at: float, stop: Callable[[], bool]
) -> float | None:
    """Search for the largest value of a deviation up to which the loop is stable; None if it is up to the limit.

    Stable means: it settles at the pose, and a small disturbance decays. No value tested before it is unstable.

    Args:
        deviation: the deviation.
        experiment: experiment, whose loop is stable.
        cache: cache of this thread.
        at: time of the reference whose attitude is held [s].
        stop: polled a few times a second; returns True to stop.
    """
    own = deviation.own(experiment)

    def holds(by: float) -> bool:
        value = deviation.value(own, by)
        try:
            loop = SettledLoop(
                experiment.replaced(**deviation.changes(value)), cache, at=at,
                unknown_delay=value if deviation.is_delay else 0.0, stop=stop,
            )  # fmt: skip
        except NotLinearError:
            return False
        return loop.is_stable()

    found = first_crossing(holds, deviation.first, deviation.limit, TOLERANCE)
    return None if found.status is CrossingStatus.NEVER else deviation.value(own, found.holds or 0.0)
