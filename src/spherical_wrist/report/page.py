"""Report page: one HTML file that needs no network, no script and no other file.

The templates in ``templates/`` hold the page; here is what they show besides the summary of the campaign.
"""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.report import parts
from spherical_wrist.report.findings import Curves
from spherical_wrist.report.html import template_environment
from spherical_wrist.report.pictures import (
    Looks,
    Picture,
    against_parameter,
    bars,
    distribution,
    exceedance,
    page_looks,
)
from spherical_wrist.report.sensitivity import EVEN
from spherical_wrist.report.table import FIGURES

ERROR = METRICS[FIGURES["error"]]
"""Metric by which episodes and laws are compared."""

RATES = {
    "diverged": "diverged",
    "failed": "failed: the law raised, or gave no torque",
    "exceeding": "beyond the bound, or not completed",
    "invalid": "invalid: could not be simulated",
}
MISSING = {"diverged": "diverged", "failed": "failed", "invalid": "was invalid"}
"""Words for rates that are zero for all laws."""


def page(summary: Mapping[str, Any], curves: Curves) -> str:
    """Render the page of a report.

    Args:
        summary: of the campaign, by :func:`spherical_wrist.report.findings.findings`.
        curves: data of the pictures.
    """
    campaign, laws = summary["campaign"], list(summary["laws"])
    bound = f"{summary['bound_mm']:g} mm"
    used = [key for key in RATES if key == "exceeding" or any(_rate(summary, law, key)["count"] for law in laws)]
    environment = template_environment("spherical_wrist.report")
    filters = (parts.breakable, parts.grouped, parts.law, parts.percent, parts.setting)
    environment.filters.update({each.__name__: each for each in filters})
    functions = (parts.number, parts.percent, parts.ratio, parts.interval)
    environment.globals.update({each.__name__: each for each in functions})
    looks = page_looks(curves.statuses)
    environment.globals["mark"] = lambda law: parts.mark(looks[law])
    return environment.get_template("page.html").render(
        title=f"Report: {campaign['folder'].rstrip('/').rpartition('/')[2]}",
        summary=summary,
        laws=laws,
        several=len(laws) > 1,
        bound=bound,
        **_best(summary),
        varied=_varied(campaign),
        metrics={name: METRICS[metric] for name, metric in FIGURES.items()},
        precision=_precision(summary, curves, looks),
        rates={key: RATES[key].replace("the bound", bound) for key in used},
        missing=_listed([MISSING[key] for key in MISSING if key not in used]),
        pairs={(pair["law"], pair["other"]): pair for pair in summary["pairs"]},
        dependence=_dependence(summary, curves, looks) if curves.parameters else None,
        above_worst=_above_worst(summary),
        even=campaign["design"] in EVEN,
    )


def _rate(summary: Mapping[str, Any], law: str, key: str) -> Mapping[str, Any]:
    rate: Mapping[str, Any] = summary["laws"][law]["rates"][key]
    return rate


def _best(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Find the law with the smallest median error, and the one that exceeds the bound least often; None if unknown."""
    laws = {law: row for law, row in summary["laws"].items() if row["quantiles"][ERROR.name]}
    medians = {law: row["quantiles"][ERROR.name]["median"]["value"] for law, row in laws.items()}
    shares = {law: row["rates"]["exceeding"]["share"] for law, row in laws.items()}
    best = min((law for law in laws if medians[law] is not None), key=lambda law: medians[law], default=None)
    safest = min(laws, key=lambda law: (shares[law], medians[law] is None, medians[law]), default=None)
    return {
        "best": None if best is None else {"law": best, "median": medians[best]},
        "safest": None if safest is None else {"law": safest, "share": shares[safest]},
    }


def _varied(campaign: Mapping[str, Any]) -> dict[str, Any]:
    """Return the distributions by parameter with its unit; one for all axes ends in a star."""
    units = {**{f"{name[:-1]}*": unit for name, unit in campaign["units"].items()}, **campaign["units"]}
    return {parts.with_unit(name, units): parts.drawn(given) for name, given in campaign["varied"].items()}


def _precision(summary: Mapping[str, Any], curves: Curves, looks: Looks) -> list[Picture]:
    """Draw the distributions of the metrics."""
    shown = curves.distributions
    error, tip, chattering = (METRICS[name] for name in FIGURES.values())
    lost = any(row["measured"] > row["completed"] for row in summary["laws"].values())
    note = " A curve that ends below 1 is of a law that did not complete every episode." if lost else ""
    return [
        distribution(
            shown[error.name],
            looks,
            error.label_and_unit,
            f"Share of episodes whose attitude error is up to a value.{note}",
        ),
        exceedance(
            shown[tip.name],
            looks,
            tip.label_and_unit,
            summary["bound_mm"],
            "Share of episodes in which the tool tip strays further than a value; dashed: the bound.",
        ),
        distribution(
            shown[chattering.name],
            looks,
            chattering.label_and_unit,
            f"Share of episodes whose chattering is up to a value.{note}",
        ),
    ]


def _listed(words: list[str]) -> str:
    return " or ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def _dependence(summary: Mapping[str, Any], curves: Curves, looks: Looks) -> dict[str, Any]:
    """Draw the share that each parameter explains, and the error against each, the most important first."""
    units = summary["campaign"]["units"]

    def explained(name: str) -> float:
        """Return the largest share that a parameter explains under any law."""
        rows = (row for found in summary["sensitivity"].values() for row in found if row["parameter"] == name)
        return max((row["sobol"]["value"] or 0.0 for row in rows), default=0.0)

    order = sorted(units, key=lambda name: -explained(name))
    ordered = {
        law: sorted(found, key=lambda row: order.index(row["parameter"]))
        for law, found in summary["sensitivity"].items()
    }
    medians = {law: row["quantiles"][ERROR.name].get("median") for law, row in summary["laws"].items()}
    middles = {law: each["value"] for law, each in medians.items() if each and each["value"] is not None}
    shown = "median, and 90 % as thin lines" if len(ordered) > 1 else "median, and the band from 10 % to 90 %"
    return {
        "shares": [
            bars(rows, looks[law].colour, f"Shares that parameters explain of the error of {law}.")
            for law, rows in ordered.items()
        ],
        "rows": {
            law: [{**row, "name": parts.with_unit(row["parameter"], units)} for row in rows]
            for law, rows in ordered.items()
        },
        "pictures": [
            against_parameter(
                curves.bands[name], middles, looks, parts.with_unit(name, units), f"Error against {name}: {shown}."
            )
            for name in order
        ],
    }


def _above_worst(summary: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the share of all wrists that may be worse than the worst of the largest sample; None if unknown."""
    largest = max(summary["laws"].values(), key=lambda row: row["measured"])
    share = largest["quantiles"][ERROR.name].get("worst", {}).get("above")
    return None if share is None else {"share": share, "episodes": largest["measured"]}
