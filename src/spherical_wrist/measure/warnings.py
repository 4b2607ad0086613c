"""Warnings of runs: the table of conditions under which the figures of a run are doubtful, and their texts.

A run that is right says nothing. A warning is one plain sentence with the figure, what it means, and the setting that
helps. ``Run.warnings`` has those of one run, from three sources:

- the prepared experiment: ``Wrist.warnings`` of the model, :meth:`.Reference.warnings` of the motion, and
  whatever else is appended to ``ClosedLoop.warnings``, before the run or while it goes on;
- the finished run: :data:`CHECKS`, over its metrics.

To contribute a check of a run, add an entry to :data:`CHECKS`, over a metric of
:data:`spherical_wrist.measure.metrics.METRICS`. Everything else follows: the line on the error stream, ``--json``, the
recording and its views, comparisons, frontiers, tuning and campaigns, which count the runs, and ``wrist list``.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from spherical_wrist.measure.metrics import METRICS


class Check(NamedTuple):
    """Check of a finished run: a metric that must not exceed a limit.

    Attributes:
        name: identifier.
        metric: name of the metric.
        limit: largest value that is not worth a word.
        event: statement of what happened; begins the sentence.
        size: how much; ``{value}`` stands for the value and its unit.
        advice: meaning for the figures, and setting that helps.
    """

    name: str
    metric: str
    limit: float
    event: str
    size: str
    advice: str

    @property
    def meaning(self) -> str:
        """Statement of the condition and its meaning, without figures."""
        return f"{self.event}: {self.advice}"

    def found(self, metrics: Mapping[str, float | None]) -> bool:
        """Return True if the metric exceeds the limit."""
        value = metrics.get(self.metric)
        return value is not None and value > self.limit

    def sentence(self, metrics: Mapping[str, float | None]) -> str:
        """Return the warning of one run."""
        return f"{self.event} {self._size(metrics[self.metric])}: {self.advice}"

    def summary(self, runs: Mapping[str, Mapping[str, float | None]]) -> str:
        """Return the warning of several runs together: the number of those affected, and the worst of them.

        Args:
            runs: metrics of all the runs, by words for each; at least one is found.
        """
        found = [name for name, metrics in runs.items() if self.found(metrics)]
        worst = max(found, key=lambda name: runs[name][self.metric] or 0.0)
        return self.counted(f"{len(found)} of {len(runs)} runs", worst, runs[worst][self.metric])

    def counted(self, affected: str, worst: str, value: float | None) -> str:
        """Return the warning of several runs.

        Args:
            affected: how many of how many runs.
            worst: words for the worst of them.
            value: its value of the metric.
        """
        return f"{self.event} in {affected}, most in {worst} {self._size(value)}: {self.advice}"

    def _size(self, value: float | None) -> str:
        metric = METRICS[self.metric]
        shown = metric.shown_value(value)
        return self.size.format(value=f"{shown:.3g} {metric.shown_unit}".strip())


CHECKS: dict[str, Check] = {
    check.name: check
    for check in (
        Check(
            "saturated", "saturated_fraction", 0.01,
            "the torque saturated", "at {value} of the control instants",
            "the figures are those of the motors' limits as much as of the law; give stronger motors, a gentler "
            "reference or a smaller disturbance.level",
        ),
        Check(
            "large_error", "max_error_rad", 0.5,
            "the attitude error passed half a radian", "(largest {value})",
            "the wrist does not follow the reference; give other gains, a gentler reference or a smaller "
            "disturbance.level",
        ),
    )
}  # fmt: skip
"""All checks by name, in the order in which they are said.

