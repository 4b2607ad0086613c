"""The two tables beside the plots."""

import rerun as rr

from spherical_wrist.recording.layout import EXPERIMENT_TEXT, METRICS_TEXT


def send_texts(recording: rr.RecordingStream, metrics: str, experiment: str) -> None:
    """Sends both as Markdown; they take the place of those sent before."""
    for entity, text in ((METRICS_TEXT, metrics), (EXPERIMENT_TEXT, experiment)):
        recording.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
