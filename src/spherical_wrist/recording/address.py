"""Address of a viewer, and a check that one listens there."""

import socket
from typing import NamedTuple

from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.process import HOST

PORT = 9876
"""Default port on which a viewer listens for live runs."""

_PATIENCE = 3.0
"""Time in which a viewer must answer [s]."""

_HELLO = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes((0, 0, 0, 4, 0, 0, 0, 0, 0))
"""First bytes of an HTTP/2 client, RFC 9113 section 3.4: the preface and an empty SETTINGS frame."""

_SETTINGS = 4


class Address(NamedTuple):
    """A host and a port."""

    host: str = HOST
    port: int = PORT

    def __str__(self) -> str:
        """As it is given."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def url(self) -> str:
        """Of the viewer, for Rerun."""
        return f"rerun+http://{self}/proxy"


def read_address(text: str) -> Address:
    """The address that ``HOST:PORT`` stands for.

    Raises:
        ViewerError: the text is not of this form.
    """
    host, _, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]") if host.startswith("[") else host
    if not host or (":" in host and not text.startswith("[")) or not port.isascii() or not port.isdigit():
        raise ViewerError(f"viewer {text!r}: HOST:PORT is needed, such as {Address()}")
    if not 1 <= int(port) <= 65535:
        raise ViewerError(f"viewer {text!r}: a port is a number from 1 to 65535")
    return Address(host, int(port))


def check_viewer(address: Address) -> None:
    """Check that a viewer listens at an address.

    Raises:
        ViewerError: nobody listens there, or something else does.
    """
    try:
        with socket.create_connection((address.host, address.port), _PATIENCE) as connection:
            connection.sendall(_HELLO)
            answer = connection.recv(9)
    except OSError as error:
        if isinstance(error, TimeoutError):
            raise ViewerError(f"the program at {address} does not answer: is the viewer hanging?") from None
        raise ViewerError(f"no viewer listens on {address}: start one with `wrist view`") from None
    if len(answer) < 4 or answer[3] != _SETTINGS:
        raise ViewerError(f"the program at {address} is no viewer: start one with `wrist view`, on a free --port")


def is_listening(port: int) -> bool:
    """Return True if anything listens on a port of this machine."""
    try:
        with socket.create_connection((HOST, port), _PATIENCE):
            return True
    except OSError:
        return False


def free_port() -> int:
    """A port of this machine on which nothing listens."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
