"""Machine code on disk: one file per compiled function, named by the digest of everything it was compiled from.

A file is read only if its checksum is right, and nothing in it is executed or unpickled before. Whatever is wrong with
the folder or a file costs a compilation and a warning.
"""

import errno
import hashlib
import json
import os
import stat
import tempfile
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path

from spherical_wrist.files import read_whole
from spherical_wrist.loop.machine_code import MachineCode

MAGIC = b"spherical-wrist machine code 1\n"
KEPT = 512
"""Number of files kept; the oldest are deleted."""


AGAIN = "compiled code in {!r} is not used, and compiled again: {}"
"""Warning about a file that cannot be used."""

ROOT = 0
"""Number of the user whose files may be used besides one's own: they may have come with an installation."""


def folder() -> Path:
    """Return the folder of the cache, created if need be.

    It is ``WRIST_CACHE_DIR``, or ``spherical-wrist`` in ``XDG_CACHE_HOME`` or ``~/.cache``. Code from it is run: a
    folder of another user than root, or one that others may write to, is not used.

    Raises:
        OSError: there can be none.
    """
    own = os.environ.get("WRIST_CACHE_DIR")
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    except RuntimeError as error:  # no home folder
        raise OSError(errno.ENOENT, str(error)) from None
    path = Path(own) if own else Path(base) / "spherical-wrist"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
    except ValueError as error:  # a zero in its name
        raise OSError(errno.EINVAL, str(error)) from None
    _check_owner(path.stat())
    return path


def _check_owner(found: os.stat_result) -> None:
    """Refuse a folder or file that another user than root owns, or may write to.

    Raises:
        OSError: it is such.
    """
    if hasattr(os, "getuid") and found.st_uid not in (ROOT, os.getuid()):
        raise OSError(errno.EPERM, "it belongs to another user")
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise OSError(errno.EPERM, "other users may write to it")


def read(key: str) -> MachineCode | None:
    """Return the machine code of a key; None if there is none. A warning names a file that cannot be used."""
    try:
        path = folder() / f"{key}.object"
    except OSError:
        return None  # told when it is written
    try:
        content = read_whole(path)
        _check_owner(path.stat())
        checksum, body = content[len(MAGIC) : len(MAGIC) + 32], content[len(MAGIC) + 32 :]
        if not content.startswith(MAGIC) or checksum != _checksum(key, body):
            _warn(AGAIN.format(str(path), "it is damaged"))
            return None
        header, _, code = body.partition(b"\n")
        symbol, words, imports = json.loads(header)
        return MachineCode(symbol, words, tuple(imports), code)
    except FileNotFoundError:
        return None
    except OSError as error:
        _warn(AGAIN.format(str(path), error.strerror or error))
    except (ValueError, TypeError) as error:
        _warn(AGAIN.format(str(path), error))
    return None


def write(key: str, machine_code: MachineCode) -> None:
    """Keep machine code under a key; a warning tells if that is not possible."""
    try:
        _write(folder(), key, machine_code)
    except OSError as error:
        place = os.environ.get("WRIST_CACHE_DIR") or "~/.cache/spherical-wrist"
        reason = error.strerror or error
        _warn(f"compiled code cannot be kept in {place!r}, so that every process compiles again: {reason}")


def _write(path: Path, key: str, machine_code: MachineCode) -> None:
    header = json.dumps([machine_code.symbol, machine_code.words, machine_code.imports]).encode()
    body = header + b"\n" + machine_code.code
    descriptor, name = tempfile.mkstemp(prefix=f"{key[:8]}-", suffix=".part", dir=path)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(MAGIC + _checksum(key, body) + body)
        target = path / f"{key}.object"
        if target.is_dir():  # which no file can replace
            target.rmdir()
        Path(name).replace(target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    with suppress(OSError):  # another process removes them too
        _remove_oldest(path)


@cache
def _warn(text: str) -> None:
    """Warn once a process."""
    warnings.warn(text, stacklevel=2)


def _checksum(key: str, body: bytes) -> bytes:
    """Return a checksum that also ties the content to its name."""
    return hashlib.sha256(key.encode() + body).digest()


def _remove_oldest(path: Path) -> None:
    ages = sorted((file.stat().st_mtime, file) for file in path.glob("*.object"))
    for _, file in ages[: max(0, len(ages) - KEPT)]:
        file.unlink(missing_ok=True)
