"""The folder of a study: used by one command at a time."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spherical_wrist.errors import ParameterError
from spherical_wrist.files import make_folder

LOCK = ".lock"


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """The folder, made where there is none, for this command alone; the lock is the kernel's and ends with its holder.

    Raises:
        WristError: another command holds it, or it cannot be made or written to.
    """
    make_folder(folder)
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise ParameterError(f"folder {str(folder)!r} cannot be used: {error.strerror or error}") from None
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ParameterError(f"another command is tuning in {str(folder)!r}: wait for it") from None
        yield
    finally:
        os.close(descriptor)
