"""``wrist frontier``: distance from the nominal wrist up to which each law holds a bound."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import (
    Bound,
    Changes,
    ExperimentFile,
    Folder,
    Jobs,
    Json,
    Laws,
    Settings,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, json_bytes, print_json, printer, short, written_to

if TYPE_CHECKING:
    from spherical_wrist.comparison.frontier import Axis


@with_parameters("duration", "seed")
def command(
    *,
    experiment: ExperimentFile = None,
    law: Laws = None,
    axis: Annotated[
        list[str] | None,
        Option(metavar="NAME", help="mass, com, disturbance, delay or noise; may be repeated [all]"),
    ] = None,
    bound: Bound = 0.1,
    tolerance: Annotated[float, Option(metavar="FRACTION", help="relative tolerance of the values")] = 0.02,
    set_: Settings = None,
    changes: Changes,
    output: Folder = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Along each axis (mass, centre of mass, disturbance, delay, attitude noise) alone, values grow until a miss.

    A miss is a largest tip error in the steady window above the bound, or a run that diverges; bisection then finds the
    first one. No value tested below it missed; values between tested ones are not known. Everything else is as in the
    experiment: by default the Lissajous motion of an undisturbed plant equal to the nominal model.

    The bound of 0.1 mm is what coronary surgery typically needs (Bachta et al., 2011). With -o: frontier.json, .png
    and .svg.

    Exit code: 0 found, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.comparison.frontier import chosen_axes, frontier
    from spherical_wrist.comparison.frontier_report import to_dict
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.command import read_settings
    from spherical_wrist.experiment.description import read_toml

    tables = read_toml(experiment) if experiment else {}
    every = {**changes, **read_settings(set_ or [])}
    laws, axes = laws_from_texts(law or [], tables, every), chosen_axes(axis or [])
    began = time.perf_counter()
    with counting("searching") as progress:
        edges = frontier(
            laws, axes, tables, every, bound=bound, tolerance=tolerance, folder=output, jobs=jobs, progress=progress
        )
    table = to_dict(edges, laws, axes, bound, tolerance, time.perf_counter() - began)
    if output is not None:
        _write(table, axes, output)
    if json:
        print_json(table)
    else:
        _print(table, axes, output)


def _write(table: dict[str, Any], axes: Sequence[Axis], folder: Path) -> None:
    from spherical_wrist.comparison.frontier_picture import frontier_picture
    from spherical_wrist.files import write_together
    from spherical_wrist.picture_file import folder_pictures

    contents = folder_pictures(frontier_picture(table, axes), "frontier")
    table["files"] = sorted([*contents, "frontier.json"])
    contents["frontier.json"] = json_bytes(table)
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
        console.print(written_to(folder, ", ".join(table["files"])), soft_wrap=True)


def _reach(edge: Mapping[str, Any], axis: Axis) -> float:
    from spherical_wrist.comparison.crossing import CrossingStatus

    if edge["found"] == CrossingStatus.NEVER:
        return float("inf")
    return -1.0 if edge["found"] == CrossingStatus.NOMINAL else float(edge["misses"])


def _entry(edge: Mapping[str, Any], axis: Axis) -> str:
    from spherical_wrist.comparison.crossing import CrossingStatus

    if edge["found"] == CrossingStatus.NOMINAL:
        return "nominal"
    scale, _ = axis.shown
    if edge["found"] == CrossingStatus.NEVER:
        return f"> {short(scale * edge['holds'])}"
    return short(scale * edge["misses"])
