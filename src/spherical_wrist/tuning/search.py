"""The search for gains: proposals are scored on a family of wrists, and kept."""

import hashlib
import time
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.comparison.contestants import YARDSTICK
from spherical_wrist.comparison.threads import Progress
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.run import versions
from spherical_wrist.tuning.benches import Benches
from spherical_wrist.tuning.family import Family
from spherical_wrist.tuning.folder import alone
from spherical_wrist.tuning.objective import Score
from spherical_wrist.tuning.ranges import Space
from spherical_wrist.tuning.sameness import check_same
from spherical_wrist.tuning.scoring import idle_ranges, proposed_scores, scores_of
from spherical_wrist.tuning.study import SamplerName, Study, Trial

FILE, START = "tune.db", "wrist tune"


class Search(NamedTuple):
    """What is searched for, and how.

    Attributes:
        space: the law and the ranges of its parameters.
        own: the ranges are the user's own; of others, those that change nothing on the family are left out.
        family: what gains are scored on.
        sampler: how trials are proposed.
        seed: of the proposals.
    """

    space: Space
    own: bool
    family: Family
    sampler: SamplerName
    seed: int

    def told(self) -> dict[str, Any]:
        """All of it as plain data: a study goes on only where this is the same."""
        law = self.space.law
        return {
            "law": law.model_dump(mode="json"),
            "file of the law": hashlib.sha256(law.source()).hexdigest(),
            "range": {each.name: [each.low, each.high] for each in self.space.ranges},
            "ranges given": self.own,
            "case": self.family.told(),
            "bound": self.family.bound,
            "sampler": self.sampler,
            "seed": self.seed,
        }


class Found(NamedTuple):
    """What a search has found so far.

    Attributes:
        search: what is searched for.
        space: the ranges without those that change nothing.
        idle: names of these.
        plain: the score of plain computed torque.
        trials: all that are done, the default gains first.
        stopped: there are fewer than were asked for.
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
    progress: Progress = lambda done, total: None,
    stop: Callable[[], bool] = lambda: False,
) -> Found | None:
    """Tries gains until there are so many trials in the study of a folder; goes on with a study that is there.

    Args:
        search: what is searched for.
        folder: where the study is kept, as ``tune.db``; made where there is none.
        trials: how many there are to be, with those that are there already.
        jobs: threads; None for as many as there are cores. The result does not depend on it.
        progress: told how many trials are done.
        stop: asked now and then whether to stop; what is done then is kept.

    Returns:
        What was found, by this and by earlier calls; None where it was stopped before the first trials were done.

    Raises:
        WristError: the folder holds another study or cannot be used, or the law raises with its default gains.
    """
    if trials < 1:
        raise ParameterError(f"--trials {trials}: must be 1 or more")
    began, benches = time.perf_counter(), Benches(jobs, stop)
    with alone(folder), closing(Study(folder / FILE)) as study:
        told = search.told()
        start = study.remembered(START)
        if start is not None:
            check_same(start["search"], told, folder)
        try:
            if start is None:
                start = {"search": told, **_start(search, benches)}
                study.remember(START, start)
            space = search.space.without(start["idle"])
            _go_on(study, search._replace(space=space), trials, benches, progress)
        except CancelledError:
            if not stop():
                raise
        done = tuple(study.trials())
    if start is None or not done:
        return None
    idle, plain = tuple(start["idle"]), Score.from_plain(start["plain"])
    return Found(search, space, idle, plain, done, len(done) < trials, start["versions"], time.perf_counter() - began)


def _go_on(study: Study, search: Search, trials: int, benches: Benches, progress: Progress) -> None:
    """Fills a study up to so many trials."""
    space, done = search.space, study.trials()
    known = {space.law_with(each.values): each.score for each in done if not each.score.refused}
    progress(len(done), trials)
    for batch in study.batches(space, search.sampler, search.seed, trials):
        share = len(batch.values), batch.first

        def part(runs: int, of: int, share: tuple[int, int] = share) -> None:
            progress(share[1] + share[0] * runs // of, trials)

        batch.hand_in(proposed_scores(space, batch.values, search.family, known, benches, part))
        progress(sum(share), trials)


def _start(search: Search, benches: Benches) -> dict[str, Any]:
    """What a study begins with: parameters that change nothing, the score of plain computed torque, versions."""
    # the law itself too: it must not raise with its default gains
    plain, _ = scores_of([YARDSTICK, search.space.law], search.family._replace(bound=None), benches)
    idle = [] if search.own else idle_ranges(search.space, search.family, benches)
    if len(idle) == len(search.space.ranges):
        raise ParameterError(f"no parameter of law {search.space.law.name!r} changes anything on these cases")
    return {"idle": idle, "plain": plain.to_plain(), "versions": versions()}
