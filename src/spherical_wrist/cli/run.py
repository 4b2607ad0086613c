"""``wrist run``: options to an experiment, the experiment to a run, the run to a table, JSON and a recording."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from spherical_wrist.cli.options import (
    Changes,
    ExperimentFile,
    Hardware,
    Json,
    Settings,
    read_experiment,
    with_parameters,
)
from spherical_wrist.plain_text import visible

if TYPE_CHECKING:
    from spherical_wrist.experiment.description import Experiment
    from spherical_wrist.measure.series import Series
    from spherical_wrist.simulation.run import Run

USUAL = "wrist.rrd"
"""Recording that is written where none is named."""

SHOW_PROGRESS_FROM = 60.0
"""Simulated time [s] from which a run takes long enough for a progress bar."""


@with_parameters()
def command(
    *,
    experiment: ExperimentFile = None,
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Annotated[
        Path | None,
        Option("--output", "-o", metavar="FILE.rrd", help=f"recording to write [{USUAL}, which is replaced]"),
    ] = None,
    no_recording: Annotated[bool, Option("--no-recording", help="write no recording")] = False,
    record_every: Annotated[int, Option(metavar="N", help="record every N-th control instant only")] = 1,
    live: Annotated[bool, Option("--live", help="show the run while it is simulated, in an open wrist view")] = False,
    viewer: Annotated[
        str | None, Option(metavar="HOST:PORT", help="the viewer to show it live in [127.0.0.1:9876]")
    ] = None,
    json: Json = False,
) -> int:
    """Without arguments: the default experiment, whose parameters are in brackets.

    This is the paper's fuzzy law on a Lissajous motion, against a constant disturbance and a plant that is heavier than
    the controller believes.

    Exit code: 0 completed, 1 diverged or failed, 2 wrong input, 130 or 143 stopped by a signal (what was simulated
    is kept).

    Raises:
        ParameterError: options contradict each other, or a value is not valid.
    """
    from rich.text import Text

    from spherical_wrist.compat.imports import import_mujoco_without_window, pandas_hidden

    import_mujoco_without_window()

    from spherical_wrist.cli.output import run_table, warn
    from spherical_wrist.cli.signals import heard, noted
    from spherical_wrist.cli.tables import print_json, printer
    from spherical_wrist.errors import ParameterError
    from spherical_wrist.experiment.description import Experiment, with_changes
    from spherical_wrist.files import check_writable, note_input
    from spherical_wrist.loop.outcome import Status
    from spherical_wrist.parameters import Member, paths_of
    from spherical_wrist.simulation.simulate import simulate

    described = Experiment(**with_changes(*read_experiment(experiment, hardware, changes, set_)))
    if record_every < 1:
        raise ParameterError(f"--record-every {record_every}: must be 1 or more")
    target = None if no_recording else output or Path(USUAL)
    if target is not None:
        for part in (described, *(value for _, value in described if isinstance(value, Member))):
            for path in paths_of(part).values():
                note_input(path)
        check_writable(target)
    replaced = _age(target) if target is not None and output is None else ""
    with ExitStack() as stack:
        show, close = (
            stack.enter_context(_live(described, viewer, record_every)) if live or viewer is not None else (None, None)
        )
        received = stack.enter_context(noted())
        with _progress(described.duration, json) as progress:
            run = simulate(
                described,
                record_every=record_every,
                keep_series=target is not None,
                progress=progress,
                stop=lambda: bool(received),
                watch=show,
            )
        if received:
            heard()
        recording = target if len(run) else None
        if recording is not None:
            with pandas_hidden():
                from spherical_wrist.recording.runs import record  # half a second of imports

                record(run, recording)
        if close is not None:
            close(run)
    motion = described.reference.about()
    if json:
        more = {"motion": motion} if motion else {}
        print_json({**_summary(run, recording), "replaced": bool(recording and replaced), **more})
        warn(run.warnings)
    else:
        run_table(run, recording, motion)
        if recording is not None and replaced:
            printer().print(Text(f"replaces the {recording} of {replaced}; -o NAME.rrd keeps both", "dim"))
    if received:
        return 128 + received[0]
    return 0 if run.outcome.status is Status.COMPLETED else 1


def _age(path: Path) -> str:
    """Return the age of a file in words; empty if there is none."""
    try:
        seconds = time.time() - path.stat().st_mtime
    except OSError:
        return ""
    for unit, size in (("day", 86400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0)):
        if seconds >= size:
            count = int(seconds // size)
            return f"{count} {unit}{'s' * (count > 1)} ago"
    return "just now"


def _summary(run: Run, recording: Path | None) -> dict[str, Any]:
    """Return the object that ``--json`` prints; a run that did not complete also says when and why."""
    from spherical_wrist.loop.outcome import Status

    experiment, outcome = run.experiment, run.outcome
    early = {"ended_at_s": outcome.time, "reason": outcome.reason}
    return {
        "outcome": str(outcome.status),
        **({} if outcome.status is Status.COMPLETED else early),
        **run.verdict.to_dict(),
        "warnings": list(run.warnings),
        "law": experiment.law.name,
        "reference": experiment.reference.name,
        "duration_s": experiment.duration,
        "control_period_s": experiment.control_period,
        "seed": experiment.seed,
        "recording": None if recording is None else str(recording),
        "wall_time_s": run.wall_time,
        "real_time_factor": run.real_time_factor,
        "metrics": dict(run.metrics),
    }


@contextmanager
def _live(
    experiment: Experiment, viewer: str | None, every: int
) -> Iterator[tuple[Callable[[Series], None], Callable[[Run], None]]]:
    """Open a view of the run; yield a function that shows the next piece of the series, and one that ends the view."""
    from spherical_wrist.recording.address import read_address
    from spherical_wrist.recording.live_run import close_view, live_view

    address = None if viewer is None else read_address(viewer)

    def close(run: Run) -> None:
        missed = close_view(view, run)
        if missed:
            print(visible(f"wrist: {missed}"), file=sys.stderr)

    with live_view(experiment, address, every) as view:
        yield view.show, close


@contextmanager
def _progress(duration: float, quiet: bool) -> Iterator[Any]:
    """Show a bar for a run that takes long; yield None if there is nothing to show."""
    from spherical_wrist.cli.progress import shows_bars, simulating

    if quiet or duration < SHOW_PROGRESS_FROM or not shows_bars():
        yield None
        return
    with simulating(duration) as progress:
        yield progress
