"""``wrist inspect``: what a recording holds, and whether it is consistent."""

from dataclasses import asdict
from pathlib import Path

from rich.text import Text

from spherical_wrist.cli.output import (
    conditions,
    footnote,
    headline,
    metrics_table,
    parts,
    print_json,
    printer,
    thinning,
)
from spherical_wrist.inspection import Inspection, inspect


def inspect_recording(path: Path, as_json: bool) -> None:
    """Prints what was run, the versions, and stored beside recomputed metrics.

    Raises:
        RecordingError: the file is no recording of this package, or its stored metrics are not those of its series.
    """
    found = inspect(path)
    if as_json:
        found.check()
        _print_json(found, path)
    else:
        _print_tables(found, path)
        found.check()


def _print_json(found: Inspection, path: Path) -> None:
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
    console.print(parts(run))
    console.print(Text("made with " + " · ".join(f"{name} {version}" for name, version in run.versions.items()), "dim"))
