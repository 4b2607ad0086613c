"""Run to recordings and back."""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.description import PARTS
from spherical_wrist.experiment.embedded_files import EmbeddedFiles
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics, MetricSettings
from spherical_wrist.recording import read_recording, write_recording
from spherical_wrist.recording.experiment_text import experiment_text, title
from spherical_wrist.simulation.run import Run


def record(run: Run, path: Path | str) -> None:
    """Write a run to a Rerun file, with its experiment, outcome, metrics and versions; completely or not at all.

    Args:
        run: the run.
        path: file to write, usually ``*.rrd``. One that is there already is replaced.

    Raises:
        RecordingError: the file cannot be written, or the run has no series.
    """
    if not len(run):
        raise RecordingError("the run has no series to record: simulate with keep_series=True")
    with run.plant() as plant:
        texts = title(run.description), experiment_text(run.description)
        write_recording(Path(path), run, plant, properties_of(run), run.every, run.embedded_files.archive(), *texts)


def load_recording(path: Path | str, *, trust: bool = False) -> Run:
    """Read a run back from a file that :func:`record` wrote; the series bit for bit.

    Args:
        path: recording.
        trust: allow the Python code that it carries, such as a user's own law, to run where its experiment is asked
            for. Whoever made the recording could have put anything there. Reading it runs none.

    Raises:
        RecordingError: the file is missing, truncated, damaged, or not a recording of this package.
    """
    recording = read_recording(Path(path))
    properties = recording.properties
    try:
        settings = _measurement(properties["measurement"])
        return Run(
            channels=recording.series.channels,
            described=recording.series.described,
            description=_described(properties["experiment"]),
            outcome=_outcome(properties["outcome"]),
            metrics=Metrics.recorded(properties["metrics"], settings, recording.format),
            measurement=settings,
            versions=properties["versions"],
            every=recording.every,
            wall_time=properties["run"]["wall_time_s"],
            embedded_files=_embedded_files(properties, recording.archive),
            trusted=trust,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(
            f"recording {str(path)!r} lacks properties of a run ({error!r}): was it made by another version?"
        ) from None


def _described(experiment: Any) -> Mapping[str, Any]:
    """Return the description of an experiment, whose parts must be tables with a name.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(experiment, Mapping):
        raise TypeError("experiment is no table")
    for part in PARTS.keys() & experiment.keys():
        if not isinstance(experiment[part], Mapping) or not isinstance(experiment[part].get("name"), str):
            raise TypeError(f"experiment.{part} is no table with a name")
    return experiment


def _embedded_files(properties: Mapping[str, Any], archive: bytes) -> EmbeddedFiles:
    places = {name: file["path"] for name, file in properties.get("files", {}).items()}
    return EmbeddedFiles.from_archive(places, archive) if places else EmbeddedFiles()


def properties_of(run: Run) -> dict[str, dict[str, Any]]:
    """The groups of entries that describe a run in its recording."""
    return {
        "experiment": dict(run.description),
        "outcome": {"status": str(run.outcome.status), "time_s": run.outcome.time, "reason": run.outcome.reason},
        "metrics": run.metrics.available,
        "measurement": run.measurement._asdict(),
        "versions": dict(run.versions),
        "files": {
            name: {"path": path, "sha256": sha256(run.embedded_files.files[path]).hexdigest()}
            for name, path in run.embedded_files.places.items()
        },
        "run": {"wall_time_s": run.wall_time, "real_time_factor": run.real_time_factor},
    }


def _outcome(table: Mapping[str, Any]) -> Outcome:
    return Outcome(Status(table["status"]), table["time_s"], table["reason"])


def _measurement(table: Mapping[str, Any]) -> MetricSettings:
    layer = table["boundary_layer"]
    lever, layer = tuple(table["lever"]), None if layer is None else tuple(layer)
    until = table.get("steady_until")  # since format 2
    return MetricSettings(table["steady_from"], table["period"], lever, layer, table["resistance"], until)
