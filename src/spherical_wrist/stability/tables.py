"""Tables of margins: a row for each law that has a linear loop, the smallest worst tip error first."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.comparison.law_selection import named_laws
from spherical_wrist.picture_style import own_laws
from spherical_wrist.result_table import Column, ResultTable, short
from spherical_wrist.stability.stable_range import DEVIATIONS

COLUMNS = (
    (Column("Ms"), "max_sensitivity", 1.0),
    (Column("gain up", "dB"), "gain_margin_db", 1.0),
    (Column("down", "dB"), "gain_reduction_margin_db", 1.0),
    (Column("phase", "°"), "phase_margin_deg", 1.0),
    (Column("delay", "ms"), "delay_margin_s", 1e3),
    (Column("disk"), "disk_margin", 1.0),
    (Column("band", "Hz"), "bandwidth_hz", 1.0),
    (Column("worst tip", "µm"), "worst_tip_error_mm", 1e3),
)
"""Columns of the first table: column, key in the JSON object, factor."""


def margins_table(table: Mapping[str, Any]) -> ResultTable:
    """Return the margins at the plant's input, and the worst tip error.

    Args:
        table: margins as :func:`spherical_wrist.stability.report.to_dict` returns them.
    """
    laws = _stable(table)
    size = table["disturbance"]
    bound = f"{short(1e3 * size['size_Nm'])} mN·m"
    if size["level"] is not None:
        bound = f"{100.0 * size['level']:g} % ({bound})"
    return ResultTable(
        f"margins at the plant's input; torques within {bound} per axis",
        [Column("law", text=True), *(column for column, *_ in COLUMNS)],
        [[law["law"], *(_scaled(law[key], factor) for _, key, factor in COLUMNS)] for law in laws],
        notes=["Worst tip: from where the tip rests without the disturbance. A dash: no end.", *named_laws(laws)],
        own=_own(laws),
    )


def ranges_table(table: Mapping[str, Any]) -> ResultTable | None:
    """Return the ranges within which the loops stay stable; None if they were left out."""
    laws = _stable(table)
    if not laws or not laws[0]["ranges"]:
        return None
    return ResultTable(
        "stable, one change at a time",
        [Column("law", text=True), *(each.column for each in DEVIATIONS)],
        [[law["law"], *(_scaled(law["ranges"][each.name], each.factor) for each in DEVIATIONS)] for law in laws],
        own=_own(laws),
    )


def _stable(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return sorted((law for law in table["laws"] if law["stable"]), key=lambda law: law["worst_tip_error_mm"])


def _own(laws: list[Mapping[str, Any]]) -> frozenset[int]:
    own = own_laws({law["law"]: law["status"] for law in laws})
    return frozenset(place for place, law in enumerate(laws) if law["law"] in own)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
