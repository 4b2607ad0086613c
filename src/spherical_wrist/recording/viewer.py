"""Recordings in Rerun's native viewer."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.address import PORT, is_listening
from spherical_wrist.recording.process import HOST, Viewer, rerun_process
from spherical_wrist.recording.seal import check_seal


class Opened(NamedTuple):
    """The native viewer.

    Attributes:
        viewer: Rerun's program; it ends when its window is closed, or when it has handed the recording over.
        handed_over: another viewer, which listened already, shows the recording.
    """

    viewer: Viewer
    handed_over: bool


@contextmanager
def opened_viewer(path: Path | None, port: int = PORT) -> Iterator[Opened]:
    """Open the native viewer, and closes it at the end of the ``with`` block.

    A viewer that listens on the port already shows the recording as one more, and stays.

    Args:
        path: a recording that this package made; None for an empty viewer, which waits for live runs.
        port: where live runs reach it.

    Raises:
        RecordingError: the file is missing, damaged, or not a recording of this package.
        ViewerError: there is no display, or the port is taken.
    """
    if path is not None:
        check_seal(path)
    taken = is_listening(port)
    if taken and path is None:
        raise ViewerError(f"something listens on {HOST}:{port} already, maybe a viewer: use it, or give another --port")
    if not taken:
        _check_display()
    files = [] if path is None else [str(path.resolve())]
    with rerun_process([*files, "--port", str(port), "--hide-welcome-screen"]) as viewer:
        yield Opened(viewer, taken)


def _check_display() -> None:
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerError(
            "there is no display for the viewer: use --web for a browser, or --screenshot OUT.png for a picture"
        )
