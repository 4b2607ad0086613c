"""``wrist list``: every law, reference and disturbance, and the experiment's own parameters."""

from inspect import cleandoc
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined, to_jsonable_python
from rich.console import Console
from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.output import print_json
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.parameters import Member, unit_of
from spherical_wrist.reference import Reference

FAMILIES: dict[str, type[Member]] = {"laws": Law, "references": Reference, "disturbances": Disturbance}


def list_parameters(as_json: bool) -> None:
    """Prints all names that an experiment can use, with their parameters, units, defaults and meanings."""
    everything = {
        title: {name: describe(m) for name, m in family.members.items()} for title, family in FAMILIES.items()
    }
    if as_json:
        print_json({**everything, "experiment": describe(Experiment)})
        return
    console = Console(highlight=False)
    for title, members in everything.items():
        for name, member in members.items():
            console.print(Text.assemble((f"{FAMILIES[title].kind} ", "dim"), (name, "bold"), f"  {member['summary']}"))
            console.print(_table(f"{FAMILIES[title].kind}.", member["parameters"]))
    console.print(Text.assemble(("experiment", "bold"), "  Keys of an experiment file; each also as --set name=value."))
    console.print(_table("", describe(Experiment)["parameters"]))


def describe(model: type[BaseModel]) -> dict[str, Any]:
    """A model's summary, and for each parameter its default, unit and meaning."""
    return {
        "summary": cleandoc(model.__doc__ or "").split("\n\n")[0].replace("\n", " "),
        "parameters": {
            name: {
                "default": None if field.default is PydanticUndefined else to_jsonable_python(field.default),
                "unit": unit_of(model, name),
                "meaning": field.description or "",
            }
            for name, field in model.model_fields.items()
        },
    }


def _table(prefix: str, parameters: dict[str, Any]) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 2))
    for name, info in parameters.items():
        table.add_row(f"  {prefix}{name}", Text(_default(info["default"]), style="cyan"), info["unit"], info["meaning"])
    return table


def _default(value: Any) -> str:
    if value is None:
        return "—"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[" + " ".join(str(row) for row in value).replace(" ", "").replace("][", "] [") + "]"
    return str(value)
