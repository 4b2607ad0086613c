"""Search for the gains of a law by the criterion: CMA-ES, from the middle of the declared ranges, with a seed."""

from concurrent.futures import CancelledError
from functools import partial
from typing import NamedTuple

import numpy as np

from spherical_wrist.control import Law
from spherical_wrist.design.criterion import INFEASIBLE, cost
from spherical_wrist.design.record import TRIALS
from spherical_wrist.errors import ParameterError
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.missing_package import missing
from spherical_wrist.parameters import searched, unit_of
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress
from spherical_wrist.tuning.ranges import Range, Space, numbers, space_of

try:
    from cmaes import CMA
except ImportError:
    raise missing("a search for gains needs cmaes", "tune") from None

SPREAD = 0.25
"""Standard deviation of the first candidates, as a share of the range on its logarithmic scale."""


class Found(NamedTuple):
    """Best gains of a search.

    Attributes:
        law: law with these gains.
        gains: the searched ones by name.
        cost: see :func:`.criterion.cost`.
        trials: number of sets of gains that were to be tried.
    """

    law: Law
    gains: dict[str, float]
    cost: float
    trials: int


def designed() -> list[str]:
    """Return the names of the laws of the package whose gains are searched: all but baselines and the paper's."""
    members = {name: member for name, member in Law.members.items() if issubclass(member, Law)}
    return [name for name, member in members.items() if member.status in ("rival", "ours")]


def space_of_design(law: Law) -> Space:
    """Return the ranges to search: those that the law declares, or else a factor up and down from its own gains.

    Raises:
        ParameterError: the law has no gains.
    """
    declared = {name: searched(type(law), name) for name in numbers(law)}
    ranges = tuple(
        Range(f"law.{name}", *ends, _largest(getattr(law, name)), unit_of(type(law), name))
        for name, ends in declared.items()
        if ends is not None
    )
    return Space(law, ranges) if ranges else space_of(law)


def _largest(value: float | tuple[float, ...]) -> float:
    return max(value, key=abs) if isinstance(value, tuple) else value


def find_gains(
    law: Law, *, seed: int = 0, trials: int = TRIALS, jobs: int | None = None, progress: Progress = ignore_progress
) -> Found:
    """Search for the gains of a law. The result depends on its declared ranges, the seed and the budget alone.

    Args:
        law: law whose other parameters stay as they are; its own gains count only if it declares no ranges.
        seed: seed of the search.
        trials: number of sets of gains to try; the last generation is finished.
        jobs: number of threads; the result does not depend on it.
        progress: called with the number of tried sets of gains and of all.

    Raises:
        ParameterError: the law has no gains, or there are no trials.
        CancelledError: the work was stopped.
    """
    if trials < 1:
        raise ParameterError(f"--trials {trials}: must be 1 or more")
    space = space_of_design(law)
    names = [each.name for each in space.ranges]
    low, high = (np.log([getattr(each, end) for each in space.ranges]) for end in ("low", "high"))
    # a law with one gain has a second coordinate that does nothing: CMA-ES needs two
    size = max(2, len(names))
    bounds = np.tile([0.0, 1.0], (size, 1))
    method = CMA(mean=np.full(size, 0.5), sigma=SPREAD, bounds=bounds, seed=seed)
    runner, best, done = Runner(jobs), None, 0
    progress(0, trials)
    while done < trials and not method.should_stop():
        points = [method.ask() for _ in range(method.population_size)]
        values = [
            dict(zip(names, np.exp(low + point[: len(names)] * (high - low)).tolist(), strict=True)) for point in points
        ]
        costs = runner.map(partial(_cost, space), values)
        method.tell(list(zip(points, costs, strict=True)))
        for value, found in zip(values, costs, strict=True):
            if best is None or found < best[0]:
                best = found, value
        done += len(points)
        progress(min(done, trials), trials)
    assert best is not None
    gains = {name.removeprefix("law."): value for name, value in space.used(best[1]).items()}
    return Found(space.law_with(best[1]), gains, best[0], trials)


def _cost(space: Space, values: dict[str, float], worker: Worker) -> float:
    try:
        return cost(space.law_with(values), worker)
    except ParameterError:  # the law refuses these gains together
        return 100.0 * INFEASIBLE
    except StoppedError:
        raise CancelledError from None
