"""Screenshots of recordings, taken by Rerun's own viewer without a screen."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from spherical_wrist.compat.rerun import connect_viewer
from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.address import Address, free_port
from spherical_wrist.recording.layout import TIMELINE
from spherical_wrist.recording.process import HOST, Viewer, rerun_process
from spherical_wrist.recording.seal import check_seal

if TYPE_CHECKING:
    from spherical_wrist.compat.rerun import ViewerClient, ViewerState

_PATIENCE = 90.0
"""Longest time that anything may take [s]: drawing in software on a busy machine is slow."""

_BETWEEN = 0.4
"""Time between two looks [s]."""

_QUIET = {
    # notices of what the viewer logs would lie over the picture
    "RUST_LOG": "error",
    # nothing listens there: the viewer would ask for newer versions of itself otherwise
    "HTTPS_PROXY": f"http://{HOST}:9",
    "https_proxy": f"http://{HOST}:9",
}

Result = TypeVar("Result")


class Screenshot(NamedTuple):
    """Screenshot of the viewer.

    Attributes:
        png: the picture.
        reports: complaints of the views, a line each.
    """

    png: bytes
    reports: tuple[str, ...]


def screenshot(path: Path, at: float | None = None, size: tuple[int, int] = (1600, 1000)) -> Screenshot:
    """Take a screenshot of a recording in the viewer.

    Args:
        path: a recording that this package made.
        at: simulated time to show [s]; the end where none is given.
        size: width and height of the viewer's window [pixels].

    Raises:
        RecordingError: the file is missing, damaged, or not a recording of this package.
        ViewerError: the viewer cannot draw here, or the time is not in the recording.
    """
    check_seal(path)
    address = Address(HOST, free_port())
    window = ["--window-size", f"{size[0]}x{size[1]}"]
    arguments = [str(path.resolve()), "--headless", "--hide-welcome-screen", "--port", str(address.port), *window]
    with rerun_process(arguments, _QUIET) as viewer:
        client, state = _patiently(viewer, lambda: _loaded(address), "load the recording")
        if at is not None:
            _seek(viewer, client, state, at)
        png = _patiently(viewer, _Settled(client), "come to rest")
        state = _patiently(viewer, client.get_state, "answer")
    return Screenshot(
        png,
        tuple(f"{view.name}: {report.severity}: {report.summary}" for view in state.views for report in view.reports),
    )


def _patiently(viewer: Viewer, look: Callable[[], Result | None], what: str) -> Result:
    """Look again and again until there is something to see."""
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline:
        if not viewer.running:
            raise viewer.complaint()
        try:
            found = look()
        except (ConnectionError, RuntimeError):  # it does not listen yet, or was too busy drawing to answer
            found = None
        if found is not None:
            return found
        time.sleep(_BETWEEN)
    raise ViewerError(f"the viewer did not {what} within {_PATIENCE:g} s: is the machine very busy?")


def _loaded(address: Address) -> "tuple[ViewerClient, ViewerState] | None":
    client = connect_viewer(address.url)
    state = client.get_state()
    complete = state.recordings and state.recordings[0].timelines and state.views and not state.loading
    return (client, state) if complete else None


def _seek(viewer: Viewer, client: "ViewerClient", state: "ViewerState", at: float) -> None:
    """Stop the viewer's clock at a time."""
    line = next(line for line in state.recordings[0].timelines if line.name == TIMELINE)
    begin, end = (line.start or 0) / 1e9, (line.end or 0) / 1e9
    if not begin <= at <= end:
        raise ViewerError(f"time {at:g} s is not in the recording, which goes from {begin:g} s to {end:g} s")
    wanted = round(1e9 * at)
    client.set_time(TIMELINE, duration=np.timedelta64(wanted, "ns"), play_state="paused")
    _patiently(viewer, lambda: client.get_state().recordings[0].current_time == wanted or None, "go to that time")


class _Settled:
    """Look for two pictures in a row that are the same: then nothing is loading or fading any more."""

    def __init__(self, client: "ViewerClient") -> None:
        self._client, self._before = client, b""

    def __call__(self) -> bytes | None:
        picture = self._client.take_screenshot()
        settled, self._before = picture == self._before, picture
        return picture if settled else None
