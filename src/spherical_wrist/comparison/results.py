"""Results of a comparison: runs, case by case standings of the laws, and their standings over all cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.comparison.cases import FAULTY, IDEAL, Case, group_of
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.comparison.ranking import (
    CLOSE,
    RatioInterval,
    combined_error,
    geometric_mean,
    median_intervals,
    over_seeds,
    ranks,
    ratios,
)
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.result import Result, counted


class Cell(NamedTuple):
    """Result of one run: one law on one case with one seed.

    Attributes:
        law: label of the law.
        case: name of the case.
        seed: seed of everything random.
        experiment: experiment that was run.
        outcome: outcome of the run.
        metrics: metrics of the run.
        recording: file of the recording; None if there is none.
        warnings: warnings of the run.
    """

    law: str
    case: str
    seed: int
    experiment: Experiment
    outcome: Outcome
    metrics: Metrics
    recording: Path | None = None
    warnings: tuple[str, ...] = ()

    @property
    def lost(self) -> bool:
        """True if the run did not complete, or ended before there was anything to measure."""
        return self.outcome.status is not Status.COMPLETED or self.metrics.rms_error_rad is None

    @property
    def within(self) -> bool:
        """True if the run completed with its tip error within the bound of its experiment."""
        largest = self.error("max_tip_error_mm")
        return largest is not None and largest <= self.experiment.bound

    def error(self, figure: str) -> float | None:
        """Return an error by the name of its metric; None if the run was lost."""
        return None if self.lost else self.metrics[figure]


class CaseStanding(NamedTuple):
    """Standing of a law on one case, over the seeds.

    Attributes:
        law: label of the law.
        case: name of the case.
        rank: 1 for the best.
        ratio: combined error relative to the best law, each the median over the seeds; infinite if a run was lost.
        range: smallest and largest ratio to the best law of the same seed, over the seeds.
        attitude_ratio: attitude error relative to the smallest of all laws; infinite if a run was lost.
        tip_ratio: tip error, likewise.
        lost: seeds of the runs that were lost.
    """

    law: str
    case: str
    rank: int
    ratio: float
    range: RatioInterval
    attitude_ratio: float
    tip_ratio: float
    lost: tuple[int, ...]

    @property
    def close(self) -> bool:
        """True for the best law, and for those within 5 % of it."""
        return self.ratio <= CLOSE


class Standing(NamedTuple):
    """Standing of a law over all cases.

    Attributes:
        law: label of the law.
        rank: 1 for the best, by the median ratio, and then by the worst.
        median_ratio: median over the cases of the combined error relative to the best law; infinite if the law lost
            half of the cases.
        interval: interval of the median that covers 95 %; see :func:`.ranking.median_intervals`.
        worst_ratio: largest ratio of a run; infinite if a run was lost.
        worst_case: case of that run.
        worst_seed: seed of that run.
        wins: number of cases on which no law is better.
        close: number of cases on which it is within 5 % of the best law, wins included.
        lost: names of the cases with a run that diverged, failed or was not measured.
        lost_runs: number of those runs.
        runs: number of its runs.
    """

    law: str
    rank: int
    median_ratio: float
    interval: RatioInterval
    worst_ratio: float
    worst_case: str
    worst_seed: int
    wins: int
    close: int
    lost: tuple[str, ...]
    lost_runs: int
    runs: int


class Spread(NamedTuple):
    """Spread of a positive metric over several runs: smallest value, geometric mean, largest value."""

    smallest: float
    mean: float
    largest: float


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """Results of every law on every case.

    Attributes:
        laws: laws by label, in the given order.
        cases: cases.
        seeds: seeds with which each case was run, by its name; one for a case in which nothing is random.
        cells: results by label, name of the case and seed.
        baseline_chattering: chattering of plain computed torque by case and seed [N·m/s]; None if that was lost.
        wall_time: wall time of all runs [s].
    """

    view: ClassVar[str] = "spherical_wrist.api.comparison_view:ComparisonView"

    laws: Laws
    cases: tuple[Case, ...]
    seeds: Mapping[str, tuple[int, ...]]
    cells: Mapping[tuple[str, str, int], Cell]
    baseline_chattering: Mapping[tuple[str, int], float | None]
    wall_time: float

    def headline(self) -> str:
        """Return the numbers of laws and cases, and the best law."""
        size, best = f"{counted(len(self.laws), 'law')} × {counted(len(self.cases), 'case')}", self.standings()[0]
        return f"{size}: {best.law} is first, best on {best.wins} and within 5 % of the best on {best.close}"

    def runs(self, law: str, case: str) -> list[Cell]:
        """Return the results of a law on a case, in the order of the seeds."""
        return [self.cells[law, case, seed] for seed in self.seeds[case]]

    def figure(self, cell: Cell, name: str) -> float | None:
        """Return a metric of a cell by name, or its ``chattering_ratio`` to plain computed torque on the same case.

        None if the run does not have the metric; for the ratio also if one of the two runs was lost.
        """
        if name != "chattering_ratio":
            return cell.metrics[name]
        baseline, own = self.baseline_chattering[cell.case, cell.seed], cell.metrics.chattering_Nm_per_s
        return own / baseline if baseline and own is not None and not cell.lost else None

    def groups(self) -> dict[str, list[str]]:
        """Return the names of the cases with ideal and with non-ideal hardware; a group without cases is left out."""
        first = next(iter(self.laws))
        groups: dict[str, list[str]] = {IDEAL: [], FAULTY: []}
        for case in self.cases:
            groups[group_of(self.runs(first, case.name)[0].experiment)].append(case.name)
        return {group: cases for group, cases in groups.items() if cases}

    def run_ratios(self, case: str, seed: int) -> dict[str, float]:
        """Return the combined error of every law relative to the best one, on a case with a seed."""
        place = self.seeds[case].index(seed)
        return ratios({law: float(self._combined[case][row, place]) for row, law in enumerate(self.laws)})

    def case_standings(self, case: str) -> dict[str, CaseStanding]:
        """Return the standing of every law on a case, best first."""
        return self._by_case[case]

    def standings(self) -> list[Standing]:
        """Return the standing of every law, best first."""
        return self._standings

    def spread(self, law: str, cases: Sequence[str], figure: str) -> Spread | None:
        """Return the spread of a metric of a law over runs that were not lost; None without a positive value."""
        cells = (cell for case in cases for cell in self.runs(law, case))
        values = [value for cell in cells if not cell.lost and (value := self.figure(cell, figure))]
        mean = geometric_mean(values)
        return None if mean is None else Spread(min(values), mean, max(values))

    @cached_property
    def _combined(self) -> dict[str, Array]:
        """Combined errors by case, (laws, seeds)."""
        return {
            case.name: np.array(
                [[combined_error(*map(cell.error, case.figures)) for cell in self.runs(law, case.name)]
                 for law in self.laws]
            )
            for case in self.cases
        }  # fmt: skip

    @cached_property
    def _by_case(self) -> dict[str, dict[str, CaseStanding]]:
        return {case.name: self._case_standings(case) for case in self.cases}

    def _case_standings(self, case: Case) -> dict[str, CaseStanding]:
        def relative(figure: str) -> dict[str, float]:
            found = [[cell.error(figure) for cell in self.runs(law, case.name)] for law in self.laws]
            errors = np.array([[inf if each is None else each for each in row] for row in found])
            medians = dict(zip(self.laws, map(float, over_seeds(errors)), strict=True))
            return ratios({law: max(error, 1e-300) for law, error in medians.items()})

        combined = dict(zip(self.laws, map(float, over_seeds(self._combined[case.name])), strict=True))
        ratio, rank = ratios(combined), ranks(combined)
        attitude, tip = map(relative, case.figures)
        of_seed = [self.run_ratios(case.name, seed) for seed in self.seeds[case.name]]
        rows = {}
        for law in sorted(self.laws, key=lambda law: rank[law]):
            own = [each[law] for each in of_seed]
            lost = tuple(cell.seed for cell in self.runs(law, case.name) if cell.lost)
            interval = RatioInterval(min(own), max(own))
            rows[law] = CaseStanding(law, case.name, rank[law], ratio[law], interval, attitude[law], tip[law], lost)
        return rows

    @cached_property
    def _standings(self) -> list[Standing]:
        intervals = median_intervals([self._combined[case.name] for case in self.cases])
        by_seed = {(case, seed): self.run_ratios(case, seed) for case, seeds in self.seeds.items() for seed in seeds}
        rows = []
        for law, interval in zip(self.laws, intervals, strict=True):
            own = [self._by_case[case.name][law] for case in self.cases]
            worst_case, worst_seed = max(by_seed, key=lambda run: by_seed[run][law])
            rows.append(
                Standing(
                    law,
                    rank=0,
                    median_ratio=float(np.median([row.ratio for row in own])),
                    interval=interval,
                    worst_ratio=by_seed[worst_case, worst_seed][law],
                    worst_case=worst_case,
                    worst_seed=worst_seed,
                    wins=sum(row.rank == 1 and not row.lost for row in own),
                    close=sum(row.close for row in own),
                    lost=tuple(row.case for row in own if row.lost),
                    lost_runs=sum(len(row.lost) for row in own),
                    runs=len(by_seed),
                )
            )
        key = {row.law: (row.median_ratio, row.worst_ratio, row.lost_runs) for row in rows}
        order = sorted(key.values())
        rows.sort(key=lambda row: key[row.law])
        return [row._replace(rank=order.index(key[row.law]) + 1) for row in rows]
