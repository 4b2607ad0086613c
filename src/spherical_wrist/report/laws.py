"""The sections on laws: how precise each is, how often it goes wrong, and which is better on the same samples."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.report.findings import Curves
from spherical_wrist.report.parts import breakable, gallery, interval, mark, number, percent, table
from spherical_wrist.report.pictures import distribution, exceedance

FIGURES = {
    "rms_error_rad": "RMS attitude error [rad]",
    "max_tip_error_mm": "largest tip error [mm]",
    "chattering_Nm_per_s": "chattering [N·m/s]",
}
SHARES = {
    "diverged": "diverged",
    "failed": "failed: the law raised, or gave no torque",
    "exceeding": "beyond the bound, or not completed",
    "invalid": "invalid: could not be simulated",
}
NONE = {"diverged": "diverged", "failed": "failed", "invalid": "was invalid"}
"""What is said where there is none."""


def precision(told: Mapping[str, Any], curves: Curves) -> str:
    """Distributions and quantiles of each figure."""
    several, shown = len(told["laws"]) > 1, curves.distributions
    error, tip, chattering = FIGURES
    lost = any(row["measured"] > row["completed"] for row in told["laws"].values())
    note = " A curve that ends below 1 is of a law that did not complete every episode." if lost else ""
    pictures = [
        distribution(shown[error], FIGURES[error], f"Share of episodes whose RMS error is up to a value.{note}"),
        exceedance(
            shown[tip],
            FIGURES[tip],
            told["bound_mm"],
            "Share of episodes in which the tool tip strays further than a value; dashed: the bound.",
        ),
        distribution(
            shown[chattering], FIGURES[chattering], f"Share of episodes whose chattering is up to a value.{note}"
        ),
    ]
    parts = ["<h2>How precise</h2>", gallery(pictures)]
    for metric, label in FIGURES.items():
        rows = [
            [(mark(position) if several else "") + breakable(law), *_quantiles(row["quantiles"][metric])]
            for position, (law, row) in enumerate(told["laws"].items())
        ]
        parts += [f"<h3>{label}</h3>", table(["law", "median", "90 %", "99 %", "worst"], rows, kind="cards figures")]
    return "".join(parts)


def _quantiles(found: Mapping[str, Any]) -> list[str]:
    if not found:
        return ["—"] * 4
    inner = [
        f"<span>{number(each['value'])}{interval(each['low'], each['high'])}</span>"
        for each in (found[name] for name in ("median", "90 %", "99 %"))
    ]
    return [*inner, f"<span>{number(found['worst']['value'])}</span>"]


def failures(told: Mapping[str, Any]) -> str:
    """Shares of what went wrong."""
    laws = told["laws"]
    used = [key for key in SHARES if key == "exceeding" or any(row["rates"][key]["count"] for row in laws.values())]
    rows = [[breakable(law), *(_share(row["rates"][key]) for key in used)] for law, row in laws.items()]
    missing = [NONE[key] for key in NONE if key not in used]
    words = " or ".join(filter(None, [", ".join(missing[:-1]), *missing[-1:]]))
    names = [SHARES[key].replace("the bound", f"{told['bound_mm']:g} mm") for key in used]
    none = f"<p>No episode {words}.</p>" if missing else ""
    return f"<h2>How often it goes wrong</h2>{none}{table(['law', *names], rows)}"


def _share(rate: Mapping[str, Any]) -> str:
    of = f'<span class="soft">({rate["count"]:,} of {rate["of"]:,})</span>'
    return f"<span>{percent(rate['share'])} {of}{interval(rate['low'], rate['high'], percent)}</span>"


def law_against_law(told: Mapping[str, Any]) -> str:
    """Every law against every other on the same samples."""
    laws = list(told["laws"])
    pairs = {(pair["law"], pair["other"]): pair for pair in told["pairs"]}
    rows = [
        [
            f'{position + 1} {mark(position)}<span class="name">{breakable(law)}</span>',
            *(_duel(pairs[law, other]) if law != other else "·" for other in laws),
        ]
        for position, law in enumerate(laws)
    ]
    headings = ["error of …", *(f"÷ that of {position + 1} {mark(position)}" for position in range(len(laws)))]
    text = (
        "<p>On the same wrists with the same disturbances and noise: the median of the ratio of their RMS errors, and "
        "in how many episodes the law on the left wins: has the smaller one.</p>"
    )
    return f"<h2>Law against law</h2>{text}{table(headings, rows, kind='matrix')}"


def _duel(pair: Mapping[str, Any]) -> str:
    ratio, share = pair["ratio"], pair["share"]
    if not pair["samples"]:
        return "—"
    ends = interval(ratio["low"], ratio["high"], lambda value: number(value, "∞"))
    wins = f"<small>wins {percent(share['value'])}</small>{interval(share['low'], share['high'], percent)}"
    return f"<span>× {number(ratio['value'], '∞')}{ends}{wins}</span>"
