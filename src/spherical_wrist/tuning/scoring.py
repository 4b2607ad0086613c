"""Scores of laws on a family of wrists, many runs at a time."""

from collections.abc import Callable, Mapping, Sequence

from spherical_wrist.comparison.cases import Case
from spherical_wrist.control import Law
from spherical_wrist.errors import LawError, ParameterError
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress
from spherical_wrist.tuning.family import Family
from spherical_wrist.tuning.objective import Figures, Score
from spherical_wrist.tuning.ranges import Range, Space


def scores_of(laws: Sequence[Law], family: Family, runner: Runner, progress: Progress = ignore_progress) -> list[Score]:
    """Return the score of each law on the family.

    Raises:
        WristError: a law raises.
    """
    return _scores(laws, family, runner, progress, _figures)


def proposed_scores(
    space: Space,
    proposals: Sequence[Mapping[str, float]],
    family: Family,
    known: dict[Law, Score],
    runner: Runner,
    progress: Progress = ignore_progress,
) -> list[Score]:
    """Return the scores of proposed values. Values that the law refuses, and cases that it fails, are infeasible.

    Args:
        space: the law and its ranges.
        proposals: values by the names of the ranges.
        family: cases to score on.
        known: scores that need not be simulated again; new ones are added.
        runner: runs the experiments.
        progress: called with the number of completed runs and of all.
    """
    made = [_law(space, values) for values in proposals]
    laws = [law for law in dict.fromkeys(made) if isinstance(law, Law) and law not in known]
    known.update(zip(laws, _scores(laws, family, runner, progress, _tolerant), strict=True))
    return [known[law] if isinstance(law, Law) else Score({}, law) for law in made]


def idle_ranges(space: Space, family: Family, runner: Runner) -> list[str]:
    """Return the names of ranges whose ends change no figure of the default gains in any case."""

    def idle(each: Range, worker: Worker) -> bool:
        laws = [_law(space, {each.name: end}) for end in (each.low, each.high)]
        return all(
            isinstance(law, Law) and _tolerant(case, law, anything, worker) == default.cases[case.name]
            for law in laws
            for case in family.cases
        )

    anything = family._replace(bound=None)  # what misses the bound has no figures to compare
    (default,) = scores_of([space.law], anything, runner)
    answers = runner.map(idle, space.ranges)
    return [each.name for each, answer in zip(space.ranges, answers, strict=True) if answer]


def _scores(
    laws: Sequence[Law],
    family: Family,
    runner: Runner,
    progress: Progress,
    figures: Callable[[Case, Law, Family, Worker], Figures],
) -> list[Score]:
    work = [(case, law) for law in laws for case in family.cases]
    done = iter(runner.map(lambda item, worker: figures(*item, family, worker), work, progress))
    return [Score({case.name: next(done) for case in family.cases}) for _ in laws]


def _figures(case: Case, law: Law, family: Family, worker: Worker) -> Figures:
    experiment = family.experiments[family.cases.index(case)]
    return Figures.of(worker.measure(experiment.replaced(law=law)), case.name, family.bound)


def _tolerant(case: Case, law: Law, family: Family, worker: Worker) -> Figures:
    try:
        return _figures(case, law, family, worker)
    except (LawError, ParameterError):
        return Figures("failed")


def _law(space: Space, values: Mapping[str, float]) -> Law | str:
    """Return the law with these values, or the reason why it refuses them."""
    try:
        return space.law_with(values)
    except ParameterError as error:
        return str(error)
