"""``sw.margins``: stability margins, and the largest tip error by any bounded torque."""

import time
from dataclasses import dataclass
from typing import Any, ClassVar, Unpack

from spherical_wrist.api.arguments import Arguments, ExperimentGiven, LawsGiven, ProgressGiven
from spherical_wrist.experiment.values import Conditions
from spherical_wrist.result import Result, counted
from spherical_wrist.stability.law_margins import LawMargins
from spherical_wrist.stability.law_margins import margins as margins_of
from spherical_wrist.stability.report import to_dict


@dataclass(frozen=True, repr=False)
class Margins(Result):
    """Margins of laws.

    Attributes:
        laws: margins of each law.
        at: time of the reference whose attitude is held [s].
        wall_time: time that all took [s].
    """

    view: ClassVar[str] = "spherical_wrist.api.margins_view:MarginsView"

    laws: tuple[LawMargins, ...]
    at: float
    wall_time: float

    def headline(self) -> str:
        """Return the number of laws, and the smallest of their worst tip errors."""
        errors = {each.law: each.worst_tip_error_mm for each in self.laws}
        found = {law: error for law, error in errors.items() if error is not None}
        if not found:
            return f"{counted(len(self.laws), 'law')}: none has a linear loop"
        best = min(found, key=lambda law: found[law])
        return f"{counted(len(self.laws), 'law')}: smallest worst tip error {1e3 * found[best]:.3g} µm, by {best}"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of :mod:`spherical_wrist.stability.report`."""
        return to_dict(self.laws, self.at, self.wall_time)


def margins(
    laws: LawsGiven | None = None,
    *,
    at: float = 0.0,
    ranges: bool = True,
    experiment: ExperimentGiven | None = None,
    jobs: int | None = None,
    progress: ProgressGiven | None = None,
    **changes: Unpack[Conditions],
) -> Margins:
    """Linearise the compiled loop of each law about an attitude of the reference, and compute its margins.

    Needs python-control and Slycot: ``pip install 'spherical-wrist[margins]'``.

    Args:
        laws: laws; by default all of the package.
        at: time of the reference whose attitude is held [s].
        ranges: True to search for the masses, payloads and delays up to which each loop is stable, which takes longest.
        experiment: experiment, whose disturbance bounds the torque; by default the default experiment.
        jobs: number of threads; by default one for each core.
        progress: True for a line on the error stream, or a function of the finished laws and of all.
        **changes: parameters of the experiment that replace its own, such as ``duration``; ``hardware="realistic"``.

    Raises:
        WristError: a law or a parameter is not valid, the disturbance has no size, or a law raises.
    """
    given, began = Arguments.of(laws, experiment, changes, progress, "linearising"), time.perf_counter()
    found = margins_of(
        given.laws, given.tables, given.changes, at=at, ranges=ranges, jobs=jobs, progress=given.progress
    )
    return Margins(tuple(found), at, time.perf_counter() - began)
