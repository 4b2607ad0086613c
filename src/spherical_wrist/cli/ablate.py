"""``wrist ablate``: figures of a law with each of its parts switched off."""

from __future__ import annotations

from typing import Annotated, Any

from rich.text import Text
from typer import Argument

from spherical_wrist.cli.options import (
    CONDITIONS,
    Changes,
    Hardware,
    Jobs,
    Json,
    Settings,
    read_experiment,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, print_json, printer, short


@with_parameters(*CONDITIONS)
def command(
    *,
    law: Annotated[str, Argument(metavar="LAW", help="a law with parts, with parameters: 'NAME PARAMETER=VALUE'")],
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Switch off each part of a law in turn, and compute what it was worth.

    The parts are those that the law declares, with the parameters that switch them off. Figures are of the default
    experiment, or of the one that the options describe: precision and chattering on realistic hardware, precision under
    slow, square and worst torques, and the delay that nobody knows of with which the loop stays calm.

    Exit code: 0 computed, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.comparison.ablation import FIGURES, WHOLE, ablation
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.description import with_changes

    tables, every = read_experiment(None, hardware, changes, set_)
    (whole,) = laws_from_texts([law], tables, every).values()
    base = with_changes(tables, {name: value for name, value in every.items() if not name.startswith("law.")})
    with counting("running") as progress:
        found = ablation(whole, base, jobs=jobs, progress=progress)
    if json:
        rows_of = [{"part": None if part == WHOLE else part, **figures} for part, figures in found.items()]
        print_json({"law": law, "parameters": {p: dict(c) for p, c in whole.ablations.items()}, "rows": rows_of})
        return
    console = printer()
    headings = ["without", *(f"{figure.label}\n[{figure.unit}]" for figure in FIGURES)]
    rows: list[list[Entry]] = []
    for part, figures in found.items():
        entries: list[Entry] = [Text("(nothing)" if part == WHOLE else part)]
        for figure in FIGURES:
            value, best = figures[figure.name], found[WHOLE][figure.name]
            entries.append(Text("lost" if value is None else short(value), _style(value, best, figure.more)))
        rows.append(entries)
    console.print(fitted(law, headings, rows, console.width))
    meanings = "tip and chatter: realistic hardware; slow, worst, square: torques of 25 %; delay: unknown, at mass m."
    console.print(Text(meanings, "dim"))
    console.print(Text("red: at least a quarter worse than the whole law. green: as much better.", "dim"))


def _style(value: Any, whole: Any, more: bool) -> str:
    if value is None or whole is None:
        return "red" if value is None else ""
    worse = (whole + 1e-12) / (value + 1e-12) if more else (value + 1e-12) / (whole + 1e-12)
    return "red" if worse >= 1.25 else "green" if worse <= 0.8 else ""
