"""``wrist run``: options to an experiment, the experiment to a run, the run to a table, JSON and a recording."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.cli.output import print_json, run_table
from spherical_wrist.cli.signals import noted
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import Experiment, read_toml, with_changes
from spherical_wrist.experiment.run import Run
from spherical_wrist.experiment.simulate import simulate
from spherical_wrist.files import check_writable
from spherical_wrist.simulation.outcome import Status
from spherical_wrist.simulation.series import Series

SHOW_PROGRESS_FROM = 60.0
"""Simulated time [s] from which a run takes long enough for a progress bar."""


class RunOptions(NamedTuple):
    """What to do with the run.

    Attributes:
        recording: file to write, None for none.
        every: thinning of the recording.
        json: print JSON instead of a table.
        live: show the run in a viewer meanwhile.
        viewer: where that listens, None for where one usually does.
    """

    recording: Path | None
    every: int
    json: bool
    live: bool = False
    viewer: str | None = None


def run_experiment(file: Path | None, changes: Mapping[str, Any], settings: list[str], options: RunOptions) -> int:
    """Runs and reports; returns the exit code.

    Args:
        file: experiment file, if any.
        changes: values by dotted name that take the place of those in the file.
        settings: ``name=value`` texts that take the place of both.
        options: what to do with the run.

    Raises:
        WristError: wrong input, or a recording that cannot be written.
    """
    tables = read_toml(file) if file else {}
    experiment = Experiment(**with_changes(with_changes(tables, changes), read_settings(settings)))
    if options.every < 1:
        raise ParameterError(f"--record-every {options.every}: must be 1 or more")
    if options.recording is not None:
        check_writable(options.recording)
    with _live(experiment, options) as live, noted() as received:
        with _progress(experiment.duration, options.json) as progress:
            run = simulate(
                experiment,
                record_every=options.every,
                keep_series=options.recording is not None,
                progress=progress,
                stop=lambda: bool(received),
                watch=None if live is None else live.show,
            )
        recording = options.recording if len(run) else None
        if recording is not None:
            from spherical_wrist.experiment.recordings import record  # half a second of imports

            record(run, recording)
        if live is not None:
            live.close(run)
    if options.json:
        print_json(summary(run, recording))
    else:
        run_table(run, recording)
    if received:
        return 128 + received[0]
    return 0 if run.outcome.status is Status.COMPLETED else 1


def summary(run: Run, recording: Path | None) -> dict[str, Any]:
    """The run as the object that ``--json`` prints; a run that did not complete also says when and why."""
    experiment, outcome = run.experiment, run.outcome
    early = {"ended_at_s": outcome.time, "reason": outcome.reason}
    return {
        "outcome": str(outcome.status),
        **({} if outcome.status is Status.COMPLETED else early),
        "law": experiment.law.name,
        "reference": experiment.reference.name,
        "duration_s": experiment.duration,
        "control_period_s": experiment.control_period,
        "seed": experiment.seed,
        "recording": None if recording is None else str(recording),
        "wall_time_s": run.wall_time,
        "real_time_factor": run.real_time_factor,
        "metrics": asdict(run.metrics),
    }


class _Live(NamedTuple):
    """A viewer that shows the run.

    Attributes:
        show: takes the next piece of the series.
        close: shows how the run ended, and tells the user what the viewer did not show.
    """

    show: Callable[[Series], None]
    close: Callable[[Run], None]


@contextmanager
def _live(experiment: Experiment, options: RunOptions) -> Iterator[_Live | None]:
    """The viewer that the run is shown in meanwhile; None for none."""
    if not options.live:
        yield None
        return
    from spherical_wrist.experiment.live import close_view, live_view
    from spherical_wrist.recording.address import read_address

    address = None if options.viewer is None else read_address(options.viewer)

    def close(run: Run) -> None:
        missed = close_view(view, run)
        if missed:
            print(f"wrist: {missed}", file=sys.stderr)

    with live_view(experiment, address, options.every) as view:
        yield _Live(view.show, close)


@contextmanager
def _progress(duration: float, quiet: bool) -> Iterator[Any]:
    """A bar on the terminal's error stream for runs that take long; None where there is nothing to show it on."""
    if quiet or duration < SHOW_PROGRESS_FROM or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("simulating"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=duration)
        yield lambda simulated: bar.update(task, completed=simulated)
