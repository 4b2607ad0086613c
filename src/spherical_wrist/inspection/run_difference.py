"""Difference of two runs: experiments, versions, outcomes, metrics and series."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from spherical_wrist.inspection.difference import Difference, difference
from spherical_wrist.inspection.settings import Setting, differing_settings
from spherical_wrist.loop.outcome import Outcome
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.simulation.run import Run


class MetricPair(NamedTuple):
    """A metric of two runs.

    Attributes:
        a: of the first; None where it has none.
        b: of the second.
    """

    a: float | None
    b: float | None

    @property
    def change(self) -> float | None:
        """Relative change (b − a) / |a|; None where it has no meaning."""
        if self.a is None or self.b is None or self.a == 0.0:
            return 0.0 if self.a == self.b == 0.0 else None
        return (self.b - self.a) / abs(self.a)


@dataclass(frozen=True)
class RunDifference:
    """Difference of two runs.

    Attributes:
        settings: entries of the experiments that differ, and digests of files that differ.
        versions: versions that differ, both by name; None where one does not say.
        outcomes: outcome of either.
        metrics: of both, by name, always of the full series.
        every: either series has every so-many-th control instant.
        series: difference of the series.
    """

    settings: tuple[Setting, ...]
    versions: dict[str, tuple[str | None, str | None]]
    outcomes: tuple[Outcome, Outcome]
    metrics: dict[str, MetricPair]
    every: tuple[int, int]
    series: Difference

    @property
    def same_outcome(self) -> bool:
        """True if both ended in the same way at the same time, for whatever reason."""
        return self.outcomes[0][:2] == self.outcomes[1][:2]

    @property
    def same(self) -> bool:
        """True if it is the same experiment with the same series and outcome.

        Neither versions nor the time that simulating took count, nor how much of the series was recorded.
        """
        return not self.settings and self.same_outcome and self.series.same


def run_difference(a: Run, b: Run, tolerance: float = 0.0) -> RunDifference:
    """Compare two runs.

    Args:
        a: a run.
        b: another one.
        tolerance: of the series; see :func:`spherical_wrist.inspection.difference.difference`.
    """
    names = dict.fromkeys([*a.versions, *b.versions])
    versions = {name: (a.versions.get(name), b.versions.get(name)) for name in names}
    return RunDifference(
        settings=(*differing_settings(a.description, b.description), *_differing_files(a, b)),
        versions={name: pair for name, pair in versions.items() if pair[0] != pair[1]},
        outcomes=(a.outcome, b.outcome),
        metrics={name: MetricPair(a.metrics[name], b.metrics[name]) for name in METRICS},
        every=(a.every, b.every),
        series=difference(a, b, tolerance),
    )


def _differing_files(a: Run, b: Run) -> Iterator[Setting]:
    """The files that the recordings carry and that are not the same, by digests of their contents."""
    if a.embedded_files.places and b.embedded_files.places:
        for name in dict.fromkeys([*a.embedded_files.places, *b.embedded_files.places]):
            digests = [run.embedded_files.digest(name) for run in (a, b)]
            if digests[0] != digests[1]:
                yield Setting(f"file of {name}", "", *digests)


def to_dict(found: RunDifference) -> dict[str, Any]:
    """Convert a difference to plain tables, for JSON."""
    series = found.series
    return {
        "same": found.same,
        "tolerance": series.tolerance,
        "experiment": {
            setting.name: {"unit": setting.unit, "a": setting.a, "b": setting.b} for setting in found.settings
        },
        "versions": {name: {"a": a, "b": b} for name, (a, b) in found.versions.items()},
        "outcome": {
            side: {"status": str(outcome.status), "time_s": outcome.time, "reason": outcome.reason}
            for side, outcome in zip("ab", found.outcomes, strict=True)
        },
        "metrics": {
            name: {"a": figure.a, "b": figure.b, "relative_change": figure.change}
            for name, figure in found.metrics.items()
        },
        "series": {
            "same": series.same,
            "rows": dict(zip("ab", series.rows, strict=True)),
            "record_every": dict(zip("ab", found.every, strict=True)),
            "spans_s": dict(zip("ab", series.spans, strict=True)),
            "common_rows": series.common,
            "common_span_s": series.common_span,
            "one_goes_on": not series.whole,
            "first": _place(series.first),
            "arrays": {array.name: _array(array) for array in series.arrays},
        },
    }


def _array(array: Any) -> dict[str, Any]:
    return {
        **asdict(array),
        "same": array.same,
        "components": dict(zip("ab", array.components, strict=True)),
        **{name: _place(getattr(array, name)) for name in ("first", "beyond", "largest_at")},
    }


def _place(place: Any) -> dict[str, Any] | None:
    return None if place is None else {"time_s": place.time, "row_a": place.row_a, "row_b": place.row_b}
