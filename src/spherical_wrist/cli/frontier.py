"""``wrist frontier``: distance from the nominal wrist up to which each law keeps bounds on its metrics."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from itertools import count
from typing import TYPE_CHECKING, Annotated, Any

from rich.text import Text
from typer import Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import (
    CONDITIONS,
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
from spherical_wrist.cli.tables import Entry, cell_width, fitted, print_json, printer, short
from spherical_wrist.experiment.axes import AXES

if TYPE_CHECKING:
    from spherical_wrist.experiment.axes import Axis

LOST = "!"
"""Mark of a value at which the run did not complete."""


@with_parameters(*CONDITIONS)
def command(
    *,
    experiment: ExperimentFile = None,
    law: Laws = None,
    axis: Annotated[
        list[str] | None,
        Option(metavar="NAME", help=f"{', '.join(AXES)}; may be repeated [all]", autocompletion=completion.axes),
    ] = None,
    max_: Annotated[
        list[str] | None,
        Option(
            "--max",
            metavar="METRIC=VALUE",
            help="bound on any metric, in its unit (see wrist list), or none; may be repeated "
            "[max_tip_error_mm=0.1 and max_error_rad=0.01]",
            autocompletion=completion.bounds,
        ),
    ] = None,
    tolerance: Annotated[float, Option(metavar="FRACTION", help="relative tolerance of the values")] = 0.02,
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Folder = None,
    plot: Plots = None,
    table: Tables = None,
    width: Width = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Along each axis alone, such as a heavier plant or a delay, values move away from the nominal until a miss.

    A miss is a metric of the steady window above its bound, or a run that does not complete; bisection then finds the
    first one. No tested value on the way to it missed; values between tested ones are not known, and beyond the first
    miss the bounds may hold again, as they often do along the frequency of a disturbance. Everything else is as in the
    experiment: by default the Lissajous motion of an undisturbed plant equal to the nominal model. `wrist guide
    hardware` has a table of the axes.

    The tip error of 0.1 mm is what coronary surgery typically needs (Bachta et al., 2011). The attitude error of 0.01
    rad displaces a needle's point 10 mm beside the tool's axis by as much. With -o: frontier.json,
    .png, .svg, .pdf, .tex and .md.

    Exit code: 0 found, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.comparison.bounds import BOUNDS, read_bounds
    from spherical_wrist.comparison.frontier import frontier
    from spherical_wrist.comparison.frontier_picture import frontier_picture
    from spherical_wrist.comparison.frontier_report import to_dict
    from spherical_wrist.comparison.frontier_table import frontier_table
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.axes import chosen_axes

    tables, every = read_experiment(experiment, hardware, changes, set_)
    bounds, axes = read_bounds(max_ or [], BOUNDS), chosen_axes(axis or [])
    laws = laws_from_texts(law or [], tables, every)
    files = result_files(output, plot, table, width)
    began = time.perf_counter()
    with counting("searching") as progress:
        edges = frontier(
            laws, axes, tables, every, bounds=bounds, tolerance=tolerance, folder=output, jobs=jobs, progress=progress
        )
    found = to_dict(edges, laws, axes, bounds, tolerance, time.perf_counter() - began)
    write_results(
        files,
        "frontier",
        found,
        lambda width: frontier_picture(found, axes, width),
        lambda: frontier_table(found, axes),
    )
    warn(found["warnings"])
    if json:
        print_json(found)
    else:
        _print(found, axes, files)


def _print(table: dict[str, Any], axes: Sequence[Axis], files: ResultFiles) -> None:
    from spherical_wrist.comparison.bounds import statement
    from spherical_wrist.comparison.law_selection import named_laws

    console = printer()
    marks = _marks(table["bounds"])
    columns = [_column(table["laws"], axis, marks) for axis in axes]
    laws: list[Entry] = [law["law"] for law in table["laws"]]
    console.print(Text("first value at which a law misses its bounds, one axis at a time", "bold"))
    for some in _side_by_side(columns, max(map(cell_width, laws)), console.width):
        rows = [list(row) for row in zip(laws, *(entries for _, entries in some), strict=True)]
        console.print(fitted("", ["law", *(heading for heading, _ in some)], rows, console.width))
    for axis in axes:
        console.print(Text(f"{axis.name}: {axis.meaning}", "dim"))
    bounds = [f"{marks[name] or 'no mark'}: {statement(name, bound)}" for name, bound in table["bounds"].items()]
    console.print(Text(f"missed: {'; '.join(bounds)}; {LOST}: the run did not complete", "dim"))
    for note in named_laws(table["laws"]):
        console.print(Text(note, "dim"), soft_wrap=True)
    console.print(Text("nominal: missed already there; > or <: never missed up to there", "dim"))
    files.say(", ".join(table["files"]))


def _marks(bounds: Mapping[str, float]) -> dict[str, str]:
    """Return the mark of each bound behind the values that miss it: none for the first one, then asterisks."""
    return dict(zip(bounds, ("*" * stars for stars in count()), strict=False))


def _column(laws: Sequence[Mapping[str, Any]], axis: Axis, marks: Mapping[str, str]) -> tuple[str, list[Entry]]:
    """Return heading and entries of an axis; the law that goes furthest stands out."""
    edges = [law["edges"][axis.name] for law in laws]
    reach = [_reach(edge, axis) for edge in edges]
    texts = [_entry(edge, axis, marks) for edge in edges]
    entries = (Text(text, "bold green" if own == max(reach) else "") for text, own in zip(texts, reach, strict=True))
    return f"{axis.name.replace('_', ' ')}\n[{axis.shown[1]}]", list(entries)


def _side_by_side(
    columns: Sequence[tuple[str, list[Entry]]], names: int, width: int
) -> list[list[tuple[str, list[Entry]]]]:
    """Divide columns into tables that fit the terminal beside a column of names."""
    tables: list[list[tuple[str, list[Entry]]]] = [[]]
    room = left = max(width - min(names, width // 3) - 2, 1)
    for heading, entries in columns:
        wide = 2 + max(cell_width(entry) for entry in [*heading.split("\n"), *entries])
        if wide > left and tables[-1]:
            tables.append([])
            left = room
        tables[-1].append((heading, entries))
        left -= wide
    return tables


def _reach(edge: Mapping[str, Any], axis: Axis) -> float:
    from spherical_wrist.comparison.crossing import CrossingStatus

    if edge["found"] == CrossingStatus.NEVER:
        return float("inf")
    return -1.0 if edge["found"] == CrossingStatus.NOMINAL else axis.deviation(edge["misses"])


def _entry(edge: Mapping[str, Any], axis: Axis, marks: Mapping[str, str]) -> str:
    from spherical_wrist.comparison.crossing import CrossingStatus

    scale, _ = axis.shown
    if edge["found"] == CrossingStatus.NEVER:
        return f"{'<' if axis.downwards else '>'} {short(scale * edge['holds'])}"
    value = "nominal" if edge["found"] == CrossingStatus.NOMINAL else short(scale * edge["misses"])
    return f"{value}{marks.get(edge['by'], LOST)}"
