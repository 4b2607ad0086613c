"""The search as an Optuna study, kept in a journal file. The only file that imports Optuna.

Trials are proposed in batches. The proposals of a batch depend only on the seed, on the number of the batch and on the
completed trials of earlier batches: the trials of the batch are stored, as running, before the first of them is scored.
So a study that was stopped, however, and one that was continued with more trials go on exactly as if they had not been
interrupted, on any number of threads.
"""

import errno
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from spherical_wrist.errors import ParameterError, one_line
from spherical_wrist.files import read_whole
from spherical_wrist.missing_package import missing
from spherical_wrist.tuning.objective import Score
from spherical_wrist.tuning.ranges import Space

try:
    import optuna
    from optuna.storages.journal import JournalFileBackend, JournalFileSymlinkLock, JournalStorage
    from optuna.trial import TrialState
except ImportError:
    raise missing("tuning needs Optuna", "tune") from None

SamplerName = Literal["nsga2", "tpe"]
BATCH = 8
"""Trials that are proposed together."""
POPULATION = 24
"""Trials of a generation of NSGA-II: whole batches."""
NAME = "tune"
DIRECTIONS: list[Literal["minimize", "maximize"]] = ["minimize", "minimize"]
SETTINGS, SCORE, VIOLATION = "settings", "score", "cases not completed"
"""Names of user attributes of the study and of its trials, and of the constraint."""
START = b'{"op_code"'
"""Beginning of a journal."""
SAMPLERS: dict[SamplerName, Callable[[int], optuna.samplers.BaseSampler]] = {
    "nsga2": lambda seed: optuna.samplers.NSGAIISampler(population_size=POPULATION, seed=seed),
    "tpe": lambda seed: optuna.samplers.TPESampler(multivariate=True, constant_liar=True, seed=seed),
}
"""Samplers: NSGA-II (Deb et al., 2002), and the multi-objective tree-structured Parzen estimator."""


class Trial(NamedTuple):
    """A trial: gains and their score.

    Attributes:
        number: position among the completed trials; 0 for the default gains.
        values: of the ranges, by name.
        score: of the law with these values.
    """

    number: int
    values: Mapping[str, float]
    score: Score


class ProposedTrials(NamedTuple):
    """Trials to be scored.

    Attributes:
        first: number of the first of them.
        values: of the ranges, one entry for each trial.
        hand_in: stores their scores, given in the same order.
    """

    first: int
    values: Sequence[Mapping[str, float]]
    hand_in: Callable[[Sequence[Score]], None]


