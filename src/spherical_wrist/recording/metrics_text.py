"""Metrics as text for the viewer, and the parts of such texts."""

from collections.abc import Iterator, Mapping, Sequence
from math import inf

from spherical_wrist.measure.bound import BOUND, meaning_of
from spherical_wrist.measure.metrics import METRICS, Metric
from spherical_wrist.plain_text import markdown
from spherical_wrist.recording.layout import JSON

_SPELLED = {"rms": "RMS", "Nm": "N·m", "com": "CoM"}


def metrics_text(properties: Mapping[str, Mapping[str, JSON]], rows: int, every: int) -> str:
    """Return verdict, warnings and metrics as Markdown.

    Args:
        properties: of the recording; its metrics are those that the run has.
        rows: number of rows that are recorded.
        every: the recording has every ``every``-th control instant.
    """
    outcome = properties.get("outcome", {})
    lines = []
    if "verdict" in outcome:
        lines = [f"#### {markdown(str(outcome['verdict']))}"]
    elif "status" in outcome:
        lines = [f"#### {markdown(str(outcome['status']))}", markdown(str(outcome.get("reason") or ""))]
    warnings = outcome.get("warnings")
    if isinstance(warnings, Sequence) and not isinstance(warnings, str):
        lines += [f"**warning:** {markdown(str(warning))}" for warning in warnings]
    figures = properties.get("metrics", {})
    metrics = [
        (each.label, _metric(each, figures[name]), each.note) for name, each in METRICS.items() if name in figures
    ]
    which = "every control instant" if every == 1 else f"every {every}th control instant"
    lines += [" · ".join(_measured(properties)), table(("metric", "value", ""), metrics), f"{rows} rows, {which}"]
    return "\n\n".join(line for line in lines if line)


def flattened(entries: Mapping[str, JSON], prefix: str = "") -> Iterator[tuple[str, float | str]]:
    """Yield the entries of nested tables as numbers and texts, by dotted name; entries without a value are left out."""
    for key, value in entries.items():
        name = f"{prefix}{key}" or "–"
        if isinstance(value, Mapping):
            yield from flattened(value, f"{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield name, float(value)
        elif value is not None:
            yield name, text(value)


def bound_of(properties: Mapping[str, Mapping[str, JSON]]) -> float:
    """Return the bound on the tip error [mm] of a run; the usual one where it is not said."""
    bound = properties.get("measurement", {}).get("bound")
    return float(bound) if isinstance(bound, int | float) and 0.0 < bound < inf else BOUND


def _measured(properties: Mapping[str, Mapping[str, JSON]]) -> Iterator[str]:
    """Yield the window of the metrics, and the meaning of the bound."""
    measurement, bound = properties.get("measurement", {}), bound_of(properties)
    begin, until = measurement.get("steady_from"), measurement.get("steady_until")
    if isinstance(begin, int | float):
        ends = isinstance(until, int | float)
        yield "steady window " + (f"{begin:g} s to {until:g} s, where the motion ends" if ends else f"t ≥ {begin:g} s")
        yield f"{bound:g} mm: {meaning_of(bound)}"


def _metric(metric: Metric, value: JSON) -> str:
    if not isinstance(value, int | float):
        return "–"
    shown = metric.shown_value(value)
    return f"**{shown:.{metric.digits}g}** {metric.shown_unit}".rstrip()


def words(name: str) -> str:
    """Return the name of a parameter in words."""
    return " ".join(_SPELLED.get(word, word) for word in name.split("_"))


def text(value: JSON) -> str:
    """Return a value as text; a vector of equal components as one number."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        parts = [text(part) for part in value]
        return parts[0] if len(parts) > 1 and len(set(parts)) == 1 else ", ".join(parts)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {text(part)}" for key, part in value.items())
    return str(value)


def is_zero(value: JSON) -> bool:
    """Return True for zero, and for vectors of zeros; choices by name and flags are not zero."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return all(is_zero(part) for part in value)
    return not isinstance(value, str | bool) and value == 0


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; empty without rows."""
    if not rows:
        return ""
    lines = [head, ["---"] * len(head), *rows]
    cells = ([cell.replace("|", "\\|") for cell in line] for line in lines)
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)
