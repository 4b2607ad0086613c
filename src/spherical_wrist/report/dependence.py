"""The section on what the error depends on."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.report.findings import Curves
from spherical_wrist.report.parts import breakable, folded, gallery, interval, mark, number, percent, table, with_unit
from spherical_wrist.report.pictures import against_parameter, bars, look

TEXT = (
    "<p>How much of the variance of log error a parameter explains by itself (its first-order Sobol index), and, as ρ, "
    "its rank correlation with the error: +1 where larger values always make larger errors. What the indices leave of "
    "100 % is interactions and chance.</p>"
)


def dependence(told: Mapping[str, Any], curves: Curves) -> str:
    """Shares of each parameter as bars and in figures, and the error against each, the most important first."""
    units, several = told["campaign"]["units"], len(told["laws"]) > 1
    order = sorted(units, key=lambda name: -_explained(told, name))
    shares, rows = [], []
    for position, (law, found) in enumerate(told["sensitivity"].items()):
        ordered = sorted(found, key=lambda row: order.index(row["parameter"]))
        shares.append(bars(ordered, look(position)[0], f"Shares that parameters explain of the error of {law}."))
        rows += [_row(law, row, units) for row in ordered]
    medians = {law: row["quantiles"]["rms_error_rad"].get("median") for law, row in told["laws"].items()}
    middles = {law: each["value"] for law, each in medians.items() if each and each["value"] is not None}
    shown = "median, and 90 % as thin lines" if several else "median, and the band from 10 % to 90 %"
    pictures = [
        against_parameter(curves.bands[name], middles, with_unit(name, units), f"Error against {name}: {shown}.")
        for name in order
    ]
    titles = [f"{position + 1} {mark(position)}{breakable(law)}" for position, law in enumerate(told["laws"])]
    figures = folded("The same in figures", table(["law", "parameter", "explains", "ρ", "p"], rows))
    bar_charts = gallery(shares, titles if several else [])
    return f"<h2>What the error depends on</h2>{TEXT}{bar_charts}{figures}{gallery(pictures)}"


def _explained(told: Mapping[str, Any], name: str) -> float:
    """The largest share that a parameter explains under any law."""
    rows = (row for found in told["sensitivity"].values() for row in found if row["parameter"] == name)
    return max((row["sobol"]["value"] or 0.0 for row in rows), default=0.0)


def _row(law: str, row: Mapping[str, Any], units: Mapping[str, str]) -> list[str]:
    sobol, spearman = row["sobol"], row["spearman"]
    explains = f"<span>{percent(sobol['value'])}{interval(sobol['low'], sobol['high'], percent)}</span>"
    cells = [breakable(law), breakable(with_unit(row["parameter"], units)), explains]
    if spearman is None:
        return [*cells, "—", "—"]
    rho = f"<span>{number(spearman['value'])}{interval(spearman['low'], spearman['high'])}</span>"
    return [*cells, rho, number(spearman["p"], "—")]
