"""All that a report says, as plain tables: the page and ``--json`` have the same figures.

The JSON object has these keys, which stay as they are; an infinite error (of a run that did not complete), and an end
of an interval that is open, are null:

================  ===================================================================================================
``campaign``      ``folder``, ``digest``, ``design``, ``seed``, ``samples``, ``episodes`` (in all), ``stored``,
                  ``complete``, ``resume`` (the command that goes on), ``laws`` (by label: ``name`` and
                  ``parameters``), ``varied`` (by name: as in the file), ``units`` (of each varied parameter),
                  ``experiment`` (what every episode starts from), ``file`` (the campaign file as it was given)
``versions``      of the packages and the platform that the episodes come from
``odd``           files in the folder that were not trusted, and why
``warnings``      what makes the figures of episodes that completed doubtful: how many of them, and the worst
``intervals``     whether intervals are given: not of a grid, whose points are no draws
``confidence``    of the intervals
``bound_mm``      the bound on the tip error
``laws``          by label: ``episodes``, ``completed``, ``diverged``, ``failed``, ``invalid``, ``unmeasured``,
                  ``measured``; ``rates`` (``diverged``, ``failed``, ``exceeding``, ``invalid``: ``count``, ``of``,
                  ``share``, ``low``, ``high``); ``quantiles`` (by metric: ``median``, ``90 %``, ``99 %`` with
                  ``value``, ``low``, ``high``; ``worst`` with ``value`` and ``above``, the share of all that may be
                  worse)
``pairs``         ``law``, ``other``, ``samples``, ``wins``, ``draws``, ``share`` (of wins) and ``ratio`` (median of the
                  errors' ratios), both with ``value``, ``low``, ``high``
``sensitivity``   by label of the law, one entry a parameter: ``parameter``, ``sobol`` (``value``, ``low``, ``high``),
                  ``spearman`` (``value``, ``low``, ``high``, ``p``), ``episodes``
``worst``         ``overall`` and ``laws`` (by label): ``id``, ``law``, ``sample``, ``outcome``, ``ended_at_s``,
                  ``reason``, ``error``, ``tip``, ``chattering``, ``parameters``, ``command`` (which replays it)
================  ===================================================================================================
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from spherical_wrist.campaign.folder import GIVEN, Folder
from spherical_wrist.campaign.store import Column, columns, python_warning
from spherical_wrist.errors import ParameterError
from spherical_wrist.measure.warnings import summarized_table
from spherical_wrist.parameters import Parameters, unit_of
from spherical_wrist.report.intervals import CONFIDENCE
from spherical_wrist.report.questions import against, bands, counts, curve, quantiles, worst
from spherical_wrist.report.sensitivity import Sensitivity, sensitivity
from spherical_wrist.report.table import FIGURES, Table, table_of

DIGITS = 9
"""Of figures from sums, whose last digits depend on the order of adding up."""


class Curves(NamedTuple):
    """Data of the pictures that the summary does not have.

    Attributes:
        distributions: of each figure, by law: values and the shares of episodes up to them.
        bands: of each parameter, by law: quantiles of the error in bins.
        parameters: the varied parameters.
        statuses: status of each law (:data:`~spherical_wrist.control.contract.LawStatus`), by label.
    """

    distributions: Mapping[str, Mapping[str, list[tuple[float, float]]]]
    bands: Mapping[str, Mapping[str, list[dict[str, Any]]]]
    parameters: tuple[Column, ...]
    statuses: Mapping[str, str]


def findings(
    folder: Folder, bound: float, warn: Callable[[str], None] = python_warning
) -> tuple[dict[str, Any], Curves]:
    """Return the results of a campaign, as the object that is described above, and curves to draw.

    Args:
        folder: the campaign's folder; it need not be complete.
        bound: on the tip error [mm].
        warn: called with a line about each file that is not trusted or not sealed.

    Raises:
        CampaignError: nothing is stored yet, or it cannot be read.
        ParameterError: the bound is not positive.
    """
    if not 0.0 < bound < float("inf"):
        raise ParameterError(f"--bound {bound:g} [mm]: must be greater than 0")
    grid = folder.campaign.design == "grid"
    with table_of(folder, warn) as table:
        laws = {law: counts(table, law, bound, intervals=not grid) for law in table.laws}
        for law, row in laws.items():
            row["quantiles"] = {
                metric: quantiles(table, law, figure, intervals=not grid) for figure, metric in FIGURES.items()
            }
        found = {
            "campaign": _campaign(folder, sum(row["episodes"] for row in laws.values())),
            "versions": dict(folder.versions),
            "odd": list(table.odd),
            "warnings": list(summarized_table(table.named)),
            "intervals": not grid,
            "confidence": CONFIDENCE,
            "bound_mm": bound,
            "laws": laws,
            "pairs": [
                against(table, law, other, intervals=not grid)
                for law in table.laws
                for other in table.laws
                if law != other
            ],
            "sensitivity": {
                law: [_plain(sensitivity(table, law, column, folder.campaign.design)) for column in table.parameters]
                for law in table.laws
            },
            "worst": {
                "overall": _replayed(folder, worst(table)),
                "laws": {law: _replayed(folder, worst(table, law)) for law in table.laws},
            },
        }
        return found, _curves(table, {law: base.law.status for law, base in folder.campaign.bases.items()})


def _curves(table: Table, statuses: Mapping[str, str]) -> Curves:
    return Curves(
        {metric: {law: curve(table, law, name) for law in table.laws} for name, metric in FIGURES.items()},
        {column.name: {law: bands(table, law, column) for law in table.laws} for column in table.parameters},
        table.parameters,
        statuses,
    )


def _campaign(folder: Folder, stored: int) -> dict[str, Any]:
    campaign = folder.campaign
    dumps = {label: base.law.model_dump(mode="json") for label, base in campaign.bases.items()}
    given = folder.path / GIVEN
    return {
        "folder": str(folder.path),
        "digest": folder.digest,
        "design": campaign.design,
        "seed": campaign.seed,
        "samples": campaign.sample_count,
        "episodes": campaign.size,
        "stored": stored,
        "complete": stored == campaign.size,
        "resume": folder.command("--resume"),
        "laws": {
            label: {"name": dump["name"], "parameters": {key: value for key, value in dump.items() if key != "name"}}
            for label, dump in dumps.items()
        },
        "varied": dict(campaign.vary),
        "units": {column.name: _unit(next(iter(campaign.bases.values())), column.name) for column in columns(campaign)},
        "experiment": dict(campaign.experiment),
        "file": given.read_text(encoding="utf-8", errors="replace") if given.is_file() else "",
    }


def _unit(owner: Any, dotted: str) -> str:
    """The unit of a parameter by its dotted name, which may end in that of an axis."""
    name, _, rest = dotted.partition(".")
    if name not in type(owner).model_fields:
        return ""  # of a part that other samples have
    part = getattr(owner, name)
    return _unit(part, rest) if rest and isinstance(part, Parameters) else unit_of(type(owner), name)


def _plain(found: Sensitivity) -> dict[str, Any]:
    spearman = None if found.spearman is None else {k: _short(v) for k, v in found.spearman._asdict().items()}
    sobol = {name: _short(value) for name, value in found.sobol._asdict().items()}
    return {"parameter": found.parameter, "sobol": sobol, "spearman": spearman, "episodes": found.episodes}


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{DIGITS}g}")


def _replayed(folder: Folder, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """With the command that runs each again, alone, and records it."""
    for row in rows:
        row["command"] = folder.command("--replay", str(row["id"]), "-o", f"episode-{row['id']}.rrd")
    return rows
