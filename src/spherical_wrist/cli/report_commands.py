"""The command that reports on campaigns, and its options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli.app import Option, app


@app.command()
def report(
    campaign: Annotated[Path, typer.Argument(metavar="DIR", help="folder of a campaign, complete or not")],
    bound: Annotated[float, Option(metavar="MM", help="bound on the tip error, to count what exceeds it [0.1]")] = 0.1,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE.html", help="page to write [DIR/report.html]")
    ] = None,
    json: Annotated[
        bool, Option("--json", help="print one JSON object and nothing else; write a page only with -o")
    ] = False,
) -> None:
    """Report on a campaign: one HTML page that needs nothing else, no network and no script.

    What was run and how much of it is there; of each law, quantiles of its errors and how often it diverges or exceeds
    a bound, with confidence intervals; laws against each other on the same samples; what the error depends on; and the
    worst episodes, each with the command that runs it again. Runs that did not complete count as the worst.

    The bound of 0.1 mm is what coronary surgery typically needs (Bachta et al., 2011).

    Exit code: 0 reported, 2 wrong input.
    """
    from spherical_wrist.cli.report import report_campaign

    report_campaign(campaign, bound, output, json)
