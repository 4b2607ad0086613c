"""``wrist replay``: a recording simulated again, and compared."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.table import Table
from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import Json, RecordingFile
from spherical_wrist.cli.streams import say
from spherical_wrist.cli.tables import number, print_json, printer

if TYPE_CHECKING:
    from spherical_wrist.inspection.difference import ArrayDifference, CommonRow
    from spherical_wrist.inspection.replay import Replay

NO_CAUSE = (
    "Versions, C library and processor are those of the recording: another cause is likely, such as changed source of "
    "this package, or a run in plain Python."
)


def command(
    recording: RecordingFile,
    trust: Annotated[
        bool, Option("--trust", help="run Python code in the recording, such as a user's own law")
    ] = False,
    extract: Annotated[
        Path | None, Option(metavar="DIR", help="only write the files in the recording to a folder")
    ] = None,
    json: Json = False,
) -> int:
    """A recording contains its experiment, its model with meshes, recorded motions and the user's own Python files.

    Nothing else is read. If the bits differ, the command prints where they differ first, by how much, and which
    versions or processor may be the cause.

    Exit code: 0 bit-identical, 1 different, 2 it cannot be replayed, 130 or 143 stopped by a signal.
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.cli.signals import noted
    from spherical_wrist.inspection.replay import replay

    if extract is not None:
        _extract(recording, extract)
        return 0
    with noted() as received:
        found = replay(recording, trust=trust, stop=lambda: bool(received))
    if received:
        return 128 + received[0]
    if json:
        print_json({"recording": str(recording), **_summary(found)})
        warn(found.recorded.warnings)
    else:
        _print(found, recording)
    return 0 if found.identical else 1


def _extract(recording: Path, folder: Path) -> None:
    """Write the files in a recording to a folder, and list them."""
    from spherical_wrist.recording.runs import load_recording

    embedded_files = load_recording(recording).embedded_files
    embedded_files.unpack(folder)
    for file in sorted(embedded_files.files):
        say(folder / file)


def _summary(found: Replay) -> dict[str, Any]:
    first = found.series.first
    return {
        "identical": found.identical,
        "rows": list(found.series.rows),
        "outcomes": [str(found.recorded.outcome), str(found.again.outcome)],
        **found.recorded.verdict.to_dict(),
        "warnings": list(found.recorded.warnings),
        "first_difference": None if first is None else {"time_s": first.time, "row": first.row_a},
        "arrays": {each.name: _array_summary(each) for each in found.series.arrays if not each.same},
        "metrics": {
            name: [getattr(run.metrics, name) for run in (found.recorded, found.again)] for name in found.metrics
        },
        "circumstances": {name: list(pair) for name, pair in found.circumstances.items()},
    }


def _array_summary(array: ArrayDifference) -> dict[str, Any]:
    return {
        "first_at_s": array.beyond and array.beyond.time,
        "largest": array.largest,
        "largest_at_s": array.largest_at and array.largest_at.time,
        "rms": array.rms,
        "unit": array.unit,
    }


def _print(found: Replay, path: Path) -> None:
    from spherical_wrist.cli.output import headline, print_verdict, thinning

    console, series = printer(), found.series
    if found.identical:
        verdict = f"{series.rows[0]} rows of {len(series.arrays)} arrays, all metrics and the outcome"
        console.print(Text.assemble(("bit-identical", "bold green"), f": {verdict}, simulated again"))
        if found.circumstances:
            console.print(Text(f"although {_changes(found)}", "dim"))
    else:
        first = series.first
        where = f" first at t = {first.time:.6g} s, row {first.row_a}" if first else ""
        console.print(Text.assemble(("differs", "bold red"), where))
    print_verdict(found.recorded.verdict, found.recorded.warnings, console)
    console.print(Text.assemble((str(path), "bold"), f"  {series.rows[0]} samples", thinning(found.recorded)))
    console.print(headline(found.recorded))
    if found.identical:
        return
    if not found.same_outcome:
        console.print(f"recorded: {found.recorded.outcome}; replayed: {found.again.outcome}")
    if series.rows[0] != series.rows[1]:
        console.print(f"recorded: {series.rows[0]} rows; replayed: {series.rows[1]}")
    console.print(_table(found))
    console.print(f"metrics that differ: {', '.join(found.metrics) or 'none'}")
    console.print(f"Possible cause: {_changes(found)}" if found.circumstances else NO_CAUSE)


def _changes(found: Replay) -> str:
    return "; ".join(f"{name} {then} then, {now} now" for name, (then, now) in found.circumstances.items())


def _table(found: Replay) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("array")
    for heading in ("first at [s]", "largest", "at [s]", "RMS"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for each in found.series.arrays:
        if not each.same:
            cells = (_time(each.beyond), number(each.largest), _time(each.largest_at), number(each.rms))
            table.add_row(each.name, *cells, Text(each.unit, "dim"))
    return table


def _time(place: CommonRow | None) -> str:
    return "—" if place is None else f"{place.time:.6g}"
