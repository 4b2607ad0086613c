"""Simulation of a recorded experiment again, and its comparison with the recording, bit for bit."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.errors import RecordingError, WristError
from spherical_wrist.inspection.difference import Difference, difference
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.runs import load_recording
from spherical_wrist.simulation.run import AGENT, Run
from spherical_wrist.simulation.simulate import simulate

LONGEST = 10**9
"""Most physics steps of a run that is simulated again, about an hour of work: a description asks for any number."""


class Replay(NamedTuple):
    """A recorded run and the same simulated again.

    Attributes:
        recorded: the recorded run.
        again: result of the simulation here.
        series: how the two differ in the channels that are recorded; a newer version may log more.
        metrics: names of the metrics that differ in a bit.
        circumstances: versions, C library and processor that are not those of the recording: the one then, and the
            one now.
    """

    recorded: Run
    again: Run
    series: Difference
    metrics: tuple[str, ...]
    circumstances: dict[str, tuple[str, str]]

    @property
    def same_outcome(self) -> bool:
        """True if both ended in the same way, at the same time."""
        return self.recorded.outcome == self.again.outcome

    @property
    def identical(self) -> bool:
        """True if series, metrics and outcome are the same to the last bit."""
        return self.series.same and not self.metrics and self.same_outcome


def replay(
    path: Path | str,
    *,
    trust: bool = False,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Replay:
    """Simulate a recorded run again, with the model, the motion and the Python that are in the recording.

    Args:
        path: recording.
        trust: run Python code of the user's own that the recording carries. Whoever made it could have put anything
            there.
        progress: see :func:`spherical_wrist.simulation.simulate.simulate`.
        stop: likewise; a replay that is stopped is that of a part.

    Raises:
        RecordingError: the recording cannot be read, carries no files, or carries code that is not trusted.
        WristError: its experiment cannot be simulated here.
    """
    recorded, name = load_recording(path, trust=trust), f"recording {str(path)!r}"
    if recorded.description["law"]["name"] == AGENT:
        raise RecordingError(f"{name} is of an agent in an environment: it cannot be simulated again without the agent")
    if "model" not in recorded.embedded_files.places:
        raise RecordingError(
            f"{name} was made by a version that kept no files in it: it cannot be replayed from itself"
        )
    try:
        experiment = recorded.experiment
    except RecordingError as error:
        raise RecordingError(f"{name}: {error}") from None
    except WristError as error:
        raise RecordingError(f"{name} cannot be replayed by this version: {error}") from None
    try:
        steps = experiment.duration / experiment.timing(experiment.nominal()).physics_period
    except WristError as error:
        raise RecordingError(f"{name} cannot be replayed: {error}") from None
    if steps > LONGEST:
        raise RecordingError(f"{name} is of {steps:.3g} physics steps; at most {LONGEST:g} are simulated again")
    end, interrupted = recorded.outcome.time, recorded.outcome.status is Status.INTERRUPTED
    so_far = 0.0

    def note(simulated: float) -> None:
        nonlocal so_far
        so_far = simulated
        if progress is not None:
            progress(simulated)

    def enough() -> bool:
        return stop() or (so_far >= end if interrupted else so_far > end)

    again = simulate(experiment, record_every=recorded.every, progress=note, stop=enough)
    then, now = recorded.metrics.available, again.metrics
    changed = {
        what: (version, again.versions.get(what, "unknown"))
        for what, version in recorded.versions.items()
        if version != again.versions.get(what)
    }
    logged_then = Series(channels={name: rows for name, rows in again.channels.items() if name in recorded.channels})
    return Replay(
        recorded,
        again,
        difference(recorded, logged_then),
        tuple(metric for metric in then if then[metric] != now[metric]),
        changed,
    )
