"""A checksum of a whole file inside that file, checked before anything of the file is interpreted.

Rerun reads a truncated file as far as it goes, and a damaged byte can end the whole process inside its reader. So a
recording carries the SHA-256 of its own bytes, taken with a placeholder where the checksum is.
"""

import hashlib
import re
from pathlib import Path

from spherical_wrist.errors import RecordingError

_MARK = "<SHA-256 "
PLACEHOLDER = _MARK + "ghijklmnopqrstuvwxyzGHIJKLMNOPQRSTUVWXYZ!#$%&()*+,-./;=?@[]^_{|}" + ">"
"""Placeholder of the checksum, in a property of its own.

Rerun compresses what it stores. This is left as it is, since no part of it comes twice, or is like the names and the
hexadecimal numbers that come with a property.
"""

_SEAL = re.compile(re.escape(_MARK.encode()) + b"[0-9a-f]{64}>")
_BEGIN, _END = b"RRF2", b"RRF2FOOT"


def sealed(content: bytes) -> bytes:
    """A copy of ``content`` with the checksum in the place of :data:`PLACEHOLDER`.

    Raises:
        RecordingError: the placeholder is not there exactly once.
    """
    blank = PLACEHOLDER.encode()
    before, *after = content.split(blank)
    if len(after) != 1:
        raise RecordingError("the recording cannot be sealed: does a property contain the mark of a seal?")
    seal = f"{_MARK}{hashlib.sha256(content).hexdigest()}>"
    return before + seal.encode() + after[0]


def check_seal(path: Path) -> None:
    """Check that a file is a recording that nothing has changed since it was written.

    Raises:
        RecordingError: it cannot be read, is no recording of this package, or is truncated or damaged.
    """
    name = f"recording {str(path)!r}"
    if not path.is_file():
        found = "it is not a file" if path.exists() else "there is no such file"
        raise RecordingError(f"{name} cannot be read: {found}; give the path of an .rrd file")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{name} cannot be read: {error.strerror or error}; check its permissions") from None
    if not content:
        raise RecordingError(f"{name} is empty; record the run again")
    if not content.startswith(_BEGIN):
        raise RecordingError(f"{name} is not a Rerun file of the kind that this version reads")
    if _END not in content[-2 * len(_END) :]:
        raise RecordingError(f"{name} is truncated; record the run again")
    seals = list(_SEAL.finditer(content))
    if len(seals) != 1:
        raise RecordingError(f"{name} was not made by spherical-wrist, or it is damaged")
    begin, end = seals[0].span()
    checksum = hashlib.sha256(content[:begin])
    checksum.update(PLACEHOLDER.encode())
    checksum.update(content[end:])
    if f"{_MARK}{checksum.hexdigest()}>".encode() != seals[0][0]:
        raise RecordingError(f"{name} is damaged or was changed: it does not match its checksum; record the run again")