:meta hide-value:
"""


def warnings_of(metrics: Mapping[str, float | None]) -> tuple[str, ...]:
    """Return the warnings of one finished run."""
    return tuple(check.sentence(metrics) for check in CHECKS.values() if check.found(metrics))


NUMBER = re.compile(r"\d[\d.]*(?:e[-+]?\d+)?")
"""Figures of a sentence, in which warnings of the same kind differ."""


def summarized(
    runs: Mapping[str, Mapping[str, float | None]], warnings: Mapping[str, Iterable[str]] | None = None
) -> tuple[str, ...]:
    """Return the warnings of several finished runs together, one for each kind.

    Args:
        runs: metrics of all the runs, by words for each.
        warnings: warnings of these runs, with those of models and motions; None for those of the metrics alone.
    """
    kinds: dict[str, dict[str, str]] = {}
    for name, given in (warnings or {}).items():
        own = warnings_of(runs[name])
        for text in given:
            if text not in own:
                kinds.setdefault(NUMBER.sub("#", text), {}).setdefault(name, text)
    others = (_together(found, len(runs)) for found in kinds.values())
    return (*others, *(check.summary(runs) for check in CHECKS.values() if any(map(check.found, runs.values()))))


def _together(found: Mapping[str, str], total: int) -> str:
    """Return one warning for those of one kind, by words for the runs that have it."""
    name, text = next(iter(found.items()))
    return _counted(text, len(set(found.values())) == 1, len(found), total, "runs", name)


def _counted(text: str, same: bool, found: int, total: int, runs: str, name: str) -> str:
    """Return a warning of a model or motion with the number of runs that have it, unless all have the same."""
    return text if same and found == total else f"in {found:,} of {total:,} {runs}, such as {name}: {text}"


LINE = "\n"
"""End of a warning among those of an episode in a table."""

MOST_KINDS = 20
"""Most kinds of warnings of models and motions that are said of a table."""


def other_warnings(warnings: Iterable[str], metrics: Mapping[str, float | None]) -> str:
    """Return the warnings of a run as a text for a table, without those that follow from its metrics."""
    own = warnings_of(metrics)
    return LINE.join(text.replace(LINE, " ") for text in warnings if text not in own)


def summarized_table(query: Callable[[str], list[dict[str, Any]]]) -> tuple[str, ...]:
    """Return the warnings of the finished runs of a table of episodes, one for each kind.

    Args:
        query: returns the rows of an SQL query; the table is ``episodes``, with a column for each metric, and the
            column ``warnings`` with the texts of :func:`other_warnings`.
    """
    [[total]] = (row.values() for row in query("SELECT count(*) FROM episodes WHERE outcome = 'completed'"))
    kinds = query(
        "SELECT count(DISTINCT id) AS found, count(DISTINCT text) AS texts, min(id) AS id, arg_min(text, id) AS text "
        "FROM (SELECT id, unnest(string_split(warnings, chr(10))) AS text FROM episodes "
        f"WHERE outcome = 'completed' AND warnings <> '') GROUP BY regexp_replace(text, '{NUMBER.pattern}', '#', 'g') "
        f"ORDER BY id, text LIMIT {MOST_KINDS}"
    )
    said = [
        _counted(kind["text"], kind["texts"] == 1, kind["found"], total, "episodes", f"episode {kind['id']}")
        for kind in kinds
    ]
    for check in CHECKS.values():
        rows = query(
            f"SELECT count(*) FILTER ({check.metric} > {check.limit!r}) AS found, "
            f"max({check.metric}) AS largest, "
            # of equals the first, whichever thread meets it
            f"arg_max(id, row({check.metric}, -id)) FILTER ({check.metric} IS NOT NULL) AS worst FROM episodes "
            "WHERE outcome = 'completed'"
        )
        [row] = rows
        if row["found"]:
            affected = f"{row['found']:,} of {total:,} episodes"
            said.append(check.counted(affected, f"episode {row['worst']}", row["largest"]))
    return tuple(said)


def without_repeats(warnings: Iterable[str]) -> tuple[str, ...]:
    """Return every warning once, in order."""
    return tuple(dict.fromkeys(warnings))
