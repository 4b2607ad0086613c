"""``wrist inspect``: a recording's contents, their consistency, a picture of them, and exports."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import Json, Plots, RecordingFile
from spherical_wrist.cli.tables import print_json, printer

if TYPE_CHECKING:
    from spherical_wrist.inspection import Inspection
    from spherical_wrist.simulation.run import Run
    from spherical_wrist.simulation.verdict import Verdict


def command(
    recording: RecordingFile,
    plot: Plots = None,
    width: Annotated[
        str | None,
        Option("--width", metavar="WIDTH", help="of the picture: two-column, or a length such as 160mm [280mm]"),
    ] = None,
    export: Annotated[
        list[Path] | None,
        Option("--export", metavar="OUT.csv|.parquet|.npz", help="write every array of the series; may be repeated"),
    ] = None,
    json: Json = False,
) -> None:
    """A plot has attitude, errors, torque and disturbance over time, and the phase portrait of every axis.

    It also shows sliding surface, boundary layer and slope if the law has them, and faults of sensors and motors if
    they are not ideal.

    An export has every number bit for bit: CSV and Parquet as one column a component, named like error_x_rad, NPZ as
    NumPy arrays. Parquet and NPZ also carry experiment, outcome, metrics and versions as JSON. (With pandas, read the
    CSV with float_precision="round_trip".)

    Exit code: 0 consistent, 2 wrong input, or a recording that contradicts itself (nothing is written then).
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.files import check_writable, note_input
    from spherical_wrist.inspection import inspect
    from spherical_wrist.inspection.formats import EXPORTS
    from spherical_wrist.picture_file import PICTURES, check_ending
    from spherical_wrist.picture_style import width_inches

    note_input(recording)
    plots, exports = plot or [], export or []
    inches = None if width is None else width_inches(width)
    if inches is not None:
        from spherical_wrist.inspection.picture import check_width

        check_width(inches)
    for files, kind, valid in ((plots, "picture", PICTURES), (exports, "export", EXPORTS)):
        for file in files:
            check_ending(file, kind, valid)
            check_writable(file, kind)
    inspection = inspect(recording)
    if json:
        warn(inspection.run.warnings)
    else:
        _print_tables(inspection, recording)
    inspection.check()
    _write(inspection.run, inspection.verdict, plots, exports, inches)
    if json:
        _print_json(inspection, recording, plots, exports)
        return
    for kind, files in (("picture", plots), ("export", exports)):
        for file in files:
            printer().print(Text.assemble(f"{kind} written to ", (str(file), "bold")), soft_wrap=True)


def _write(run: Run, verdict: Verdict, plots: list[Path], exports: list[Path], width: float | None) -> None:
    """Write all files or none."""
    from spherical_wrist.files import write_together

    contents: dict[Path, bytes | Iterable[bytes]] = {}
    if plots:
        from spherical_wrist.inspection.picture import WIDTH, run_picture
        from spherical_wrist.picture_file import picture_content

        drawing = run_picture(run, _title(run, verdict), width or WIDTH)
        contents |= {file: picture_content(drawing, file) for file in plots}
    if exports:
        from spherical_wrist.inspection.export import exported

        contents |= {file: exported(run, file) for file in exports}
    write_together(contents)


def _title(run: Run, verdict: Verdict) -> list[str]:
    from spherical_wrist.cli.output import conditions, name_of, thinning

    names = f"{name_of(run.description['law'])} on {name_of(run.description['reference'])}"
    how = f"{run.outcome.status} · {conditions(run)}{thinning(run)}"
    return [names, verdict.text, *(f"warning: {warning}" for warning in run.warnings), how]


def _print_json(found: Inspection, path: Path, plots: list[Path], exports: list[Path]) -> None:
    run = found.run
    print_json(
        {
            "recording": str(path),
            "experiment": run.description,
            "versions": run.versions,
            "outcome": {"status": str(run.outcome.status), "time_s": run.outcome.time, "reason": run.outcome.reason},
            **found.verdict.to_dict(),
            "warnings": list(run.warnings),
            "samples": len(run),
            "record_every": run.every,
            "metrics": dict(run.metrics),
            "recomputed_metrics": dict(found.recomputed),
            "mismatches": list(found.mismatches),
            "plots": [str(file) for file in plots],
            "exports": [str(file) for file in exports],
        }
    )


def _print_tables(found: Inspection, path: Path) -> None:
    from spherical_wrist.cli.output import (
        conditions,
        footnotes,
        headline,
        metrics_table,
        print_verdict,
        thinning,
    )
    from spherical_wrist.cli.parameters_table import folded, parameters_table

    run = found.run
    console = printer()
    print_verdict(found.verdict, run.warnings, console)
    console.print(Text.assemble((str(path), "bold"), f"  {len(run)} samples", thinning(run)), soft_wrap=True)
    console.print(headline(run))
    console.print(Text(conditions(run), style="dim"))
    both = {"": run.metrics} if found.agrees else {"stored": run.metrics, "recomputed": found.recomputed}
    console.print(metrics_table(both, console.width))
    console.print(Text(footnotes(run), style="dim"))
    if found.agrees:
        console.print(Text("the series was measured again: the figures are its own", style="dim"))
    if run.every > 1:
        note = "stored figures are of the full series, recomputed ones estimates from the thinned one"
        console.print(Text(note, style="yellow"))
    console.print(parameters_table(run.description, console.width))
    made_with = (f"{name} {version}" for name, version in run.versions.items())
    console.print(Text(folded(made_with, console.width, "made with "), "dim"))
