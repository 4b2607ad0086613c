"""Tables of runs and their metrics on the terminal."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.cli.streams import warned
from spherical_wrist.cli.tables import number, printer
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.plain_text import visible
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.simulation.run import Run

IDEAL = {"sensing": IdealSensing().model_dump(mode="json"), "actuation": IdealActuation().model_dump(mode="json")}
"""Descriptions of sensors and motors without faults, as recorded."""

COLOURS = {Status.COMPLETED: "green", Status.DIVERGED: "red", Status.FAILED: "red", Status.INTERRUPTED: "yellow"}


def warn(warnings: Iterable[str]) -> None:
    """Print warnings on the error stream, a line each."""
    for warning in warnings:
        warned(warning)


def run_table(run: Run, recording: Path | None, motion: str = "") -> None:
    """Print the experiment, its outcome and its metrics.

    Args:
        run: the run.
        recording: its recording; None where there is none.
        motion: description of the motion that was read, in one line; empty for a formula.
    """
    console = printer()
    console.print(headline(run))
    console.print(Text(conditions(run), style="dim"))
    if motion:
        console.print(Text(visible(motion), style="dim"))
    console.print(metrics_table({"": run.metrics}))
    console.print(Text(footnote(run), style="dim"))
    if recording is not None:
        console.print(Text.assemble("recording ", (str(recording), "bold"), thinning(run)), soft_wrap=True)


def headline(run: Run) -> Text:
    """Return law, reference and outcome."""
    status = run.outcome.status
    text = Text.assemble(
        (name_of(run.description["law"]), "bold"), " on ", (name_of(run.description["reference"]), "bold"), "  "
    )
    text.append(str(status), style=f"bold {COLOURS[status]}")
    text.append(str(run.outcome).removeprefix(str(status)))
    return text


def name_of(table: Any) -> str:
    """Return the name in a recorded table, without the folder of a user's own file."""
    return str(table["name"]).rpartition("/")[2]


def conditions(run: Run) -> str:
    """Return timing, perturbation of the plant and hardware in one line."""
    description = run.description
    disturbance = description["disturbance"]
    size = disturbance["level"] if disturbance["amplitude"] is None else disturbance["amplitude"]
    parts = [
        f"{description['duration']:g} s at {1.0 / description['control_period']:g} Hz",
        f"mass × {description['mass_scale']:g}",
        f"disturbance {disturbance['name']} "
        + (f"{100.0 * size:g} %" if disturbance["amplitude"] is None else f"{size:g} N·m")
        if size
        else "no disturbance",
    ]
    for name, unit in (("payload", "kg"), ("friction", "N·m"), ("damping", "N·m·s/rad")):
        if description[name]:
            parts.append(f"{name} {description[name]:g} {unit}")
    for name in ("sensing", "actuation"):
        if description[name] != IDEAL[name]:
            parts.append(
                f"{name} {description[name]['name']}" + (" with faults" if description[name]["name"] == "ideal" else "")
            )
    return " · ".join([*parts, f"seed {description['seed']}"])


def metrics_table(columns: dict[str, Metrics]) -> Table:
    """Return a table of the metrics that any of the runs has, one column of figures for each run."""
    table = Table(show_header=len(columns) > 1, header_style="bold")
    table.add_column("")
    for title in columns:
        table.add_column(title, justify="right")
    table.add_column("")
    for name, metric in METRICS.items():
        if any(name in metrics.available for metrics in columns.values()):
            figures = [metric_figure(name, metrics[name]) for metrics in columns.values()]
            table.add_row(metric.label, *figures, Text(metric.shown_unit, style="dim"))
    return table


def metric_figure(name: str, value: float | None) -> str:
    """Write the value of a metric in the unit in which people see it."""
    metric = METRICS[name]
    return number(metric.shown_value(value), metric.digits)


def thinning(run: Run) -> str:
    """Return a note that a recording does not have every control instant; empty if it has."""
    return f" (1 in {run.every} control instants)" if run.every > 1 else ""


def footnote(run: Run) -> str:
    """Return the window of the metrics, and the speed of the simulation."""
    until = run.measurement.steady_until
    window = f"figures over t ≥ {run.measurement.steady_from:g} s"
    if until is not None:
        window = f"figures over {run.measurement.steady_from:g} s ≤ t ≤ {until:g} s, where the motion ends"
    return f"{window} · simulated in {run.wall_time:.3g} s, {run.real_time_factor:.0f} × real time"
