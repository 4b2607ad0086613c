"""``wrist paper``: evaluation of the source paper, with verdicts on its claims."""

from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

from rich.console import Group
from rich.padding import Padding
from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import Json
from spherical_wrist.cli.tables import fitted, print_json, printer, short

COLOURS = {"reproduced": "green", "reproduced under a condition": "yellow", "not reproduced": "red"}


def command(
    output: Annotated[Path, Option("--output", "-o", metavar="DIR", help="folder to write")] = Path("paper"),
    json: Json = False,
) -> None:
    """Files in DIR: report.md, both figures as PNG, SVG and PDF, and the recordings behind them."""
    from spherical_wrist.paper.evaluation.report import regenerate

    report = regenerate(output)
    if json:
        print_json(report)
        return
    console = printer()
    console.print(_table(report["table"], console.width))
    for claim in report["claims"]:
        console.print()
        console.print(
            Text.assemble(
                (claim["verdict"], COLOURS[claim["verdict"]]), f": {claim['claim']} ", (f"({claim['source']})", "dim")
            )
        )
        for word, holds in (("holds", True), ("fails", False)):
            if conditions := [trial["condition"] for trial in claim["trials"] if trial["holds"] is holds]:
                words = Text(f"{word}: {'; '.join(conditions)}", "dim")
                console.print(Padding(words, (0, 0, 0, 2), expand=False))
    console.print()
    console.print(Text.assemble("report ", (str(output / "report.md"), "bold")), soft_wrap=True)


def _table(entries: list[dict[str, Any]], width: int) -> Group:
    """Lay out table 1: a row per method, under the title of its variant."""
    levels = dict.fromkeys(entry["disturbance_level"] for entry in entries)
    headings = [f"{figure}\n{100.0 * level:.0f} %" for level in levels for figure in ("error", "chattering")]
    rows: list[list[Text | str]] = []
    for variant, group in groupby(entries, lambda entry: entry["title"]):
        if variant:
            rows.append([Text(variant, "bold"), *[""] * len(headings)])
        for method, cells in groupby(group, lambda entry: entry["method"]):
            figures = [short(cell[name]) for cell in cells for name in ("rms_error_rad", "chattering_Nm_per_s")]
            rows.append([method, *figures])
    return fitted("Table 1: RMS attitude error [rad], chattering [N·m/s]", ["method", *headings], rows, width)
