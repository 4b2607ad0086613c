"""A process of its own that hands a run to a viewer.

Rerun's streams wait for a viewer that hangs, when they are closed and when their process ends, for ever. Here nothing
but this process waits, and it can be killed.

It reads pickled messages from its input: an :class:`Opening`, pieces of the series, and a :class:`Closing`; and answers
each with a line, once the viewer has taken it.
"""

import os
import pickle
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt
import rerun as rr

from spherical_wrist.compat.rerun import send_blueprint
from spherical_wrist.errors import RecordingError
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.blueprint import blueprint
from spherical_wrist.recording.layout import APPLICATION, JSON, TIP_PLOT
from spherical_wrist.recording.metrics_text import metrics_text
from spherical_wrist.recording.plots import send_curves, send_styles, send_tip_error
from spherical_wrist.recording.scene import draw_motion, draw_wrist, timeline
from spherical_wrist.recording.stream import checked, send_texts

TAKEN, LOST = b"taken\n", b"lost\n"
"""Answers: the viewer has it, the viewer is not there any more; anything else says what went wrong."""

_LOOK = 0.5
"""Time between two looks whether anybody is left to send for [s]."""


class Stage(NamedTuple):
    """Geometry of the wrist: a ``geometry.Drawable`` that can be pickled."""

    model: mujoco.MjModel
    anchor: npt.NDArray[np.float64]
    mount: npt.NDArray[np.float64]
    moving: list[int]


class Opening(NamedTuple):
    """First message, before the run begins.

    Attributes:
        url: of the viewer.
        stage: geometry of the wrist.
        title: name of the recording in the viewer.
        experiment: the experiment as Markdown.
        rows: number of rows that the run will have.
        bound: on its tip error [mm].
    """

    url: str
    stage: Stage
    title: str
    experiment: str
    rows: int
    bound: float


class Closing(NamedTuple):
    """Last message, after the run has ended.

    Attributes:
        properties: groups of entries, metrics and outcome among them.
        ranges: ends of the vertical axes of the plots.
        rows: number of rows that were recorded.
        every: one in how many control instants these are.
    """

    properties: Mapping[str, Mapping[str, JSON]]
    ranges: Mapping[str, tuple[float, float]]
    rows: int
    every: int


class Relay:
    """A run on its way to a viewer.

    Args:
        opening: first message.
    """

    def __init__(self, opening: Opening) -> None:
        self._opening, self._parent = opening, os.getppid()
        self._stream = rr.RecordingStream(APPLICATION)
        if not rr.is_enabled(self._stream):
            raise RecordingError("the environment switches Rerun off: unset the variable RERUN")
        self._stream.connect_grpc(opening.url)
        self._first: Series | None = None
        self._last: Series | None = None

    def open(self) -> None:
        """Send the static data."""
        self._stream.send_recording_name(f"{self._opening.title} (live)")
        draw_wrist(self._stream, self._opening.stage)
        send_texts(self._stream, "**simulating**", self._opening.experiment)
        self._deliver()

    def show(self, series: Series) -> None:
        """Send the next piece of the series."""
        series = checked(series)
        plots = list(series.plots())
        if self._first is None:
            self._first = series.rows(slice(1))
            send_styles(self._stream, plots, self._opening.rows, self._opening.bound)
            self._arrange(self._first, {})
        self._last = draw_motion(self._stream, series, self._opening.stage, self._last)
        send_curves(self._stream, timeline(series.time), [plot for plot in plots if plot.name != TIP_PLOT])
        send_tip_error(self._stream, series.time, plots, self._opening.rows, self._opening.bound)
        self._deliver()

    def close(self, closing: Closing) -> None:
        """Send how the run ended, and shows it as its recording is shown."""
        metrics = metrics_text(closing.properties, closing.rows, closing.every)
        send_texts(self._stream, metrics, self._opening.experiment)
        if closing.ranges and self._first is not None:
            self._arrange(self._first, closing.ranges)
        self._deliver()
        self._stream.disconnect()

    def _arrange(self, first: Series, ranges: Mapping[str, tuple[float, float]]) -> None:
        layout = blueprint(self._opening.stage, first, ranges, self._opening.bound)
        send_blueprint(self._stream, APPLICATION, layout)

    def _deliver(self) -> None:
        """Wait until the viewer has everything, however long that takes.

        Raises:
            ConnectionError: the viewer is not there any more.
        """
        while True:
            try:
                self._stream.flush(timeout_sec=_LOOK)
                return
            except RuntimeError as error:
                if "timed out" not in str(error):
                    raise ConnectionError(str(error)) from None
            if os.getppid() != self._parent:
                os._exit(1)


def main() -> None:
    """Relay one run, as the whole life of a process."""
    requests, answers = sys.stdin.buffer, sys.stdout.buffer
    relay: Relay | None = None
    try:
        while True:
            message: Any = pickle.load(requests)
            try:
                if relay is None:
                    relay = Relay(message)
                    relay.open()
                elif isinstance(message, Closing):
                    relay.close(message)
                else:
                    relay.show(message)
                answers.write(TAKEN)
            except ConnectionError:
                answers.write(LOST)
            except Exception as error:  # whatever it is, the run must hear of it and go on
                answers.write(f"{type(error).__name__}: {' '.join(str(error).split())}\n".encode())
            answers.flush()
    except (EOFError, OSError, KeyboardInterrupt):
        os._exit(0)  # the run is over, and with it this process: nothing may wait for the viewer
