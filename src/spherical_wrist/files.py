"""Files that are written whole or not at all."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spherical_wrist.errors import RecordingError

_ADVICE = {
    errno.ENOENT: "create its directory first",
    errno.ENOTDIR: "give a path inside a directory",
    errno.EACCES: "choose a directory that you may write to",
    errno.EPERM: "choose a directory that you may write to",
    errno.EROFS: "choose a directory that can be written to",
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.EFBIG: "raise the limit on file sizes, or record fewer rows",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def write_whole(path: Path, content: bytes, what: str = "recording") -> None:
    """Writes a file so that ``path`` holds either all of ``content`` or what it held before.

    Args:
        path: the file.
        content: all of it.
        what: what to call it where it cannot be written.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    with replacing(path, what) as part:
        _fill(part, content)


@contextmanager
def replacing(path: Path, what: str = "recording") -> Iterator[Path]:
    """Writes a file bit by bit so that ``path`` holds either all of it or what it held before.

    It is written to a hidden file beside the target, which takes the target's place once it is on the disk. Where the
    path is a symbolic link, the file that it points to is replaced.

    Args:
        path: the file.
        what: what to call it where it cannot be written.

    Yields:
        The hidden file, empty. It is gone where an exception comes out of the block.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        _check_kind(path, target, what)
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666))  # what forbids it shows now
        yield part
        _sync(part)
        part.replace(target)
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "choose another place")
        reason = error.strerror or str(error)
        raise RecordingError(f"{what} {str(path)!r} cannot be written: {reason}; {advice}") from None
    finally:
        with suppress(OSError):
            part.unlink()
    _settle(target.parent)


def _check_kind(path: Path, target: Path, what: str) -> None:
    if target.exists() and not target.is_file():
        kind = "a directory" if target.is_dir() else "not a regular file"
        raise RecordingError(f"{what} {str(path)!r} cannot be written: it is {kind}; give the path of a file")


def _fill(path: Path, content: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CLOEXEC)
    try:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(descriptor, rest) :]
    finally:
        os.close(descriptor)


def _settle(directory: Path) -> None:
    """Makes a rename survive a power cut, where the file system can; the file itself is complete either way."""
    with suppress(OSError):
        _sync(directory)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
