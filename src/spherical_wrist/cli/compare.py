"""``wrist compare``: laws × cases, ranked."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.output import number, print_json, printer
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, short
from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
from spherical_wrist.comparison.compare import compare
from spherical_wrist.comparison.contestants import contestants
from spherical_wrist.comparison.report import FIGURES, as_csv, as_markdown, figure, told
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import read_toml
from spherical_wrist.files import write_together

FEW = 40
"""Number of cells up to which all of their figures are printed without being asked for."""
NARROW = ("rms_error_rad", "max_tip_error_mm", "chattering_ratio", "peak_torque_Nm")
"""Figures that fit beside the name of a law in 80 columns."""
WIDE = 118
ABOUT = (
    "score: geometric mean over the cases of the RMS error as a multiple of the best law's; ideal, non-ideal: geometric"
    " mean of the RMS error over the cases with that hardware; chattering: the same over the last of these, as a "
    "multiple of plain computed torque"
)


class CompareOptions(NamedTuple):
    """What to compare and where to; see ``wrist compare --help``."""

    laws: list[str]
    cases: list[str]
    suite: Path | None
    folder: Path | None
    record: list[str]
    full: bool
    jobs: int | None
    json: bool


def compare_laws(file: Path | None, changes: Mapping[str, Any], settings: list[str], options: CompareOptions) -> None:
    """Compares, prints and writes.

    Args:
        file: experiment file, if any.
        changes: values by dotted name that take the place of those in the file and of the cases.
        settings: ``name=value`` texts that take the place of all.
        options: the rest.

    Raises:
        WristError: wrong input, or a file that cannot be written.
    """
    tables = read_toml(file) if file else {}
    every = {**changes, **read_settings(settings)}
    laws = contestants(options.laws, tables, every)
    cases = select(read_cases(options.suite) if options.suite else DEFAULT, options.cases)
    with counting("comparing") as progress:
        found = compare(
            laws, cases, tables, every, record=options.record, folder=options.folder, jobs=options.jobs,
            progress=progress,
        )  # fmt: skip
    table = told(found, str(options.suite or "default"))
    if options.folder is not None:
        _write(table, options.folder)
    if options.json:
        print_json(table)
    else:
        print_comparison(table, options)


def _write(table: dict[str, Any], folder: Path) -> None:
    from spherical_wrist.comparison.picture import as_files, pareto_picture

    contents = as_files(pareto_picture(table), "comparison")
    contents["comparison.csv"] = as_csv(table).encode()
    contents["comparison.md"] = as_markdown(table, number).encode()
    table["files"] = sorted([*contents, "comparison.json"])
    contents["comparison.json"] = (json.dumps(table, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
    write_together({folder / name: content for name, content in contents.items()})


def print_comparison(table: dict[str, Any], options: CompareOptions) -> None:
    """Prints the standings, then the errors or every figure of the cells, and what diverged.

    Args:
        table: what :func:`spherical_wrist.comparison.report.told` returns.
        options: whether all figures are wanted, and where files were written.
    """
    console = printer()
    console.print(_standings(table, console.width))
    console.print(Text(ABOUT, "dim"))
    if options.full or len(table["cells"]) <= FEW:
        blocks = _figures(table, console.width)
    else:
        blocks = _matrix(table, console.width)
    for block in blocks:
        console.print()
        console.print(block)
    console.print()
    for cell in table["cells"]:
        if cell["outcome"] != "completed":
            where = f"{cell['law']} on {cell['case']} {cell['outcome']} at {cell['ended_at_s']:.6g} s: {cell['reason']}"
            console.print(Text(where, "red"), soft_wrap=True)
    if options.folder is None:
        console.print(Text("every figure: --full; files and the picture: -o DIR; commands that replay: --json", "dim"))
    else:
        recorded = sum(cell["recording"] is not None for cell in table["cells"])
        more = f" and {recorded} recordings" if recorded else ""
        names = ", ".join(table["files"])
        console.print(Text.assemble("written to ", (str(options.folder), "bold"), f": {names}{more}"), soft_wrap=True)


def _standings(table: dict[str, Any], width: int) -> Table:
    groups = list(table["laws"][0]["groups"])
    failures = any(row["diverged"] for row in table["laws"])
    headings = ["#", "law", "score", "best\non", *(["div."] if failures else [])]
    headings += [*(f"{_first(group)}\n[rad]" for group in groups), "chat-\ntering"]
    rows: list[list[Entry]] = []
    for row in table["laws"]:
        figures = [row["groups"][group] for group in groups]
        entries: list[Entry] = [str(row["rank"]), Text(row["law"], "bold"), short(row["score"]), str(row["wins"])]
        if failures:
            entries.append(Text(str(len(row["diverged"])), "red" if row["diverged"] else ""))
        entries += [_mean(entry["rms_error_rad"], "{:.1e}") for entry in figures]
        rows.append([*entries, _mean(figures[-1]["chattering_ratio"], "×{:.3g}")])
    return fitted(f"{len(rows)} laws × {len(table['cases'])} cases", headings, rows, width, names=1)


def _first(text: str) -> str:
    return text.partition(" ")[0]


def _mean(spread: Mapping[str, float] | None, form: str) -> str:
    return "—" if spread is None else form.format(spread["mean"])


def _matrix(table: dict[str, Any], width: int) -> Iterator[Table]:
    """RMS errors, cases by laws, in blocks of as many laws as there is room for."""
    names = [case["case"] for case in table["cases"]]
    cells = {(cell["law"], cell["case"]): cell for cell in table["cells"]}
    room = max(1, (width - max(map(len, names)) - 1) // len("1.2e-03 "))
    for first in range(0, len(table["laws"]), room):
        laws = table["laws"][first : first + room]
        rows = [[case, *(_error(cells[law["law"], case]) for law in laws)] for case in names]
        title = "RMS error [rad] of the laws above, by rank" if not first else ""
        yield fitted(title, ["case", *(f"#{law['rank']}" for law in laws)], rows, width)


def _error(cell: Mapping[str, Any]) -> Text:
    if cell["outcome"] != "completed":
        return Text("div.", "red")
    return Text(f"{cell['metrics']['rms_error_rad']:.1e}", "bold green" if cell["rank"] == 1 else "")


def _figures(table: dict[str, Any], width: int) -> Iterator[Table]:
    """Every figure that there is room for, case by case, best law first."""
    wanted = FIGURES if width >= WIDE else NARROW
    first, *others = wanted
    keys = [first, *(key for key in others if any(figure(cell, key) is not None for cell in table["cells"]))]
    for case in table["cases"]:
        cells = [cell for cell in table["cells"] if cell["case"] == case["case"]]
        rows: list[list[Entry]] = []
        for cell in sorted(cells, key=lambda cell: cell["rank"]):
            entries: list[Entry] = [cell["law"], *(short(figure(cell, key)) for key in keys)]
            if cell["outcome"] != "completed":
                entries[1] = Text(cell["outcome"], "red")
            rows.append(entries)
        headings = ["law", *(FIGURES[key].replace(" [", "\n[") for key in keys)]
        title = f"{case['case']}: {case['meaning']}" if case["meaning"] else case["case"]
        yield fitted(title, headings, rows, width)
