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
from spherical_wrist.files import make_folder
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress

EXTRA_LABEL = ""
"""Label of the baseline law if it is not among the compared laws."""


def compare(
    laws: Laws,
    cases: Sequence[Case],
    tables: Mapping[str, Any],
    changes: Mapping[str, Any],
    *,
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
        record: patterns ``LAW:CASE``, with ``*`` and ``?``, of the cells to record; ``all`` for every cell.
        folder: folder for recordings ``LAW--CASE.rrd``, created before anything is simulated.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished runs and their total.

    Raises:
        WristError: a case or a pattern is not valid, a law raises, or a recording cannot be written.
    """
    began = time.perf_counter()
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    baseline = next((label for label, law in laws.items() if law == BASELINE), EXTRA_LABEL)
    with_baseline: Laws = laws if baseline in laws else {baseline: BASELINE, **laws}
    work = [
        (label, case.name, case.experiment(tables, {**shared, "law": law}))
        for case in cases  # outer loop, so that threads begin with different laws, which are compiled once each
        for label, law in with_baseline.items()
    ]
    files = _files(record, laws, [case.name for case in cases], folder)
    if folder is not None:
        make_folder(folder)
    writing = threading.Lock()

    def run_cell(item: tuple[str, str, Experiment], worker: Worker) -> Cell:
        label, case, experiment = item
        file = files.get((label, case))
        if file is None:
            measured = worker.measure(experiment)
            return Cell(label, case, experiment, measured.outcome, measured.metrics)
        from spherical_wrist.recording.runs import record as write  # imports take half a second

        run = worker.simulate(experiment)
        with writing:
            write(run, file)
        return Cell(label, case, experiment, run.outcome, run.metrics, file)

    finished = Runner(jobs).map(run_cell, work, progress)
    cells = {(cell.law, cell.case): cell for cell in finished}
    baseline_chattering = {case.name: _chattering(cells[baseline, case.name]) for case in cases}
    chosen = {key: cell for key, cell in cells.items() if key[0] in laws}
    return Comparison(laws, tuple(cases), chosen, baseline_chattering, time.perf_counter() - began)


def _chattering(cell: Cell) -> float | None:
    return cell.metrics.chattering_Nm_per_s if cell.error is not None else None


def _files(
    patterns: Sequence[str], laws: Iterable[str], cases: Sequence[str], folder: Path | None
) -> dict[tuple[str, str], Path]:
    """Return the files of the cells that match a pattern, by label and name of the case."""
    if folder is None:
        if patterns:
            raise ParameterError("recording needs a folder: give one with -o DIR")
        return {}
    chosen = dict.fromkeys(key for pattern in patterns for key in _matching(pattern, tuple(laws), cases))
    files = {(law, case): folder / f"{_file_stem(law)}--{_file_stem(case)}.rrd" for law, case in chosen}
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
