"""Runs to recordings and back."""

from collections.abc import Mapping
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.evidence import Evidence
from spherical_wrist.experiment.run import Run
from spherical_wrist.metrics import Measurement, Metrics
from spherical_wrist.recording import read_recording, write_recording
from spherical_wrist.simulation.outcome import Outcome, Status


def record(run: Run, path: Path | str) -> None:
    """Writes a run to a Rerun file, with its experiment, outcome, metrics and versions; completely or not at all.

    Args:
        run: the run.
        path: file to write, usually ``*.rrd``. One that is there already is replaced.

    Raises:
        RecordingError: the file cannot be written, or the run has no series.
    """
    if not len(run):
        raise RecordingError("the run has no series to record: simulate with keep_series=True")
    with run.plant() as plant:
        write_recording(Path(path), run, plant, properties_of(run), run.every, run.evidence.archive())


def load_recording(path: Path | str) -> Run:
    """Reads a run back from a file that :func:`record` wrote; the series bit for bit.

    Raises:
        RecordingError: the file is missing, truncated, damaged, or not a recording of this package.
    """
    recording = read_recording(Path(path))
    properties = recording.properties
    try:
        return Run(
            **recording.series.arrays(),
            description=properties["experiment"],
            outcome=_outcome(properties["outcome"]),
            metrics=Metrics(**properties["metrics"]),
            measurement=_measurement(properties["measurement"]),
            versions=properties["versions"],
            every=recording.every,
            wall_time=properties["run"]["wall_time_s"],
            evidence=_evidence(properties, recording.archive),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(
            f"recording {str(path)!r} lacks properties of a run ({error!r}): was it made by another version?"
        ) from None


def _evidence(properties: Mapping[str, Any], archive: bytes) -> Evidence:
    places = {name: file["path"] for name, file in properties.get("files", {}).items()}
    return Evidence.from_archive(places, archive) if places else Evidence()


def properties_of(run: Run) -> dict[str, dict[str, Any]]:
    """The groups of entries that describe a run in its recording."""
    return {
        "experiment": dict(run.description),
        "outcome": {"status": str(run.outcome.status), "time_s": run.outcome.time, "reason": run.outcome.reason},
        "metrics": asdict(run.metrics),
        "measurement": run.measurement._asdict(),
        "versions": dict(run.versions),
        "files": {
            name: {"path": path, "sha256": sha256(run.evidence.files[path]).hexdigest()}
            for name, path in run.evidence.places.items()
        },
        "run": {"wall_time_s": run.wall_time, "real_time_factor": run.real_time_factor},
    }


def _outcome(table: Mapping[str, Any]) -> Outcome:
    return Outcome(Status(table["status"]), table["time_s"], table["reason"])


def _measurement(table: Mapping[str, Any]) -> Measurement:
    layer = table["boundary_layer"]
    lever, layer = tuple(table["lever"]), None if layer is None else tuple(layer)
    return Measurement(table["steady_from"], table["period"], lever, layer, table["resistance"])
