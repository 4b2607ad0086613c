"""``wrist report``: findings of a campaign, as a page or as JSON."""

from pathlib import Path
from typing import Annotated, Any

from rich.text import Text
from typer import Argument, Option

from spherical_wrist.cli.options import Bound, Json
from spherical_wrist.cli.progress import waiting
from spherical_wrist.cli.streams import warned
from spherical_wrist.cli.tables import Entry, fitted, print_json, printer, short
from spherical_wrist.measure.bound import BOUND

PAGE = "report.html"


def command(
    campaign: Annotated[Path, Argument(metavar="DIR", help="folder of a campaign, complete or not")],
    bound: Bound = BOUND,
    output: Annotated[
        Path | None,
        Option("--output", "-o", metavar="FILE.html", help="page to write [DIR/report.html; with --json, none]"),
    ] = None,
    json: Json = False,
) -> None:
    """Contents: the campaign and how much of it is stored; of each law, quantiles of its errors and how often it fails.

    Rates of divergence and of tip errors beyond the bound have confidence intervals. Laws are compared on the same
    samples, errors are related to the conditions, and the worst episodes are listed, each with the command that runs it
    again. Runs that did not complete count as the worst.

    The bound of 0.1 mm is what coronary surgery typically needs (Bachta et al., 2011).

    Exit code: 0 reported, 2 wrong input.
    """
    from spherical_wrist.campaign.folder import Folder
    from spherical_wrist.cli.output import warn
    from spherical_wrist.files import check_writable, write_whole
    from spherical_wrist.report.findings import findings

    folder = Folder.open(campaign)
    if output is None and not json:
        output = campaign / PAGE
    if output is not None:
        folder.check_output(output)
        check_writable(output, "page")
    with waiting("reading the episodes"):
        table, curves = findings(folder, bound, warned)
    warn(table["warnings"])
    if output is not None:
        from spherical_wrist.report.page import page  # matplotlib, half a second of imports

        write_whole(output, page(table, curves).encode(), "page")
    if json:
        print_json(table)
    else:
        _print(table, output)


def _print(table: dict[str, Any], output: Path | None) -> None:
    from spherical_wrist.measure.metrics import METRICS
    from spherical_wrist.report.table import FIGURES

    console = printer()
    campaign = table["campaign"]
    share = (
        "complete" if campaign["complete"] else f"{100.0 * campaign['stored'] / campaign['episodes']:.3g} % complete"
    )
    console.print(
        Text.assemble(
            (campaign["folder"], "bold"), f"  {campaign['stored']:,} of {campaign['episodes']:,} episodes, {share}"
        ),
        soft_wrap=True,
    )
    error = METRICS[FIGURES["error"]]
    headings = [
        "law",
        *(f"{each}\n[{error.unit}]" for each in ("median", "99 %", "worst")),
        "beyond\nthe bound",
        "lost",
    ]
    rows: list[list[Entry]] = []
    for law, row in table["laws"].items():
        found, rates = row["quantiles"][error.name], row["rates"]
        errors = (found[name]["value"] for name in ("median", "99 %", "worst")) if found else (None, None, None)
        lost = rates["diverged"]["count"] + rates["failed"]["count"]
        beyond = rates["exceeding"]["share"]
        rows.append([law, *map(short, errors), "—" if beyond is None else f"{100.0 * beyond:.3g} %", f"{lost:,}"])
    title = f"{error.label}, and share of episodes with a tip error beyond {table['bound_mm']:g} mm"
    console.print(fitted(title, headings, rows, console.width))
    if output is not None:
        console.print(Text.assemble("page written to ", (str(output), "bold")), soft_wrap=True)
