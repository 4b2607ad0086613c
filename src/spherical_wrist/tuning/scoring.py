"""Scores of laws on a family of wrists, many runs at a time."""

from collections.abc import Callable, Mapping, Sequence

from spherical_wrist.comparison.cases import Case
from spherical_wrist.comparison.threads import Progress
from spherical_wrist.control import Law
from spherical_wrist.errors import LawError, ParameterError
from spherical_wrist.tuning.benches import Benches, Measure
from spherical_wrist.tuning.family import Family
from spherical_wrist.tuning.objective import Figures, Score
from spherical_wrist.tuning.ranges import Range, Space


def _unheard(done: int, total: int) -> None:
    """Tells nobody."""


def scores_of(laws: Sequence[Law], family: Family, benches: Benches, progress: Progress = _unheard) -> list[Score]:
    """The score of each law on the family.

    Raises:
        WristError: a law raises.
    """
    return _scores(laws, family, benches, progress, _figures)


def proposed_scores(
    space: Space,
    proposals: Sequence[Mapping[str, float]],
    family: Family,
    known: dict[Law, Score],
    benches: Benches,
    progress: Progress = _unheard,
) -> list[Score]:
    """The scores of values of the ranges. Values that the law refuses, and cases that it fails, are infeasible.

    Args:
        space: the law and its ranges.
        proposals: the values by name of the ranges.
        family: what they are scored on.
        known: scores that need not be simulated again; new ones join them.
        benches: where to run.
        progress: told how many runs of how many are done.
    """
    made = [_law(space, values) for values in proposals]
    laws = [law for law in dict.fromkeys(made) if isinstance(law, Law) and law not in known]
    known.update(zip(laws, _scores(laws, family, benches, progress, _tolerant), strict=True))
    return [known[law] if isinstance(law, Law) else Score({}, law) for law in made]


def idle_ranges(space: Space, family: Family, benches: Benches) -> list[str]:
    """Names of ranges whose ends, with all else as by default, change no figure of the default gains in any case."""

    def idle(each: Range, run: Measure) -> bool:
        laws = [_law(space, {each.name: end}) for end in (each.low, each.high)]
        return all(
            isinstance(law, Law) and _tolerant(case, law, anything, run) == default.cases[case.name]
            for law in laws
            for case in family.cases
        )

    anything = family._replace(bound=None)  # what misses the bound has no figures to compare
    (default,) = scores_of([space.law], anything, benches)
    answers = benches.each(idle, space.ranges)
    return [each.name for each, answer in zip(space.ranges, answers, strict=True) if answer]


def _scores(
    laws: Sequence[Law],
    family: Family,
    benches: Benches,
    progress: Progress,
    figures: Callable[[Case, Law, Family, Measure], Figures],
) -> list[Score]:
    work = [(case, law) for law in laws for case in family.cases]
    done = iter(benches.each(lambda item, run: figures(*item, family, run), work, progress))
    return [Score({case.name: next(done) for case in family.cases}) for _ in laws]


def _figures(case: Case, law: Law, family: Family, run: Measure) -> Figures:
    experiment = family.experiments[family.cases.index(case)]
    return Figures.of(run(experiment.replaced(law=law)), case.name, family.bound)


def _tolerant(case: Case, law: Law, family: Family, run: Measure) -> Figures:
    try:
        return _figures(case, law, family, run)
    except (LawError, ParameterError):
        return Figures("failed")


def _law(space: Space, values: Mapping[str, float]) -> Law | str:
    """The law with these values, or why it refuses them."""
    try:
        return space.law_with(values)
    except ParameterError as error:
        return str(error)
