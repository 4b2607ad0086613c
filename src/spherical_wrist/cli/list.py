"""``wrist list``: every law, reference, disturbance, kind of sensors and of motors, and the experiment's parameters."""

from inspect import cleandoc
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import PydanticUndefined, to_jsonable_python
from rich.table import Table
from rich.text import Text

from spherical_wrist.actuation import Actuation
from spherical_wrist.cli.output import print_json, printer
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.parameters import Member, unit_of
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing

FAMILIES: dict[str, type[Member]] = {
    "laws": Law,
    "references": Reference,
    "disturbances": Disturbance,
    "sensing": Sensing,
    "actuation": Actuation,
}


def list_parameters(as_json: bool) -> None:
    """Prints all names that an experiment can use, with their parameters, units, defaults and meanings."""
    families = {title: {name: describe(m) for name, m in family.members.items()} for title, family in FAMILIES.items()}
    if as_json:
        print_json({**families, "experiment": describe(Experiment)})
        return
    console = printer()
    for title, members in families.items():
        kind = FAMILIES[title].kind
        console.rule(Text(title.capitalize(), "bold"), align="left")
        for name, member in members.items():
            console.print(Text.assemble((name, "bold green"), f"  {member['summary']}"))
            console.print(_table(f"{kind}.", member["parameters"]))
            console.print()
    console.rule(Text("Experiment", "bold"), align="left")
    console.print("Keys of an experiment file; all of them, and those above, also as --set NAME=VALUE.")
    console.print(_table("", describe(Experiment)["parameters"]))


def describe(model: type[BaseModel]) -> dict[str, Any]:
    """A model's summary, and for each parameter its default, unit, meaning and, where it has a few, its choices."""
    return {
        "summary": cleandoc(model.__doc__ or "").split("\n\n")[0].replace("\n", " "),
        "parameters": {name: _parameter(model, name) for name in model.model_fields},
    }


def _parameter(model: type[BaseModel], name: str) -> dict[str, Any]:
    field = model.model_fields[name]
    choices = [choice for choice in get_args(field.annotation) if isinstance(choice, str)]
    return {
        "default": None if field.default is PydanticUndefined else to_jsonable_python(field.default),
        "unit": unit_of(model, name),
        "meaning": field.description or "",
        **({"choices": choices} if choices else {}),
    }


def _table(prefix: str, parameters: dict[str, Any]) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 1), pad_edge=False)
    table.add_column(min_width=24)
    table.add_column(style="cyan", max_width=31)
    table.add_column(style="dim")
    table.add_column(ratio=1)
    for name, info in parameters.items():
        meaning = f"{info['meaning']}: {', '.join(info['choices'])}" if "choices" in info else info["meaning"]
        table.add_row(f"  {prefix}{name}", _text(info["default"]), info["unit"], meaning)
    return table


def _text(value: Any) -> str:
    """A default as one would write it, with at most six digits."""
    if isinstance(value, list):
        nested = any(isinstance(entry, list) for entry in value)
        return "[" + (",\n " if nested else ", ").join(map(_text, value)) + "]"
    if value is None:
        return "—"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
