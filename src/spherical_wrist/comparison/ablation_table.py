"""Ablation as a JSON object, and as a table for a paper."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.comparison.ablation import FIGURES, WHOLE, variant
from spherical_wrist.control import Law
from spherical_wrist.result_table import Cell, Column, ResultTable

MEANING = "realistic: sensors and motors; slow, worst, square: torques of 25 %; delay: unknown, at mass m"


def to_dict(label: str, law: Law, found: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return an ablation as plain data.

    Args:
        label: the law as it was given.
        law: the law.
        found: figures by part, as :func:`.ablation` returns them.
    """
    return {
        "law": label,
        "parameters": {part: dict(changes) for part, changes in law.ablations.items()},
        "rows": [{"part": None if part == WHOLE else part, **figures} for part, figures in found.items()],
        "files": [],
    }


def row_name(row: Mapping[str, Any]) -> str:
    """Return the name of a row: the part that is switched off, or the whole law."""
    return variant(row["part"] or WHOLE)


def ablation_table(table: Mapping[str, Any]) -> ResultTable:
    """Return the figures of the whole law and without each part; the best of each stand out.

    Args:
        table: ablation as :func:`to_dict` returns it.
    """
    rows: list[list[Cell]] = [
        [row_name(row), *("lost" if row[figure.name] is None else row[figure.name] for figure in FIGURES)]
        for row in table["rows"]
    ]
    best = frozenset(
        (place, column)
        for column, figure in enumerate(FIGURES, start=1)
        if (best := _best([row[figure.name] for row in table["rows"]], more=figure.more)) is not None
        for place, row in enumerate(table["rows"])
        if row[figure.name] == best
    )
    columns = [Column("", text=True), *(Column(figure.title, figure.unit) for figure in FIGURES)]
    title = f"{table['law']}, with each of its parts switched off"
    return ResultTable(title, columns, rows, best, [MEANING], frozenset({0}))


def _best(values: list[float | None], *, more: bool) -> float | None:
    known = [value for value in values if value is not None]
    return (max if more else min)(known, default=None)
