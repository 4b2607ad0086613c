"""``wrist margins``: stability margins, and the largest tip error that a bounded disturbance can cause."""

from __future__ import annotations

import time
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
    Plots,
    Settings,
    Tables,
    Width,
    read_experiment,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.results import ResultFiles, result_files, write_results
from spherical_wrist.cli.tables import print_json, printer, shown
from spherical_wrist.experiment.options import OPTIONS

CHOSEN = [option.parameter for option in OPTIONS if option.parameter not in ("law", "disturbance.name")]


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
    plot: Plots = None,
    table: Tables = None,
    width: Width = None,
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

    With -o: margins.json, .png, .svg, .pdf, .tex and .md. Needs python-control and Slycot: pip install
    'spherical-wrist[margins]'.

    Exit code: 0 computed, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.files import make_folder
    from spherical_wrist.result_table import beside
    from spherical_wrist.stability import margins
    from spherical_wrist.stability.picture import margins_picture
    from spherical_wrist.stability.report import to_dict
    from spherical_wrist.stability.tables import margins_table, ranges_table

    tables, every = read_experiment(experiment, hardware, changes, set_)
    laws = laws_from_texts(law or [], tables, every)
    files = result_files(output, plot, table, width)
    if output is not None:
        make_folder(output)
    began = time.perf_counter()
    with counting("linearising") as progress:
        found = margins(laws, tables, every, at=at, ranges=not no_ranges, jobs=jobs, progress=progress)
    results = to_dict(found, at, time.perf_counter() - began)
    write_results(
        files,
        "margins",
        results,
        lambda width: margins_picture(results, width),
        lambda: beside(margins_table(results), ranges_table(results)),
    )
    if json:
        print_json(results)
    else:
        _print(results, files)


def _print(table: dict[str, Any], files: ResultFiles) -> None:
    from spherical_wrist.stability.tables import margins_table, ranges_table

    console = printer()
    found, ranges = margins_table(table), ranges_table(table)
    if found.rows:
        console.print(shown(found, console.width))
        for note in found.notes:
            console.print(Text(note, "dim"), soft_wrap=True)
    if ranges is not None:
        console.print()
        console.print(shown(ranges, console.width))
    for law in table["laws"]:
        if not law["stable"]:
            console.print(f"{law['law']}: no margins; {law['reason']}", soft_wrap=True)
    files.say(", ".join(table["files"]))
