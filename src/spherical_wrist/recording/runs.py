"""Run to recordings and back."""

import warnings
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from spherical_wrist.errors import RecordingError, one_line
from spherical_wrist.experiment.embedded_files import EmbeddedFiles, text_without_folders, without_folders
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.bound import BOUND
from spherical_wrist.measure.metrics import Metrics, MetricSettings
from spherical_wrist.measure.warnings import warnings_of
from spherical_wrist.recording.experiment_text import experiment_text, title
from spherical_wrist.recording.properties import check_properties
from spherical_wrist.recording.reader import Recording, read_recording
from spherical_wrist.recording.writer import write_recording
from spherical_wrist.simulation.run import Run
from spherical_wrist.stages import stage


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
    for part, reason in run.embedded_files.missing.items():
        text = f"the recording cannot be replayed elsewhere: it has no source of its {part}, since {reason}"
        warnings.warn(f"{text}; define it in a file, and name it as path/to/file.py:Name", stacklevel=2)
    with run.plant() as plant, stage(f"written to {path}"):
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
        check_properties(properties)
        settings = _measurement(properties["measurement"])
        embedded_files = _embedded_files(properties, recording.archive)
        description, outcome = properties["experiment"], _outcome(properties["outcome"])
        _check_times(recording, description, outcome)
        metrics = Metrics.recorded(properties["metrics"], settings, recording.format)
        return Run(
            channels=recording.series.channels,
            described=recording.series.described,
            description=without_folders({"bound": settings.bound, **description}, embedded_files.places),
            outcome=outcome,
            metrics=metrics,
            measurement=settings,
            versions=properties["versions"],
            warnings=_warnings(properties["outcome"], metrics),
            every=recording.every,
            wall_time=properties["run"]["wall_time_s"],
            embedded_files=embedded_files,
            trusted=trust,
        )
    except KeyError as error:
        raise RecordingError(f"recording {str(path)!r} is not of a run: it lacks or has the metric {error}") from None
    except ValueError as error:
        raise RecordingError(f"recording {str(path)!r} is not of a run: {one_line(error)}") from None


def _check_times(recording: Recording, description: Mapping[str, Any], outcome: Outcome) -> None:
    """Check that the rows of a recording are as many as its experiment and its outcome say, one after the other.

    Raises:
        ValueError: they are not.
    """
    time, period = recording.series.time, description["control_period"]
    if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise ValueError("its times do not increase")
    end, interval = max(outcome.time, float(time[-1])), recording.every * period
    if end > description["duration"] + period or end > (len(time) + 1) * interval:
        raise ValueError(f"it has {len(time)} rows, every {interval:g} s, of a run that ended at {end:g} s")


def _embedded_files(properties: Mapping[str, Any], archive: bytes) -> EmbeddedFiles:
    places = {name: file["path"] for name, file in properties.get("files", {}).items()}
    return EmbeddedFiles.from_archive(places, archive) if places else EmbeddedFiles()


def properties_of(run: Run) -> dict[str, dict[str, Any]]:
    """The groups of entries that describe a run in its recording."""
    return {
        "experiment": dict(run.description),
        "outcome": {
            "status": str(run.outcome.status),
            "time_s": run.outcome.time,
            "reason": text_without_folders(run.outcome.reason),
            "verdict": text_without_folders(run.verdict.text),
            "warnings": list(map(text_without_folders, run.warnings)),
        },
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
    return Outcome(Status(table["status"]), table["time_s"], _sentence(table["reason"]))


def _warnings(table: Mapping[str, Any], metrics: Metrics) -> tuple[str, ...]:
    """Return the warnings of a recording; of versions that wrote none, those of its metrics."""
    return tuple(map(_sentence, table.get("warnings", warnings_of(metrics))))


def _sentence(text: str) -> str:
    """Return a text of a recording without folders, and in one line: it may come from anywhere."""
    return " ".join(text_without_folders(text).split())


def _measurement(table: Mapping[str, Any]) -> MetricSettings:
    layer = table["boundary_layer"]
    lever, layer = tuple(table["lever"]), None if layer is None else tuple(layer)
    return MetricSettings(
        table["steady_from"], table["period"], lever, layer, table["resistance"],
        steady_until=table.get("steady_until"),  # since format 2
        surface_stays=table.get("surface_stays", False),  # likewise
        bound=table.get("bound", BOUND),  # since format 3, and those below
        limit_shares=tuple(map(tuple, table.get("limit_shares", ()))),
        current_limit=table.get("current_limit"),
    )  # fmt: skip
