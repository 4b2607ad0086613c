"""``wrist ablate``: figures of a law with each of its parts switched off."""

from __future__ import annotations

from typing import Annotated, Any

from rich.text import Text
from typer import Argument

from spherical_wrist.cli.options import (
    CONDITIONS,
    Changes,
    Folder,
    Hardware,
    Jobs,
    Json,
    Plots,
    Settings,
    Tables,
    Width,
    read_experiment,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.results import ResultFiles, result_files, write_results
from spherical_wrist.cli.tables import Entry, fitted, print_json, printer, short


@with_parameters(*CONDITIONS)
def command(
    *,
    law: Annotated[str, Argument(metavar="LAW", help="a law with parts, with parameters: 'NAME PARAMETER=VALUE'")],
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Folder = None,
    plot: Plots = None,
    table: Tables = None,
    width: Width = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Switch off each part of a law in turn, and compare the law without it.

    The parts are those that the law declares, with the parameters that switch them off. Figures are of the default
    experiment, or of the one that the options describe: precision and chattering on realistic hardware, precision under
    slow, square and worst torques, and the delay that nobody knows of with which the loop stays calm.

    With -o: ablation.json, .png, .svg, .pdf, .tex and .md.

    Exit code: 0 computed, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.comparison.ablation import ablation
    from spherical_wrist.comparison.ablation_picture import ablation_picture
    from spherical_wrist.comparison.ablation_table import ablation_table, to_dict
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.description import with_changes
    from spherical_wrist.files import make_folder

    tables, every = read_experiment(None, hardware, changes, set_)
    files = result_files(output, plot, table, width)
    ((label, whole),) = laws_from_texts([law], tables, every).items()
    base = with_changes(tables, {name: value for name, value in every.items() if not name.startswith("law.")})
    if output is not None:
        make_folder(output)
    with counting("running") as progress:
        found = to_dict(label, whole, ablation(whole, base, jobs=jobs, progress=progress))
    write_results(files, "ablation", found, lambda width: ablation_picture(found, width), lambda: ablation_table(found))
    if json:
        print_json(found)
    else:
        _print(found, files)


def _print(table: dict[str, Any], files: ResultFiles) -> None:
    from spherical_wrist.comparison.ablation import FIGURES
    from spherical_wrist.comparison.ablation_table import MEANING

    console = printer()
    headings = ["without", *(f"{figure.label}\n[{figure.unit}]" for figure in FIGURES)]
    whole = next(row for row in table["rows"] if row["part"] is None)
    rows: list[list[Entry]] = []
    for row in table["rows"]:
        entries: list[Entry] = [Text(row["part"] or "(nothing)")]
        for figure in FIGURES:
            value = row[figure.name]
            style = _style(value, whole[figure.name], figure.more)
            entries.append(Text("lost" if value is None else short(value), style))
        rows.append(entries)
    console.print(fitted(table["law"], headings, rows, console.width))
    console.print(Text(MEANING, "dim"))
    console.print(Text("red: at least a quarter worse than the whole law. green: as much better.", "dim"))
    files.say(", ".join(table["files"]))


def _style(value: Any, whole: Any, more: bool) -> str:
    if value is None or whole is None:
        return "red" if value is None else ""
    worse = (whole + 1e-12) / (value + 1e-12) if more else (value + 1e-12) / (whole + 1e-12)
    return "red" if worse >= 1.25 else "green" if worse <= 0.8 else ""
