"""Comparison as plain tables for JSON, CSV and Markdown.

The keys of the JSON object are stable:

===============  ====================================================================================================
``suite``        file of the cases, ``"default"`` for the default suite
``laws``         best first: ``law`` (label), ``rank``, ``score``, ``wins``, ``lost`` (names of cases), ``name``,
                 ``parameters``, ``groups`` (by group: ``rms_error_rad`` and ``chattering_ratio`` as ``smallest``,
                 ``mean`` (geometric), ``largest`` over the group's cases, and ``on_pareto_front``)
``cases``        in their order: ``case`` (name), ``meaning``, ``group``, ``changes``, ``ranking`` (labels, best first)
``cells``        law by law, case by case: ``law``, ``case``, ``rank``, ``outcome``, ``ended_at_s``, ``reason``,
                 ``metrics``, ``error_ratio`` (to the best law of the case), ``chattering_ratio`` (to plain computed
                 torque on the same case), ``command`` (replays this cell alone), ``recording``
``warnings``     sentences about what makes the figures of completed runs doubtful; see
                 :mod:`spherical_wrist.measure.warnings`
``versions``     of the packages and the platform
``files``        names of the files written, in the folder of the comparison
``wall_time_s``  time that all runs took
===============  ====================================================================================================

Missing values are null: rank and ratios of a run that was lost, its metrics if it did not reach the steady window, and
the command of a law that is defined in the calling program.
"""

import csv
import io
from collections.abc import Mapping
from math import inf
from typing import Any

from spherical_wrist.comparison.ranking import pareto_front, ranks, ratios
from spherical_wrist.comparison.results import Cell, Comparison, Spread
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import command_of
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.measure.warnings import summarized
from spherical_wrist.simulation.run import versions

ERROR, CHATTERING = "rms_error_rad", "chattering_ratio"
FIGURES = (
    ERROR,
    "max_error_rad",
    "max_tip_error_mm",
    "chattering_Nm_per_s",
    CHATTERING,
    "peak_torque_Nm",
    "rms_torque_Nm",
    "copper_loss_W",
)
"""Columns of the Markdown table: names of metrics, and the chattering ratio."""

NARROW = (ERROR, "max_tip_error_mm", CHATTERING, "peak_torque_Nm")
"""Columns that fit beside the name of a law in 80 characters."""


