"""``wrist view``: a recording in a window, in the browser, or as a picture."""

import os
import re
import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from spherical_wrist.cli.signals import raising
from spherical_wrist.errors import ParameterError

SIZE = "1600x1000"
SMALLEST, LARGEST = 200, 8000
"""Sides of a picture [pixels]."""


class ViewOptions(NamedTuple):
    """How to show it; see ``wrist view --help``."""

    web: bool
    no_browser: bool
    port: int | None
    screenshot: Path | None
    at: float | None
    size: str | None


def view_recording(path: Path | None, options: ViewOptions) -> int:
    """Shows a recording until its viewer is closed; returns the exit code.

    Raises:
        WristError: wrong input, or no viewer can be opened.
    """
    _check(path, options)
    with _ended_by_signals():
        if options.screenshot is not None and path is not None:
            return _picture(path, options.screenshot, options.at, options.size or SIZE)
        if options.web:
            _page(path, options)
        else:
            _window(path, options)
    return 0


def _check(path: Path | None, options: ViewOptions) -> None:
    """Refuses options that contradict each other."""
    if options.screenshot is None:
        for name, given in (("--at", options.at), ("--size", options.size)):
            if given is not None:
                raise ParameterError(f"{name} is for a picture: add --screenshot OUT.png")
    elif path is None:
        raise ParameterError("--screenshot needs a recording: wrist view FILE.rrd --screenshot OUT.png")
    elif options.web or options.port is not None:
        raise ParameterError("--screenshot takes a picture without a page or a port: leave out --web and --port")
    if options.no_browser and not options.web:
        raise ParameterError("--no-browser is for a page: add --web")


def _picture(path: Path, target: Path, at: float | None, size: str) -> int:
    from spherical_wrist.files import check_writable, write_whole
    from spherical_wrist.recording.screenshot import photograph

    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", size, re.ASCII)
    sides = [int(side) for side in found.groups()] if found else []
    if not sides or not all(SMALLEST <= side <= LARGEST for side in sides):
        raise ParameterError(
            f"--size {size!r}: WIDTHxHEIGHT is needed, each from {SMALLEST} to {LARGEST}, such as {SIZE}"
        )
    check_writable(target, "picture")
    taken = photograph(path, at, (sides[0], sides[1]))
    write_whole(target, taken.png, "picture")
    print(f"picture {target}")
    for report in taken.reports:
        print(f"wrist: {report}", file=sys.stderr)
    return 1 if taken.reports else 0


def _page(path: Path | None, options: ViewOptions) -> None:
    from spherical_wrist.recording.web import PAGE_PORT, served_viewer

    with served_viewer(path, options.port or PAGE_PORT) as served:
        print(f"{served.url}\nlive runs: wrist run --live --viewer {served.address} · Ctrl-C ends it", flush=True)
        if not options.no_browser and _has_display():
            with suppress(webbrowser.Error):  # the address is printed
                webbrowser.open(served.url)
        served.server.process.wait()
        raise served.server.complaint()


def _window(path: Path | None, options: ViewOptions) -> None:
    from spherical_wrist.recording.address import PORT, Address
    from spherical_wrist.recording.viewer import opened_viewer

    address = Address(port=options.port or PORT)
    with opened_viewer(path, address.port) as opened:
        if path is None:
            print(f"waiting for live runs: wrist run --live --viewer {address}", flush=True)
        opened.viewer.wait()
    if opened.handed_over:
        print(f"shown in the viewer that is open already, on {address}")


def _has_display() -> bool:
    """Whether a browser would get a window; one in the terminal could not show this page."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Makes the signals that end a process end it as Ctrl-C does: what it has started ends first."""

    def end(number: int) -> None:
        sys.exit(128 + number)

    watched = (signal.SIGTERM, signal.SIGHUP)
    before = [signal.signal(number, raising(end)) for number in watched]
    try:
        yield
    finally:
        for number, handler in zip(watched, before, strict=True):
            signal.signal(number, handler)
