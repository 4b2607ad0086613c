"""What came out of a comparison: cells, standings, and spreads of figures over cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.comparison.cases import FAULTY, IDEAL, Case, group_of
from spherical_wrist.comparison.contestants import Laws
from spherical_wrist.comparison.ranking import geometric_mean, ranks, ratios
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.metrics import Metrics
from spherical_wrist.simulation.outcome import Outcome, Status


class Cell(NamedTuple):
    """One law on one case.

    Attributes:
        law: the law's label.
        case: the case's name.
        experiment: what was run.
        outcome: how the run ended.
        metrics: how well it tracked.
        recording: file that the run was recorded to, if any.
    """

    law: str
    case: str
    experiment: Experiment
    outcome: Outcome
    metrics: Metrics
    recording: Path | None = None

    @property
    def error(self) -> float | None:
        """The RMS attitude error [rad] that cells are ranked by; None where the run did not complete."""
        return self.metrics.rms_error_rad if self.outcome.status is Status.COMPLETED else None


class Standing(NamedTuple):
    """Where a law stands over all cases.

    Attributes:
        law: the law's label.
        rank: 1 for the best. Laws that diverged less often come first, then those with the smaller score.
        score: geometric mean, over the cases that the law completed, of its RMS error as a multiple of the best law's
            on the same case; 1 for a law that is best everywhere. None where it completed none.
        wins: cases on which no law has a smaller error.
        diverged: names of the cases on which it diverged.
    """

    law: str
    rank: int
    score: float | None
    wins: int
    diverged: tuple[str, ...]


class Spread(NamedTuple):
    """A positive figure over several cases: smallest, geometric mean, largest."""

    smallest: float
    mean: float
    largest: float


@dataclass(frozen=True)
class Comparison:
    """Every law on every case.

    Attributes:
        laws: the laws by label, in the order in which they were given.
        cases: the cases.
        cells: by label and name of the case.
        calm: chattering of plain computed torque by case [N·m/s]; None where that did not complete.
        wall_time: time that all of it took [s].
    """

    laws: Laws
    cases: tuple[Case, ...]
    cells: Mapping[tuple[str, str], Cell]
    calm: Mapping[str, float | None]
    wall_time: float

    def errors(self, case: str) -> dict[str, float | None]:
        """RMS error [rad] by law on one case."""
        return {law: self.cells[law, case].error for law in self.laws}

    def figure(self, cell: Cell, name: str) -> float | None:
        """A metric of a cell by name, or its ``chattering_ratio``: how many times plain computed torque on this case.

        None where the run has none; a ratio also where it, or plain computed torque, did not complete.
        """
        if name != "chattering_ratio":
            value: float | None = getattr(cell.metrics, name)
            return value
        calm, own = self.calm[cell.case], cell.metrics.chattering_Nm_per_s
        return own / calm if calm and own is not None and cell.error is not None else None

    def groups(self) -> dict[str, list[str]]:
        """Names of the cases with ideal and with non-ideal hardware; a group without cases is left out."""
        first = next(iter(self.laws))
        found: dict[str, list[str]] = {IDEAL: [], FAULTY: []}
        for case in self.cases:
            found[group_of(self.cells[first, case.name].experiment)].append(case.name)
        return {group: cases for group, cases in found.items() if cases}

    def standings(self) -> list[Standing]:
        """Every law, best first."""
        relative = {case.name: ratios(self.errors(case.name)) for case in self.cases}
        places = {case.name: ranks(self.errors(case.name)) for case in self.cases}
        rows = []
        for law in self.laws:
            completed = [own for case in self.cases if (own := relative[case.name][law]) is not None]
            diverged = tuple(case.name for case in self.cases if self.cells[law, case.name].error is None)
            wins = sum(places[case.name][law] == 1 for case in self.cases if case.name not in diverged)
            rows.append(Standing(law, 0, geometric_mean(completed), wins, diverged))
        key = {row.law: (len(row.diverged), float("inf") if row.score is None else row.score) for row in rows}
        rows.sort(key=lambda row: key[row.law])
        order = sorted(key.values())
        return [row._replace(rank=order.index(key[row.law]) + 1) for row in rows]

    def spread(self, law: str, cases: Sequence[str], figure: str) -> Spread | None:
        """A figure of a law over the cases that it completed; None where it has no positive value among them."""
        cells = (self.cells[law, case] for case in cases)
        values = [value for cell in cells if cell.error is not None and (value := self.figure(cell, figure))]
        mean = geometric_mean(values)
        return None if mean is None else Spread(min(values), mean, max(values))
