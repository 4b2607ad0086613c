"""Recording streams of Rerun that leave no thread and no memory behind, with their common settings.

A campaign that records thousands of runs would otherwise run out of both.
"""

from collections.abc import Callable

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from spherical_wrist.compat.rerun import free_streams, send_blueprint, strict_errors
from spherical_wrist.errors import RecordingError
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.layout import APPLICATION, EXPERIMENT_TEXT, METRICS_TEXT

_ETERNITY = 3.15e9
"""Largest time [s] of Rerun's timelines, about 100 years."""


def recorded(fill: Callable[[rr.RecordingStream], None], blueprint: rrb.Blueprint) -> bytes:
    """Return the bytes of a recording.

    Args:
        fill: sends the contents; data that Rerun cannot store raises.
        blueprint: layout of the viewer.

    Raises:
        RecordingError: the environment switches Rerun off.
    """
    try:
        with strict_errors():
            content = _recorded(fill, blueprint)
    finally:
        free_streams()
    return content


def _recorded(fill: Callable[[rr.RecordingStream], None], blueprint: rrb.Blueprint) -> bytes:
    stream = rr.RecordingStream(APPLICATION)
    memory = stream.memory_recording()
    try:
        if not rr.is_enabled(stream):
            raise RecordingError("the environment switches Rerun off: unset the variable RERUN to record")
        send_blueprint(stream, APPLICATION, blueprint)
        fill(stream)
        return memory.drain_as_bytes()
    finally:
        stream.disconnect()


def send_texts(recording: rr.RecordingStream, metrics: str, experiment: str) -> None:
    """Send the two tables beside the plots as Markdown; they take the place of those sent before."""
    for entity, text in ((METRICS_TEXT, metrics), (EXPERIMENT_TEXT, experiment)):
        recording.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def checked(series: Series) -> Series:
    """Return a series with contiguous float64 arrays.

    Raises:
        RecordingError: there are no rows, an array has another shape than its channel, or a time is not finite.
    """
    rows = len(series)
    if not rows:
        raise RecordingError("a series without rows cannot be recorded: let the run make at least one step")
    arrays = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in series.channels.items()}
    for name, array in arrays.items():
        axes = series.channel(name).axes
        width = len(axes) if axes is not None else array.shape[-1]
        expected = (rows, width) if width else (rows,)
        if array.shape != expected:
            raise RecordingError(f"the channel {name!r} of the series has shape {array.shape}; it must be {expected}")
    if not (np.abs(arrays["time"]) < _ETERNITY).all():
        raise RecordingError("the series has times that are not finite, or beyond 100 years: they fit no timeline")
    return Series(channels=arrays, described=series.described)
