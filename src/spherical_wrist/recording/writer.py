"""Writing recordings."""

import json
from collections.abc import Mapping
from pathlib import Path

import rerun as rr

from spherical_wrist.channels import description_of
from spherical_wrist.files import write_whole
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.blueprint import blueprint
from spherical_wrist.recording.layout import ABOUT, ARCHIVE, FORMAT, JSON, SEAL, ZIP
from spherical_wrist.recording.metrics_text import bound_of, flattened, metrics_text
from spherical_wrist.recording.plots import ranges, send_channels
from spherical_wrist.recording.scene import draw_motion, draw_wrist, timeline
from spherical_wrist.recording.stream import checked, recorded, send_texts
from spherical_wrist.seal import PLACEHOLDER, sealed
from spherical_wrist.wrist import Wrist


def write_recording(
    path: Path,
    series: Series,
    wrist: Wrist,
    properties: Mapping[str, Mapping[str, JSON]],
    every: int = 1,
    archive: bytes = b"",
    title: str = "wrist",
    experiment: str = "",
) -> None:
    """Write a run to a Rerun file, completely or not at all.

    Args:
        path: file to write, usually ``*.rrd``. One that is there already is replaced.
        series: the channels of the run; every one is stored bit for bit.
        wrist: the plant, whose geometry is drawn.
        properties: groups of entries such as ``experiment``, ``metrics`` and ``outcome``; nested tables are fine.
        every: the series has every ``every``-th control instant.
        archive: archive of the files that the run depends on, kept as it is.
        title: name of the recording in the viewer.
        experiment: the experiment as Markdown, for the viewer.

    Raises:
        RecordingError: the file cannot be written, or the series has no rows or channels of the wrong shape.
        ValueError: a group of properties has the name that is kept for the recording itself.
    """
    if taken := {ABOUT, ARCHIVE, SEAL} & properties.keys():
        raise ValueError(f"{', '.join(sorted(taken))}: a group of properties cannot be called so")
    series, bound = checked(series), bound_of(properties)

    def fill(recording: rr.RecordingStream) -> None:
        draw_wrist(recording, wrist)
        draw_motion(recording, series, wrist)
        entities = send_channels(recording, timeline(series.time), series, bound)
        recording.send_recording_name(title)
        send_texts(recording, metrics_text(properties, len(series), every), experiment)
        _describe(recording, properties, series, every, entities)
        if archive:
            blob = rr.AnyValues().with_component_from_data(ZIP, rr.components.BlobBatch([archive]))
            recording.send_property(ARCHIVE, blob)

    write_whole(path, sealed(recorded(fill, blueprint(wrist, series, ranges(series, bound), bound))))


def _describe(
    recording: rr.RecordingStream,
    properties: Mapping[str, Mapping[str, JSON]],
    series: Series,
    every: int,
    entities: Mapping[str, list[str]],
) -> None:
    for group, entries in properties.items():
        visible = dict(flattened(entries))
        if visible:
            recording.send_property(group, _visible(visible))
    channels = {name: {**description_of(series.channel(name)), "entities": own} for name, own in entities.items()}
    about: dict[str, float | str] = {
        "format": FORMAT,
        "rows": len(series),
        "every": every,
        "channels": json.dumps(channels, ensure_ascii=False),
        "properties": json.dumps(properties, ensure_ascii=False),
    }
    recording.send_property(ABOUT, _visible(about))
    recording.send_property(SEAL, _visible({"checksum": PLACEHOLDER}))


def _visible(entries: Mapping[str, float | str]) -> rr.AnyValues:
    """Entries as components. Typed, since Rerun would expect the type of a name's first value ever after."""
    values = rr.AnyValues()
    for name, value in entries.items():
        batch = rr.components.TextBatch([value]) if isinstance(value, str) else rr.components.ScalarBatch([value])
        values.with_component_from_data(name, batch)
    return values
