"""A comparison as plain tables for JSON, CSV and Markdown.

The JSON object has these keys, which stay as they are:

===============  ====================================================================================================
``suite``        the file of the cases, ``"default"`` for those of the package
``laws``         best first: ``law`` (label), ``rank``, ``score``, ``wins``, ``diverged`` (names of cases), ``name``,
                 ``parameters``, ``groups`` (by group: ``rms_error_rad`` and ``chattering_ratio`` as ``smallest``,
                 ``mean`` (geometric), ``largest`` over the group's cases, and ``on_pareto_front``)
``cases``        in their order: ``case`` (name), ``meaning``, ``group``, ``changes``, ``ranking`` (labels, best first)
``cells``        law by law, case by case: ``law``, ``case``, ``rank``, ``outcome``, ``ended_at_s``, ``reason``,
                 ``metrics``, ``error_ratio`` (to the best law of the case), ``chattering_ratio`` (to plain computed
                 torque on the same case), ``command`` (replays this cell alone), ``recording``
``versions``     of the packages and the platform
``files``        names of the files written, in the folder of the comparison
``wall_time_s``  time that all runs took
===============  ====================================================================================================

What a cell has no figure for is null: the ratios of a run that diverged, its metrics where it never reached the steady
window, and the command of a law that only lives in the program that called.
"""

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from spherical_wrist.comparison.ranking import pareto_front, ranks, ratios
from spherical_wrist.comparison.results import Cell, Comparison, Spread
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import command_of
from spherical_wrist.experiment.run import versions
from spherical_wrist.metrics import Metrics

ERROR, CHATTERING = "rms_error_rad", "chattering_ratio"
FIGURES = {
    ERROR: "RMS error [rad]",
    "max_error_rad": "max error [rad]",
    "max_tip_error_mm": "max tip error [mm]",
    "chattering_Nm_per_s": "chattering [N·m/s]",
    CHATTERING: "chattering [× plain]",
    "peak_torque_Nm": "peak torque [N·m]",
    "rms_torque_Nm": "RMS torque [N·m]",
    "copper_loss_W": "copper loss [W]",
}
"""Columns of the Markdown table, and their headings."""


def told(found: Comparison, suite: str) -> dict[str, Any]:
    """The comparison as the object that is described above."""
    groups = found.groups()
    fronts = {group: front(found, cases) for group, cases in groups.items()}
    laws = [
        {
            "law": row.law,
            "rank": row.rank,
            "score": row.score,
            "wins": row.wins,
            "diverged": list(row.diverged),
            "name": found.laws[row.law].name,
            "parameters": _parameters(found.laws[row.law].model_dump(mode="json")),
            "groups": {
                group: {
                    ERROR: _spread(found.spread(row.law, cases, ERROR)),
                    CHATTERING: _spread(found.spread(row.law, cases, CHATTERING)),
                    "on_pareto_front": row.law in fronts[group],
                }
                for group, cases in groups.items()
            },
        }
        for row in found.standings()
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
                "ranking": ranking(found, case.name),
            }
            for case in found.cases
        ],
        "cells": cells(found),
        "versions": versions(),
        "files": [],
        "wall_time_s": found.wall_time,
    }


def cells(found: Comparison) -> list[dict[str, Any]]:
    """Every cell as plain data, law by law in the order of the ranking."""
    relative = {case.name: ratios(found.errors(case.name)) for case in found.cases}
    places = {case.name: ranks(found.errors(case.name)) for case in found.cases}
    return [
        {
            "law": row.law,
            "case": case.name,
            "rank": places[case.name][row.law],
            "outcome": str(cell.outcome.status),
            "ended_at_s": cell.outcome.time,
            "reason": cell.outcome.reason,
            "metrics": asdict(cell.metrics),
            "error_ratio": relative[case.name][row.law],
            "chattering_ratio": found.figure(cell, CHATTERING),
            "command": _command(cell),
            "recording": None if cell.recording is None else str(cell.recording),
        }
        for row in found.standings()
        for case in found.cases
        for cell in [found.cells[row.law, case.name]]
    ]


def ranking(found: Comparison, case: str) -> list[str]:
    """The labels of all laws, best on this case first."""
    places = ranks(found.errors(case))
    return sorted(places, key=lambda law: places[law])


def front(found: Comparison, cases: list[str]) -> list[str]:
    """Labels of the laws that no other one beats in both mean error and mean chattering over these cases.

    Means are compared to three digits: less is no difference. A law that diverged on one of the cases is left out.
    """
    points = {}
    for law in found.laws:
        error, chattering = (found.spread(law, cases, figure) for figure in (ERROR, CHATTERING))
        if error and chattering and all(found.cells[law, case].error is not None for case in cases):
            points[law] = (float(f"{chattering.mean:.3g}"), float(f"{error.mean:.3g}"))
    return pareto_front(points)


def as_csv(table: Mapping[str, Any]) -> str:
    """One line a cell, with the names of the metrics as headings."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    metrics = list(Metrics.__dataclass_fields__)
    plain = ["law", "case", "rank", "outcome", "ended_at_s"]
    after = ["error_ratio", "chattering_ratio", "command"]
    writer.writerow([*plain, *metrics, *after])
    for cell in table["cells"]:
        values = [cell[key] for key in plain] + [cell["metrics"][key] for key in metrics] + [cell[key] for key in after]
        writer.writerow(["" if value is None else value for value in values])
    return text.getvalue()


def as_markdown(table: Mapping[str, Any], number: Any) -> str:
    """The ranking, and below it one table a case, best law first.

    Args:
        table: what :func:`told` returns.
        number: writes a figure.
    """
    lines = ["# Laws compared", "", "![Error against chattering](comparison.png)", ""]
    lines += ["| rank | law | score | best on | diverged on |", "|---:|---|---:|---:|---|"]
    for row in table["laws"]:
        failures = ", ".join(row["diverged"]) or "—"
        lines.append(f"| {row['rank']} | {row['law']} | {number(row['score'])} | {row['wins']} | {failures} |")
    lines += ["", "Score: geometric mean over the cases of the RMS error as a multiple of the best law's.", ""]
    by_case: dict[str, list[dict[str, Any]]] = {}
    for cell in table["cells"]:
        by_case.setdefault(cell["case"], []).append(cell)
    for case in table["cases"]:
        rows = sorted(by_case[case["case"]], key=lambda cell: cell["rank"])
        shown = [key for key in FIGURES if any(figure(cell, key) is not None for cell in rows)]
        lines += [f"## {case['case']}", "", f"{case['meaning']} ({case['group']})", ""]
        lines += ["| law | " + " | ".join(FIGURES[key] for key in shown) + " |", "|---|" + "---:|" * len(shown)]
        for cell in rows:
            values = [number(figure(cell, key)) for key in shown]
            name = cell["law"] if cell["outcome"] == "completed" else f"{cell['law']} (**{cell['outcome']}**)"
            lines.append(f"| {name} | {' | '.join(values)} |")
        lines.append("")
    return "\n".join(lines)


def figure(cell: Mapping[str, Any], key: str) -> float | None:
    """A metric of a cell, or its chattering ratio; None where the run did not complete."""
    if cell["outcome"] != "completed":
        return None
    value: float | None = cell["chattering_ratio"] if key == "chattering_ratio" else cell["metrics"][key]
    return value


def _spread(found: Spread | None) -> dict[str, float] | None:
    return None if found is None else found._asdict()


def _command(cell: Cell) -> str | None:
    try:
        return command_of(cell.experiment)
    except ParameterError:  # a law that only lives in the program that called
        return None


def _parameters(table: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name != "name"}
