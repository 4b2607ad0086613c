"""``wrist compare``: laws × cases, ranked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf
from pathlib import Path
from typing import Annotated, Any

from rich.table import Table
from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import (
    CaseFile,
    CaseNames,
    Changes,
    ExperimentFile,
    Folder,
    Jobs,
    Json,
    Laws,
    Settings,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, json_bytes, number, print_json, printer, short, written_to

FEW = 40
"""Number of cells up to which every figure is printed without --full."""
WIDE = 118
ABOUT = (
    "score: geometric mean over the cases of the RMS error as a multiple of the best law's; ideal, non-ideal: geometric"
    " mean of the RMS error over the cases with that hardware; chattering: the same over the last of these, as a "
    "multiple of plain computed torque"
)


@with_parameters("duration", "seed")
def command(
    *,
    experiment: ExperimentFile = None,
    law: Laws = None,
    case: CaseNames = None,
    cases: CaseFile = None,
    set_: Settings = None,
    changes: Changes,
    output: Folder = None,
    record: Annotated[
        list[str] | None,
        Option(metavar="LAW:CASE", help="record this run to DIR, or those that match 'pd:*', or all; may be repeated"),
    ] = None,
    full: Annotated[bool, Option("--full", help="print every figure of every law on every case")] = False,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """The suite: disturbances and wrong masses with ideal hardware, then every fault of sensors and motors, then all.

    A case of your own is a table of a FILE.toml with a name and any parameters: [[case]] name = "late",
    sensing.delay = 0.002.

    The score of a law is the geometric mean, over the cases, of its RMS error as a multiple of the best law's. With
    -o: comparison.json, .csv, .md, and a picture of error against chattering as .png and .svg.

    Exit code: 0 compared (runs may be lost), 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
    from spherical_wrist.comparison.compare import compare
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.comparison.report import to_dict
    from spherical_wrist.experiment.command import read_settings
    from spherical_wrist.experiment.description import read_toml

    tables = read_toml(experiment) if experiment else {}
    every = {**changes, **read_settings(set_ or [])}
    laws = laws_from_texts(law or [], tables, every)
    chosen = select(read_cases(cases) if cases else DEFAULT, case or [])
    with counting("comparing") as progress:
        results = compare(laws, chosen, tables, every, record=record or [], folder=output, jobs=jobs, progress=progress)
    table = to_dict(results, str(cases or "default"))
    if output is not None:
        _write(table, output)
    if json:
        print_json(table)
    else:
        print_comparison(table, full=full, folder=output)
    warn(table["warnings"])


def _write(table: dict[str, Any], folder: Path) -> None:
    from spherical_wrist.comparison.picture import pareto_picture
    from spherical_wrist.comparison.report import as_csv, as_markdown
    from spherical_wrist.files import write_together
    from spherical_wrist.picture_file import folder_pictures

    contents = folder_pictures(pareto_picture(table), "comparison")
    contents["comparison.csv"] = as_csv(table).encode()
    contents["comparison.md"] = as_markdown(table, number).encode()
    table["files"] = sorted([*contents, "comparison.json"])
    contents["comparison.json"] = json_bytes(table)
    write_together({folder / name: content for name, content in contents.items()})


def print_comparison(table: dict[str, Any], *, full: bool, folder: Path | None) -> None:
    """Print the ranking, then the errors or every figure of the cells, and the runs that were lost.

    Args:
        table: comparison as :func:`spherical_wrist.comparison.report.to_dict` returns it.
        full: print every figure.
        folder: folder that files were written to, if any.
    """
    console = printer()
    console.print(_standings(table, console.width))
    console.print(Text(ABOUT, "dim"))
    every = full or len(table["cells"]) <= FEW
    for block in (_figures if every else _matrix)(table, console.width):
        console.print()
        console.print(block)
    console.print()
    for cell in table["cells"]:
        if cell["outcome"] != "completed":
            where = f"{cell['law']} on {cell['case']} {cell['outcome']} at {cell['ended_at_s']:.6g} s: {cell['reason']}"
            console.print(Text(where, "red"), soft_wrap=True)
    if folder is None:
        console.print(Text("every figure: --full; files and the picture: -o DIR; commands that replay: --json", "dim"))
    else:
        recorded = sum(cell["recording"] is not None for cell in table["cells"])
        more = f" and {recorded} recordings" if recorded else ""
        console.print(written_to(folder, ", ".join(table["files"]) + more), soft_wrap=True)


