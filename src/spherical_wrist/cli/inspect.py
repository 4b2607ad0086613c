"""``wrist inspect``: what a recording holds, whether it is consistent, and what it looks like."""

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from rich.text import Text

from spherical_wrist.cli.output import (
    conditions,
    footnote,
    headline,
    metrics_table,
    name_of,
    print_json,
    printer,
    thinning,
)
from spherical_wrist.cli.parameters_table import folded, parameters_table
from spherical_wrist.experiment.run import Run
from spherical_wrist.files import check_writable, write_together
from spherical_wrist.inspection import Inspection, inspect
from spherical_wrist.inspection.formats import EXPORTS, IMAGES, check_suffix


def inspect_recording(path: Path, plots: list[Path], exports: list[Path], as_json: bool) -> None:
    """Prints what was run, the versions, and stored beside recomputed metrics; then draws and exports.

    Raises:
        RecordingError: the file is no recording of this package, its stored metrics are not those of its series, or
            something cannot be written.
        ParameterError: the name of a file to write does not say what to make.
    """
    for files, what, valid in ((plots, "picture", IMAGES), (exports, "export", EXPORTS)):
        for file in files:
            check_suffix(file, what, valid)
            check_writable(file, what)
    found = inspect(path)
    if not as_json:
        _print_tables(found, path)
    found.check()
    _write(found.run, plots, exports)
    if as_json:
        _print_json(found, path, plots, exports)
    for what, files in (("picture", plots), ("export", exports)):
        for file in files if not as_json else ():
            printer().print(Text.assemble(f"{what} written to ", (str(file), "bold")), soft_wrap=True)


def _write(run: Run, plots: list[Path], exports: list[Path]) -> None:
    """Writes all files or none."""
    contents: dict[Path, bytes | Iterable[bytes]] = {}
    if plots:
        from spherical_wrist.inspection.drawing import as_image
        from spherical_wrist.inspection.picture import run_picture

        drawing = run_picture(run, _title(run))
        contents |= {file: as_image(drawing, file) for file in plots}
    if exports:
        from spherical_wrist.inspection.export import exported

        contents |= {file: exported(run, file) for file in exports}
    write_together(contents)


def _title(run: Run) -> list[str]:
    names = f"{name_of(run.description['law'])} on {name_of(run.description['reference'])}"
    told = conditions(run) + thinning(run)
    return [names, str(run.outcome), told] if run.outcome.reason else [names, f"{run.outcome} · {told}"]


def _print_json(found: Inspection, path: Path, plots: list[Path], exports: list[Path]) -> None:
    run = found.run
    print_json(
        {
            "recording": str(path),
            "experiment": run.description,
            "versions": run.versions,
            "outcome": {"status": str(run.outcome.status), "time_s": run.outcome.time, "reason": run.outcome.reason},
            "samples": len(run),
            "record_every": run.every,
            "metrics": asdict(run.metrics),
            "recomputed_metrics": asdict(found.recomputed),
            "mismatches": list(found.mismatches),
            "plots": [str(file) for file in plots],
            "exports": [str(file) for file in exports],
        }
    )


def _print_tables(found: Inspection, path: Path) -> None:
    run = found.run
    console = printer()
    console.print(Text.assemble((str(path), "bold"), f"  {len(run)} samples", thinning(run)), soft_wrap=True)
    console.print(headline(run))
    console.print(Text(conditions(run), style="dim"))
    console.print(metrics_table({"stored": run.metrics, "recomputed": found.recomputed}))
    console.print(Text(footnote(run), style="dim"))
    if run.every > 1:
        note = "stored figures are of the full series, recomputed ones estimates from the thinned one"
        console.print(Text(note, style="yellow"))
    console.print(parameters_table(run.description, console.width))
    made_with = (f"{name} {version}" for name, version in run.versions.items())
    console.print(Text(folded(made_with, console.width, "made with "), "dim"))
