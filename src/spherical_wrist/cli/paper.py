"""``wrist paper``: evaluation of the source paper, with verdicts on its claims."""

from pathlib import Path
from typing import Annotated

from rich.table import Table
from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import Json
from spherical_wrist.cli.tables import number, print_json, printer

COLOURS = {"reproduced": "green", "reproduced under a condition": "yellow", "not reproduced": "red"}


def command(
    output: Annotated[Path, Option("--output", "-o", metavar="DIR", help="folder to write")] = Path("paper"),
    json: Json = False,
) -> None:
    """Files in DIR: report.md, both figures as PNG and SVG, and the recordings behind them."""
    from spherical_wrist.paper.evaluation.report import regenerate

    report = regenerate(output)
    if json:
        print_json(report)
        return
    console = printer()
    table = Table(title="Table 1: RMS attitude error and chattering", title_justify="left", title_style="bold")
    table.add_column("variant")
    table.add_column("method")
    for title in ("disturbance", "error [rad]", "[N·m/s]"):
        table.add_column(title, justify="right")
    for entry in report["table"]:
        table.add_row(
            entry["variant"] or "any",
            entry["method"],
            f"{100.0 * entry['disturbance_level']:.0f} %",
            number(entry["rms_error_rad"]),
            number(entry["chattering_Nm_per_s"]),
            end_section=entry["method"].startswith("fuzzy") and entry["disturbance_level"] > 0.0,
        )
    console.print(table)
    for claim in report["claims"]:
        console.print(
            Text.assemble(
                (claim["verdict"], COLOURS[claim["verdict"]]), f": {claim['claim']} ", (f"({claim['source']})", "dim")
            )
        )
    console.print(Text.assemble("report ", (str(output / "report.md"), "bold")), soft_wrap=True)
