"""``wrist margins``: stability margins, and the largest tip error that a bounded disturbance can cause."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import (
    Changes,
    ExperimentFile,
    Folder,
    Hardware,
    Jobs,
    Json,
    Laws,
    Settings,
    with_hardware,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, json_bytes, print_json, printer, short, written_to
from spherical_wrist.experiment.options import OPTIONS

CHOSEN = [option.parameter for option in OPTIONS if option.parameter not in ("law", "disturbance.name")]
COLUMNS = (
    ("Ms", "max_sensitivity", 1.0),
    ("gain up\n[dB]", "gain_margin_db", 1.0),
    ("down\n[dB]", "gain_reduction_margin_db", 1.0),
    ("phase\n[°]", "phase_margin_deg", 1.0),
    ("delay\n[ms]", "delay_margin_s", 1e3),
    ("disk", "disk_margin", 1.0),
    ("band\n[Hz]", "bandwidth_hz", 1.0),
    ("worst tip\n[µm]", "worst_tip_error_mm", 1e3),
)
"""Columns of the first table: heading, key in the JSON object, factor."""


@with_parameters(*CHOSEN)
def command(
    *,
    experiment: ExperimentFile = None,
    law: Laws = None,
    changes: Changes,
    hardware: Hardware = None,
    at: Annotated[float, Option(metavar="SECONDS", help="time of the reference whose attitude is held")] = 0.0,
    no_ranges: Annotated[bool, Option("--no-ranges", help="leave out the ranges, which take longest")] = False,
    set_: Settings = None,
    output: Folder = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """The loop of each law settles at an attitude of the reference and is linearised there as it runs, compiled.

    Delay, lag, filters and observers are in it; noise, resolution, losses and dry friction are left out. Ms is the
    largest sensitivity at the plant's input, of all axes together; gain, phase and delay are the smallest changes of
    one axis or of all alike that make the loop unstable; disk is the margin against gain and phase at once, on every
    axis at its own; band is the frequency up to which disturbances are halved in power. Worst tip: the largest tip
    error that any torque within the disturbance's level on every axis can cause, by linear theory;
    wrist run --disturbance-shape worst runs it. Ranges: how far mass, payload and a delay that nobody knows of may go,
    each alone. A dash is a margin without end.

    With -o: margins.json, .png and .svg. Needs python-control and Slycot: pip install 'spherical-wrist[margins]'.

    Exit code: 0 computed, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.command import read_settings
    from spherical_wrist.experiment.description import read_toml
    from spherical_wrist.files import make_folder
    from spherical_wrist.stability import margins
    from spherical_wrist.stability.report import to_dict

    tables = read_toml(experiment) if experiment else {}
    every = {**with_hardware(hardware, changes), **read_settings(set_ or [])}
    laws = laws_from_texts(law or [], tables, every)
    if output is not None:
        make_folder(output)
    began = time.perf_counter()
    with counting("linearising") as progress:
        found = margins(laws, tables, every, at=at, ranges=not no_ranges, jobs=jobs, progress=progress)
    table = to_dict(found, at, time.perf_counter() - began)
    if output is not None:
        _write(table, output)
    if json:
        print_json(table)
    else:
        _print(table, output)


def _write(table: dict[str, Any], folder: Path) -> None:
    from spherical_wrist.files import write_together
    from spherical_wrist.picture_file import folder_pictures
    from spherical_wrist.stability.picture import margins_picture

    contents = folder_pictures(margins_picture(table), "margins")
    table["files"] = sorted([*contents, "margins.json"])
    contents["margins.json"] = json_bytes(table)
    write_together({folder / name: content for name, content in contents.items()})


def _print(table: dict[str, Any], folder: Path | None) -> None:
    from spherical_wrist.stability.stable_range import DEVIATIONS

    console = printer()
    stable = [law for law in table["laws"] if law["stable"]]
    stable.sort(key=lambda law: law["worst_tip_error_mm"])
    size = table["disturbance"]
    bound = f"{short(1e3 * size['size_Nm'])} mN·m"
    if size["level"] is not None:
        bound = f"{100.0 * size['level']:g} % ({bound})"
    if stable:
        title = f"margins at the plant's input; torques within {bound} per axis"
        rows: list[list[Entry]] = [
            [law["law"], *(_scaled(law[key], factor) for _, key, factor in COLUMNS)] for law in stable
        ]
        console.print(fitted(title, ["law", *(heading for heading, _, _ in COLUMNS)], rows, console.width))
        note = "Worst tip: from where the tip rests without the disturbance. A dash: no end."
        console.print(Text(note, "dim"))
    if stable and stable[0]["ranges"]:
        rows = [
            [law["law"], *(_scaled(law["ranges"][each.name], each.factor) for each in DEVIATIONS)] for law in stable
        ]
        headings = ["law", *(each.heading for each in DEVIATIONS)]
        console.print()
        console.print(fitted("stable, one change at a time", headings, rows, console.width))
    for law in table["laws"]:
        if not law["stable"]:
            console.print(f"{law['law']}: no margins; {law['reason']}", soft_wrap=True)
    if folder is not None:
        console.print(written_to(folder, ", ".join(table["files"])), soft_wrap=True)


def _scaled(value: float | None, factor: float) -> Text:
    return Text(short(None if value is None else factor * value))
