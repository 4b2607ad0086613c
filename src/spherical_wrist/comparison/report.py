"""Comparison as plain tables for JSON, CSV and Markdown.

The keys of the JSON object are stable:

===============  ====================================================================================================
``suite``        file of the cases, ``"default"`` for the default suite
``laws``         best first: ``law`` (label), ``rank``, ``median_ratio`` (over the cases), ``median_interval_95``
                 (``[low, high]``), ``worst_ratio``, ``worst_case``, ``worst_seed``, ``wins`` and ``within_5_percent``
                 (numbers of cases; those within 5 % of the best law include the wins), ``lost`` (names of cases),
                 ``lost_runs``, ``runs``, ``name``, ``status``, ``option`` (value of ``--law`` that makes it again),
                 ``parameters``, ``groups`` (by group: ``rms_error_rad``, ``rms_tip_error_mm`` and ``chattering_ratio``
                 as ``smallest``, ``mean`` (geometric), ``largest`` over the group's runs, and ``on_pareto_front``)
``cases``        in their order: ``case`` (name), ``meaning``, ``discriminates``, ``judged_by`` (two names of metrics),
                 ``group``, ``changes``, ``seeds`` (list), ``random`` (false: nothing depends on the seed), ``winner``,
                 ``runner_up``, ``runner_up_ratio``, ``within_5_percent`` (labels, best first), ``lost_by`` (labels),
                 ``ranking`` (labels, best first)
``standings``    law by law, case by case, over the seeds: ``law``, ``case``, ``rank``, ``ratio``, ``ratio_range``
                 (``[smallest, largest]`` over the seeds), ``attitude_ratio``, ``tip_ratio``, ``lost_seeds``
``bound_mm``     bound on the tip error; null if that of the cases differs
``cells``        every run, law by law, case by case, seed by seed: ``law``, ``case``, ``seed``, ``within_bound``
                 (the tip error keeps to the bound), ``outcome``, ``ended_at_s``, ``reason``, ``metrics``, ``ratio``
                 (to the best law of this case and seed), ``chattering_ratio`` (to plain computed torque, likewise),
                 ``command`` (replays this run alone, to the last bit), ``recording``
``warnings``     sentences about what makes the figures of completed runs doubtful; see
                 :mod:`spherical_wrist.measure.warnings`
``versions``     of the packages and the platform
``files``        names of the files written, in the folder of the comparison
``wall_time_s``  time that all runs took
===============  ====================================================================================================

All ratios are those of the combined error √(attitude error · tip error) to that of the best law of the case; see
:mod:`.ranking`. Infinite ratios, of lost runs, are null, and so are other missing values: metrics of a run that did not
reach the steady window, the winner of a case that all laws lost, and the command of a law that is defined in the
calling program.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from math import isfinite
from statistics import median
from typing import Any

from pydantic_core import to_jsonable_python

from spherical_wrist.comparison.cases import Case
from spherical_wrist.comparison.law_selection import law_option
from spherical_wrist.comparison.ranking import pareto_front
from spherical_wrist.comparison.results import CaseStanding, Cell, Comparison, Spread, Standing
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import command_of
from spherical_wrist.experiment.randomness import is_random
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.measure.warnings import summarized
from spherical_wrist.simulation.run import versions

ERROR, TIP_ERROR, CHATTERING = "rms_error_rad", "rms_tip_error_mm", "chattering_ratio"
FIGURES = (
    ERROR,
    TIP_ERROR,
    "max_error_rad",
    "max_tip_error_mm",
    "chattering_Nm_per_s",
    CHATTERING,
    "peak_torque_Nm",
    "rms_torque_Nm",
    "copper_loss_W",
)
"""Columns of the Markdown table: names of metrics, and the chattering ratio."""

NARROW = (ERROR, TIP_ERROR, "max_tip_error_mm", CHATTERING)
"""Columns that fit beside the name of a law in 80 characters."""


def to_dict(comparison: Comparison, suite: str) -> dict[str, Any]:
    """Return a comparison as the JSON object described above."""
    groups = comparison.groups()
    fronts = {group: pareto_laws(comparison, cases) for group, cases in groups.items()}
    laws = [
        {
            **_standing(row),
            "name": comparison.laws[row.law].name,
            "status": comparison.laws[row.law].status,
            "option": law_option(row.law, comparison.laws[row.law]),
            "parameters": _parameters(comparison.laws[row.law].model_dump(mode="json")),
            "groups": {
                group: {
                    **{key: _spread(comparison.spread(row.law, cases, key)) for key in (ERROR, TIP_ERROR, CHATTERING)},
                    "on_pareto_front": row.law in fronts[group],
                }
                for group, cases in groups.items()
            },
        }
        for row in comparison.standings()
    ]
    of_case = {case: group for group, cases in groups.items() for case in cases}
    return {
        "suite": suite,
        "laws": laws,
        "cases": [_case(comparison, case, of_case[case.name]) for case in comparison.cases],
        "standings": [
            _case_standing(comparison.case_standings(case.name)[row.law])
            for row in comparison.standings()
            for case in comparison.cases
        ],
        "bound_mm": _bound(comparison),
        "cells": cells(comparison),
        "warnings": _warnings(comparison),
        "versions": versions(),
        "files": [],
        "wall_time_s": comparison.wall_time,
    }


def _bound(comparison: Comparison) -> float | None:
    bounds = {cell.experiment.bound for cell in comparison.cells.values()}
    return bounds.pop() if len(bounds) == 1 else None


def _standing(row: Standing) -> dict[str, Any]:
    return {
        "law": row.law,
        "rank": row.rank,
        "median_ratio": _finite(row.median_ratio),
        "median_interval_95": [*map(_finite, row.interval)],
        "worst_ratio": _finite(row.worst_ratio),
        "worst_case": row.worst_case,
        "worst_seed": row.worst_seed,
        "wins": row.wins,
        "within_5_percent": row.close,
        "lost": list(row.lost),
        "lost_runs": row.lost_runs,
        "runs": row.runs,
    }


def _case(comparison: Comparison, case: Case, group: str) -> dict[str, Any]:
    rows = list(comparison.case_standings(case.name).values())
    winner, *others = rows
    won, runner_up = isfinite(winner.ratio), next((row for row in others if isfinite(row.ratio)), None)
    return {
        "case": case.name,
        "meaning": case.meaning,
        "discriminates": case.discriminates,
        "judged_by": list(case.figures),
        "group": group,
        "changes": _plain(case.changes),
        "seeds": list(comparison.seeds[case.name]),
        "random": is_random(comparison.runs(winner.law, case.name)[0].experiment),
        "winner": winner.law if won else None,
        "runner_up": runner_up.law if runner_up else None,
        "runner_up_ratio": runner_up.ratio if runner_up else None,
        "within_5_percent": [row.law for row in rows if row.close],
        "lost_by": [row.law for row in rows if row.lost],
        "ranking": [row.law for row in rows],
    }


def _case_standing(row: CaseStanding) -> dict[str, Any]:
    return {
        "law": row.law,
        "case": row.case,
        "rank": row.rank,
        "ratio": _finite(row.ratio),
        "ratio_range": [*map(_finite, row.range)],
        "attitude_ratio": _finite(row.attitude_ratio),
        "tip_ratio": _finite(row.tip_ratio),
        "lost_seeds": list(row.lost),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _warnings(comparison: Comparison) -> list[str]:
    """Return the warnings of the runs that were not lost."""
    several = {case: len(seeds) > 1 for case, seeds in comparison.seeds.items()}
    done = {
        f"{cell.law} on {cell.case}{f' (seed {cell.seed})' if several[cell.case] else ''}": cell
        for cell in comparison.cells.values()
        if not cell.lost
    }
    metrics = {name: cell.metrics for name, cell in done.items()}
    return list(summarized(metrics, {name: cell.warnings for name, cell in done.items()}))


def cells(comparison: Comparison) -> list[dict[str, Any]]:
    """Return every run as a dictionary, law by law in the order of the ranking."""
    return [
        {
            "law": cell.law,
            "case": cell.case,
            "seed": cell.seed,
            "within_bound": cell.within,
            "outcome": str(cell.outcome.status),
            "ended_at_s": cell.outcome.time,
            "reason": cell.outcome.reason,
            "metrics": dict(cell.metrics),
            "ratio": _finite(comparison.run_ratios(cell.case, cell.seed)[cell.law]),
            "chattering_ratio": comparison.figure(cell, CHATTERING),
            "command": _command(cell),
            "recording": None if cell.recording is None else str(cell.recording),
        }
        for row in comparison.standings()
        for case in comparison.cases
        for cell in comparison.runs(row.law, case.name)
    ]


def pareto_laws(comparison: Comparison, cases: list[str]) -> list[str]:
    """Return the labels of the laws on the Pareto front of mean error and mean chattering over some cases.

    Means are rounded to three digits. A law that lost a run on one of the cases is left out.
    """
    points = {}
    for law in comparison.laws:
        error, chattering = (comparison.spread(law, cases, figure) for figure in (ERROR, CHATTERING))
        if error and chattering and not any(cell.lost for case in cases for cell in comparison.runs(law, case)):
            points[law] = (float(f"{chattering.mean:.3g}"), float(f"{error.mean:.3g}"))
    return pareto_front(points)


def as_csv(table: Mapping[str, Any]) -> str:
    """Return a CSV table with one line per run and the names of the metrics as headings.

    The columns ``case_rank``, ``case_ratio`` and ``winner`` are those of the law on the case, over all seeds.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    plain = ["law", "case", "seed", "outcome", "ended_at_s"]
    after = ["ratio", "chattering_ratio"]
    writer.writerow([*plain, *METRICS, *after, "case_rank", "case_ratio", "winner", "command"])
    over_seeds = {(row["law"], row["case"]): row for row in table["standings"]}
    winners = {case["case"]: case["winner"] for case in table["cases"]}
    for cell in table["cells"]:
        own = over_seeds[cell["law"], cell["case"]]
        values = [cell[key] for key in plain] + [cell["metrics"][key] for key in METRICS] + [cell[key] for key in after]
        values += [own["rank"], own["ratio"], winners[cell["case"]], cell["command"]]
        writer.writerow(["" if value is None else value for value in values])
    return text.getvalue()


