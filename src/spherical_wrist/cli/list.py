"""``wrist list``: names and parameters of everything that an experiment is made of; metrics and warnings."""

from __future__ import annotations

from inspect import cleandoc
from typing import TYPE_CHECKING, Any, get_args

from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.options import Json
from spherical_wrist.cli.tables import print_json, printer

if TYPE_CHECKING:
    from pydantic import BaseModel

    from spherical_wrist.measure.metrics import Metric

UNCOUNTABLE = ("sensing", "actuation")


def command(json: Json = False) -> None:
    """Everything listed can be set with --set NAME=VALUE, in an experiment file, or in Python."""
    from spherical_wrist.experiment.description import PARTS, Experiment
    from spherical_wrist.measure.metrics import METRICS
    from spherical_wrist.measure.warnings import CHECKS

    titles = {part: family_title(part) for part in PARTS}
    families = {
        titles[part]: {name: _describe(member) for name, member in family.members.items()}
        for part, family in PARTS.items()
    }
    if json:
        metrics = {name: _describe_metric(metric) for name, metric in METRICS.items()}
        warnings = {name: check._asdict() for name, check in CHECKS.items()}
        print_json({**families, "experiment": _describe(Experiment), "metrics": metrics, "warnings": warnings})
        return
    console = printer()
    for part, title in titles.items():
        console.rule(Text(title.capitalize(), "bold"), align="left")
        for name, member in families[title].items():
            console.print(Text.assemble((name, "bold green"), f"  {member['summary']}"))
            console.print(_table(f"{part}.", member["parameters"]))
            console.print()
    console.rule(Text("Experiment", "bold"), align="left")
    console.print("Keys of an experiment file; all of them, and those above, also as --set NAME=VALUE.")
    console.print(_table("", _describe(Experiment)["parameters"]))
    console.print()
    console.rule(Text("Metrics", "bold"), align="left")
    console.print("Figures of merit of a run, by their names in JSON, campaigns and bounds.")
    console.print(_metrics_table())
    console.print()
    console.rule(Text("Warnings", "bold"), align="left")
    console.print("What makes the figures of a run doubtful; runs that are right have none.")
    console.print(_warnings_table())


def family_title(part: str) -> str:
    """Return the key of a part's family in JSON, and its heading."""
    return part if part in UNCOUNTABLE else f"{part}s"


def _describe(model: type[BaseModel]) -> dict[str, Any]:
    """Return the summary of a model and, for each parameter, default, unit, meaning and, if there are some, choices."""
    return {
        "summary": cleandoc(model.__doc__ or "").split("\n\n")[0].replace("\n", " "),
        "parameters": {name: _parameter(model, name) for name in model.model_fields},
    }


def _describe_metric(metric: Metric) -> dict[str, Any]:
    """Return what the registry says of a metric to its readers."""
    return {
        "label": metric.label,
        "unit": metric.unit,
        "meaning": metric.meaning,
        "runs": metric.needs.runs,
        "less_is_better": metric.less_is_better,
    }


def _metrics_table() -> Table:
    from spherical_wrist.measure.metrics import EVERY_RUN, METRICS

    table = _columns()
    for name, metric in METRICS.items():
        runs = "" if metric.needs is EVERY_RUN else f" ({metric.needs.runs})"
        table.add_row(f"  {name}", metric.label, metric.unit, metric.meaning + runs)
    return table


def _warnings_table() -> Table:
    from spherical_wrist.measure.metrics import METRICS
    from spherical_wrist.measure.warnings import CHECKS

    table = _columns()
    for name, check in CHECKS.items():
        metric = METRICS[check.metric]
        limit = f"{metric.label} > {metric.shown_value(check.limit):g}"
        table.add_row(f"  {name}", limit, metric.shown_unit, check.meaning)
    return table


def _parameter(model: type[BaseModel], name: str) -> dict[str, Any]:
    from pydantic_core import PydanticUndefined, to_jsonable_python

    from spherical_wrist.parameters import unit_of

    field = model.model_fields[name]
    choices = [choice for choice in get_args(field.annotation) if isinstance(choice, str)]
    return {
        "default": None if field.default is PydanticUndefined else to_jsonable_python(field.default),
        "unit": unit_of(model, name),
        "meaning": field.description or "",
        **({"choices": choices} if choices else {}),
    }


def _table(prefix: str, parameters: dict[str, Any]) -> Table:
    table = _columns()
    for name, info in parameters.items():
        meaning = f"{info['meaning']}: {', '.join(info['choices'])}" if "choices" in info else info["meaning"]
        table.add_row(f"  {prefix}{name}", _text(info["default"]), info["unit"], meaning)
    return table


def _columns() -> Table:
    table = Table(show_header=False, box=None, padding=(0, 1), pad_edge=False)
    table.add_column(min_width=24)
    table.add_column(style="cyan", max_width=31)
    table.add_column(style="dim")
    table.add_column(ratio=1)
    return table


def _text(value: Any) -> str:
    """Write a default with at most six digits."""
    if isinstance(value, list):
        nested = any(isinstance(entry, list) for entry in value)
        return "[" + (",\n " if nested else ", ").join(map(_text, value)) + "]"
    if value is None:
        return "—"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
