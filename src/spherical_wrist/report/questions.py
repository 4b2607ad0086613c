"""Queries of the episodes: counts, quantiles, laws against each other, the worst, and curves to draw."""

from collections.abc import Sequence
from math import inf, isinf
from typing import Any

import numpy as np

from spherical_wrist.campaign.store import Column
from spherical_wrist.report.intervals import NOTHING, Estimate, above_worst, quantile_ranks, wilson
from spherical_wrist.report.sensitivity import SMALLEST
from spherical_wrist.report.table import FIGURES, UNMEASURED, Table, quoted

QUANTILES = {"median": 0.5, "90 %": 0.9, "99 %": 0.99}
WORST = 10
CURVE, TAIL = 160, 60
"""Points of a curve over all samples, and more of them towards the largest."""
BANDS = 24
BAND_LEAST = 20
"""Bins of a parameter for a picture at most, and episodes in each at least."""
Value = float | None


def counts(table: Table, law: str, bound: float, *, intervals: bool) -> dict[str, Any]:
    """Count the episodes of a law by outcome, with the rates of failures.

    ``exceeding`` counts the largest tip errors above the bound [mm], and the runs that did not complete.
    """
    (row,) = table.named(
        "SELECT count(*) AS episodes, "
        + ", ".join(
            f"count(*) FILTER (outcome = '{outcome}') AS {outcome}"
            for outcome in ("completed", "diverged", "failed", "invalid")
        )
        + f", count(*) FILTER ({UNMEASURED}) AS unmeasured FROM episodes WHERE law = ?",
        law,
    )
    ((measured, exceeding),) = table.rows(
        "SELECT count(*), count(*) FILTER (tip > ?) FROM measured WHERE law = ?", bound, law
    )

    def share(hits: int, count: int) -> dict[str, Any]:
        found = wilson(hits, count)
        return {"count": hits, "of": count, "share": found.value, **_ends(found, intervals)}

    return {
        **row,
        "measured": measured,
        "rates": {
            "diverged": share(row["diverged"], measured),
            "failed": share(row["failed"], measured),
            "exceeding": share(exceeding, measured),
            "invalid": share(row["invalid"], row["episodes"]),
        },
    }


def quantiles(table: Table, law: str, figure: str, *, intervals: bool) -> dict[str, Any]:
    """Quantiles of a figure with their intervals, and the largest; null where that run did not complete."""
    ((count,),) = table.rows("SELECT count(*) FROM measured WHERE law = ?", law)
    if not count:
        return {}
    ranks = {name: quantile_ranks(probability, count) for name, probability in QUANTILES.items()}
    wanted = {rank for each in ranks.values() for rank in each if rank is not None} | {count}
    at = _at_ranks(table, figure, "law = ?", [law], wanted)
    found: dict[str, Any] = {
        name: {
            "value": finite(at[each.value]),
            "low": finite(at[each.low]) if intervals and each.low is not None else None,
            "high": finite(at[each.high]) if intervals and each.high is not None else None,
        }
        for name, each in ranks.items()
    }
    found["worst"] = {"value": finite(at[count]), "above": above_worst(count) if intervals else None}
    return found


def against(table: Table, law: str, other: str, *, intervals: bool) -> dict[str, Any]:
    """A law against another on the samples that both have run: how often its error is smaller, and by how much.

    A run that did not complete loses against one that did; two of them are a draw, and their ratio is 1.
    """
    ratio = (
        "CASE WHEN isinf(a.error) AND isinf(b.error) THEN 1e0 WHEN isinf(b.error) THEN 0e0 "
        f"ELSE greatest(a.error, {SMALLEST}) / greatest(b.error, {SMALLEST}) END"
    )
    paired = f"SELECT {ratio} AS ratio FROM measured a JOIN measured b USING (sample) WHERE a.law = ? AND b.law = ?"
    ((count, wins, draws),) = table.rows(
        f"SELECT count(*), count(*) FILTER (ratio < 1), count(*) FILTER (ratio = 1) FROM ({paired})", law, other
    )
    found: dict[str, Any] = {"law": law, "other": other, "samples": count, "wins": wins, "draws": draws}
    won, ratio_of = wilson(wins, count), NOTHING
    if count:
        ranks = quantile_ranks(0.5, count)
        at = _at_ranks(table, "ratio", "TRUE", [], {rank for rank in ranks if rank}, f"({paired})", [law, other])
        ratio_of = Estimate(*(None if rank is None else finite(at[rank]) for rank in ranks))
    return {
        **found,
        "share": {"value": won.value, **_ends(won, intervals)},
        "ratio": {"value": ratio_of.value, **_ends(ratio_of, intervals)},
    }