def as_markdown(table: Mapping[str, Any], number: Any) -> str:
    """Return the ranking, the table of winners, and one table per case with the best law first, as Markdown.

    Args:
        table: result of :func:`to_dict`.
        number: function that formats a number.
    """
    lines = ["# Laws compared", "", "![Errors relative to the best law, and chattering](comparison.png)", ""]
    lines += _markdown_ranking(table) + _markdown_winners(table)
    for case in table["cases"]:
        lines += _markdown_case(table, case, number)
    return "\n".join(lines)


def _markdown_ranking(table: Mapping[str, Any]) -> list[str]:
    lines = ["| rank | law | median ratio | 95 % interval | worst ratio | on | best on | within 5 % on | lost runs |"]
    lines.append("|---:|---|---:|---:|---:|---|---:|---:|---|")
    for row in table["laws"]:
        low, high = map(ratio_text, row["median_interval_95"])
        entries = [row["rank"], row["law"], ratio_text(row["median_ratio"]), f"{low} – {high}"]
        entries += [ratio_text(row["worst_ratio"]), row["worst_case"], row["wins"], row["within_5_percent"]]
        entries += [f"{row['lost_runs']} of {row['runs']}: {', '.join(row['lost'])}" if row["lost"] else "—"]
        lines.append(f"| {' | '.join(map(str, entries))} |")
    return [*lines, "", RANKING, INTERVAL, ""]


