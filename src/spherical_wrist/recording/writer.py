"""Writing recordings."""

import json
from collections.abc import Mapping
from pathlib import Path

import rerun as rr

from spherical_wrist.files import write_whole
from spherical_wrist.recording import summary
from spherical_wrist.recording.blueprint import blueprint
from spherical_wrist.recording.contents import arrays_of
from spherical_wrist.recording.layout import ABOUT, ARCHIVE, FORMAT, JSON, SEAL, ZIP
from spherical_wrist.recording.plots import ranges, send_arrays
from spherical_wrist.recording.scene import draw_motion, draw_wrist, timeline
from spherical_wrist.recording.seal import PLACEHOLDER, sealed
from spherical_wrist.recording.stream import recorded
from spherical_wrist.recording.texts import send_texts
from spherical_wrist.simulation.series import Series
from spherical_wrist.wrist import Wrist


def write_recording(
    path: Path,
    series: Series,
    wrist: Wrist,
    properties: Mapping[str, Mapping[str, JSON]],
    every: int = 1,
    archive: bytes = b"",
) -> None:
    """Writes a run to a Rerun file, completely or not at all.

    Args:
        path: file to write, usually ``*.rrd``. One that is there already is replaced.
        series: the arrays of the run; every one is stored bit for bit.
        wrist: the plant, whose geometry is drawn.
        properties: groups of entries such as ``experiment``, ``metrics`` and ``outcome``; nested tables are fine.
        every: the series has every ``every``-th control instant.
        archive: of the files that the run depends on, kept as it is.

    Raises:
        RecordingError: the file cannot be written, or the series has no rows or arrays of the wrong shape.
        ValueError: a group of properties has the name that is kept for the recording itself.
    """
    if taken := {ABOUT, ARCHIVE, SEAL} & properties.keys():
        raise ValueError(f"{', '.join(sorted(taken))}: a group of properties cannot be called so")
    arrays = arrays_of(series)

    def fill(recording: rr.RecordingStream) -> None:
        _describe(recording, properties, len(series), every)
        if archive:
            blob = rr.AnyValues().with_component_from_data(ZIP, rr.components.BlobBatch([archive]))
            recording.send_property(ARCHIVE, blob)
        draw_wrist(recording, wrist)
        draw_motion(recording, series, wrist)
        send_arrays(recording, timeline(arrays["time"]), arrays)

    write_whole(path, sealed(recorded(fill, blueprint(wrist, arrays, ranges(arrays)))))


def _describe(
    recording: rr.RecordingStream, properties: Mapping[str, Mapping[str, JSON]], rows: int, every: int
) -> None:
    recording.send_recording_name(summary.title(properties))
    for group, entries in properties.items():
        visible = dict(summary.flattened(entries))
        if visible:
            recording.send_property(group, _visible(visible))
    exact = json.dumps(properties, ensure_ascii=False)
    about: dict[str, float | str] = {
        "format": FORMAT,
        "rows": rows,
        "every": every,
        "properties": exact,
    }
    recording.send_property(ABOUT, _visible(about))
    recording.send_property(SEAL, _visible({"checksum": PLACEHOLDER}))
    send_texts(recording, summary.metrics_text(properties, rows, every), summary.experiment_text(properties))


def _visible(entries: Mapping[str, float | str]) -> rr.AnyValues:
    """Entries as components. Typed, since Rerun would expect the type of a name's first value ever after."""
    values = rr.AnyValues()
    for name, value in entries.items():
        batch = rr.components.TextBatch([value]) if isinstance(value, str) else rr.components.ScalarBatch([value])
        values.with_component_from_data(name, batch)
    return values