def _standings(table: dict[str, Any], width: int) -> Table:
    from spherical_wrist.comparison.report import CHATTERING, ERROR
    from spherical_wrist.measure.metrics import METRICS

    groups = list(table["laws"][0]["groups"])
    failures = any(row["lost"] for row in table["laws"])
    headings = ["#", "law", "score", "best\non", *(["lost"] if failures else [])]
    headings += [*(f"{_first(group)}\n[{METRICS[ERROR].unit}]" for group in groups), "chat-\ntering"]
    rows: list[list[Entry]] = []
    for row in table["laws"]:
        figures = [row["groups"][group] for group in groups]
        entries: list[Entry] = [str(row["rank"]), Text(row["law"], "bold"), short(row["score"]), str(row["wins"])]
        if failures:
            entries.append(Text(str(len(row["lost"])), "red" if row["lost"] else ""))
        entries += [_mean(entry[ERROR], "{:.1e}") for entry in figures]
        rows.append([*entries, _mean(figures[-1][CHATTERING], "×{:.3g}")])
    return fitted(f"{len(rows)} laws × {len(table['cases'])} cases", headings, rows, width, names=1)


def _first(text: str) -> str:
    return text.partition(" ")[0]


def _mean(spread: Mapping[str, float] | None, form: str) -> str:
    return "—" if spread is None else form.format(spread["mean"])


def _matrix(table: dict[str, Any], width: int) -> Iterator[Table]:
    """Yield tables of RMS errors, cases × laws, each with as many laws as fit the terminal."""
    from spherical_wrist.comparison.report import ERROR
    from spherical_wrist.measure.metrics import METRICS

    names = [case["case"] for case in table["cases"]]
    cells = {(cell["law"], cell["case"]): cell for cell in table["cells"]}
    room = max(1, (width - max(map(len, names)) - 1) // len("1.2e-03 "))
    for first in range(0, len(table["laws"]), room):
        laws = table["laws"][first : first + room]
        rows = [[case, *(_error(cells[law["law"], case]) for law in laws)] for case in names]
        title = f"{METRICS[ERROR].heading_and_unit} of the laws above, by rank" if not first else ""
        yield fitted(title, ["case", *(f"#{law['rank']}" for law in laws)], rows, width)


def _error(cell: Mapping[str, Any]) -> Text:
    from spherical_wrist.comparison.report import ERROR

    if cell["outcome"] != "completed":
        return Text({"diverged": "div.", "failed": "fail"}.get(cell["outcome"], cell["outcome"]), "red")
    return Text(f"{cell['metrics'][ERROR]:.1e}", "bold green" if cell["rank"] == 1 else "")


def _figures(table: dict[str, Any], width: int) -> Iterator[Table]:
    """Yield a table for each case, best law first, with every figure that fits the terminal."""
    from spherical_wrist.comparison.report import FIGURES, NARROW, figure, heading

    wanted = FIGURES if width >= WIDE else NARROW
    first, *others = wanted
    keys = [first, *(key for key in others if any(figure(cell, key) is not None for cell in table["cells"]))]
    for case in table["cases"]:
        cells = [cell for cell in table["cells"] if cell["case"] == case["case"]]
        rows: list[list[Entry]] = []
        for cell in sorted(cells, key=lambda cell: cell["rank"] or inf):
            entries: list[Entry] = [cell["law"], *(short(figure(cell, key)) for key in keys)]
            if cell["outcome"] != "completed":
                entries[1] = Text(cell["outcome"], "red")
            rows.append(entries)
        headings = ["law", *(heading(key).replace(" [", "\n[") for key in keys)]
        title = f"{case['case']}: {case['meaning']}" if case["meaning"] else case["case"]
        yield fitted(title, headings, rows, width)
