"""``wrist replay``: a recording simulated again, and what came out."""

from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.output import headline, number, print_json, printer, thinning
from spherical_wrist.cli.signals import noted
from spherical_wrist.experiment.recordings import load_recording
from spherical_wrist.inspection.difference import ArrayDifference, Place
from spherical_wrist.inspection.replay import Replay, replay

NO_CAUSE = (
    "Versions, C library and processor are those of the recording: the cause is elsewhere, such as a changed source of "
    "this package, or a run in plain Python."
)


def replay_recording(path: Path, trust: bool, as_json: bool) -> int:
    """Replays and reports; returns the exit code: 0 bit-identical, 1 not, 128 + n where signal n came.

    Raises:
        WristError: the recording cannot be read or replayed.
    """
    with noted() as received:
        found = replay(path, trust=trust, stop=lambda: bool(received))
    if received:
        return 128 + received[0]
    if as_json:
        print_json({"recording": str(path), **_summary(found)})
    else:
        _print(found, path)
    return 0 if found.identical else 1


def extract_files(path: Path, folder: Path) -> None:
    """Writes the files that a recording carries to a folder, and lists them.

    Raises:
        WristError: the recording cannot be read, or the folder not be written to.
    """
    evidence = load_recording(path).evidence
    evidence.unpack(folder)
    for file in sorted(evidence.files):
        print(folder / file)


def _summary(found: Replay) -> dict[str, Any]:
    first = found.series.first
    return {
        "identical": found.identical,
        "rows": list(found.series.rows),
        "outcomes": [str(found.recorded.outcome), str(found.again.outcome)],
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
    console, series = printer(), found.series
    console.print(Text.assemble((str(path), "bold"), f"  {series.rows[0]} samples", thinning(found.recorded)))
    console.print(headline(found.recorded))
    if found.identical:
        verdict = f"{series.rows[0]} rows of {len(series.arrays)} arrays, all metrics and the outcome"
        console.print(Text.assemble(("bit-identical", "bold green"), f": {verdict}, simulated again"))
        if found.circumstances:
            console.print(Text(f"although {_changes(found)}", "dim"))
        return
    first = series.first
    where = f" first at t = {first.time:.6g} s, row {first.row_a}" if first else ""
    console.print(Text.assemble(("differs", "bold red"), where))
    if not found.same_outcome:
        console.print(f"recorded: {found.recorded.outcome}; replayed: {found.again.outcome}")
    if series.rows[0] != series.rows[1]:
        console.print(f"recorded: {series.rows[0]} rows; replayed: {series.rows[1]}")
    console.print(_table(found))
    console.print(f"metrics that differ: {', '.join(found.metrics) or 'none'}")
    console.print(f"What may be the cause: {_changes(found)}" if found.circumstances else NO_CAUSE)


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


def _time(place: Place | None) -> str:
    return "—" if place is None else f"{place.time:.6g}"
