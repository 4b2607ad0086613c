"""Page of Rerun's web viewer that connects to this machine only.

Rerun's own server is behind it. Its page asks other hosts for fonts, newer versions and examples, and tells one that it
is used; it has no switch for that. A content security policy is one for the browser: https://www.w3.org/TR/CSP3/.
"""

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection, HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar

from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.process import HOST

_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' http://{host}:{port}; frame-ancestors 'none'; form-action 'none'"
)
_HINTS = re.compile(rb'<link\b[^>]*"https://[^>]*>', re.DOTALL)
"""Links of the page to other hosts; a browser follows some of them before it knows the policy."""

_KEPT = ("Content-Type", "rerun-final-length")


@contextmanager
def served_page(port: int, upstream: int, data: int) -> Iterator[None]:
    """Serve the page on a port of the loopback interface.

    Args:
        port: where.
        upstream: port of Rerun's own page.
        data: port of Rerun's own data, the only one that the page may talk to besides.

    Raises:
        ViewerError: the port is taken or not allowed.
    """

    class Handler(_Page):
        source = upstream
        policy = _POLICY.format(host=HOST, port=data)

    try:
        server = ThreadingHTTPServer((HOST, port), Handler)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ViewerError(f"the page cannot be served on {HOST}:{port}: {reason}; give another --port") from None
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()


class _Page(BaseHTTPRequestHandler):
    """Pass on the answers of Rerun's own server."""

    source: ClassVar[int]
    policy: ClassVar[str]

    def do_GET(self) -> None:
        """Answer a request."""
        connection = HTTPConnection(HOST, self.source, timeout=30.0)
        try:
            connection.request("GET", self.path)
            answer = connection.getresponse()
            body = answer.read()
        except (OSError, HTTPException):
            self.send_error(502, "the viewer has ended")
            return
        finally:
            connection.close()
        if "text/html" in (answer.getheader("Content-Type") or ""):
            body = _HINTS.sub(b"", body)
        self.send_response(answer.status)
        for name in _KEPT:
            value = answer.getheader(name)
            if value is not None:
                self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Content-Security-Policy", self.policy)
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: object) -> None:
        """Say nothing of the requests."""
