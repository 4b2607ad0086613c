"""A process of its own that hands a run to a viewer.

Rerun's streams wait for a viewer that hangs, when they are closed and when their process ends, for ever. Here nothing
but this process waits, and it can be killed.

It reads pickled messages from its input: an :class:`Opening`, pieces of the series as arrays by name, and a
:class:`Closing`; and answers each with a line, once the viewer has taken it.
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

from spherical_wrist.errors import RecordingError
from spherical_wrist.recording import summary
from spherical_wrist.recording.blueprint import blueprint
from spherical_wrist.recording.contents import arrays_of
from spherical_wrist.recording.layout import APPLICATION, JSON
from spherical_wrist.recording.plots import send_curves, send_styles
from spherical_wrist.recording.scene import draw_motion, draw_wrist, timeline
from spherical_wrist.recording.stream import send_blueprint
from spherical_wrist.recording.texts import send_texts
from spherical_wrist.simulation.series import Series

TAKEN, LOST = b"taken\n", b"lost\n"
"""Answers: the viewer has it, the viewer is not there any more; anything else says what went wrong."""

_LOOK = 0.5
"""Time between two looks whether anybody is left to send for [s]."""


class Stage(NamedTuple):
    """What is drawn: a ``geometry.Drawable`` that can be sent."""

    model: mujoco.MjModel
    anchor: npt.NDArray[np.float64]
    mount: npt.NDArray[np.float64]
    moving: list[int]


class Opening(NamedTuple):
    """How a run begins.

    Attributes:
        url: of the viewer.
        stage: what is drawn.
        properties: groups of entries, of which there is at least the experiment.
        rows: as many rows as the run will have.
    """

    url: str
    stage: Stage
    properties: Mapping[str, Mapping[str, JSON]]
    rows: int


class Closing(NamedTuple):
    """How a run ended.

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
        opening: how it begins.
    """

    def __init__(self, opening: Opening) -> None:
        self._opening, self._parent = opening, os.getppid()
        self._stream = rr.RecordingStream(APPLICATION)
        if not rr.is_enabled(self._stream):
            raise RecordingError("the environment switches Rerun off: unset the variable RERUN")
        self._stream.connect_grpc(opening.url)
        self._first: dict[str, npt.NDArray[np.float64]] = {}
        self._last: Series | None = None

    def open(self) -> None:
        """Sends what does not change."""
        properties = self._opening.properties
        self._stream.send_recording_name(f"{summary.title(properties)} (live)")
        draw_wrist(self._stream, self._opening.stage)
        send_texts(self._stream, "**simulating**", summary.experiment_text(properties))
        self._deliver()

    def show(self, series: Series) -> None:
        """Sends the next piece of the series."""
        arrays = arrays_of(series)
        if not self._first:
            self._first = {name: array[:1] for name, array in arrays.items()}
            send_styles(self._stream, arrays, self._opening.rows)
            self._arrange({})
        self._last = draw_motion(self._stream, series, self._opening.stage, self._last)
        send_curves(self._stream, timeline(series.time), arrays)
        self._deliver()

    def close(self, closing: Closing) -> None:
        """Sends how the run ended, and shows it as its recording is shown."""
        properties = closing.properties
        metrics = summary.metrics_text(properties, closing.rows, closing.every)
        send_texts(self._stream, metrics, summary.experiment_text(properties))
        if closing.ranges and self._first:
            self._arrange(closing.ranges)
        self._deliver()
        self._stream.disconnect()

    def _arrange(self, ranges: Mapping[str, tuple[float, float]]) -> None:
        send_blueprint(self._stream, blueprint(self._opening.stage, self._first, ranges))

    def _deliver(self) -> None:
        """Waits until the viewer has everything, however long that takes.

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
    """Relays one run, as the whole life of a process."""
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
                    relay.show(Series(**message))
                answers.write(TAKEN)
            except ConnectionError:
                answers.write(LOST)
            except Exception as error:  # whatever it is, the run must hear of it and go on
                answers.write(f"{type(error).__name__}: {' '.join(str(error).split())}\n".encode())
            answers.flush()
    except (EOFError, OSError, KeyboardInterrupt):
        os._exit(0)  # the run is over, and with it this process: nothing may wait for the viewer
