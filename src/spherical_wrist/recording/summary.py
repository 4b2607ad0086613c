"""The experiment and its metrics as text for the viewer."""

from collections.abc import Iterator, Mapping, Sequence

from spherical_wrist.actuation import Actuation
from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.parameters import Member, unit_of
from spherical_wrist.recording.layout import JSON
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.sensing import Sensing

_HARDWARE: Mapping[str, type[Member]] = {"sensing": Sensing, "actuation": Actuation}
_MOOT = {"detents": ("cogging",), "failure_known": ("failed",), "timestamped": ("delay", "loss")}
"""What says nothing of sensors or motors in which all of these are zero."""

_IDEAL = (IdealSensing().model_dump(mode="json"), IdealActuation().model_dump(mode="json"))
"""Sensors and motors without a fault, which go without saying."""

_UNITS = {
    "com_shift": "m",
    "payload": "kg",
    "friction": "N·m",
    "damping": "N·m·s/rad",
    "initial_error": "rad",
    "initial_rate_error": "rad/s",
    "duration": "s",
    "control_period": "s",
    "physics_period": "s",
    "steady_from": "s",
}
"""Units of an experiment's entries, whose names do not say them."""

_SUFFIXES = {
    "_Nm_per_s": "N·m/s",
    "_Nm": "N·m",
    "_mm": "mm",
    "_rad": "rad",
    "_s": "s",
    "_fraction": "%",
    "_W": "W",
    "_A": "A",
}
"""Units that the names of metrics end with; longer endings first."""

_OF_COILS = ("copper_loss_W", "peak_current_A", "max_condition_number")
"""Metrics that go without saying where there are none of them."""

_FIRST = ("law", "reference", "disturbance", "mass_scale", "payload", "seed")
"""What a reader looks for, before all the rest."""

_SPELLED = {"rms": "RMS", "Nm": "N·m", "com": "CoM"}


def title(properties: Mapping[str, Mapping[str, JSON]]) -> str:
    """What the viewer calls the recording: its law and its reference."""
    experiment = properties.get("experiment", {})
    names = [_name_of(experiment[key]) for key in ("law", "reference") if key in experiment]
    return " · ".join(names) or "wrist"


def experiment_text(properties: Mapping[str, Mapping[str, JSON]]) -> str:
    """The experiment as Markdown tables. Entries that are zero or not given are left out, except the seed.

    Likewise the faults that sensors and motors do not have; those that they have come with their units.
    """
    experiment = properties.get("experiment", {})
    keys = [key for key in _FIRST if key in experiment] + [key for key in experiment if key not in _FIRST]
    rows: list[tuple[str, str]] = []
    details: list[tuple[str, str]] = []
    for key in keys:
        value = experiment[key]
        if value in _IDEAL:
            continue
        if isinstance(value, Mapping) and key in _HARDWARE:
            faults = list(_faults(key, value))
            if value.get("name") != "ideal":
                rows.append((_words(key), f"**{value.get('name')}**"))
                details += [(f"{_words(key)}: {fault}", size) for fault, size in faults]
            else:  # a line each: the viewer would cut a long one off
                heads = [(_words(key), "**ideal** but for "), *[("", "")] * len(faults)]
                rows += [
                    (head, f"{but}{fault} {size}") for (head, but), (fault, size) in zip(heads, faults, strict=False)
                ]
        elif isinstance(value, Mapping) and "name" in value:
            entries = {k: v for k, v in value.items() if k != "name" and v is not None}
            brief = [f", {_words(k)} {_text(v)}" for k, v in entries.items() if key == "disturbance"]
            rows.append((_words(key), f"**{value['name']}**{''.join(brief)}"))
            details += [(f"{_words(key)}: {k}", _text(v)) for k, v in entries.items() if key != "disturbance"]
        elif value is not None and (key == "seed" or not _is_zero(value)):
            rows.append((_words(key), f"{_text(value)} {_UNITS.get(key, '')}".strip()))
    return _table(("experiment", ""), rows) + "\n\n" + _table(("parameters", ""), details)


def _faults(key: str, told: Mapping[str, JSON]) -> Iterator[tuple[str, str]]:
    """The parameters of sensors or motors, but for faults that they do not have; with units."""
    member = _HARDWARE[key].members.get(str(told.get("name")))
    for name, value in told.items():
        moot = name in _MOOT and all(_is_zero(told.get(other, 0)) for other in _MOOT[name])
        if name == "name" or value in (None, "measured") or moot or _is_zero(value):
            continue
        unit = unit_of(member, name) if member is not None and name in member.model_fields else ""
        yield _words(name), f"{_text(value)} {unit}".strip()


def metrics_text(properties: Mapping[str, Mapping[str, JSON]], rows: int, every: int) -> str:
    """Outcome and metrics as Markdown tables.

    Args:
        properties: of the recording.
        rows: number of rows that are recorded.
        every: the recording has every ``every``-th control instant.
    """
    outcome = properties.get("outcome", {})
    lines = []
    if "status" in outcome:
        time = outcome.get("time_s")
        at = f" at {time:.6g} s" if isinstance(time, int | float) else ""
        lines = [f"**{outcome['status']}**{at}", str(outcome.get("reason") or "")]
    figures = properties.get("metrics", {})
    coils = any(figures.get(name) is not None for name in _OF_COILS)
    metrics = [_metric(name, value) for name, value in figures.items() if coils or name not in _OF_COILS]
    which = "every control instant" if every == 1 else f"every {every}th control instant"
    lines += [_table(("metric", "value"), metrics), f"{rows} rows, {which}"]
    return "\n\n".join(line for line in lines if line)


def flattened(entries: Mapping[str, JSON], prefix: str = "") -> Iterator[tuple[str, float | str]]:
    """The entries of nested tables as numbers and texts, by dotted name; entries without a value are left out."""
    for key, value in entries.items():
        name = f"{prefix}{key}" or "–"
        if isinstance(value, Mapping):
            yield from flattened(value, f"{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield name, float(value)
        elif value is not None:
            yield name, _text(value)


def _metric(name: str, value: JSON) -> tuple[str, str]:
    for suffix, unit in _SUFFIXES.items():
        if name.endswith(suffix):
            if isinstance(value, int | float) and unit == "%":
                value = 100.0 * value
            words = _words(name.removesuffix(suffix))
            return words, "–" if value is None else f"**{_text(value)}** {unit}"
    return _words(name), "–" if value is None else f"**{_text(value)}**"


def _words(name: str) -> str:
    return " ".join(_SPELLED.get(word, word) for word in name.split("_"))


def _name_of(value: JSON) -> str:
    return str(value["name"]) if isinstance(value, Mapping) and "name" in value else _text(value)


def _text(value: JSON) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        parts = [_text(part) for part in value]
        return parts[0] if len(parts) > 1 and len(set(parts)) == 1 else ", ".join(parts)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(part)}" for key, part in value.items())
    return str(value)


def _is_zero(value: JSON) -> bool:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return all(_is_zero(part) for part in value)
    return not isinstance(value, str | bool) and value == 0


def _table(head: tuple[str, str], rows: Sequence[tuple[str, str]]) -> str:
    if not rows:
        return ""
    lines = [head, ("---", "---"), *rows]
    return "\n".join("| {} | {} |".format(*(cell.replace("|", "\\|") for cell in line)) for line in lines)
