"""Files that an MJCF file needs, and the same files in a form that can be moved."""

import html
import os
import re
from collections import OrderedDict, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco

from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.files import read_whole
from spherical_wrist.wrist.mjcf import read_spec
from spherical_wrist.wrist.model_sizes import COMMENT
from spherical_wrist.wrist.named_files import DOCTYPE, FILE, FOLDER, check_confined, slashed, text_named

_ELEMENT = re.compile(rb"""<(\w+)((?:[^<>"']|"[^"]*"|'[^']*')*)>""")
_ATTRIBUTE = re.compile(rb"""\b(\w+)\s*=\s*(["'])(.*?)\2""", re.DOTALL)
_REFERENCE = re.compile(r"&(#x[0-9a-fA-F]+|#[0-9]+|quot|amp|apos|lt|gt);")
"""Reference to a character; MuJoCo knows no others."""

_KEPT = 16
"""Models whose files are kept in memory."""


class _Name(NamedTuple):
    """Name of a file in a text: the text's path, where the name begins and ends in it, and the path of that file."""

    text: Path
    begin: int
    end: int
    file: Path
    is_text: bool


class _Model:
    """Files of a model: contents by path, the MJCF file first, and the same in the form that can be moved."""

    def __init__(self, contents: Mapping[Path, bytes], names: Sequence[_Name]) -> None:
        self.contents, self._names = contents, names

    @cached_property
    def portable(self) -> Mapping[str, bytes]:
        return _moved(self.contents, self._names)


_models: OrderedDict[Path, _Model] = OrderedDict()


def model_files(path: Path) -> Mapping[Path, bytes]:
    """Read an MJCF file and all files that it includes, attaches, or takes shapes and pictures from.

    Finding out which files these are takes a hundred times as long as reading them, so the last few answers are kept.
    They hold as long as no content has changed.

    Returns:
        Contents by absolute path, the file itself first.

    Raises:
        ModelError: the file is not valid MJCF, or names files that do not exist or cannot be read.
    """
    return _model(path).contents


def portable(path: Path) -> Mapping[str, bytes]:
    """Read the files of a model such that they can be moved together, by the paths that they have to each other.

    They stay as they are where all names are relative, without symbolic links, and stay within the folder of the model
    wherever MuJoCo may look for them. Otherwise all MJCF files stand beside each other, with folders of assets beside
    them, and no folder keeps its name: then every way of looking for a file leads to the same one. Folders above the
    model's are nobody's concern. Comments that are no XML, and
    declarations of a document type, which MuJoCo skips, are left out.

    Raises:
        ModelError: as :func:`model_files` raises; or a text is one that MuJoCo reads, and is no XML.
    """
    return _model(path).portable


def _moved(contents: Mapping[Path, bytes], names: Sequence[_Name]) -> dict[str, bytes]:
    main = next(iter(contents))
    texts = {main, *(name.file for name in names if name.is_text)}
    contents = {file: _well_formed(file, content) if file in texts else content for file, content in contents.items()}
    root = main.parent
    try:
        check_confined(main, root)
    except ModelError:
        return _flat(contents, names)
    elements = [element for file in texts for element in _elements(contents[file])]
    folders = {
        key for tag, attributes in elements if tag == "compiler" for key, _ in attributes if FOLDER.fullmatch(key)
    }
    # MuJoCo may look in one of them if a file is there, and read it from the other
    ambiguous = "assetdir" in folders and len(folders) > 1
    if ambiguous or any(file.resolve() != file for file in contents):
        return _flat(contents, names)
    return {file.relative_to(root).as_posix(): content for file, content in contents.items()}


def _flat(contents: Mapping[Path, bytes], names: Sequence[_Name]) -> dict[str, bytes]:
    """Return the files with all texts beside each other, assets in folders beside them, and names that fit."""
    taken, folders = set[str](), dict[Path, str]()
    main = next(iter(contents))
    texts = dict.fromkeys([main, *(name.file for name in names if name.is_text)])
    places = {file: _free(file.name, taken) for file in texts}
    for file in contents.keys() - texts.keys():
        if file.parent not in folders:
            folders[file.parent] = _free("assets", taken)
        places[file] = f"{folders[file.parent]}/{file.name}"  # an asset without a name is called like its file
    edits = defaultdict[Path, dict[tuple[int, int], bytes]](dict)
    for name in names:
        edits[name.text][name.begin, name.end] = html.escape(places[name.file]).encode()
    for file in texts:
        for tag, attributes in _elements(contents[file]):
            if tag == "compiler":
                without = {(a.start(), a.end()): b"" for key, a in attributes if FOLDER.fullmatch(key)}
                edits[file] |= without | {(a.start(), a.end()): b"" for key, a in attributes if key == "strippath"}
    return {places[file]: _edited(content, edits[file]) for file, content in contents.items()}


