"""Files in an archive, read one by one when they are asked for."""

import io
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath

from spherical_wrist.errors import RecordingError, one_line

LARGEST, MOST = 1 << 28, 10_000
"""Most bytes that an archive may unpack to, and most files in it."""

_ENTRY = b"PK\x01\x02"
"""Beginning of every entry of the directory of a ZIP archive."""

_FAULTS = (
    zipfile.BadZipFile, zlib.error, struct.error, NotImplementedError, RuntimeError, EOFError, OSError, OverflowError,
    ValueError,
)  # fmt: skip
"""Errors that reading a damaged archive raises."""


class PackedFiles(Mapping[str, bytes]):
    """Files in a ZIP archive by path; only its directory is read until a file is asked for.

    Args:
        content: of the archive.

    Raises:
        ValueError: it is no archive, has too many files or too large ones, or paths that lead out of a folder.
    """

    def __init__(self, content: bytes) -> None:
        if content.count(_ENTRY) > MOST:
            raise ValueError(f"its archive has more than {MOST} files")
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(content))
        except _FAULTS as error:
            raise ValueError(f"its archive of files is damaged: {one_line(error, 100)}") from None
        entries = self._archive.infolist()
        self._entries = {entry.filename: entry for entry in entries}
        if sum(entry.file_size for entry in entries) > LARGEST:
            raise ValueError(f"the files in it are larger than {LARGEST / 1e6:.0f} MB")
        for entry in entries:
            _check_path(entry.filename)
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or entry.flag_bits & 1:
                raise ValueError(f"its archive has packed {one_line(repr(entry.filename), 60)} in another way")
        if len(self._entries) < len(entries):
            raise ValueError("its archive has two files of one path")

    def __getitem__(self, path: str) -> bytes:
        """Unpack a file.

        Raises:
            KeyError: there is none of that path.
            RecordingError: it is damaged.
        """
        entry = self._entries[path]
        try:
            return self._archive.read(entry)
        except _FAULTS as error:
            raise RecordingError(f"the file {path!r} in the recording is damaged: {one_line(error, 100)}") from None

    def __contains__(self, path: object) -> bool:
        """Return True for the path of a file, which is not unpacked for it."""
        return path in self._entries

    def __iter__(self) -> Iterator[str]:
        """Iterate over the paths."""
        return iter(self._entries)

    def __len__(self) -> int:
        """Return the number of files."""
        return len(self._entries)

    def fingerprint(self, path: str) -> tuple[int, int]:
        """Return size and CRC-32 of a file, from the directory."""
        return self._entries[path].file_size, self._entries[path].CRC


def fingerprint(files: Mapping[str, bytes], path: str) -> tuple[int, int]:
    """Return size and CRC-32 of a file, without unpacking it where it is packed."""
    return files.fingerprint(path) if isinstance(files, PackedFiles) else (len(files[path]), zlib.crc32(files[path]))


def _check_path(path: str) -> None:
    """Check that a path leads to a file within the folder that it is unpacked to.

    Raises:
        ValueError: it does not.
    """
    pure = PurePosixPath(path)
    odd = pure.is_absolute() or ".." in pure.parts or pure.as_posix() != path or "\0" in path or path == "."
    if odd or (os.name == "nt" and ("\\" in path or ":" in path)):
        raise ValueError(f"its archive of files has a path that leads nowhere: {one_line(repr(path), 60)}")
