"""``wrist paper``: the source paper's evaluation, with verdicts."""

from pathlib import Path

from rich.table import Table
from rich.text import Text

from spherical_wrist.cli.output import number, print_json, printer
from spherical_wrist.paper.report import regenerate

COLOURS = {"reproduced": "green", "reproduced under a condition": "yellow", "not reproduced": "red"}


def regenerate_paper(folder: Path, as_json: bool) -> None:
    """Writes the report and prints its table and verdicts.

    Raises:
        WristError: the folder cannot be written to.
    """
    told = regenerate(folder)
    if as_json:
        print_json(told)
        return
    console = printer()
    table = Table(title="Table 1: RMS attitude error and chattering", title_justify="left", title_style="bold")
    table.add_column("variant")
    table.add_column("method")
    for title in ("disturbance", "error [rad]", "[N·m/s]"):
        table.add_column(title, justify="right")
    for entry in told["table"]:
        table.add_row(
            entry["variant"] or "any",
            entry["method"],
            f"{100.0 * entry['disturbance_level']:.0f} %",
            number(entry["rms_error_rad"]),
            number(entry["chattering_Nm_per_s"]),
            end_section=entry["method"].startswith("fuzzy") and entry["disturbance_level"] > 0.0,
        )
    console.print(table)
    for claim in told["claims"]:
        console.print(
            Text.assemble(
                (claim["verdict"], COLOURS[claim["verdict"]]), f": {claim['claim']} ", (f"({claim['source']})", "dim")
            )
        )
    console.print(Text.assemble("report ", (str(folder / "report.md"), "bold")), soft_wrap=True)
