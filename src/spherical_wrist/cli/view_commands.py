"""The command that shows recordings, and its options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli.app import Option, app
from spherical_wrist.cli.completion import recordings


@app.command()
def view(
    recording: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE.rrd", help="recording made by wrist run [wait for live runs]", autocompletion=recordings
        ),
    ] = None,
    web: Annotated[bool, Option("--web", help="show it in the browser instead of a window")] = False,
    no_browser: Annotated[bool, Option("--no-browser", help="with --web: only print the address of the page")] = False,
    port: Annotated[
        int | None,
        Option(min=1, max=65535, help="where live runs reach the window [9876]; with --web, the page [9090]"),
    ] = None,
    screenshot: Annotated[
        Path | None, Option(metavar="OUT.png", help="take a picture instead; needs no display")
    ] = None,
    at: Annotated[float | None, Option(metavar="SECONDS", help="with --screenshot: simulated time [the end]")] = None,
    size: Annotated[str | None, Option(metavar="WIDTHxHEIGHT", help="with --screenshot [1600x1000]")] = None,
) -> int:
    """Show a recording in the Rerun viewer, until it is closed: the wrist as it moves, and everything over time.

    Without a recording: an empty viewer that waits for wrist run --live. Where a viewer is open already, it shows the
    recording as one more. Everything listens on this machine only, and no telemetry is sent; but the window, as any of
    Rerun's, asks GitHub whether there is a newer version (its settings can switch that off). The page asks nobody.

    A picture is taken by the same viewer without a display. Exit code: 0 shown, 1 where the viewer complains of a view
    in the picture, 2 wrong input or no viewer, 130 or 143 stopped by a signal.
    """
    from spherical_wrist.cli.view import ViewOptions, view_recording

    return view_recording(recording, ViewOptions(web, no_browser, port, screenshot, at, size))
