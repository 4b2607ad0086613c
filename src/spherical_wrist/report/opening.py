"""The head of a page: what was run, how much of it is there, and the answers that a reader looks for first."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from spherical_wrist.report.parts import (
    breakable,
    definitions,
    folded,
    mark,
    number,
    percent,
    setting,
    with_unit,
)

DESIGNS = {"sobol": "Sobol", "latin_hypercube": "Latin hypercube"}


def opening(told: Mapping[str, Any]) -> str:
    """Cards with the most important, what is to be known before reading on, what was varied, and the laws' marks."""
    campaign, laws = told["campaign"], list(told["laws"])
    count = len(campaign["laws"])
    design = DESIGNS.get(campaign["design"], campaign["design"])
    cards = [
        (f"{campaign['stored']:,} of {campaign['episodes']:,} episodes", _progress(campaign)),
        (
            f"{count} {'law' if count == 1 else 'laws'} × {campaign['samples']:,} samples",
            f"{design} design, seed {campaign['seed']}",
        ),
        *_answers(told),
    ]
    text = "".join(f"<div><b>{title}</b><span>{detail}</span></div>" for title, detail in cards)
    return f'<div class="lead">{text}</div>{_warnings(told)}{_run(told)}{_legend(laws)}'


def _progress(campaign: Mapping[str, Any]) -> str:
    share = campaign["stored"] / campaign["episodes"]
    words = "complete" if campaign["complete"] else f"{100.0 * share:.3g} % complete"
    return f'<progress max="1" value="{share:.4f}"></progress>{words}'


def _answers(told: Mapping[str, Any]) -> list[tuple[str, str]]:
    laws = {law: row for law, row in told["laws"].items() if row["quantiles"]["rms_error_rad"]}
    medians = {law: row["quantiles"]["rms_error_rad"]["median"]["value"] for law, row in laws.items()}
    shares = {law: row["rates"]["exceeding"]["share"] for law, row in laws.items()}
    best = min((law for law in laws if medians[law] is not None), key=lambda law: medians[law], default=None)
    safest = min(laws, key=lambda law: (shares[law], medians[law] is None, medians[law]), default=None)
    found = []
    if best is not None:
        found.append((breakable(best), f"smallest median error: {number(medians[best], unit=' rad')}"))
    if safest is not None:
        bound = f"{told['bound_mm']:g} mm of tip error"
        found.append((breakable(safest), f"least often beyond {bound}: {percent(shares[safest])}"))
    return found


def _warnings(told: Mapping[str, Any]) -> str:
    campaign, lines = told["campaign"], []
    if not campaign["complete"]:
        command = escape(campaign["resume"])
        lines.append(f"The campaign is not complete; this goes on with it: <code>{command}</code>")
        if campaign["design"] == "grid":
            lines.append("Of a grid, the episodes so far are one corner, and stand for nothing else.")
    lines += [f"Not trusted, and left out: {escape(text)}." for text in told["odd"]]
    unmeasured = sum(row["unmeasured"] for row in told["laws"].values())
    if unmeasured:
        lines.append(f"{unmeasured:,} episodes completed without a steady window to measure, and are left out.")
    return "".join(f'<p class="warn">{line}</p>' for line in lines)


def _run(told: Mapping[str, Any]) -> str:
    """What was varied, the campaign file, and versions."""
    campaign = told["campaign"]
    units = {**{f"{name[:-1]}*": unit for name, unit in campaign["units"].items()}, **campaign["units"]}
    varied = {with_unit(name, units): _drawn(given) for name, given in campaign["varied"].items()}
    known = {name: escape(version) for name, version in told["versions"].items()}
    known["digest"] = f"<code>{campaign['digest'][:16]}</code>"
    return (
        (f"<h3>Varied</h3>{definitions(varied)}" if varied else "<p>Nothing was varied but the seed.</p>")
        + (folded("Campaign file", f"<pre>{escape(campaign['file'])}</pre>") if campaign["file"] else "")
        + folded("Versions", definitions(known))
    )


def _drawn(given: Any) -> str:
    """A distribution as a person would say it."""
    if isinstance(given, Mapping):
        return ", ".join(f"{escape(kind.replace('_', ' '))} {_drawn(values)}" for kind, values in given.items())
    if isinstance(given, list | tuple):
        return "[" + ", ".join(_drawn(each) for each in given) + "]"
    return setting(given)


def _legend(laws: Sequence[str]) -> str:
    if len(laws) < 2:
        return ""
    names = "".join(f"<span>{number + 1} {mark(number)}{breakable(law)}</span>" for number, law in enumerate(laws))
    return f'<div class="legend">{names}</div>'
