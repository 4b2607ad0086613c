"""A search that is kept in a SQLite file, with Optuna. The only file that imports it.

Trials are proposed in batches. What a batch proposes depends on the seed, on its number and on the trials of earlier
batches alone, and only finished trials are stored. So a study that was stopped, however, and one that was continued
with more trials go on exactly as if nothing had happened, on any number of threads.
"""

import json
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.tuning.objective import Score
from spherical_wrist.tuning.ranges import Space

try:
    import optuna
    from sqlalchemy.exc import SQLAlchemyError
except ImportError:
    raise ParameterError("tuning needs Optuna: pip install 'spherical-wrist[tune]'") from None

SamplerName = Literal["nsga2", "tpe"]
BATCH = 8
"""Trials that are proposed together."""
POPULATION = 24
"""Trials of a generation of NSGA-II: whole batches."""
NAME = "tune"
DIRECTIONS: list[Literal["minimize", "maximize"]] = ["minimize", "minimize"]
SCORE, VIOLATION = "wrist tune", "cases not completed"
SAMPLERS: dict[SamplerName, Callable[[int], optuna.samplers.BaseSampler]] = {
    "nsga2": lambda seed: optuna.samplers.NSGAIISampler(population_size=POPULATION, seed=seed),
    "tpe": lambda seed: optuna.samplers.TPESampler(multivariate=True, constant_liar=True, seed=seed),
}
"""Ways to propose trials: NSGA-II (Deb et al., 2002), and the multi-objective tree-structured Parzen estimator."""


class Trial(NamedTuple):
    """Gains that were tried.

    Attributes:
        number: position; 0 for the default gains.
        values: of the ranges, by name.
        score: how they did.
    """

    number: int
    values: Mapping[str, float]
    score: Score


class Batch(NamedTuple):
    """Trials to be scored.

    Attributes:
        first: number of the first of them.
        values: of the ranges, one entry for each trial.
        hand_in: takes their scores, in the same order, and stores them.
    """

    first: int
    values: Sequence[Mapping[str, float]]
    hand_in: Callable[[Sequence[Score]], None]


class Study:
    """The study in a file, made where there is none.

    Args:
        file: the file.

    Raises:
        ParameterError: the file cannot be used, or is no study.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        with _quiet(), _explained(file):
            self._storage = optuna.storages.RDBStorage(f"sqlite:///{file}")
            self._stored = optuna.create_study(
                study_name=NAME, storage=self._storage, directions=DIRECTIONS, load_if_exists=True
            )
            self._stored.set_metric_names(["RMS error [rad]", "chattering [N·m per s]"])
        if any(SCORE not in each.user_attrs for each in self._done()):
            self.close()
            raise ParameterError(f"study {str(file)!r} was not made by wrist tune: give another folder with -o")

    def close(self) -> None:
        """Lets go of the file."""
        self._storage.remove_session()
        self._storage.engine.dispose()

    def remembered(self, key: str) -> Any:
        """What was kept under a name; None where nothing was."""
        text = self._stored.user_attrs.get(key)
        return None if text is None else json.loads(text)

    def remember(self, key: str, value: Any) -> None:
        """Keeps plain data under a name."""
        with _explained(self._file):
            self._stored.set_user_attr(key, json.dumps(value))

    def trials(self) -> list[Trial]:
        """The trials that are done."""
        return [Trial(each.number, each.params, Score.from_plain(each.user_attrs[SCORE])) for each in self._done()]

    def batches(self, space: Space, sampler: SamplerName, seed: int, trials: int) -> Iterator[Batch]:
        """Batches of gains to be scored, until so many trials are there. Each must be handed in before the next."""
        ranges: dict[str, optuna.distributions.BaseDistribution] = {
            each.name: optuna.distributions.FloatDistribution(each.low, each.high, log=each.logarithmic)
            for each in space.ranges
        }
        while (done := len(self._done())) < trials:
            start = done - done % BATCH
            with _quiet():
                view = self._view(start, space, sampler, seed)
                asked = [view.ask(ranges) for _ in range(BATCH)][done - start : trials - start]
            yield Batch(done, [each.params for each in asked], partial(self._hand_in, view, asked))

    def _hand_in(self, view: optuna.Study, asked: Sequence[optuna.Trial], scores: Sequence[Score]) -> None:
        with _quiet(), _explained(self._file):
            for trial, score in zip(asked, scores, strict=True):
                trial.set_user_attr(SCORE, score.to_plain())
                trial.set_constraint(VIOLATION, float(score.failed))
                self._stored.add_trial(view.tell(trial, [score.error, score.chattering]))

    def _done(self) -> list[optuna.trial.FrozenTrial]:
        return self._stored.get_trials(deepcopy=False)

    def _view(self, count: int, space: Space, sampler: SamplerName, seed: int) -> optuna.Study:
        """A study in memory with the first trials alone, ready to propose the batch after them."""
        drawn = int(np.random.SeedSequence([seed, count]).generate_state(1)[0])
        view = optuna.create_study(directions=DIRECTIONS, sampler=SAMPLERS[sampler](drawn))
        view.add_trials(self._done()[:count])
        if not count:
            view.enqueue_trial(space.defaults)
        return view


@contextmanager
def _quiet() -> Iterator[None]:
    """Without Optuna's own log, and its notes on what is new in it."""
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        optuna.logging.set_verbosity(before)


@contextmanager
def _explained(file: Path) -> Iterator[None]:
    try:
        yield
    except (SQLAlchemyError, optuna.exceptions.OptunaError, RuntimeError, ValueError) as error:
        cause = error.__cause__ or error
        told = one_line(getattr(cause, "orig", None) or cause, limit=120)
        advice = "free some space, or give another folder with -o" if "full" in told else "give another folder with -o"
        raise ParameterError(f"study {str(file)!r} cannot be used: {told}; {advice}") from None
