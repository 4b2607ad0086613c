"""Machine code on disk: one file per compiled function, named by the digest of everything it was compiled from.

A file is read only if its checksum is right, and nothing in it is executed or unpickled before. Whatever is wrong with
the folder or a file costs a compilation and nothing else.
"""

import hashlib
import json
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

from spherical_wrist.loop.machine_code import MachineCode

MAGIC = b"spherical-wrist machine code 1\n"
KEPT = 512
"""Number of files kept; the oldest are deleted."""


def folder() -> Path | None:
    """Return the folder of the cache, created if need be; None if there can be none.

    It is ``WRIST_CACHE_DIR``, or ``spherical-wrist`` in ``XDG_CACHE_HOME`` or ``~/.cache``. Code from it is run: a
    folder of another user, or one that others may write to, is not used.
    """
    try:
        own = os.environ.get("WRIST_CACHE_DIR")
        base = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
        path = Path(own) if own else Path(base) / "spherical-wrist"
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = path.stat()
    except (OSError, RuntimeError, ValueError):  # RuntimeError: no home folder
        return None
    if hasattr(os, "getuid") and (found.st_uid != os.getuid() or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        return None
    return path


def read(key: str) -> MachineCode | None:
    """Return the machine code of a key; None if there is none, or if its file is damaged."""
    path = folder()
    try:
        content = (path / f"{key}.object").read_bytes() if path else b""
        if not content.startswith(MAGIC):
            return None
        checksum, body = content[len(MAGIC) : len(MAGIC) + 32], content[len(MAGIC) + 32 :]
        if checksum != _checksum(key, body):
            return None
        header, _, code = body.partition(b"\n")
        symbol, words, imports = json.loads(header)
        return MachineCode(symbol, words, tuple(imports), code)
    except (OSError, ValueError, TypeError):
        return None


def write(key: str, machine_code: MachineCode) -> None:
    """Keep machine code under a key, if that is possible."""
    path = folder()
    if path is None:
        return
    header = json.dumps([machine_code.symbol, machine_code.words, machine_code.imports]).encode()
    body = header + b"\n" + machine_code.code
    with suppress(OSError):
        descriptor, name = tempfile.mkstemp(prefix=f"{key[:8]}-", suffix=".part", dir=path)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(MAGIC + _checksum(key, body) + body)
            Path(name).replace(path / f"{key}.object")
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        _remove_oldest(path)


def _checksum(key: str, body: bytes) -> bytes:
    """Return a checksum that also ties the content to its name."""
    return hashlib.sha256(key.encode() + body).digest()


def _remove_oldest(path: Path) -> None:
    ages = sorted((file.stat().st_mtime, file) for file in path.glob("*.object"))
    for _, file in ages[: max(0, len(ages) - KEPT)]:
        file.unlink(missing_ok=True)
