"""Comparison of laws: every law on every case."""

import re
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from spherical_wrist.comparison.cases import Case
from spherical_wrist.comparison.law_selection import BASELINE, Laws
from spherical_wrist.comparison.results import Cell, Comparison
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.randomness import is_random
from spherical_wrist.files import make_folder
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.prepare.pulse_responses import NotLinearError
from spherical_wrist.simulation.rollouts import RolloutResult
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress

SEEDS = 3
"""Default number of seeds with which a case is run that has something random."""

EXTRA_LABEL = ""
"""Label of the baseline law if it is not among the compared laws."""


def compare(
    laws: Laws,
    cases: Sequence[Case],
    tables: Mapping[str, Any],
    changes: Mapping[str, Any],
    *,
    seeds: int = SEEDS,
    record: Sequence[str] = (),
    folder: Path | None = None,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
) -> Comparison:
    """Run every law on every case, and plain computed torque as the baseline.

    Args:
        laws: laws by label.
        cases: cases.
        tables: experiment that the cases change, as plain tables.
        changes: values by dotted name that override both. Those of laws are ignored, as ``laws`` has them already.
        seeds: number of seeds, from that of the experiment on, with which a case is run in which something is random;
            the others are run once, since every seed would give the same result.
        record: patterns ``LAW:CASE``, with ``*`` and ``?``, of the cells to record; ``all`` for every cell.
        folder: folder for recordings ``LAW--CASE.rrd``, or ``LAW--CASE--SEED.rrd`` where there are several
            seeds; created before anything is simulated.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished runs and their total.

    Raises:
        WristError: a case or a pattern is not valid, a law raises, or a recording cannot be written.
    """
    began = time.perf_counter()
    if seeds < 1:
        raise ParameterError(f"seeds = {seeds}: must be 1 or more")
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    baseline = next((label for label, law in laws.items() if law == BASELINE), EXTRA_LABEL)
    with_baseline: Laws = laws if baseline in laws else {baseline: BASELINE, **laws}
    plain = {case.name: case.experiment(tables, {**shared, "law": BASELINE}) for case in cases}
    drawn = {case: _seeds(experiment, seeds) for case, experiment in plain.items()}
    work = [
        (label, case, experiment.replaced(law=law, seed=seed))
        for case, experiment in plain.items()
        for seed in drawn[case]  # one after the other: laws share the motion and the disturbance of a seed
        for label, law in with_baseline.items()  # innermost, so that threads begin with laws to compile once each
    ]
    files = _files(record, laws, drawn, folder)
    if folder is not None:
        make_folder(folder)
    writing = threading.Lock()

    def run_cell(item: tuple[str, str, Experiment], worker: Worker) -> Cell:
        label, case, experiment = item
        file = files.get((label, case, experiment.seed))
        result: Run | RolloutResult
        try:
            result = worker.measure(experiment) if file is None else worker.simulate(experiment)
        except (
            NotLinearError
        ) as error:  # this law has no worst disturbance, because it does not come to rest without one
            return Cell(label, case, experiment.seed, experiment, Outcome(Status.FAILED, 0.0, str(error)), Metrics({}))
        if isinstance(result, Run) and file is not None:
            from spherical_wrist.recording.runs import record as write  # imports take half a second

            with writing:
                write(result, file)
        return Cell(label, case, experiment.seed, experiment, result.outcome, result.metrics, file, result.warnings)

    finished = Runner(jobs).map(
        run_cell, work, progress, lambda cell: f"{cell[0] or BASELINE.name} on {cell[1]}, seed {cell[2].seed}"
    )
    chattering = {(cell.case, cell.seed): _chattering(cell) for cell in finished if cell.law == baseline}
    chosen = {(cell.law, cell.case, cell.seed): cell for cell in finished if cell.law in laws}
    return Comparison(laws, tuple(cases), drawn, chosen, chattering, time.perf_counter() - began)


def _seeds(experiment: Experiment, count: int) -> tuple[int, ...]:
    """Return the seeds with which an experiment is run: one if nothing in it is random."""
    return tuple(range(experiment.seed, experiment.seed + (count if is_random(experiment) else 1)))


def _chattering(cell: Cell) -> float | None:
    return None if cell.lost else cell.metrics.chattering_Nm_per_s


def _files(
    patterns: Sequence[str], laws: Iterable[str], seeds: Mapping[str, Sequence[int]], folder: Path | None
) -> dict[tuple[str, str, int], Path]:
    """Return the files of the runs whose law and case match a pattern, by label, name of the case and seed."""
    if folder is None:
        if patterns:
            raise ParameterError("recording needs a folder: give one with -o DIR")
        return {}
    chosen = dict.fromkeys(key for pattern in patterns for key in _matching(pattern, tuple(laws), tuple(seeds)))
    files = {}
    for law, case in chosen:
        for seed in seeds[case]:
            of_seed = f"--{seed}" if len(seeds[case]) > 1 else ""
            files[law, case, seed] = folder / f"{_file_stem(law)}--{_file_stem(case)}{of_seed}.rrd"
    if len(set(files.values())) < len(files):
        raise ParameterError(
            "two of the runs to record would have the same file name: give the cases names that differ more"
        )
    return files


def _matching(pattern: str, laws: Sequence[str], cases: Sequence[str]) -> list[tuple[str, str]]:
    law, colon, case = ("*", ":", "*") if pattern == "all" else pattern.rpartition(":")
    if not colon:
        raise ParameterError(f"--record {pattern!r}: must be LAW:CASE, such as 'pd:*', or all")
    chosen: list[list[str]] = []
    for kind, wanted, names in (("law", law, laws), ("case", case, cases)):
        # a bracket is part of a vector in a label, not of a pattern
        chosen.append([name for name in names if fnmatchcase(name, wanted.replace("[", "[[]"))])
        if not chosen[-1]:
            raise UnknownNameError(kind, wanted, names, " in --record")
    return [(law, case) for law in chosen[0] for case in chosen[1]]


def _file_stem(label: str) -> str:
    """Return a label with characters that are not safe in a file name replaced."""
    return re.sub(r"[^\w.+=-]+", "_", label).strip("_.")