class Study:
    """An Optuna study in a journal file, created if there is none.

    Args:
        file: the file; the caller holds its folder.

    Raises:
        ParameterError: the file cannot be used, or is no study of this version.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        with _quiet(), _explained(file):
            _prepare(file)
            self._storage = JournalStorage(JournalFileBackend(str(file), _NoLock(str(file))))
            if NAME in optuna.get_all_study_names(self._storage):  # creating it would also write to the file
                self._study = optuna.load_study(study_name=NAME, storage=self._storage)
            else:
                self._study = optuna.create_study(study_name=NAME, storage=self._storage, directions=DIRECTIONS)
                self._study.set_metric_names(["attitude error, RMS [rad]", "chattering [N·m per s]"])
            foreign = self.settings is None and bool(self._study.trials)
        if foreign:
            raise ParameterError(
                f"study {str(file)!r} was not made by this version of wrist tune: give another folder with -o"
            )

    @property
    def settings(self) -> Any:
        """Settings that the study was begun with, as plain data; None before :meth:`begin`."""
        return self._study.user_attrs.get(SETTINGS)

    def begin(self, settings: Mapping[str, Any]) -> None:
        """Store the settings, as plain data."""
        with _explained(self._file):
            self._study.set_user_attr(SETTINGS, dict(settings))

    def trials(self) -> list[Trial]:
        """Return the completed trials."""
        done = self._in_state(TrialState.COMPLETE)
        return [
            Trial(number, each.params, Score.from_plain(each.user_attrs[SCORE])) for number, each in enumerate(done)
        ]

    def batches(self, space: Space, sampler: SamplerName, seed: int, trials: int) -> Iterator[ProposedTrials]:
        """Yield batches of gains to score until there are so many trials. Each must be handed in before the next."""
        while (done := len(self._in_state(TrialState.COMPLETE))) < trials:
            with _quiet(), _explained(self._file):
                batch = self._proposed(done, space, sampler, seed)[: trials - done]
                values = [each.params for each in batch]
            yield ProposedTrials(done, values, partial(self._hand_in, batch))

    def _proposed(self, done: int, space: Space, sampler: SamplerName, seed: int) -> list[optuna.Trial]:
        """Return the trials of the current batch that are not scored yet; propose the batch if it is a new one."""
        ranges: dict[str, optuna.distributions.BaseDistribution] = {
            each.name: optuna.distributions.FloatDistribution(each.low, each.high, log=each.logarithmic)
            for each in space.ranges
        }
        first = done - done % BATCH
        proposing = SAMPLERS[sampler](int(np.random.SeedSequence([seed, first]).generate_state(1)[0]))
        self._study.sampler = proposing
        running = self._in_state(TrialState.RUNNING)
        if done + len(running) == first + BATCH and all(each.params.keys() == ranges.keys() for each in running):
            return [self._trial(each.number) for each in running]
        # a new batch, or one that a killed command had not proposed to the end: nothing of it is scored
        for each in running:
            self._study.tell(each.number, state=TrialState.FAIL)
        if isinstance(proposing, optuna.samplers.BaseGASampler):
            # stores the parents: the call that selects them returns them in another order than all later calls
            proposing.get_parent_population(self._study, done // POPULATION)
        if not done and not self._in_state(TrialState.WAITING):
            self._study.enqueue_trial(space.defaults)
        return [self._study.ask(ranges) for _ in range(BATCH)]

    def _trial(self, number: int) -> optuna.Trial:
        """Return a running trial of an earlier command."""
        study = self._storage.get_study_id_from_name(NAME)
        return optuna.Trial(self._study, self._storage.get_trial_id_from_study_id_trial_number(study, number))

    def _hand_in(self, batch: Sequence[optuna.Trial], scores: Sequence[Score]) -> None:
        with _quiet(), _explained(self._file):
            for trial, score in zip(batch, scores, strict=True):
                trial.set_user_attr(SCORE, score.to_plain())
                trial.set_constraint(VIOLATION, float(score.failed))
                self._study.tell(trial, [score.error, score.chattering])

    def _in_state(self, state: TrialState) -> list[optuna.trial.FrozenTrial]:
        return self._study.get_trials(deepcopy=False, states=[state])


class _NoLock(JournalFileSymlinkLock):
    """No lock: this command holds the whole folder, and a killed one leaves no lock behind."""

    def acquire(self) -> bool:
        """Do nothing."""
        return True

    def release(self) -> None:
        """Do nothing."""


def _prepare(file: Path) -> None:
    """Refuse a file of another kind, and remove a last line that a full disk or a kill cut off.

    Optuna would write its next line behind either.
    """
    content = read_whole(file) if file.exists() else b""
    if not content.startswith(START[: len(content)]):
        raise ValueError("it is no journal of Optuna")
    if content and not content.endswith(b"\n"):
        os.truncate(file, content.rfind(b"\n") + 1)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Optuna's own log, and its warnings about experimental parts."""
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
    """Turn errors of Optuna and of the system into one line: of a file of another kind, Optuna raises all sorts."""
    try:
        yield
    except (optuna.exceptions.OptunaError, OSError, RuntimeError, ValueError, LookupError, TypeError) as error:
        full = isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        text = (isinstance(error, OSError) and error.strerror) or one_line(error, limit=120)
        advice = "free some space, or give another folder with -o" if full else "give another folder with -o"
        raise ParameterError(f"study {str(file)!r} cannot be used: {text}; {advice}") from None
