"""Tables of runs and their metrics on the terminal."""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.cli.streams import warned
from spherical_wrist.cli.tables import Entry, cell_width, number, printer
from spherical_wrist.measure.bound import meaning_of
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.plain_text import visible
from spherical_wrist.recording.experiment_text import effects
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.verdict import Judgement, Verdict

IDEAL = {"sensing": IdealSensing().model_dump(mode="json"), "actuation": IdealActuation().model_dump(mode="json")}
"""Descriptions of sensors and motors without faults, as recorded."""

COLOURS = {Judgement.WITHIN: "green", Judgement.EXCEEDS: "red", Judgement.LOST: "red", Judgement.NONE: "yellow"}
"""Colour of each verdict; of one with warnings, yellow in place of green."""


def warn(warnings: Iterable[str]) -> None:
    """Print warnings on the error stream, a line each."""
    for warning in warnings:
        warned(warning)


def run_table(run: Run, recording: Path | None, motion: str = "") -> None:
    """Print the verdict on a run, its warnings, the experiment and the metrics.

    Args:
        run: the run.
        recording: its recording; None where there is none.
        motion: description of the motion that was read, in one line; empty for a formula.
    """
    console = printer()
    print_verdict(run.verdict, run.warnings, console)
    console.print(headline(run))
    console.print(Text(conditions(run), style="dim"))
    if motion:
        console.print(Text(visible(motion), style="dim"))
    console.print(metrics_table({"": run.metrics}, console.width))
    console.print(Text(footnotes(run), style="dim"))
    if recording is not None:
        console.print(Text.assemble("recording ", (str(recording), "bold"), thinning(run)), soft_wrap=True)


def print_verdict(found: Verdict, warnings: Iterable[str], console: Console) -> None:
    """Print a verdict, and right below it the warnings, on the error stream."""
    console.print(verdict_text(found))
    sys.stdout.flush()  # both streams are one screen, where the warnings belong here
    warn(warnings)


def verdict_text(found: Verdict) -> Text:
    """Return a verdict in its colour."""
    doubtful = found.judgement is Judgement.WITHIN and found.warnings
    return Text(visible(found.text), f"bold {'yellow' if doubtful else COLOURS[found.judgement]}")


def headline(run: Run) -> Text:
    """Return law, reference and status."""
    law, reference = (name_of(run.description[part]) for part in ("law", "reference"))
    return Text.assemble((law, "bold"), " on ", (reference, "bold"), f", {run.outcome.status}")


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
        part, ideal = description[name], IDEAL[name]
        if part["name"] != ideal["name"]:
            parts.append(f"{name} {part['name']}")
        elif faults := [f"{fault} {value}" for fault, value in effects(name, part) if part[fault] != ideal[fault]]:
            parts.append(f"{name} ideal but for {', '.join(faults)}")
    return " · ".join([*parts, f"seed {description['seed']}"])


def metrics_table(columns: Mapping[str, Metrics], width: int) -> Table:
    """Return a table of the metrics that any of the runs has.

    Args:
        columns: metrics of each run by the heading of its column.
        width: width of the terminal [columns]; notes on the meaning are left out where they do not fit beside.
    """
    headings = ["", *columns, "", ""]
    rows: list[list[Entry]] = [
        [
            metric.label,
            *(metric_figure(name, metrics[name]) for metrics in columns.values()),
            Text(metric.shown_unit, "dim"),
            Text(metric.note, "dim"),
        ]
        for name, metric in METRICS.items()
        if any(name in metrics.available for metrics in columns.values())
    ]
    widest = (max(map(cell_width, column)) for column in zip(headings, *rows, strict=True))
    noted = sum(widest) + 2 * (len(headings) - 1) <= width
    shown = len(headings) if noted else len(headings) - 1
    table = Table(
        box=None,
        padding=(0, 2, 0, 0),
        pad_edge=False,
        header_style="dim",
        show_header=len(columns) > 1,
        caption=None if noted else Text("what each figure is: wrist list metrics"),
        caption_style="dim",
        caption_justify="left",
    )
    for column, heading in enumerate(headings[:shown]):
        table.add_column(Text(heading), justify="right" if 0 < column <= len(columns) else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row[:shown])
    return table


def metric_figure(name: str, value: float | None) -> str:
    """Write the value of a metric in the unit in which people see it."""
    metric = METRICS[name]
    return number(metric.shown_value(value), metric.digits)


def thinning(run: Run) -> str:
    """Return a note that a recording does not have every control instant; empty if it has."""
    return f" (1 in {run.every} control instants)" if run.every > 1 else ""


def footnotes(run: Run) -> str:
    """Return the window of the metrics, the meaning of the bound, and the speed of the simulation, in lines."""
    begin, until, bound = run.measurement.steady_from, run.measurement.steady_until, run.measurement.bound
    window = f"t ≥ {begin:g} s: without the first approach"
    if until is not None:
        window = f"{begin:g} s ≤ t ≤ {until:g} s, where the motion ends"
    first = f"figures over the steady window, {window}\n{bound:g} mm: {meaning_of(bound)}\n"
    if not run.wall_time:  # an agent drove it: the time that it took is not known
        return first.rstrip()
    speed = run.real_time_factor
    return (
        f"{first}simulated in {run.wall_time:.3g} s, {f'{speed:.2g}' if speed < 10.0 else f'{speed:.0f}'} × real time"
    )