def _markdown_winners(table: Mapping[str, Any]) -> list[str]:
    lines = [
        "## Who wins what",
        "",
        "| case | shows | best law | runner-up | ratio of the runner-up | also within 5 % |",
    ]
    lines.append("|---|---|---|---|---:|---|")
    for case in table["cases"]:
        also = ", ".join(law for law in case["within_5_percent"] if law != case["winner"]) or "—"
        lines.append(
            f"| {case['case']} | {case['discriminates']} | {case['winner'] or '—'} | {case['runner_up'] or '—'} | "
            f"{ratio_text(case['runner_up_ratio']) if case['runner_up'] else '—'} | {also} |"
        )
    return [*lines, ""]


def _markdown_case(table: Mapping[str, Any], case: Mapping[str, Any], number: Any) -> list[str]:
    name = case["case"]
    rows = {row["law"]: row for row in table["standings"] if row["case"] == name}
    runs: dict[str, list[Any]] = {law: [] for law in case["ranking"]}
    for cell in table["cells"]:
        if cell["case"] == name:
            runs[cell["law"]].append(cell)
    shown = [key for key in FIGURES if any(median_figure(cells, key) is not None for cells in runs.values())]
    said = [f"{case['meaning']} ({case['group']})" if case["meaning"] else case["group"], seeds_in_words(case)]
    said += [f"Shows: {case['discriminates']}"] if case["discriminates"] else []
    lines = [f"## {name}", "", f"{'. '.join(said)}.", ""]
    lines += ["| law | ratio | " + " | ".join(map(heading, shown)) + " |", "|---|---:|" + "---:|" * len(shown)]
    for law, cells in runs.items():
        lost = [cell["outcome"] for cell in cells if cell["outcome"] != "completed"]
        failed = f" (**{lost[0]}**, {len(lost)} of {len(cells)} runs)" if lost else ""
        values = [ratio_in_words(rows[law]), *(number(median_figure(cells, key)) for key in shown)]
        lines.append(f"| {law}{failed} | {' | '.join(values)} |")
    return [*lines, ""]


