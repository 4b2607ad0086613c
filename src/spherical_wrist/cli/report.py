"""``wrist report``: what a campaign has shown, as a page or as JSON."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from spherical_wrist.campaign.folder import Folder
from spherical_wrist.cli.output import print_json, printer
from spherical_wrist.cli.tables import Entry, fitted, short
from spherical_wrist.files import check_writable, write_whole
from spherical_wrist.report.findings import findings

PAGE = "report.html"


def report_campaign(path: Path, bound: float, output: Path | None, as_json: bool) -> None:
    """Reports, prints and writes.

    Args:
        path: folder of the campaign.
        bound: on the tip error [mm].
        output: page to write; in the folder where none is given, but none at all where JSON is printed.
        as_json: print the figures as JSON instead of the most important ones as a table.

    Raises:
        WristError: there is no campaign or no episode, it cannot be read, or the page cannot be written.
    """
    folder = Folder.open(path)
    if output is None and not as_json:
        output = path / PAGE
    if output is not None:
        check_writable(output, "page")
    with _waiting():
        told, curves = findings(folder, bound)
    if output is not None:
        from spherical_wrist.report.page import page  # matplotlib, half a second of imports

        write_whole(output, page(told, curves).encode(), "page")
    if as_json:
        print_json(told)
    else:
        _print(told, output)


@contextmanager
def _waiting() -> Iterator[None]:
    """Shows on a terminal that something goes on: a million episodes take some seconds."""
    if not sys.stderr.isatty():
        yield
        return
    with Console(stderr=True).status("reading the episodes"):
        yield


def _print(told: dict[str, Any], output: Path | None) -> None:
    console = printer()
    campaign = told["campaign"]
    share = (
        "complete" if campaign["complete"] else f"{100.0 * campaign['stored'] / campaign['episodes']:.3g} % complete"
    )
    console.print(
        Text.assemble(
            (campaign["folder"], "bold"), f"  {campaign['stored']:,} of {campaign['episodes']:,} episodes, {share}"
        ),
        soft_wrap=True,
    )
    headings = ["law", "median\n[rad]", "99 %\n[rad]", "worst\n[rad]", "beyond\nbound", "not com-\npleted"]
    rows: list[list[Entry]] = []
    for law, row in told["laws"].items():
        found, rates = row["quantiles"]["rms_error_rad"], row["rates"]
        errors = (found[name]["value"] for name in ("median", "99 %", "worst")) if found else (None, None, None)
        lost = rates["diverged"]["count"] + rates["failed"]["count"]
        beyond = rates["exceeding"]["share"]
        rows.append([law, *map(short, errors), "—" if beyond is None else f"{100.0 * beyond:.3g} %", f"{lost:,}"])
    console.print(fitted(f"RMS errors, and tip errors beyond {told['bound_mm']:g} mm", headings, rows, console.width))
    if output is not None:
        console.print(Text.assemble("page written to ", (str(output), "bold")), soft_wrap=True)
