"""Folders that one command at a time works in."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spherical_wrist.errors import WristError
from spherical_wrist.files import make_folder

LOCK = ".lock"
"""Name of the lock file in the folder."""


@contextmanager
def folder_lock(folder: Path, error: type[WristError], work: str) -> Iterator[None]:
    """Hold a folder for this command alone, and make it if there is none.

    The lock belongs to the kernel: it ends with its holder, however that ends.

    Args:
        folder: the folder.
        error: class of the exception if another command holds the folder.
        work: what that command is doing, for the message, such as ``"tuning"``.

    Raises:
        WristError: another command holds the folder, or it cannot be made or written to.
    """
    make_folder(folder)
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as cause:
        raise error(f"folder {str(folder)!r} cannot be used: {cause.strerror or cause}") from None
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise error(f"another command is {work} in {str(folder)!r}: wait for it") from None
        yield
    finally:
        os.close(descriptor)
