"""Table of a comparison for a paper: the standing of each law, or its figures where there is one case only."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.comparison.law_selection import named_laws
from spherical_wrist.comparison.report import CHATTERING, FIGURES, heading, median_figure
from spherical_wrist.picture_style import own_laws
from spherical_wrist.result_table import Cell, Column, ResultTable, short, smallest

NOTE = (
    "×: √(attitude error · tip error) as a multiple of the best law's on the case: median over the cases, with an "
    "interval of 95 %, and the worst of all runs."
)


def comparison_table(table: Mapping[str, Any]) -> ResultTable:
    """Return the laws by rank; the best figure of each column stands out.

    Args:
        table: comparison as :func:`spherical_wrist.comparison.report.to_dict` returns it.
    """
    found = _figures(table) if len(table["cases"]) == 1 else _standings(table)
    own = own_laws({law["law"]: law["status"] for law in table["laws"]})
    return found._replace(
        own=frozenset(place for place, row in enumerate(found.rows) if row[0] in own),
        notes=[*found.notes, *named_laws(table["laws"])],
    )


def _standings(table: Mapping[str, Any]) -> ResultTable:
    group = list(table["laws"][0]["groups"])[-1]
    columns = [
        Column("law", text=True), Column("median", "×"), Column("95 %", "×"), Column("worst", "×"),
        Column("on", text=True), Column("best on"), Column("within 5 % on"), Column("lost"),
        Column("chattering", "×"),
    ]  # fmt: skip
    rows: list[list[Cell]] = []
    for law in table["laws"]:
        low, high = (_times(end) for end in law["median_interval_95"])
        spread = law["groups"][group][CHATTERING]
        rows.append([
            law["law"], _or_lost(law["median_ratio"]), low if low == high else f"{low}–{high}",
            _or_lost(law["worst_ratio"]), law["worst_case"], str(law["wins"]), str(law["within_5_percent"]),
            str(len(law["lost"])), None if spread is None else spread["mean"],
        ])  # fmt: skip
    return ResultTable(
        f"{len(rows)} laws on {len(table['cases'])} cases",
        columns,
        rows,
        smallest(rows, (1, 3, 8)),
        [NOTE, f"Chattering: multiple of plain computed torque's, geometric mean over the cases with {group}."],
    )


def _figures(table: Mapping[str, Any]) -> ResultTable:
    [case] = table["cases"]
    cells: dict[str, list[Mapping[str, Any]]] = {law["law"]: [] for law in table["laws"]}
    for cell in table["cells"]:
        cells[cell["law"]].append(cell)
    keys = [key for key in FIGURES if any(median_figure(own, key) is not None for own in cells.values())]
    ratios = {standing["law"]: standing["ratio"] for standing in table["standings"]}
    names = [heading(key).removesuffix("]").partition(" [") for key in keys]
    rows: list[list[Cell]] = [
        [law, _or_lost(ratios[law]), *(median_figure(cells[law], key) for key in keys)] for law in case["ranking"]
    ]
    return ResultTable(
        f"{case['case']}: {case['meaning']}" if case["meaning"] else case["case"],
        [Column("law", text=True), Column("error", "×"), *(Column(name, unit) for name, _, unit in names)],
        rows,
        smallest(rows, range(1, len(keys) + 2)),
        ["error: √(attitude error · tip error) as a multiple of the best law's."],
    )


def _or_lost(ratio: float | None) -> Cell:
    return "lost" if ratio is None else float(ratio)


def _times(ratio: float | None) -> str:
    return "lost" if ratio is None else short(ratio)