def to_dict(comparison: Comparison, suite: str) -> dict[str, Any]:
    """Return a comparison as the JSON object described above."""
    groups = comparison.groups()
    fronts = {group: pareto_laws(comparison, cases) for group, cases in groups.items()}
    laws = [
        {
            "law": row.law,
            "rank": row.rank,
            "score": row.score,
            "wins": row.wins,
            "lost": list(row.lost),
            "name": comparison.laws[row.law].name,
            "parameters": _parameters(comparison.laws[row.law].model_dump(mode="json")),
            "groups": {
                group: {
                    ERROR: _spread(comparison.spread(row.law, cases, ERROR)),
                    CHATTERING: _spread(comparison.spread(row.law, cases, CHATTERING)),
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
        "cases": [
            {
                "case": case.name,
                "meaning": case.meaning,
                "group": of_case[case.name],
                "changes": _parameters(case.changes),
                "ranking": ranking(comparison, case.name),
            }
            for case in comparison.cases
        ],
        "cells": cells(comparison),
        "warnings": list(summarized(_completed(comparison))),
        "versions": versions(),
        "files": [],
        "wall_time_s": comparison.wall_time,
    }


def _completed(comparison: Comparison) -> dict[str, Metrics]:
    """Return the metrics of the runs that completed, by law and case in words."""
    found = comparison.cells.values()
    return {f"{cell.law} on {cell.case}": cell.metrics for cell in found if cell.error is not None}


def cells(comparison: Comparison) -> list[dict[str, Any]]:
    """Return every cell as a dictionary, law by law in the order of the ranking."""
    relative = {case.name: ratios(comparison.errors(case.name)) for case in comparison.cases}
    places = {case.name: ranks(comparison.errors(case.name)) for case in comparison.cases}
    return [
        {
            "law": row.law,
            "case": case.name,
            "rank": None if cell.error is None else places[case.name][row.law],
            "outcome": str(cell.outcome.status),
            "ended_at_s": cell.outcome.time,
            "reason": cell.outcome.reason,
            "metrics": dict(cell.metrics),
            "error_ratio": relative[case.name][row.law],
            "chattering_ratio": comparison.figure(cell, CHATTERING),
            "command": _command(cell),
            "recording": None if cell.recording is None else str(cell.recording),
        }
        for row in comparison.standings()
        for case in comparison.cases
        for cell in [comparison.cells[row.law, case.name]]
    ]


def ranking(comparison: Comparison, case: str) -> list[str]:
    """Return the labels of all laws, sorted by error on a case."""
    places = ranks(comparison.errors(case))
    return sorted(places, key=lambda law: places[law])


def pareto_laws(comparison: Comparison, cases: list[str]) -> list[str]:
    """Return the labels of the laws on the Pareto front of mean error and mean chattering over some cases.

    Means are rounded to three digits. A law that lost a run on one of the cases is left out.
    """
    points = {}
    for law in comparison.laws:
        error, chattering = (comparison.spread(law, cases, figure) for figure in (ERROR, CHATTERING))
        if error and chattering and all(comparison.cells[law, case].error is not None for case in cases):
            points[law] = (float(f"{chattering.mean:.3g}"), float(f"{error.mean:.3g}"))
    return pareto_front(points)


def as_csv(table: Mapping[str, Any]) -> str:
    """Return a CSV table with one line per cell and the names of the metrics as headings."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    plain = ["law", "case", "rank", "outcome", "ended_at_s"]
    after = ["error_ratio", "chattering_ratio", "command"]
    writer.writerow([*plain, *METRICS, *after])
    for cell in table["cells"]:
        values = [cell[key] for key in plain] + [cell["metrics"][key] for key in METRICS] + [cell[key] for key in after]
        writer.writerow(["" if value is None else value for value in values])
    return text.getvalue()


def as_markdown(table: Mapping[str, Any], number: Any) -> str:
    """Return the ranking, and one table per case with the best law first, as Markdown.

    Args:
        table: result of :func:`to_dict`.
        number: function that formats a number.
    """
    lines = ["# Laws compared", "", "![Error against chattering](comparison.png)", ""]
    lines += ["| rank | law | score | best on | lost on |", "|---:|---|---:|---:|---|"]
    for row in table["laws"]:
        failures = ", ".join(row["lost"]) or "—"
        lines.append(f"| {row['rank']} | {row['law']} | {number(row['score'])} | {row['wins']} | {failures} |")
    lines += ["", "Score: geometric mean over the cases of the RMS error as a multiple of the best law's.", ""]
    by_case: dict[str, list[dict[str, Any]]] = {}
    for cell in table["cells"]:
        by_case.setdefault(cell["case"], []).append(cell)
    for case in table["cases"]:
        rows = sorted(by_case[case["case"]], key=lambda cell: cell["rank"] or inf)
        shown = [key for key in FIGURES if any(figure(cell, key) is not None for cell in rows)]
        lines += [f"## {case['case']}", "", f"{case['meaning']} ({case['group']})", ""]
        lines += ["| law | " + " | ".join(map(heading, shown)) + " |", "|---|" + "---:|" * len(shown)]
        for cell in rows:
            values = [number(figure(cell, key)) for key in shown]
            name = cell["law"] if cell["outcome"] == "completed" else f"{cell['law']} (**{cell['outcome']}**)"
            lines.append(f"| {name} | {' | '.join(values)} |")
        lines.append("")
    return "\n".join(lines)


def heading(key: str) -> str:
    """Return the heading of a column: a metric and its unit, or the chattering ratio."""
    return "chattering [× plain]" if key == CHATTERING else METRICS[key].heading_and_unit


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
