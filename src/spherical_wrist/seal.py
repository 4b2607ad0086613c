"""A checksum of a whole file inside that file, checked before anything of the file is interpreted.

A file that is to be sealed has :data:`PLACEHOLDER` in it, once and not compressed. The SHA-256 of all its bytes, taken
with the placeholder, then takes its place.
"""

import hashlib
import re
from enum import StrEnum

from spherical_wrist.errors import RecordingError

_MARK = "<SHA-256 "
PLACEHOLDER = _MARK + "ghijklmnopqrstuvwxyzGHIJKLMNOPQRSTUVWXYZ!#$%&()*+,-./;=?@[]^_{|}" + ">"
"""Placeholder of the checksum, in a property of its own.

Rerun compresses what it stores. This is left as it is, since no part of it comes twice, or is like the names and the
hexadecimal numbers that come with a property.
"""

_SEAL = re.compile(re.escape(_MARK.encode()) + b"[0-9a-f]{64}>")


class Seal(StrEnum):
    """State of the checksum of a file."""

    INTACT = "intact"
    BROKEN = "broken"
    MISSING = "missing"


def sealed(content: bytes) -> bytes:
    """Return a copy of ``content`` with the checksum in the place of :data:`PLACEHOLDER`.

    Raises:
        RecordingError: the placeholder is not there exactly once.
    """
    blank = PLACEHOLDER.encode()
    before, *after = content.split(blank)
    if len(after) != 1:
        raise RecordingError("the file cannot be sealed: does a property contain the mark of a seal?")
    seal = f"{_MARK}{hashlib.sha256(content).hexdigest()}>"
    return before + seal.encode() + after[0]


def seal_of(content: bytes) -> Seal:
    """Check the checksum of a file, given all its bytes; a file with two of them counts as one without."""
    seals = list(_SEAL.finditer(content))
    if len(seals) != 1:
        return Seal.MISSING
    begin, end = seals[0].span()
    checksum = hashlib.sha256(memoryview(content)[:begin])
    checksum.update(PLACEHOLDER.encode())
    checksum.update(memoryview(content)[end:])
    return Seal.INTACT if f"{_MARK}{checksum.hexdigest()}>".encode() == seals[0][0] else Seal.BROKEN