def _well_formed(file: Path, content: bytes) -> bytes:
    """Return a text with blanks for what MuJoCo skips and XML does not: hyphens and any bytes in comments, a DOCTYPE.

    Raises:
        ModelError: it is no XML then either, so that nobody who gets it could look through it.
    """
    content = DOCTYPE.sub(_blank, content)
    for text in (content, COMMENT.sub(_blank, content)):
        try:
            ElementTree.fromstring(text)
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            reason = one_line(error)
        else:
            return text
    raise ModelError(
        f"model {str(file)!r} cannot be recorded, because it is no XML ({reason}): write it as XML, and out what is an "
        "entity, which MuJoCo takes as letters; or run without a recording"
    )


def _blank(comment: re.Match[bytes]) -> bytes:
    return re.sub(rb"[^\n]", b" ", comment[0])


def _free(name: str, taken: set[str]) -> str:
    """Return a name that is not taken on any system, as it is or numbered, and take it."""
    stem, dot, suffix = name.rpartition(".") if "." in name else (name, "", "")
    number = 1
    while name.lower() in taken:
        number += 1
        name = f"{stem}_{number}{dot}{suffix}"
    taken.add(name.lower())
    return name


def _edited(content: bytes, edits: Mapping[tuple[int, int], bytes]) -> bytes:
    for (begin, end), new in sorted(edits.items(), reverse=True):
        content = content[:begin] + new + content[end:]
    return content


def _model(path: Path) -> _Model:
    path = _joined(Path.cwd(), path)
    path = path.parent.resolve() / path.name  # MuJoCo looks beside a link, not beside what it leads to
    kept = _models.pop(path, None)
    try:
        if kept is None or any(read_whole(file) != content for file, content in kept.contents.items()):
            kept = None
    except OSError:
        kept = None
    try:
        found = kept or _read(path)
    except OSError as error:
        raise ModelError(f"model {str(path)!r}: {error.filename!r} cannot be read: {error.strerror}") from None
    _models[path] = found
    while len(_models) > _KEPT:
        _models.popitem(last=False)
    return found


def _read(path: Path) -> _Model:
    spec = read_spec(path)
    names = tuple(_names(path, path, spec, spec.strippath))
    files = dict.fromkeys([path, *(name.file for name in names)])
    missing = [str(file) for file in files if not file.is_file()]
    if missing:
        raise ModelError(f"model {str(path)!r} needs {missing[0]!r}, which is not there")
    return _Model({file: read_whole(file) for file in files}, names)


def _names(text: Path, main: Path, spec: mujoco.MjSpec, strip: bool) -> Iterator[_Name]:
    """Yield all names of files in a text of a model, in the texts that it includes, and in models that it attaches.

    Which names of assets MuJoCo took as they are, and which it took to be beside the including file, is in the spec, as
    are the folders of assets. The spec has neither included files nor those of flexible bodies.

    Args:
        text: MJCF file to look in.
        main: MJCF file of the model, which may be the same.
        spec: the model as MuJoCo parsed it.
        strip: True if MuJoCo uses assets' names without their folders; the outermost model says so.
    """
    meshes = {_tidy(each.file) for each in (*spec.meshes, *spec.hfields, *spec.skins)}
    pictures = {_tidy(each) for texture in spec.textures for each in (texture.file, *texture.cubefiles)}
    for tag, attributes in _elements(read_whole(text)):
        for key, found in attributes:
            name = _tidy(_REFERENCE.sub(lambda each: html.unescape(each[0]), os.fsdecode(found[3])))
            if not FILE.fullmatch(key) or not found[3]:
                continue
            if tag in ("include", "model"):
                file = text_named(tag, name, text, main)
            else:
                folder = spec.texturedir if tag == "texture" else spec.meshdir
                if tag == "flexcomp":
                    as_it_is = text == main or _joined(main.parent, name).is_file()
                else:
                    as_it_is = name in (pictures if tag == "texture" else meshes)
                name = name if as_it_is else str(_joined(text.parent, name))
                file = _joined(main.parent, slashed(folder), Path(name).name if strip else name)
            yield _Name(text, *found.span(3), file, tag in ("include", "model"))
            if tag == "include":
                yield from _names(file, main, spec, strip)
            elif tag == "model":
                yield from _names(file, file, read_spec(file), strip)


def _elements(content: bytes) -> Iterator[tuple[str, list[tuple[str, re.Match[bytes]]]]]:
    """Yield every element of a text that is not in a comment: its tag, and its attributes by key, with their places."""
    content = COMMENT.sub(_blank, content)
    for element in _ELEMENT.finditer(content):
        attributes = _ATTRIBUTE.finditer(content, *element.span(2))
        yield element[1].decode(), [(found[1].decode(), found) for found in attributes]


def _tidy(name: str) -> str:
    return os.path.normpath(slashed(name))


def _joined(*parts: Path | str) -> Path:
    """Return a path as MuJoCo joins it: an absolute part stands for itself, and ``..`` goes by the text."""
    return Path(os.path.normpath(Path(*parts)))
