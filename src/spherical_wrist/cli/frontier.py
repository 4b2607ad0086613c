"""``wrist frontier``: how far from the nominal wrist each law holds a bound."""

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.text import Text

from spherical_wrist.cli.output import print_json, printer
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, short
from spherical_wrist.comparison.contestants import contestants
from spherical_wrist.comparison.crossing import Found
from spherical_wrist.comparison.frontier import Axis, chosen_axes, frontier
from spherical_wrist.comparison.frontier_report import told
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import read_toml
from spherical_wrist.files import write_together


class FrontierOptions(NamedTuple):
    """What to search and where to write; see ``wrist frontier --help``."""

    laws: list[str]
    axes: list[str]
    bound: float
    tolerance: float
    folder: Path | None
    jobs: int | None
    json: bool


def find_frontier(file: Path | None, changes: Mapping[str, Any], settings: list[str], options: FrontierOptions) -> None:
    """Searches, prints and writes.

    Args:
        file: experiment file, if any.
        changes: values by dotted name that take the place of those in the file.
        settings: ``name=value`` texts that take the place of both.
        options: the rest.

    Raises:
        WristError: wrong input, or a file that cannot be written.
    """
    tables = read_toml(file) if file else {}
    every = {**changes, **read_settings(settings)}
    laws, axes = contestants(options.laws, tables, every), chosen_axes(options.axes)
    began = time.perf_counter()
    with counting("searching") as progress:
        edges = frontier(
            laws, axes, tables, every, bound=options.bound, tolerance=options.tolerance, folder=options.folder,
            jobs=options.jobs, progress=progress,
        )  # fmt: skip
    table = told(edges, laws, axes, options.bound, options.tolerance, time.perf_counter() - began)
    if options.folder is not None:
        _write(table, axes, options.folder)
    if options.json:
        print_json(table)
    else:
        _print(table, axes, options.folder)


def _write(table: dict[str, Any], axes: Sequence[Axis], folder: Path) -> None:
    from spherical_wrist.comparison.frontier_picture import frontier_picture
    from spherical_wrist.comparison.picture import as_files

    contents = as_files(frontier_picture(table, axes), "frontier")
    table["files"] = sorted([*contents, "frontier.json"])
    contents["frontier.json"] = (json.dumps(table, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
    write_together({folder / name: content for name, content in contents.items()})


def _print(table: dict[str, Any], axes: Sequence[Axis], folder: Path | None) -> None:
    console = printer()
    headings = ["law", *(f"{axis.name}\n[{axis.shown[1]}]" for axis in axes)]
    best = {axis.name: max(_reach(law["edges"][axis.name], axis) for law in table["laws"]) for axis in axes}
    rows: list[list[Entry]] = []
    for law in table["laws"]:
        entries = [(axis, law["edges"][axis.name]) for axis in axes]
        styles = ("bold green" if _reach(edge, axis) == best[axis.name] else "" for axis, edge in entries)
        rows.append(
            [
                law["law"],
                *(Text(_entry(edge, axis), style) for (axis, edge), style in zip(entries, styles, strict=True)),
            ]
        )
    console.print(fitted(f"first miss of {table['bound_mm']:g} mm of tip error", headings, rows, console.width))
    notes = "; ".join(f"{axis.name}: {axis.meaning}" for axis in axes)
    console.print(Text(f"{notes}. nominal: misses already there; > never missed up to there.", "dim"))
    if folder is not None:
        names = ", ".join(table["files"])
        console.print(Text.assemble("written to ", (str(folder), "bold"), f": {names}"), soft_wrap=True)


def _reach(edge: Mapping[str, Any], axis: Axis) -> float:
    if edge["found"] == Found.NEVER:
        return float("inf")
    return -1.0 if edge["found"] == Found.NOMINAL else float(edge["misses"])


def _entry(edge: Mapping[str, Any], axis: Axis) -> str:
    if edge["found"] == Found.NOMINAL:
        return "nominal"
    scale, _ = axis.shown
    if edge["found"] == Found.NEVER:
        return f"> {short(scale * edge['holds'])}"
    return short(scale * edge["misses"])
