"""A run in a viewer while it is simulated. The run never waits for the viewer."""

import os
import pickle
import subprocess
import sys
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from spherical_wrist.measure.bound import BOUND
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.address import Address, check_viewer
from spherical_wrist.recording.geometry import Drawable
from spherical_wrist.recording.relay import LOST, TAKEN, Closing, Opening, Stage, main

WAITING = 50_000
"""Most rows that wait for the viewer; of more, every second one is left out. A row takes 0.3 to 1 kB."""

_START, _PATIENCE = 30.0, 5.0
"""Time that the relay may take to start, and then the viewer to take anything, once the run is over [s]."""


class LiveView:
    """A viewer that shows a run as far as it is simulated.

    What the viewer cannot keep up with is thinned, and a viewer that goes away or hangs is given up: :meth:`close`
    says so. Use it in a ``with`` block, which leaves no process behind.

    Args:
        address: where the viewer listens.
        wrist: the plant, whose geometry is drawn.
        title: name of the recording in the viewer.
        experiment: the experiment as Markdown.
        rows: number of rows that the run will have.
        bound: on its tip error [mm].

    Raises:
        ViewerError: no viewer listens there.
    """

    def __init__(
        self, address: Address, wrist: Drawable, title: str, experiment: str, rows: int, bound: float = BOUND
    ) -> None:
        check_viewer(address)
        self._address = address
        self._changed = threading.Condition()
        self._waiting: list[Series] = []
        self._closing: Closing | None = None
        self._given = self._taken = 0  # rows
        self._fault = ""
        self._heard = 0.0
        command = [sys.executable, "-P", "-c", f"from {main.__module__} import main; main()"]
        # in a group of its own, where a Ctrl-C in the terminal, which stops the run, does not reach it
        self._relay = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            process_group=0,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        stage = Stage(wrist.model, wrist.anchor, wrist.mount, list(wrist.moving))
        opening = Opening(address.url, stage, title, experiment, rows, bound)
        self._thread = threading.Thread(target=self._work, args=(opening,), name="live view", daemon=True)
        self._thread.start()

    def show(self, series: Series) -> None:
        """Take the next piece of the series; returns at once."""
        with self._changed:
            self._given += len(series)
            if self._fault:
                return
            self._waiting.append(series)
            if sum(map(len, self._waiting)) > WAITING:
                self._waiting = [Series.joined([Series.joined(self._waiting).rows(slice(None, None, 2))])]
            self._changed.notify()

    def close(self, closing: Closing) -> str:
        """Show the outcome of the run, and return a sentence on data that the viewer did not show.

        Args:
            closing: how it ended.

        Returns:
            A line for the user; empty where the viewer shows every row.
        """
        with self._changed:
            self._closing = closing
            self._changed.notify()
        began = time.monotonic()
        while self._thread.is_alive():
            self._thread.join(0.1)
            limit = max(self._heard, began) + _PATIENCE if self._heard else began + _START
            if time.monotonic() > limit:
                self._fault = self._fault or "does not answer"
                break
        self._end()
        if self._fault:
            return f"the viewer on {self._address} {self._fault}; the run went on without it"
        if self._taken < self._given:
            share = 100.0 * self._taken / self._given
            return f"the viewer could not keep up: the live view has {share:.2g} % of the run's rows"
        return ""

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave no process behind."""
        self._end()

    def _end(self) -> None:
        self._relay.kill()
        self._relay.wait()
        self._thread.join()  # it hears at once that the relay is gone
        for pipe in (self._relay.stdin, self._relay.stdout):
            if pipe is not None:
                with suppress(OSError):  # what was not sent cannot be sent any more
                    pipe.close()

    def _work(self, opening: Opening) -> None:
        """Hand over the pieces that wait, one after the other, until the run is over; run by the thread."""
        try:
            self._hand_over(opening)
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self._waiting or self._closing)
                    pieces, self._waiting = self._waiting, []
                if pieces:
                    whole = Series.joined(pieces)
                    self._hand_over(whole)
                    self._taken += len(whole)
                elif self._closing is not None:
                    self._hand_over(self._closing)
                    return
        except (OSError, ValueError) as error:
            with self._changed:
                self._fault = self._fault or str(error)
                self._waiting = []

    def _hand_over(self, message: Any) -> None:
        """Send a message to the relay and waits for the answer.

        Raises:
            OSError: the message did not reach the viewer; the text says why, of the viewer.
        """
        requests, answers = self._relay.stdin, self._relay.stdout
        if requests is None or answers is None:
            raise OSError("cannot be reached")
        try:
            pickle.dump(message, requests, protocol=pickle.HIGHEST_PROTOCOL)
            requests.flush()
            answer = answers.readline()
        except OSError:
            answer = b""
        if answer == LOST:
            raise OSError("was closed")
        if answer != TAKEN:
            said = answer.decode(errors="replace").strip()
            raise OSError(f"was not shown the run ({said})" if said else "cannot be reached: the process between ended")
        self._heard = time.monotonic()
