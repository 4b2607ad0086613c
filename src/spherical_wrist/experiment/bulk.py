"""Experiments by the dozen, measured without keeping their series: played in calls of compiled code that they share."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.errors import one_line
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.measured import StoppedError, closed_loop
from spherical_wrist.libmujoco import warnings_kept_in_data
from spherical_wrist.metrics import LogMeter, Metrics
from spherical_wrist.simulation.addresses import laid
from spherical_wrist.simulation.bulk import PLAYING, RUN, lay, play
from spherical_wrist.simulation.closed_loop import CHUNK, MOST_STEPS
from spherical_wrist.simulation.compiler import compiled
from spherical_wrist.simulation.outcome import Outcome
from spherical_wrist.simulation.parts import Inputs
from spherical_wrist.simulation.workbench import Workbench


class Ended(NamedTuple):
    """What is left of a run.

    Attributes:
        outcome: how it ended.
        metrics: figures of merit.
    """

    outcome: Outcome
    metrics: Metrics


def measured_each(
    makers: Sequence[Callable[[], Experiment]], bench: Workbench, stop: Callable[[], bool] = lambda: False
) -> list[Ended | Exception]:
    """Runs experiments, each to its end, and measures them; the bits are those of each on its own.

    Preparing all of them before any is run costs less: running one evicts from the processor's caches what preparing
    the next needs. And their thread asks for Python's lock once for all of them.

    Args:
        makers: of the experiments, up to ``SEATS`` of the bench.
        bench: what they share on this thread; compiled.
        stop: asked a few times a second whether to stop.

    Returns:
        For each what is left of it, or the exception that making, preparing or running it raised.

    Raises:
        StoppedError: asked to stop.
    """
    with warnings_kept_in_data():
        with _by_turns():
            begun = [_begun(make, bench, seat, stop) for seat, make in enumerate(makers)]
            piece = _Piece(begun, bench)
        while piece.running:
            piece.play()
            if stop():
                raise StoppedError
            with _by_turns():
                piece.conclude()
                piece = _Piece(begun, bench)
    return [each.end if isinstance(each, _Running) else each for each in begun]


class _Running:
    """A run on a seat of a bench."""

    def __init__(self, experiment: Experiment, bench: Workbench, seat: int, stop: Callable[[], bool]) -> None:
        self.meter = LogMeter(experiment.measurement(bench.wrist(experiment.wrist_file)), bench.engine)
        self.loop = closed_loop(experiment, bench, stop, seat=seat)
        self.widths = experiment.law.state_size, len(self.loop.parts.drive.coils)
        self.fault: Exception | None = None

    @property
    def goes_on(self) -> bool:
        return self.fault is None and self.loop.outcome is None

    @property
    def end(self) -> Ended | Exception:
        if self.fault is not None:
            return self.fault
        assert self.loop.outcome is not None
        return Ended(self.loop.outcome, self.meter.result())

    def attempt(self, step: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return step(*arguments)
        except Exception as error:
            self.fault = error
            return None


_turn = threading.Lock()
PATIENCE = 0.02
"""Seconds that a thread waits for its turn, twice what preparing takes with the disturbances that are quick to draw.

Two threads that prepared at the same time would pass Python's lock to and fro, come to their ends at the same time, and
do so again after every piece. Slow disturbances are drawn in NumPy, without that lock: there it is better not to wait.
"""


@contextmanager
def _by_turns() -> Iterator[None]:
    """One thread at a time, as far as that is worth waiting for."""
    mine = _turn.acquire(timeout=PATIENCE)
    try:
        yield
    finally:
        if mine:
            _turn.release()


def _begun(
    make: Callable[[], Experiment], bench: Workbench, seat: int, stop: Callable[[], bool]
) -> _Running | Exception:
    try:
        return _Running(make(), bench, seat, stop)
    except StoppedError:
        raise
    except Exception as error:
        return error


class _Piece:
    """The next piece of all runs that are not at their end.

    Attributes:
        running: those runs.
    """

    def __init__(self, begun: Sequence[_Running | Exception], bench: Workbench) -> None:
        going = [each for each in begun if isinstance(each, _Running) and each.goes_on]
        steps = MOST_STEPS // max(len(going), 1)  # of all together as many as of one alone, for who asks to stop
        drawn = [each.attempt(each.loop.next_inputs, CHUNK, steps) for each in going]
        self.running = [each for each in going if each.goes_on]
        self._inputs: list[Inputs] = [inputs for inputs in drawn if inputs is not None]
        self._runs = np.zeros(len(self.running), RUN)
        if self.running:
            self._lay(bench)

    def _lay(self, bench: Workbench) -> None:
        """Writes where everything lies; all log into the same arrays, one after the other, and are measured between."""
        counts = [len(inputs.time) for inputs in self._inputs]
        log, widths = bench.log(max(counts)), [each.widths for each in self.running]
        sizes = np.multiply(widths, np.array(counts)[:, None]).max(axis=0)
        states, currents = (np.empty(size) for size in sizes)
        self._kept = log, states, currents
        for run, each, inputs, count in zip(self._runs, self.running, self._inputs, counts, strict=True):
            numbers, coils = each.widths
            lay(
                run,
                each.loop.parts,
                log[:count],
                states[: count * numbers].reshape(count, numbers),
                currents[: count * coils].reshape(count, coils),
                each.meter.window,
                each.meter.totals,
            )
            run["inputs"] = laid(inputs)

    def play(self) -> None:
        """Plays it."""
        first = 0
        while first < len(self.running):
            try:
                compiled(play, RUN)(self._runs[first:])
                break
            except Exception as error:  # nothing in the loop raises but a law, which may raise anything
                first += int((self._runs["status"][first:] == PLAYING).argmax())
                faulty = self.running[first]
                faulty.attempt(faulty.loop.blame, f"raised {type(error).__name__}: {one_line(error)}")
                first += 1

    def conclude(self) -> None:
        """Tells the runs how far they came."""
        for each, run in zip(self.running, self._runs, strict=True):
            if each.goes_on:
                each.attempt(each.loop.conclude, int(run["logged"]), int(run["status"]))