def worst(table: Table, law: str | None = None) -> list[dict[str, Any]]:
    """The worst episodes, of one law or of all: runs that did not complete, earliest end first, then by their error."""
    where = "TRUE" if law is None else "law = ?"
    varied = ", ".join(quoted(column.name) for column in table.parameters)
    figures = ", ".join(FIGURES)
    rows = table.named(
        f"SELECT id, law, sample, outcome, ended_at_s, reason, {figures}{', ' if varied else ''}{varied} "
        f"FROM measured WHERE {where} ORDER BY error DESC, isinf(error) DESC, ended_at_s, id LIMIT {WORST}",
        *([] if law is None else [law]),
    )
    names = [column.name for column in table.parameters]
    return [
        {
            **{name: row[name] for name in ("id", "law", "sample", "outcome", "ended_at_s", "reason")},
            **{name: finite(row[name]) for name in FIGURES},
            "parameters": {name: row[name] for name in names},
        }
        for row in rows
    ]


def curve(table: Table, law: str, figure: str) -> list[tuple[float, float]]:
    """The figure against the share of episodes up to it: its empirical distribution, thinned; without infinite ones."""
    ((count,),) = table.rows("SELECT count(*) FROM measured WHERE law = ?", law)
    if not count:
        return []
    even = np.linspace(1, count, CURVE)
    tail = count + 1 - np.geomspace(1.0, count, TAIL)
    wanted = set(np.unique(np.concatenate([even, tail]).round().astype(int)).tolist())
    at = _at_ranks(table, figure, "law = ?", [law], wanted)
    return [(at[rank], rank / count) for rank in sorted(wanted) if not isinf(at[rank])]


def bands(table: Table, law: str, column: Column) -> list[dict[str, Any]]:
    """Quantiles of the error in bins of a parameter: 10 %, median and 90 %, infinite where runs did not complete.

    Bins have equal numbers of episodes; where there are few different values, each is one.
    """
    name = quoted(column.name)
    ((count, different),) = table.rows(f"SELECT count(*), count(DISTINCT {name}) FROM measured WHERE law = ?", law)
    bins = max(1, min(BANDS, count // BAND_LEAST))
    few = different <= bins or column.kind not in ("number", "integer")
    place = (
        f"dense_rank() OVER (ORDER BY {name})" if few else f"(rank() OVER (ORDER BY {name}) - 1) * {bins} // {count}"
    )
    middle = f"any_value({name})" if few else f"median({name})"
    rows = table.rows(
        f"SELECT {middle}, quantile_disc(error, [0.1, 0.5, 0.9]), count(*) "
        f"FROM (SELECT {name}, error, {place} AS bin FROM measured WHERE law = ?) GROUP BY bin ORDER BY bin LIMIT 100",
        law,
    )
    return [{"at": at, "low": q[0], "median": q[1], "high": q[2], "episodes": n} for at, q, n in rows]


def finite(value: float) -> Value:
    """The value, or None where it is infinite: JSON has no such number."""
    return None if value == inf else float(value)


def _ends(found: Estimate, intervals: bool) -> dict[str, Value]:
    return {"low": found.low if intervals else None, "high": found.high if intervals else None}


def _at_ranks(
    table: Table,
    figure: str,
    where: str,
    values: Sequence[Any],
    ranks: set[int],
    source: str = "measured",
    before: Sequence[Any] = (),
) -> dict[int, float]:
    """The order statistics of a figure with these ranks, counted from 1."""
    listed = ", ".join(map(str, sorted(ranks)))
    rows = table.rows(
        f"SELECT place, {figure} FROM (SELECT {figure}, row_number() OVER (ORDER BY {figure}) AS place "
        f"FROM {source} WHERE {where}) WHERE place IN ({listed})",
        *before,
        *values,
    )
    return dict(rows)
