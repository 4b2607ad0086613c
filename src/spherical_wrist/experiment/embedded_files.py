"""Files embedded in a recording: model, recorded motion, and Python files of the user's own.

With them, a recording can be simulated again elsewhere, and checked.
"""

import io
import os
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple, Self

from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.files import make_folder, write_together
from spherical_wrist.parameters import Member
from spherical_wrist.wrist import default_model, model_files

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time of every file in an archive: the same files make the same archive."""

LARGEST = 1 << 30
"""Most bytes that an archive may unpack to."""


class EmbeddedFiles(NamedTuple):
    """Files embedded in a recording, keyed by archive path.

    Attributes:
        places: path in ``files`` of every parameter that stands for a file, by dotted name.
        files: contents by path; files that belong together lie beside each other as they did on disk.
    """

    places: Mapping[str, str] = {}
    files: Mapping[str, bytes] = {}

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Collect the files of an experiment as they are now; Python files as they were loaded.

        Raises:
            ModelError: the model cannot be read.
        """
        places: dict[str, str] = {}
        files: dict[str, bytes] = {}
        for name, group in _groups(experiment):
            first, root = next(iter(group)), Path(os.path.commonpath([file.parent for file in group]))
            inside = {file: f"{name}/{file.relative_to(root).as_posix()}" for file in group}
            places[name] = inside[first]
            files |= {inside[file]: content for file, content in group.items()}
        return cls(places, files)

    @property
    def code(self) -> list[str]:
        """Names of the parts of the experiment that are Python code of the user's own."""
        return [name for name, place in self.places.items() if place.endswith(".py")]

    def digest(self, name: str) -> str | None:
        """Return twelve digits of the SHA-256 of the files of a parameter, by dotted name; None without any."""
        group = {path: content for path, content in self.files.items() if path.startswith(f"{name}/")}
        digest = sha256()
        for path, content in sorted(group.items()):
            digest.update(path.encode() + b"\0" + sha256(content).digest())
        return digest.hexdigest()[:12] if group else None

    def archive(self) -> bytes:
        """Pack all files into one ZIP archive; the same files give the same bytes."""
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
            for path, file in sorted(self.files.items()):
                archive.writestr(zipfile.ZipInfo(path, EPOCH), file, zipfile.ZIP_DEFLATED)
        return content.getvalue()

    @classmethod
    def from_archive(cls, places: Mapping[str, str], content: bytes) -> Self:
        """Unpack the bytes that :meth:`archive` returned.

        Raises:
            ValueError: it is no such archive.
        """
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                if sum(info.file_size for info in archive.infolist()) > LARGEST:
                    raise ValueError(f"the files in it are larger than {LARGEST} bytes")
                files = {info.filename: archive.read(info) for info in archive.infolist()}
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
            raise ValueError(f"its archive of files is damaged: {error}") from None
        for path in (*files, *places.values()):
            if PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts or path not in files:
                raise ValueError(f"its archive of files has a path that leads nowhere: {path!r}")
        return cls(dict(places), files)

    def unpack(self, folder: Path) -> None:
        """Write the files to a folder.

        Raises:
            RecordingError: they cannot be written.
        """
        for path in self.files:
            make_folder((folder / path).parent)
        write_together({folder / path: content for path, content in self.files.items()})

    def described(self, description: Mapping[str, Any], folder: Path) -> dict[str, Any]:
        """Return a description of an experiment with every path replaced by that of the file in an unpacked folder."""
        replaced = dict(description)
        for name, place in self.places.items():
            file = str(folder / place)
            part, _, parameter = name.partition(".")
            if parameter:
                replaced[part] = {**replaced[part], parameter: file}
            elif part in PARTS:
                replaced[part] = {**replaced[part], "name": f"{file}:{replaced[part]['name'].rpartition(':')[2]}"}
            else:
                replaced[part] = file
        return replaced


def _groups(experiment: Experiment) -> Iterator[tuple[str, Mapping[Path, bytes]]]:
    """Yield, for every parameter that stands for a file, that file first and then the files that it needs."""
    yield "model", model_files(experiment.model or default_model())
    for name in PARTS:
        part: Member = getattr(experiment, name)
        if type(part).files:
            yield name, type(part).files
        for parameter in type(part).model_fields:
            file = getattr(part, parameter)
            if isinstance(file, Path):
                yield f"{name}.{parameter}", _only(file)


def _only(file: Path) -> dict[Path, bytes]:
    try:
        return {file.resolve(): file.read_bytes()}
    except OSError as error:
        raise RecordingError(f"file {str(file)!r} cannot be read: {error.strerror or error}") from None
