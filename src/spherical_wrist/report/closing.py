"""The end of a page: the worst episodes, and how the figures come about."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

from spherical_wrist.report.parts import breakable, folded, number, percent, setting, table
from spherical_wrist.report.sensitivity import EVEN

INTERVALS = (
    "Small figures are {confidence} confidence intervals. Of quantiles and of median ratios, from order statistics and "
    "the binomial distribution (David and Nagaraja, 2003); of shares, Wilson’s (1927); of rank correlations, those of "
    "Bonett and Wright (2000); of Sobol indices, from leaving out twentieths of the samples in turn. They take samples "
    "for independent: Sobol points and Latin hypercubes are spread more evenly, so that they are wider than need be."
)
POINTS = "The points of a grid are no draws, so that there are no confidence intervals: shares are of its points."


def worst(told: Mapping[str, Any]) -> str:
    """The worst episodes with the commands that replay them."""
    found, laws = told["worst"], told["worst"]["laws"]
    parts = [
        "<h2>The worst episodes</h2>",
        "<p>Runs that did not complete, then the largest RMS errors. Each can be run again, alone, and recorded.</p>",
        _episodes(found["overall"], laws=len(laws) > 1),
    ]
    if len(laws) > 1:
        parts += [folded(f"Of {breakable(law)}", _episodes(rows, laws=False)) for law, rows in laws.items()]
    return "".join(parts)


def _episodes(rows: Sequence[Mapping[str, Any]], *, laws: bool) -> str:
    lines = []
    for row in rows:
        how = number(row["error"], f"{row['outcome']} at {row['ended_at_s']:.3g} s: {row['reason']}")
        values = ", ".join(f"{breakable(name)} = {setting(value)}" for name, value in row["parameters"].items())
        law = [breakable(row["law"])] if laws else []
        again = f'<span class="set">{values}</span><code>{escape(row["command"])}</code>'
        lines.append([f"{row['id']}", *law, how, number(row["tip"], "—"), again])
    law = ["law"] if laws else []
    headings = ["episode", *law, "RMS error [rad]", "tip error [mm]", "parameters, and how to run it again"]
    return table(headings, lines, kind="cards worst")


def methods(told: Mapping[str, Any]) -> str:
    """How the figures come about."""
    return "<h2>How this was computed</h2>" + "".join(f"<p>{line}</p>" for line in _methods(told))


def _methods(told: Mapping[str, Any]) -> Iterator[str]:
    yield (
        "Figures are over the steady window of each episode. A run that did not complete counts as worse than any that "
        "did, so that a law gains nothing by losing its hardest episodes; Sobol indices are of runs that completed."
    )
    confidence = f"{100.0 * told['confidence']:g} %"
    yield INTERVALS.format(confidence=confidence) if told["intervals"] else POINTS
    largest = max(told["laws"].values(), key=lambda row: row["measured"])
    above = largest["quantiles"]["rms_error_rad"].get("worst", {}).get("above")
    if above is not None:
        yield (
            f"The worst of {largest['measured']:,} episodes is no bound: with {confidence} confidence, up to "
            f"{percent(above)} of all wrists that the design stands for may be worse (Wilks, 1941)."
        )
    bias = "" if told["campaign"]["design"] in EVEN else ", without the bias that chance gives it (Kelley, 1935)"
    yield (
        "Sobol indices are from the samples as they are, in bins of each parameter (Plischke, Borgonovo and Smith, "
        f"2013): the correlation ratio of log error{bias}."
    )
