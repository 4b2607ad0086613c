"""``wrist view``: a recording in a window, in the browser, or as a picture."""

import os
import re
import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.signals import raising
from spherical_wrist.cli.streams import say
from spherical_wrist.errors import ParameterError
from spherical_wrist.plain_text import visible

SIZE = "1600x1000"
SMALLEST, LARGEST = 200, 8000
"""Sides of a picture [pixels]."""


def command(
    recording: Annotated[
        Path | None,
        Argument(
            metavar="FILE.rrd",
            help="recording made by wrist run [wait for live runs]",
            autocompletion=completion.recordings,
        ),
    ] = None,
    web: Annotated[bool, Option("--web", help="show it in the browser instead of a window")] = False,
    no_browser: Annotated[bool, Option("--no-browser", help="with --web: only print the address of the page")] = False,
    port: Annotated[
        int | None,
        Option(min=1, max=65535, help="port for live runs [9876]; with --web, of the page [9090]"),
    ] = None,
    screenshot: Annotated[
        Path | None, Option(metavar="OUT.png", help="take a picture instead; needs no display")
    ] = None,
    at: Annotated[float | None, Option(metavar="SECONDS", help="with --screenshot: simulated time [the end]")] = None,
    size: Annotated[str | None, Option(metavar="WIDTHxHEIGHT", help="with --screenshot [1600x1000]")] = None,
) -> int:
    """The command ends when the viewer is closed. Without a recording: an empty viewer that waits for wrist run --live.

    If a viewer is open already, it shows the recording as one more. Everything listens on this machine only, and no
    telemetry is sent; but the window, as any of Rerun's, asks GitHub whether there is a newer version (its settings can
    switch that off). The page asks nobody.

    A picture is taken by the same viewer without a display. Exit code: 0 shown, 1 the viewer complains of a view in the
    picture, 2 wrong input or no viewer, 130 or 143 stopped by a signal.

    Raises:
        ParameterError: options contradict each other, or a value is not valid.
    """
    if screenshot is None:
        for name, given in (("--at", at), ("--size", size)):
            if given is not None:
                raise ParameterError(f"{name} is for a picture: add --screenshot OUT.png")
    elif recording is None:
        raise ParameterError("--screenshot needs a recording: wrist view FILE.rrd --screenshot OUT.png")
    elif web or port is not None:
        raise ParameterError("--screenshot takes a picture without a page or a port: leave out --web and --port")
    if no_browser and not web:
        raise ParameterError("--no-browser is for a page: add --web")
    with _ended_by_signals():
        if screenshot is not None and recording is not None:
            return _picture(recording, screenshot, at, size or SIZE)
        if web:
            _page(recording, port, opened=not no_browser)
        else:
            _window(recording, port)
    return 0


def _picture(path: Path, target: Path, at: float | None, size: str) -> int:
    from spherical_wrist.files import check_writable, note_input, write_whole
    from spherical_wrist.recording.screenshot import screenshot

    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", size, re.ASCII)
    sides = [int(side) for side in found.groups()] if found else []
    if not sides or not all(SMALLEST <= side <= LARGEST for side in sides):
        raise ParameterError(
            f"--size {size!r}: WIDTHxHEIGHT is needed, each from {SMALLEST} to {LARGEST}, such as {SIZE}"
        )
    note_input(path)
    check_writable(target, "picture")
    taken = screenshot(path, at, (sides[0], sides[1]))
    write_whole(target, taken.png, "picture")
    say(f"picture {target}")
    for report in taken.reports:
        print(visible(f"wrist: {report}"), file=sys.stderr)
    return 1 if taken.reports else 0


def _page(path: Path | None, port: int | None, *, opened: bool) -> None:
    from spherical_wrist.recording.web import PAGE_PORT, served_viewer

    with served_viewer(path, port or PAGE_PORT) as served:
        print(f"{served.url}\nlive runs: wrist run --live --viewer {served.address} · Ctrl-C ends it", flush=True)
        if opened and _has_display():
            with suppress(webbrowser.Error):  # the address is printed
                webbrowser.open(served.url)
        served.server.process.wait()
        raise served.server.complaint()


def _window(path: Path | None, port: int | None) -> None:
    from spherical_wrist.recording.address import PORT, Address
    from spherical_wrist.recording.viewer import opened_viewer

    address = Address(port=port or PORT)
    with opened_viewer(path, address.port) as opened:
        if path is None:
            say(f"waiting for live runs: wrist run --live --viewer {address}")
        opened.viewer.wait()
    if opened.handed_over:
        say(f"shown in the viewer that is open already, on {address}")


def _has_display() -> bool:
    """Return True if a browser would get a window; one in the terminal could not show this page."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end the process as Ctrl-C does, after the processes that it has started."""

    def end(number: int) -> None:
        sys.exit(128 + number)

    watched = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, raising(end)) for number in watched]
    try:
        yield
    finally:
        for number, handler in zip(watched, before, strict=True):
            signal.signal(number, handler)
