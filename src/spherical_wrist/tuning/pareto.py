"""Summary of a search, with its Pareto front, as plain tables for JSON, pictures and files.

The JSON object has these keys, which stay as they are:

===============  ====================================================================================================
``law``          ``name`` and ``parameters`` of the law with the gains to begin with
``parameters``   what was searched: ``name``, ``unit``, ``low``, ``high``, ``default``; a vector is told by its largest
                 component
``idle``         names of parameters that were left alone because they change nothing on these cases
``cases``        what gains were scored on: ``case``, ``meaning``, ``changes``
``bound_mm``     largest tip error that counts as completed, null for any
``plain``        chattering of plain computed torque with its default gains [N·m/s], null where it diverged
``sampler``      ``nsga2`` or ``tpe``; ``seed`` of it
``trials``       how many there are; ``infeasible``: how many of them did not complete every case
``default``      the point of the gains to begin with
``precise``      number of the trial with the smallest error of those with no more chattering than the default gains
``calm``         number of the trial with the least chattering of those with no larger error than the default gains
``front``        the points that no other one beats in both, the least chattering first
``others``       ``trial``, ``rms_error_rad``, ``chattering_Nm_per_s`` of all other feasible trials
``warnings``     what makes the figures of the default gains and of those on the front doubtful
``versions``     of the packages and the platform that the study was begun with
``files``        names of the files in the folder of the study
``wall_time_s``  time that the last part of the search took
===============  ====================================================================================================

A point has ``trial`` (its number; 0 for the default gains), ``file``, ``values`` (by name of the parameter),
``parameters`` (all of the law's), ``rms_error_rad`` and ``chattering_Nm_per_s`` (geometric means over the cases),
``error_ratio`` and ``chattering_ratio`` (to the default gains), ``max_tip_error_mm`` (the largest of all cases), and
``cases`` (by name: ``outcome``, ``rms_error_rad``, ``max_tip_error_mm``, ``chattering_Nm_per_s``, and ``doubts``:
metrics that a warning is about). A point that did not complete every case has null for the means.
"""

from collections.abc import Sequence
from typing import Any

from spherical_wrist.comparison.ranking import pareto_front
from spherical_wrist.errors import ParameterError
from spherical_wrist.measure.warnings import summarized
from spherical_wrist.tuning.search import SearchResult
from spherical_wrist.tuning.study import Trial


def summary_of(result: SearchResult) -> dict[str, Any]:
    """Return the search as the object described above."""
    search, space, default = result.search, result.space, result.trials[0]
    feasible = {trial.number: trial for trial in result.trials if not trial.score.failed}
    front = front_of(result)
    precise, calm = chosen(default, front)
    on_front = {trial.number for trial in front}
    return {
        "law": {"name": search.space.law.name, "parameters": _parameters(search.space.law.model_dump(mode="json"))},
        "parameters": [
            {"name": each.name, "unit": each.unit, "low": each.low, "high": each.high, "default": each.default}
            for each in space.ranges
        ],
        "idle": list(result.idle),
        "cases": [
            {"case": case.name, "meaning": case.meaning, "changes": _parameters(dict(case.changes))}
            for case in search.family.cases
        ],
        "bound_mm": search.family.bound,
        "plain": None if result.plain.failed else result.plain.chattering,
        "sampler": search.sampler,
        "seed": search.seed,
        "trials": len(result.trials),
        "infeasible": len(result.trials) - len(feasible),
        "default": _point(result, default, default.number in on_front),
        "precise": precise,
        "calm": calm,
        "front": [_point(result, trial, True) for trial in front],
        "others": [
            {"trial": number, "rms_error_rad": trial.score.error, "chattering_Nm_per_s": trial.score.chattering}
            for number, trial in feasible.items()
            if number not in on_front
        ],
        "warnings": _warnings([default, *front]),
        "versions": dict(result.versions),
        "files": [],
        "wall_time_s": result.wall_time,
    }


def _warnings(trials: Sequence[Trial]) -> list[str]:
    """Return the warnings of the default gains and of those on the front."""
    return list(
        summarized(
            {
                f"{'the default gains' if trial.number == 0 else f'trial {trial.number}'} on {name}": figures.doubts
                for trial in trials
                for name, figures in trial.score.cases.items()
                if figures.rms_error_rad is not None
            }
        )
    )


def front_of(result: SearchResult) -> list[Trial]:
    """Return the feasible trials that no other one beats in both means, least chattering first.

    Of trials with equal gains, the first one counts.
    """
    seen: dict[Any, Trial] = {}
    for trial in result.trials:
        if not trial.score.failed:
            seen.setdefault(result.space.law_with(trial.values), trial)
    points = {str(each.number): (each.score.chattering, each.score.error) for each in seen.values()}
    return [result.trials[int(name)] for name in pareto_front(points)]


def chosen(default: Trial, front: list[Trial]) -> tuple[int | None, int | None]:
    """Return the numbers of the most precise trial without more chattering, and of the calmest without a larger error.

    Both are the default gains if nothing better was found; None if those did not complete every case.
    """
    if default.score.failed:
        return None, None
    calmer = [each for each in front if each.score.chattering <= default.score.chattering]
    closer = [each for each in front if each.score.error <= default.score.error]
    precise = min(calmer, key=lambda each: each.score.error)
    calm = min(closer, key=lambda each: each.score.chattering)
    return precise.number, calm.number


FOLDER = "front"
"""Folder of the gains on the front, within the folder of the study."""


def file_of(trial: int) -> str:
    """Return the file of a trial on the front, relative to the folder of the study."""
    return f"{FOLDER}/trial-{trial:04d}.toml"


def _point(result: SearchResult, trial: Trial, on_front: bool) -> dict[str, Any]:
    score, default = trial.score, result.trials[0].score
    done, both = not score.failed, not (score.failed or default.failed)
    try:
        law = result.space.law_with(trial.values).model_dump(mode="json")
    except ParameterError:
        law = {}
    return {
        "trial": trial.number,
        "file": file_of(trial.number) if on_front else None,
        "values": result.space.used(trial.values),
        "parameters": _parameters(law),
        "rms_error_rad": score.error if done else None,
        "chattering_Nm_per_s": score.chattering if done else None,
        "error_ratio": score.error / default.error if both else None,
        "chattering_ratio": score.chattering / default.chattering if both else None,
        "max_tip_error_mm": score.tip_error,
        "cases": {name: {**each._asdict(), "doubts": dict(each.doubts)} for name, each in score.cases.items()},
    }


def _parameters(table: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name != "name"}
