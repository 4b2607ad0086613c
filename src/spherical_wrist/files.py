"""Files that are written whole or not at all.

Where the system can, the content goes to a file that has no name until it is complete: a process that is killed leaves
nothing behind. Elsewhere (macOS, some network file systems) it goes to a hidden file ``.wrist-….part`` beside the
target, which a kill may leave; commands clear it away when they next write into that folder.
"""

import errno
import os
import re
import secrets
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

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
_NAMELESS_UNKNOWN = (errno.EOPNOTSUPP, errno.EISDIR, errno.EINVAL)
"""What file systems answer that know no files without a name."""

_LEFTOVER = re.compile(r"\.wrist-[0-9a-f]{16}\.part")
LEFT_AFTER = 600.0
"""Age [s] from which a hidden file counts as left behind: nobody writes that long."""


def write_whole(path: Path, content: bytes | Iterable[bytes], what: str = "recording") -> None:
    """Writes a file so that ``path`` holds either all of ``content`` or what it held before.

    Where the path is a symbolic link, the file that it points to is replaced; other hard links keep what they had.

    Args:
        path: the file.
        content: all of it, or its pieces one after the other, of which only one need be in memory at a time.
        what: what to call it where it cannot be written.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    write_together({path: content}, what)


def write_together(contents: Mapping[Path, bytes | Iterable[bytes]], what: str = "file") -> None:
    """Writes files as :func:`write_whole` does, but names none before all of them are on the disk.

    So where there is no room for all, what was there before still fits together.

    Args:
        contents: what each file shall hold, by path.
        what: what to call them.

    Raises:
        RecordingError: one of them cannot be written; the message names it.
    """
    with ExitStack() as stack:
        filled = []
        for path, content in contents.items():
            with _target(path, what) as target:
                draft = stack.enter_context(_draft(target.parent))
                draft.fill(content)
                filled.append((path, draft))
        for path, draft in filled:
            with _target(path, what) as target:
                draft.become(target)
    for folder in {Path(os.path.realpath(path)).parent for path in contents}:
        _settle(folder)


@contextmanager
def replacing(path: Path, what: str = "file") -> Iterator[Path]:
    """Writes a file bit by bit so that ``path`` holds either all of it or what it held before.

    Args:
        path: the file.
        what: what to call it where it cannot be written.

    Yields:
        A path under which the caller opens what is to become the file, to write and, if need be, to read it again.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    with _target(path, what) as target, _draft(target.parent) as draft:
        yield draft.path
        os.fsync(draft.descriptor)
        draft.become(target)
    _settle(target.parent)


def check_writable(path: Path, what: str = "recording") -> None:
    """Refuses a file that could not be written, before the work that would be in it; clears its folder of leftovers.

    Args:
        path: the file.
        what: what to call it.

    Raises:
        RecordingError: something that is not a file is there, or its directory does not exist or cannot be written to.
    """
    with _target(path, what) as target:
        with _draft(target.parent):
            pass
        _clear_leftovers(target.parent)


def make_folder(folder: Path) -> None:
    """Makes a folder where there is none, and makes sure that files can be written to it; clears it of leftovers.

    Raises:
        RecordingError: it cannot be made or written to.
    """
    with _explained(f"folder {str(folder)!r} cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    with _explained(f"folder {str(folder)!r} cannot be written to"), _draft(folder):
        pass
    _clear_leftovers(folder)


class _Draft(NamedTuple):
    """A file that is being written.

    Attributes:
        descriptor: the open file.
        hidden: a name for it before it has its own.
        nameless: whether it has none yet.
    """

    descriptor: int
    hidden: Path
    nameless: bool

    @property
    def path(self) -> Path:
        """Where it can be opened."""
        return _opened(self.descriptor) if self.nameless else self.hidden

    def fill(self, content: bytes | Iterable[bytes]) -> None:
        """Brings all of the content to the disk."""
        for piece in (content,) if isinstance(content, bytes) else content:
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(self.descriptor, rest) :]
        os.fsync(self.descriptor)

    def become(self, target: Path) -> None:
        """Takes the name of the target, and the place of what is there."""
        if self.nameless:
            opened = _opened(self.descriptor)
            try:  # given src_dir_fd, Python follows the link that this is, as it must
                os.link(opened, target, src_dir_fd=self.descriptor)
                return
            except FileExistsError:  # only what has a name can replace it
                os.link(opened, self.hidden, src_dir_fd=self.descriptor)
        self.hidden.replace(target)


@contextmanager
def _draft(folder: Path) -> Iterator[_Draft]:
    hidden = folder / f".wrist-{secrets.token_hex(8)}.part"
    descriptor = _open_nameless(folder)
    nameless = descriptor is not None
    if descriptor is None:
        descriptor = os.open(hidden, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    try:
        yield _Draft(descriptor, hidden, nameless)
    finally:
        os.close(descriptor)
        with suppress(OSError):
            hidden.unlink()


def _open_nameless(folder: Path) -> int | None:
    """A new file in a folder that has no name there; None where the system has no such files."""
    if not (hasattr(os, "O_TMPFILE") and _opened(0).parent.is_dir()):
        return None
    try:
        return os.open(folder, os.O_WRONLY | os.O_TMPFILE | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno in _NAMELESS_UNKNOWN:
            return None
        raise


def _opened(descriptor: int) -> Path:
    return Path(f"/proc/self/fd/{descriptor}")


@contextmanager
def _target(path: Path, what: str) -> Iterator[Path]:
    """The file that a path stands for, once it is sure that it is or can be one; errors of the system become ours."""
    said = f"{what} {str(path)!r} cannot be written"
    with _explained(said):
        target = Path(os.path.realpath(path))  # fails where the working directory was deleted
        if target.exists() and not target.is_file():
            kind = "a directory" if target.is_dir() else "not a regular file"
            raise RecordingError(f"{said}: it is {kind}; give the path of a file")
        yield target


@contextmanager
def _explained(said: str) -> Iterator[None]:
    """An error of the system in a line that begins with what is said, and ends with what to do."""
    try:
        yield
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "choose another place")
        raise RecordingError(f"{said}: {error.strerror or error}; {advice}") from None


def _clear_leftovers(folder: Path) -> None:
    """Removes the hidden files that killed commands have left in a folder; those of running ones are younger."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError):
                if _LEFTOVER.fullmatch(entry.name) and time.time() - entry.stat().st_mtime > LEFT_AFTER:
                    Path(entry).unlink()


def _settle(directory: Path) -> None:
    """Makes a rename survive a power cut, where the file system can; the file itself is complete either way."""
    with suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
