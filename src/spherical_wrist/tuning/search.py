"""Search for gains: proposals are scored on a family of wrists and stored."""

import hashlib
import time
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.comparison.law_selection import BASELINE
from spherical_wrist.errors import ParameterError
from spherical_wrist.folder_lock import folder_lock
from spherical_wrist.simulation.run import versions
from spherical_wrist.simulation.runner import Progress, Runner, ignore_progress
from spherical_wrist.tuning.family import Family
from spherical_wrist.tuning.objective import Score
from spherical_wrist.tuning.ranges import Space
from spherical_wrist.tuning.scoring import idle_ranges, proposed_scores, scores_of
from spherical_wrist.tuning.study import SamplerName, Study, Trial
from spherical_wrist.tuning.study_check import check_same

FILE, OLD_FILE = "tune.log", "tune.db"
"""Files of a study: of this version, and of versions up to 0.1, whose studies cannot be continued."""


class Search(NamedTuple):
    """Settings of a search.

    Attributes:
        space: the law and the ranges of its parameters.
        own: True if the user gave the ranges; default ranges that change nothing on the family are left out.
        family: cases that gains are scored on.
        sampler: name of the sampler that proposes trials.
        seed: of the sampler.
    """

    space: Space
    own: bool
    family: Family
    sampler: SamplerName
    seed: int

    def summary(self) -> dict[str, Any]:
        """Return the settings as plain data: a study continues only if they are the same."""
        law = self.space.law
        return {
            "law": law.model_dump(mode="json"),
            "file of the law": hashlib.sha256(law.source()).hexdigest(),
            "range": {each.name: [each.low, each.high] for each in self.space.ranges},
            "ranges given": self.own,
            "case": self.family.summary(),
            "bound": self.family.bound,
            "sampler": self.sampler,
            "seed": self.seed,
        }


class SearchResult(NamedTuple):
    """Trials of a search so far.

    Attributes:
        search: settings of the search.
        space: the ranges without the idle ones.
        idle: names of ranges that change nothing.
        plain: score of plain computed torque.
        trials: completed trials, the default gains first.
        stopped: True if there are fewer trials than requested.
        versions: of the packages that the study was begun with.
        wall_time: time that this part of the search took [s].
    """

    search: Search
    space: Space
    idle: tuple[str, ...]
    plain: Score
    trials: tuple[Trial, ...]
    stopped: bool
    versions: Mapping[str, str]
    wall_time: float


def tune(
    search: Search,
    folder: Path,
    trials: int,
    *,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
    stop: Callable[[], bool] = lambda: False,
) -> SearchResult | None:
    """Search for gains until the study in a folder has so many trials; continue a study that is there.

    Args:
        search: settings of the search.
        folder: folder of the study, ``tune.log`` in it; made if there is none.
        trials: number of trials, including those of earlier calls.
        jobs: threads; None for one per core. The result does not depend on it.
        progress: called with the number of completed trials and of all.
        stop: polled during the search; completed trials are kept when it returns True.

    Returns:
        Trials of this and of earlier calls; None if stopped before the first trial was completed.

    Raises:
        WristError: the folder holds another study or cannot be used, or the law raises with its default gains.
    """
    if trials < 1:
        raise ParameterError(f"--trials {trials}: must be 1 or more")
    began, runner = time.perf_counter(), Runner(jobs, stop)
    with folder_lock(folder, ParameterError, "tuning"):
        if (folder / OLD_FILE).exists():
            raise ParameterError(
                f"{str(folder)!r} holds a study of an older version ({OLD_FILE}): give another folder with -o"
            )
        study = Study(folder / FILE)
        start = study.settings
        if start is not None:
            check_same(start["search"], search.summary(), folder)
        try:
            if start is None:
                start = {"search": search.summary(), **_start(search, runner)}
                study.begin(start)
            space = search.space.without(start["idle"])
            _go_on(study, search._replace(space=space), trials, runner, progress)
        except CancelledError:
            if not stop():
                raise
        done = tuple(study.trials())
    if start is None or not done:
        return None
    idle, plain = tuple(start["idle"]), Score.from_plain(start["plain"])
    wall_time = time.perf_counter() - began
    return SearchResult(search, space, idle, plain, done, len(done) < trials, start["versions"], wall_time)


def _go_on(study: Study, search: Search, trials: int, runner: Runner, progress: Progress) -> None:
    """Fill a study up to so many trials."""
    space, done = search.space, study.trials()
    known = {space.law_with(each.values): each.score for each in done if not each.score.refused}
    progress(len(done), trials)
    for batch in study.batches(space, search.sampler, search.seed, trials):
        share = len(batch.values), batch.first

        def part(runs: int, of: int, share: tuple[int, int] = share) -> None:
            progress(share[1] + share[0] * runs // of, trials)

        batch.hand_in(proposed_scores(space, batch.values, search.family, known, runner, part))
        progress(sum(share), trials)


def _start(search: Search, runner: Runner) -> dict[str, Any]:
    """Compute the initial data of a study: idle ranges, the score of plain computed torque, versions."""
    # the law itself too: it must not raise with its default gains
    plain, _ = scores_of([BASELINE, search.space.law], search.family._replace(bound=None), runner)
    idle = [] if search.own else idle_ranges(search.space, search.family, runner)
    if len(idle) == len(search.space.ranges):
        raise ParameterError(f"no parameter of law {search.space.law.name!r} changes anything on these cases")
    return {"idle": idle, "plain": plain.to_plain(), "versions": versions()}
