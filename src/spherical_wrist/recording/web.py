"""Recordings in Rerun's web viewer, served from this machine to this machine."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlencode

from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.address import PORT, Address, free_port, is_listening
from spherical_wrist.recording.page import served_page
from spherical_wrist.recording.process import HOST, Viewer, rerun_process
from spherical_wrist.recording.seal import check_seal

PAGE_PORT = 9090
"""Default port of the page."""

_PATIENCE = 30.0
"""Longest time in which the server must be there [s]."""


class Served(NamedTuple):
    """A web viewer that is there until its server ends.

    Attributes:
        url: of the page.
        address: where live runs reach it.
        server: Rerun's own program.
    """

    url: str
    address: Address
    server: Viewer


@contextmanager
def served_viewer(path: Path | None, port: int = PAGE_PORT) -> Iterator[Served]:
    """Serve the web viewer on the loopback interface, until the end of the ``with`` block.

    Live runs reach it where they look for a viewer, or on another port where one is there already.

    Args:
        path: a recording that this package made; None to wait for live runs.
        port: of the page.

    Raises:
        RecordingError: the file is missing, damaged, or not a recording of this package.
        ViewerError: the port is taken, or the server does not start.
    """
    if path is not None:
        check_seal(path)
    address = Address(HOST, free_port() if is_listening(PORT) else PORT)
    upstream = free_port()
    ports = ["--port", str(address.port), "--web-viewer-port", str(upstream)]
    with served_page(port, upstream, address.port), rerun_process(["--serve-web", *ports]) as server:
        deadline = time.monotonic() + _PATIENCE
        while not (is_listening(upstream) and is_listening(address.port)):
            if not server.running:
                raise server.complaint()
            if time.monotonic() > deadline:
                raise ViewerError(f"the web viewer was not there within {_PATIENCE:g} s: is the machine very busy?")
            time.sleep(0.05)
        if path is not None:  # handed over, because a server that read the file itself keeps a processor core busy
            with rerun_process([str(path.resolve()), "--port", str(address.port)]) as sender:
                sender.wait()
        query = urlencode({"url": address.url, "hide_welcome_screen": "1"})
        yield Served(f"http://{HOST}:{port}/?{query}", address, server)
