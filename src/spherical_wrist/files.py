"""Atomic writing of files, completely or not at all; and reading that does not wait.

If the system supports it, the content goes to a file that has no name until it is complete: a process that is killed
leaves nothing behind. Otherwise (macOS, some network file systems) it goes to a hidden file ``.wrist-….part`` beside
the target. A killed process may leave that file; commands remove it when they next write into that folder.
"""

import errno
import os
import re
import stat
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
"""Errors of file systems that do not support files without a name."""

_LEFTOVER = re.compile(r"\.wrist-[0-9a-f]{16}\.part")
LEFT_AFTER = 600.0
"""Age [s] from which a hidden file counts as left behind; no file takes so long to write."""


_inputs: set[tuple[int, int]] | None = None
"""Device and number of each file that the command has read; None outside a command."""


@contextmanager
def inputs_kept() -> Iterator[None]:
    """Refuse, in this context, to write onto a file that was read in it: a command never replaces its own input."""
    global _inputs  # noqa: PLW0603
    before, _inputs = _inputs, set()
    try:
        yield
    finally:
        _inputs = before


def note_input(path: Path) -> None:
    """Note a file as an input of the command; see :func:`inputs_kept`."""
    if _inputs is not None:
        with suppress(OSError, ValueError):
            found = path.stat()
            _inputs.add((found.st_dev, found.st_ino))


def read_whole(path: Path) -> bytes:
    """Return the content of an input file, without ever waiting for somebody to write it.

    Raises:
        OSError: it cannot be read; also raised for a pipe that nobody writes to, and for a device.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        note_input(path)
        kind = os.fstat(descriptor).st_mode
        pipe = stat.S_ISFIFO(kind)
        if not (pipe or stat.S_ISREG(kind)):
            raise OSError(errno.EINVAL, "a directory" if stat.S_ISDIR(kind) else "a device, not a file", str(path))
        os.set_blocking(descriptor, True)  # a pipe may be slow, as that of a shell's <(command)
        with open(descriptor, "rb", closefd=False) as file:
            content = file.read()
        if pipe and not content:
            raise OSError(errno.EINVAL, "a pipe that nobody writes to", str(path))
        return content
    finally:
        os.close(descriptor)


def write_whole(path: Path, content: bytes | Iterable[bytes], kind: str = "recording") -> None:
    """Write a file so that ``path`` holds either all of ``content`` or its previous content.

    If the path is a symbolic link, the file that it points to is replaced; other hard links keep the previous content.

    Args:
        path: the file.
        content: all of it, or an iterable of its pieces, of which only one is in memory at a time.
        kind: name of the kind of file in error messages.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    write_together({path: content}, kind)


def write_together(contents: Mapping[Path, bytes | Iterable[bytes]], kind: str = "file") -> None:
    """Write files as :func:`write_whole` does, but replace none before all of them are on the disk.

    If the disk has no room for all of them, the previous files still belong together.

    Args:
        contents: content of each file, keyed by path.
        kind: name of the kind of file in error messages.

    Raises:
        RecordingError: one of them cannot be written; the message names it.
    """
    with ExitStack() as stack:
        filled = []
        for path, content in contents.items():
            with _target(path, kind) as target:
                draft = stack.enter_context(_draft(target.parent))
                draft.fill(content)
                filled.append((path, draft))
        for path, draft in filled:
            with _target(path, kind) as target:
                draft.become(target)
    for folder in {Path(os.path.realpath(path)).parent for path in contents}:
        _settle(folder)


@contextmanager
def replacing(path: Path, kind: str = "file") -> Iterator[Path]:
    """Write a file piece by piece so that ``path`` holds either all of it or its previous content.

    Args:
        path: the file.
        kind: name of the kind of file in error messages.

    Yields:
        A path under which the caller opens the new file, to write and, if needed, to read it again.

    Raises:
        RecordingError: the file cannot be written; nothing is left behind.
    """
    with _target(path, kind) as target, _draft(target.parent) as draft:
        yield draft.path
        os.fsync(draft.descriptor)
        draft.become(target)
    _settle(target.parent)


def check_writable(path: Path, kind: str = "recording") -> None:
    """Check that a file can be written, before the work on its content; remove leftovers from its folder.

    Args:
        path: the file.
        kind: name of the kind of file in error messages.

    Raises:
        RecordingError: the path is not that of a file, or its directory does not exist or cannot be written to.
    """
    with _target(path, kind) as target:
        with _draft(target.parent):
            pass
        _clear_leftovers(target.parent)


def make_folder(folder: Path) -> None:
    """Create a folder if it does not exist, check that files can be written to it, and remove leftovers from it.

    Raises:
        RecordingError: it cannot be made or written to.
    """
    with _explained(f"folder {str(folder)!r} cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    with _explained(f"folder {str(folder)!r} cannot be written to"), _draft(folder):
        pass
    _clear_leftovers(folder)


class _Draft(NamedTuple):
    """File that is being written.

    Attributes:
        descriptor: the open file.
        hidden: temporary name.
        nameless: True if it has no name yet.
    """

    descriptor: int
    hidden: Path
    nameless: bool

    @property
    def path(self) -> Path:
        """Path under which the file can be opened."""
        return _opened(self.descriptor) if self.nameless else self.hidden

    def fill(self, content: bytes | Iterable[bytes]) -> None:
        """Write all of the content to the disk."""
        for piece in (content,) if isinstance(content, bytes) else content:
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(self.descriptor, rest) :]
        os.fsync(self.descriptor)

    def become(self, target: Path) -> None:
        """Rename the file to the target, and replace an existing one."""
        if self.nameless:
            opened = _opened(self.descriptor)
            try:  # given src_dir_fd, Python follows the link that this is, as it must
                os.link(opened, target, src_dir_fd=self.descriptor)
                return
            except FileExistsError:  # only a file that has a name can replace it
                os.link(opened, self.hidden, src_dir_fd=self.descriptor)
        self.hidden.replace(target)


@contextmanager
def _draft(folder: Path) -> Iterator[_Draft]:
    hidden = folder / f".wrist-{os.urandom(8).hex()}.part"
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
    """Open a new file without a name in a folder; return None if the system does not support such files."""
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
def _target(path: Path, kind: str) -> Iterator[Path]:
    """Yield the file that a path leads to, checked to be a file or free; raise a RecordingError for system errors."""
    said = f"{kind} {str(path)!r} cannot be written"
    with _explained(said):
        target = Path(os.path.realpath(path))  # fails where the working directory was deleted
        if target.exists() and not target.is_file():
            found = "a directory" if target.is_dir() else "not a regular file"
            raise RecordingError(f"{said}: it is {found}; give the path of a file")
        if _inputs and target.exists() and (target.stat().st_dev, target.stat().st_ino) in _inputs:
            raise RecordingError(f"{said}: it is an input of this command; give another path")
        yield target


@contextmanager
def _explained(said: str) -> Iterator[None]:
    """Raise a RecordingError for a system error: the given text, the reason, and advice."""
    try:
        yield
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "choose another place")
        raise RecordingError(f"{said}: {error.strerror or error}; {advice}") from None


def _clear_leftovers(folder: Path) -> None:
    """Remove the hidden files that killed commands have left in a folder; those of running commands are younger."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError):
                if _LEFTOVER.fullmatch(entry.name) and time.time() - entry.stat().st_mtime > LEFT_AFTER:
                    Path(entry).unlink()


def _settle(directory: Path) -> None:
    """Flush a directory, so that a rename survives a power cut; the file itself is complete in any case."""
    with suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
