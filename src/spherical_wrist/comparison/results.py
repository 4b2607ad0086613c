"""Results of a comparison: cells, standings, and spreads of metrics over cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

from spherical_wrist.comparison.cases import FAULTY, IDEAL, Case, group_of
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.comparison.ranking import geometric_mean, ranks, ratios
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.result import Result, counted


class Cell(NamedTuple):
    """Result of one law on one case.

    Attributes:
        law: label of the law.
        case: name of the case.
        experiment: experiment that was run.
        outcome: outcome of the run.
        metrics: metrics of the run.
        recording: file of the recording; None if there is none.
    """

    law: str
    case: str
    experiment: Experiment
    outcome: Outcome
    metrics: Metrics
    recording: Path | None = None

    @property
    def error(self) -> float | None:
        """RMS attitude error [rad], by which cells are ranked; None if the run did not complete."""
        return self.metrics.rms_error_rad if self.outcome.status is Status.COMPLETED else None


class Standing(NamedTuple):
    """Standing of a law over all cases.

    Attributes:
        law: label of the law.
        rank: 1 for the best. Laws are sorted by number of lost runs, then by score.
        score: geometric mean of the RMS error relative to the best law of the case, over the cases that the law
            completed; 1 for a law that is always the best. None if it completed no case.
        wins: number of cases on which no law has a smaller error.
        lost: names of the cases on which its run diverged, failed or was not measured.
    """

    law: str
    rank: int
    score: float | None
    wins: int
    lost: tuple[str, ...]


class Spread(NamedTuple):
    """Spread of a positive metric over several cases: smallest value, geometric mean, largest value."""

    smallest: float
    mean: float
    largest: float


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """Results of every law on every case.

    Attributes:
        laws: laws by label, in the given order.
        cases: cases.
        cells: results by label and name of the case.
        baseline_chattering: chattering of plain computed torque by case [N·m/s]; None if that did not complete.
        wall_time: wall time of all runs [s].
    """

    view: ClassVar[str] = "spherical_wrist.api.comparison_view:ComparisonView"

    laws: Laws
    cases: tuple[Case, ...]
    cells: Mapping[tuple[str, str], Cell]
    baseline_chattering: Mapping[str, float | None]
    wall_time: float

    def headline(self) -> str:
        """Return the numbers of laws and cases, and the best law."""
        size, best = f"{counted(len(self.laws), 'law')} × {counted(len(self.cases), 'case')}", self.standings()[0]
        return f"{size}: {best.law} is first, best on {best.wins}"

    def errors(self, case: str) -> dict[str, float | None]:
        """Return the RMS error [rad] on one case by law."""
        return {law: self.cells[law, case].error for law in self.laws}

    def figure(self, cell: Cell, name: str) -> float | None:
        """Return a metric of a cell by name, or its ``chattering_ratio`` to plain computed torque on the same case.

        None if the run does not have the metric; for the ratio also if one of the two runs did not complete.
        """
        if name != "chattering_ratio":
            return cell.metrics[name]
        baseline, own = self.baseline_chattering[cell.case], cell.metrics.chattering_Nm_per_s
        return own / baseline if baseline and own is not None and cell.error is not None else None

    def groups(self) -> dict[str, list[str]]:
        """Return the names of the cases with ideal and with non-ideal hardware; a group without cases is left out."""
        first = next(iter(self.laws))
        groups: dict[str, list[str]] = {IDEAL: [], FAULTY: []}
        for case in self.cases:
            groups[group_of(self.cells[first, case.name].experiment)].append(case.name)
        return {group: cases for group, cases in groups.items() if cases}

    def standings(self) -> list[Standing]:
        """Return the standing of every law, best first."""
        relative = {case.name: ratios(self.errors(case.name)) for case in self.cases}
        places = {case.name: ranks(self.errors(case.name)) for case in self.cases}
        rows = []
        for law in self.laws:
            completed = [own for case in self.cases if (own := relative[case.name][law]) is not None]
            lost = tuple(case.name for case in self.cases if self.cells[law, case.name].error is None)
            wins = sum(places[case.name][law] == 1 for case in self.cases if case.name not in lost)
            rows.append(Standing(law, 0, geometric_mean(completed), wins, lost))
        key = {row.law: (len(row.lost), float("inf") if row.score is None else row.score) for row in rows}
        rows.sort(key=lambda row: key[row.law])
        order = sorted(key.values())
        return [row._replace(rank=order.index(key[row.law]) + 1) for row in rows]

    def spread(self, law: str, cases: Sequence[str], figure: str) -> Spread | None:
        """Return the spread of a metric of a law over the cases that it completed; None without a positive value."""
        cells = (self.cells[law, case] for case in cases)
        values = [value for cell in cells if cell.error is not None and (value := self.figure(cell, figure))]
        mean = geometric_mean(values)
        return None if mean is None else Spread(min(values), mean, max(values))
