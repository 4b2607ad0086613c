"""Files embedded in a recording: model, recorded motion, and Python files of the user's own.

With them, a recording can be simulated again elsewhere, and checked.
"""

import io
import os
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple, Self, get_args

from spherical_wrist.class_source import SourceError, class_source
from spherical_wrist.consent import is_code
from spherical_wrist.errors import RecordingError, one_line
from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.experiment.packed_files import LARGEST, PackedFiles, fingerprint
from spherical_wrist.files import make_folder, write_together
from spherical_wrist.parameters import Member, paths_of
from spherical_wrist.wrist import check_confined, default_model, model_files, portable

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time of every file in an archive: the same files make the same archive."""

_FOLDERS = re.compile(
    r"""(?:(?<=['"])(?:[A-Za-z]:|~)?[/\\](?:[^/\\'"\n]+[/\\])+"""  # in quotes, with spaces in it
    r"""|(?<![^\s(=:,])(?:[A-Za-z]:|~)?[/\\](?:[^/\\'"\s]+[/\\])+)"""
)
"""Absolute path of a folder within a text."""


class EmbeddedFiles(NamedTuple):
    """Files embedded in a recording, keyed by archive path.

    Attributes:
        places: path in ``files`` of every parameter that stands for a file, by dotted name.
        files: contents by path; files that belong together lie beside each other as they did on disk.
        missing: reasons for the parts of which the source is not known, by name of the part.
    """

    places: Mapping[str, str] = {}
    files: Mapping[str, bytes] = {}
    missing: Mapping[str, str] = {}

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Collect the files of an experiment as they are now; Python files as they were loaded.

        Raises:
            ModelError: the model cannot be read.
            RecordingError: a file cannot be read, or they are too large.
        """
        places: dict[str, str] = {}
        files: dict[str, bytes] = {}
        missing: dict[str, str] = {}
        for name, group in file_groups(experiment, missing):
            inside = {f"{name}/{path}": content for path, content in group.files.items()}
            places[name] = next(iter(inside))
            files |= inside
        size = sum(map(len, files.values()))
        if size > LARGEST:
            raise RecordingError(
                f"model, motion and Python files have together {size / 1e6:.0f} MB, and at most {LARGEST / 1e6:.0f} MB "
                "are recorded: make the meshes coarser, or run without a recording (--no-recording)"
            )
        return cls(places, files, missing)

    def digest(self, name: str) -> str | None:
        """Return twelve digits that tell the files of a parameter from others, by dotted name; None without any.

        They come from paths, sizes and checksums, for which nothing has to be unpacked.
        """
        group = sorted(path for path in self.files if _is_of(name, path))
        digest = sha256(repr([(path, *fingerprint(self.files, path)) for path in group]).encode())
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
        """Read the directory of the bytes that :meth:`archive` returned; files are unpacked when they are asked for.

        Raises:
            ValueError: it is no such archive.
        """
        files = PackedFiles(content)
        for path in places.values():
            if path not in files:
                raise ValueError(f"its archive of files lacks {one_line(repr(path), 60)}")
        for name in PARTS.keys() & places.keys():
            for path in (places[name], *(path for path in files if _is_of(name, path))):
                if not path.endswith(".py"):  # nobody can read bytecode and libraries, which Python would run too
                    raise ValueError(
                        f"its archive of files has {one_line(repr(path), 60)} as the Python file of its {name}"
                    )
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
        """Return a description of an experiment with every path replaced by that of the file in an unpacked folder.

        Raises:
            RecordingError: it names a file that is not among these.
        """
        named = files_named(description)
        for name, file in named.items():
            if name not in self.places:
                raise RecordingError(f"it names the file {one_line(file, 120)!r} as its {name}, and does not carry it")
        model = self.model(description, folder)
        replaced = {**description, "model": model and str(model)}
        for name, place in self.places.items():
            inside = str(folder / place)
            part, _, parameter = name.partition(".")
            table = _table(replaced.get(part))
            if name == "model":
                continue
            if part in PARTS and parameter in table and (name in named or is_code(table["name"])):
                replaced[part] = {**table, parameter: inside}
            elif name in named:
                replaced[part] = {**table, "name": f"{inside}:{named[name].rpartition(':')[2]}"}
            else:
                raise RecordingError(f"it carries a file as its {one_line(name, 120)}, which is none")
        return replaced

    def model(self, description: Mapping[str, Any], folder: Path) -> Path | None:
        """Return the model file in an unpacked folder; None for the default model, as it is here.

        Raises:
            RecordingError: the model is not carried, or asks for files that are not.
        """
        if "model" in self.places:
            model = folder / self.places["model"]
            check_confined(model, folder)
            carried = [content for path, content in self.files.items() if _is_of("model", path)]
            default = description.get("model") is None and carried == list(model_files(default_model()).values())
            return None if default else model
        if description.get("model") is not None:
            raise RecordingError(f"it names the model {one_line(description['model'], 120)!r}, and does not carry it")
        return None


def _is_of(name: str, path: str) -> bool:
    return path.startswith(f"{name}/")


def _as_on_disk(files: Mapping[Path, bytes]) -> dict[str, bytes]:
    """Return files by path below the folder that they have in common."""
    root = Path(os.path.commonpath([file.parent for file in files]))
    return {file.relative_to(root).as_posix(): content for file, content in files.items()}


def without_folders(description: Mapping[str, Any], places: Iterable[str]) -> dict[str, Any]:
    """Return a description of an experiment that names files without their folders: where they were concerns nobody.

    Args:
        description: the experiment as plain tables.
        places: parameters that stand for files, by dotted name.
    """
    short = dict(description)
    if short.get("model") is not None:
        short["model"] = file_name(short["model"])
    for part, family in PARTS.items():
        if isinstance(short.get(part), Mapping):
            table = dict(short[part])
            name = str(table.get("name"))
            table["name"] = file_name(name)
            fields = family.members[name].model_fields if name in family.members else {}
            of_files = {key for key in fields if _takes_path(fields[key].annotation)}
            of_files |= {place.rpartition(".")[2] for place in places if place.startswith(f"{part}.")}
            short[part] = table | {key: file_name(table[key]) for key in of_files if isinstance(table.get(key), str)}
    return short


def file_name(path: str) -> str:
    """Return a path of any system without its folders."""
    return re.split(r"[/\\]", path)[-1]


def text_without_folders(text: str) -> str:
    """Return a text in which files are named without their absolute folders."""
    return _FOLDERS.sub("", text)


def files_named(description: Mapping[str, Any]) -> dict[str, str]:
    """Return the files that the parts of a described experiment name, by dotted name; Python files as ``file.py:Name``.

    Raises:
        RecordingError: a part is described as no recording of this package describes it.
    """
    found = {}
    for part, family in PARTS.items():
        table = _table(description.get(part))
        name = table.get("name")
        if is_code(name):
            found[part] = str(name)
        elif name not in family.members:
            raise RecordingError(f"its {part} {one_line(repr(name), 120)} is not known to this version")
        else:
            fields = family.members[name].model_fields
            of_files = [key for key in fields if _takes_path(fields[key].annotation)]
            found |= {f"{part}.{key}": str(table[key]) for key in of_files if table.get(key) is not None}
    return found


def _takes_path(annotation: Any) -> bool:
    return annotation is Path or any(map(_takes_path, get_args(annotation)))


def _table(part: Any) -> dict[str, Any]:
    return dict(part) if isinstance(part, Mapping) else {"name": part}


class FileGroup(NamedTuple):
    """A file that an experiment names, with the files that it needs.

    Attributes:
        given: the text that names it in the description of the experiment; None for the default model.
        files: contents by the paths that they have to each other, the named file first.
    """

    given: str | None
    files: Mapping[str, bytes]


def file_groups(experiment: Experiment, missing: dict[str, str]) -> Iterator[tuple[str, FileGroup]]:
    """Yield the files of every parameter that stands for one, with its dotted name.

    Reasons for parts of which the source is not known are added to ``missing``.

    Raises:
        ModelError: the model cannot be read.
        RecordingError: a file cannot be read.
    """
    model = experiment.model
    yield "model", FileGroup(None if model is None else str(model), portable(model or default_model()))
    for name in PARTS:
        part: Member = getattr(experiment, name)
        if type(part).files:
            yield name, FileGroup(type(part).address, _as_on_disk(type(part).files))
        elif _is_own_class(name, part):
            try:
                yield name, FileGroup(type(part).address, _as_on_disk(_source_files(part)))
            except SourceError as error:
                missing[name] = str(error)
        for parameter, file in paths_of(part).items():
            yield f"{name}.{parameter}", FileGroup(str(file), _as_on_disk(_only(file)))


def _is_own_class(name: str, part: Member) -> bool:
    """Return True for a part of a class of the user's that does not come from a file by name."""
    return type(part) not in PARTS[name].members.values() and not is_code(type(part).address)


def _source_files(part: Member) -> dict[Path, bytes]:
    """Return the source of the class of a part as a file, and the modules beside it, in a folder that is not there."""
    text, modules = class_source(type(part))
    name = type(part).name
    while f"{name}.py" in modules:
        name += "_"
    return {Path("/", file): content for file, content in {f"{name}.py": text, **modules}.items()}


def description_of(experiment: Experiment, embedded_files: EmbeddedFiles) -> dict[str, Any]:
    """Return an experiment as plain tables, as it is recorded: files are named without their folders."""
    description = without_folders(experiment.model_dump(mode="json"), embedded_files.places)
    for name in PARTS.keys() & embedded_files.places.keys():
        if not is_code(description[name]["name"]):
            file = file_name(embedded_files.places[name])
            description[name]["name"] = f"{file}:{type(getattr(experiment, name)).__name__}"
    return description


def _only(file: Path) -> dict[Path, bytes]:
    try:
        return {file.resolve(): file.read_bytes()}
    except OSError as error:
        raise RecordingError(f"file {str(file)!r} cannot be read: {error.strerror or error}") from None
