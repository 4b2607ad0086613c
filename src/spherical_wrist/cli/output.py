"""What commands print: tables for people, JSON for programs."""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.cli.streams import speaks_unicode
from spherical_wrist.experiment.run import Run
from spherical_wrist.metrics import Metrics
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.simulation.outcome import Status

LABELS = {
    "rms_error_rad": ("attitude error, RMS", "rad"),
    "max_error_rad": ("attitude error, largest", "rad"),
    "rms_tip_error_mm": ("tip error, RMS", "mm"),
    "max_tip_error_mm": ("tip error, largest", "mm"),
    "chattering_Nm_per_s": ("chattering", "N·m/s"),
    "peak_torque_Nm": ("torque, peak", "N·m"),
    "rms_torque_Nm": ("torque, RMS", "N·m"),
    "saturated_fraction": ("saturated", "of samples"),
    "reaching_time_s": ("surface reached at", "s"),
    "max_tilt_rad": ("tilt, largest", "rad"),
    "copper_loss_W": ("copper loss", "W"),
    "peak_current_A": ("coil current, peak", "A"),
    "max_condition_number": ("condition number, largest", ""),
}
COIL_FIGURES = ("copper_loss_W", "peak_current_A", "max_condition_number")
"""Rows that only a motor with coils has."""

IDEAL = {"sensing": IdealSensing().model_dump(mode="json"), "actuation": IdealActuation().model_dump(mode="json")}
"""Sensors and motors without a fault, as a run describes them."""

NARROWEST = 60
"""Columns that tables get at least; a narrower terminal folds their lines."""

COLOURS = {Status.COMPLETED: "green", Status.DIVERGED: "red", Status.INTERRUPTED: "yellow"}


def print_json(value: Any) -> None:
    """One JSON object on stdout."""
    print(json.dumps(value, indent=2, ensure_ascii=not speaks_unicode(), allow_nan=False))


def printer() -> Console:
    """Where tables go: as wide as the terminal, but never so narrow that figures would be cut."""
    found = Console(highlight=False)
    found.width = max(found.width, NARROWEST)
    return found


def number(value: float | None) -> str:
    """A figure with four significant digits; a dash for none."""
    if value is None:
        return "—"
    return f"{value:.4g}" if value == 0.0 or 1e-3 <= abs(value) < 1e5 else f"{value:.3e}"


def run_table(run: Run, recording: Path | None) -> None:
    """Prints what was run, how it ended and how well it tracked."""
    console = printer()
    console.print(headline(run))
    console.print(Text(conditions(run), style="dim"))
    console.print(metrics_table({"": run.metrics}))
    console.print(Text(footnote(run), style="dim"))
    if recording is not None:
        console.print(Text.assemble("recording ", (str(recording), "bold"), thinning(run)), soft_wrap=True)


def headline(run: Run) -> Text:
    """Law, reference and outcome."""
    status = run.outcome.status
    text = Text.assemble(
        (name_of(run.description["law"]), "bold"), " on ", (name_of(run.description["reference"]), "bold"), "  "
    )
    text.append(str(status), style=f"bold {COLOURS[status]}")
    text.append(str(run.outcome).removeprefix(str(status)))
    return text


def name_of(table: Any) -> str:
    """The name in a recorded table, without the folder that a user's own file lies in."""
    return str(table["name"]).rpartition("/")[2]


def conditions(run: Run) -> str:
    """What the plant suffered that the controller does not know of, and the timing, in one line."""
    told = run.description
    disturbance = told["disturbance"]
    size = disturbance["level"] if disturbance["amplitude"] is None else disturbance["amplitude"]
    parts = [
        f"{told['duration']:g} s at {1.0 / told['control_period']:g} Hz",
        f"mass × {told['mass_scale']:g}",
        f"disturbance {disturbance['name']} "
        + (f"{100.0 * size:g} %" if disturbance["amplitude"] is None else f"{size:g} N·m")
        if size
        else "no disturbance",
    ]
    for name, unit in (("payload", "kg"), ("friction", "N·m"), ("damping", "N·m·s/rad")):
        if told[name]:
            parts.append(f"{name} {told[name]:g} {unit}")
    for name in ("sensing", "actuation"):
        if told[name] != IDEAL[name]:
            parts.append(f"{name} {told[name]['name']}" + (" with faults" if told[name]["name"] == "ideal" else ""))
    return " · ".join([*parts, f"seed {told['seed']}"])


def metrics_table(columns: dict[str, Metrics], rows: Iterable[str] = LABELS) -> Table:
    """A table of metrics, one column of figures for each entry."""
    table = Table(show_header=len(columns) > 1, header_style="bold")
    table.add_column("")
    for title in columns:
        table.add_column(title, justify="right")
    table.add_column("")
    values = [asdict(metrics) for metrics in columns.values()]
    for row in rows:
        if row in COIL_FIGURES and all(value[row] is None for value in values):
            continue
        label, unit = LABELS[row]
        table.add_row(label, *(number(value[row]) for value in values), Text(unit, style="dim"))
    return table


def thinning(run: Run) -> str:
    """Says that a recording does not have every control instant; empty where it does."""
    return f" (1 in {run.every} control instants)" if run.every > 1 else ""


def footnote(run: Run) -> str:
    """Where the figures come from, and how fast they came."""
    window = f"figures over t ≥ {run.measurement.steady_from:g} s"
    return f"{window} · simulated in {run.wall_time:.3g} s, {run.real_time_factor:.0f} × real time"