RANKING = (
    "Ratio: combined error √(attitude error · tip error) as a multiple of that of the best law on the case, RMS unless "
    "the case is judged by the largest errors; median over the cases, worst over all runs. A case with several seeds "
    "counts once, with the median over its seeds, and as lost if one of its runs was lost. Lost cases have an infinite "
    "ratio."
)
INTERVAL = "Interval: percentile bootstrap of the median, over the cases and over the seeds of each."
LOST = "lost"


def seeds_in_words(case: Mapping[str, Any]) -> str:
    """Return the seeds of a case in words."""
    if not case["random"]:
        return "Nothing is random: one run"
    seeds = case["seeds"]
    return f"Seeds {seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else f"Seed {seeds[0]}"


def ratio_in_words(row: Mapping[str, Any]) -> str:
    """Return the ratio of a law on a case, with its range over the seeds if there are several."""
    low, high = row["ratio_range"]
    ratio = ratio_text(row["ratio"])
    return ratio if low == high else f"{ratio} ({ratio_text(low)} – {ratio_text(high)})"


def ratio_text(ratio: float | None) -> str:
    """Write a ratio in at most five characters; infinite ones, of lost runs, are None."""
    if ratio is None:
        return LOST
    if ratio < 9.995:
        return f"{ratio:.2f}"
    if ratio < 99.95:
        return f"{ratio:.1f}"
    return f"{ratio:.0f}" if ratio < 9999.5 else f"{ratio:.0e}".replace("e+0", "e")


def median_figure(cells: Sequence[Mapping[str, Any]], key: str) -> float | None:
    """Return the median of a figure over the runs of a law on a case; None if one of them was lost."""
    found = [figure(cell, key) for cell in cells]
    known = [each for each in found if each is not None]
    return median(known) if known and len(known) == len(found) else None


def heading(key: str) -> str:
    """Return the heading of a column: a metric and its unit, or the chattering ratio."""
    return "chattering [× plain]" if key == CHATTERING else METRICS[key].label_and_unit


def figure(cell: Mapping[str, Any], key: str) -> float | None:
    """Return a metric of a cell in its display unit, or its chattering ratio; None if the run did not complete."""
    if cell["outcome"] != "completed":
        return None
    ratio: float | None = cell[CHATTERING] if key == CHATTERING else None
    return ratio if key == CHATTERING else METRICS[key].shown_value(cell["metrics"][key])


def _spread(spread: Spread | None) -> dict[str, float] | None:
    return None if spread is None else spread._asdict()


def _command(cell: Cell) -> str | None:
    try:
        return command_of(cell.experiment)
    except ParameterError:  # a law that is defined in the calling program has no command
        return None


def _parameters(table: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name != "name"}


def _plain(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changed parameters as plain data."""
    plain: dict[str, Any] = to_jsonable_python(dict(changes))
    return plain
