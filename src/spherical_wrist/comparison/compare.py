"""Laws × cases: every law on every case."""

import re
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from spherical_wrist.comparison.cases import Case
from spherical_wrist.comparison.contestants import YARDSTICK, Laws
from spherical_wrist.comparison.results import Cell, Comparison
from spherical_wrist.comparison.threads import Progress, Simulate, in_threads
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.files import make_folder

BESIDE = ""
"""Label of plain computed torque where it runs beside the laws and not as one of them."""


def compare(
    laws: Laws,
    cases: Sequence[Case],
    tables: Mapping[str, Any],
    changes: Mapping[str, Any],
    *,
    record: Sequence[str] = (),
    folder: Path | None = None,
    jobs: int | None = None,
    progress: Progress = lambda done, total: None,
) -> Comparison:
    """Runs every law on every case, and plain computed torque beside them.

    Args:
        laws: the laws, by label.
        cases: the cases.
        tables: the experiment that the cases change, as plain tables.
        changes: values by dotted name that take the place of both; those of laws are ``laws``' own business.
        record: patterns ``LAW:CASE``, with ``*`` and ``?``, of the cells to record; ``all`` for every one.
        folder: where to record, as ``LAW--CASE.rrd``; made, where there is none, before anything is simulated.
        jobs: threads; None for as many as there are cores.
        progress: told what is done.

    Raises:
        WristError: a case or a pattern is not valid, a law raises, or a recording cannot be written.
    """
    began = time.perf_counter()
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    yardstick = next((label for label, law in laws.items() if law == YARDSTICK), BESIDE)
    everyone: Laws = laws if yardstick in laws else {yardstick: YARDSTICK, **laws}
    work = [
        (label, case.name, case.experiment(tables, {**shared, "law": law}))
        for case in cases  # outside, so that threads begin with different laws, each to be compiled once
        for label, law in everyone.items()
    ]
    files = _files(record, laws, [case.name for case in cases], folder)
    if folder is not None:
        make_folder(folder)
    writing = threading.Lock()

    def run(item: tuple[str, str, Experiment], simulate: Simulate) -> Cell:
        label, case, experiment = item
        file = files.get((label, case))
        found = simulate(experiment, file is not None)
        if file is not None:
            from spherical_wrist.experiment.recordings import record as write  # half a second of imports

            with writing:
                write(found, file)
        return Cell(label, case, experiment, found.outcome, found.metrics, file)

    done = in_threads(run, work, jobs, progress)
    cells = {(cell.law, cell.case): cell for cell in done}
    calm = {case.name: _calm(cells[yardstick, case.name]) for case in cases}
    chosen = {key: cell for key, cell in cells.items() if key[0] in laws}
    return Comparison(laws, tuple(cases), chosen, calm, time.perf_counter() - began)


def _calm(cell: Cell) -> float | None:
    return cell.metrics.chattering_Nm_per_s if cell.error is not None else None


def _files(
    patterns: Sequence[str], laws: Iterable[str], cases: Sequence[str], folder: Path | None
) -> dict[tuple[str, str], Path]:
    """The files of the cells that match any of the patterns, by label and name of the case."""
    if folder is None:
        if patterns:
            raise ParameterError("a folder to record to is needed: give one with -o DIR")
        return {}
    chosen = dict.fromkeys(key for pattern in patterns for key in _matching(pattern, tuple(laws), cases))
    files = {(law, case): folder / f"{_plain(law)}--{_plain(case)}.rrd" for law, case in chosen}
    if len(set(files.values())) < len(files):
        raise ParameterError(
            "two of the runs to record would have the same file: give the cases names that differ more"
        )
    return files


def _matching(pattern: str, laws: Sequence[str], cases: Sequence[str]) -> list[tuple[str, str]]:
    law, colon, case = ("*", ":", "*") if pattern == "all" else pattern.rpartition(":")
    if not colon:
        raise ParameterError(f"--record {pattern!r}: LAW:CASE is needed, such as 'pd:*', or all")
    chosen: list[list[str]] = []
    for kind, wanted, names in (("law", law, laws), ("case", case, cases)):
        # brackets are those of a vector in a label, and no pattern
        chosen.append([name for name in names if fnmatchcase(name, wanted.replace("[", "[[]"))])
        if not chosen[-1]:
            raise UnknownNameError(kind, wanted, names, " in --record")
    return [(law, case) for law in chosen[0] for case in chosen[1]]


def _plain(label: str) -> str:
    """A label with nothing in it that a file name should not have."""
    return re.sub(r"[^\w.+=-]+", "_", label).strip("_.")
