"""Names of files in an MJCF file that comes from elsewhere.

MuJoCo opens whatever a model names, wherever it is. The names are therefore looked up in the text before MuJoCo parses.
"""

import os
import re
from pathlib import Path
from xml.etree import ElementTree

from spherical_wrist.errors import ModelError, one_line

FILE, FOLDER = re.compile(r"file(?!name)\w*"), re.compile(r"(mesh|texture|asset)dir")
"""Attributes of MJCF that name files (``file``, ``fileright`` ...), and folders of files."""


_OUTSIDE, _QUOTED = rb"""[^\[\]<>"']""", rb""""[^"]*"|'[^']*'"""
DOCTYPE = re.compile(rb"<!DOCTYPE(?:%b|%b)*(?:\[(?:%b|%b)*\]\s*)?>" % (_OUTSIDE, _QUOTED, rb"""[^\]"']""", _QUOTED))
"""Declaration of a document type, with what is declared in it."""

_PLAIN_DOCTYPE = re.compile(rb"""<!DOCTYPE(?:[^\[\]<>"']|"[^"<>]*"|'[^'<>]*')*>""")


def slashed(name: str) -> str:
    """Return a name of a file as MuJoCo reads it on every system: a backslash parts folders too."""
    return name.replace("\\", "/")


def text_named(tag: str, name: str, text: Path, main: Path) -> Path:
    """Return the MJCF file that an element of another one names.

    Args:
        tag: ``include`` or ``model``.
        name: what it names, with slashes.
        text: file that the element is in.
        main: MJCF file of the model, which may be the same.

    Returns:
        The first file that is there, where MuJoCo looks for it; the first place without any.
    """
    bases = (text.parent, main.parent) if tag == "model" else (main.parent, text.parent)
    places = [Path(os.path.normpath(base / name)) for base in bases]
    return next((each for each in places if each.is_file()), places[0])


def check_confined(model: Path, folder: Path) -> None:
    """Check that an MJCF file, and those that it includes or attaches, name only files within a folder.

    A name is looked for in every place that MuJoCo may look in: beside the model, beside the including file, and in the
    folders of assets. None of them may lie outside.

    Args:
        model: MJCF file in the folder.
        folder: folder without symbolic links, such as one that an archive was unpacked to.

    Raises:
        ModelError: a file is named outside of it, or a file is no XML.
    """
    root, waiting, checked = folder.resolve(), {model.resolve()}, set[Path]()
    while waiting:
        checked |= {each := waiting.pop()}
        waiting |= _attached(each, root) - checked


def _attached(model: Path, root: Path) -> set[Path]:
    """Check one model and the files that it includes, and return the models that it attaches."""
    elements, waiting, read = [], [model], set[Path]()
    while waiting:
        file = waiting.pop()
        if file in read or not file.is_file():
            continue
        read.add(file)
        found = _parsed(file)
        elements += [(file.parent, element) for element in found]
        for element in found:
            if element.tag.lower() == "include":  # as MuJoCo compares it
                waiting += [_within(base, element.get("file", ""), root) for base in (model.parent, file.parent)]
    dirs = [value for _, element in elements for key, value in element.items() if FOLDER.fullmatch(key)]
    attached = set()
    for here, element in elements:
        bases = {model.parent, here}
        if element.tag == "model":
            attached |= {_within(base, element.get("file", ""), root) for base in bases}
        for base in (*bases, *(_within(base, each, root) for base in bases for each in dirs)):
            for key, value in element.items():
                if FILE.fullmatch(key):
                    _within(base, value, root)
    return attached


def _parsed(file: Path) -> list[ElementTree.Element]:
    content = file.read_bytes()
    if b"<!ENTITY" in content:  # MuJoCo takes them as letters, and would read another name than is checked here
        raise ModelError(f"{file.name!r} declares entities, which MuJoCo does not know: write them out")
    if b"<!DOCTYPE" in _PLAIN_DOCTYPE.sub(b"", content):  # which ends for MuJoCo at the first ">" in it
        raise ModelError(f"{file.name!r} declares a document type, which MuJoCo reads in another way: leave it out")
    try:
        return list(ElementTree.fromstring(content).iter())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ModelError(f"{file.name!r} is not valid MJCF: {one_line(error)}") from None


def _within(base: Path, name: str, root: Path) -> Path:
    name = slashed(name)
    try:
        path = (base / name).resolve()
    except (OSError, ValueError, RuntimeError):
        path = Path("/")
    if Path(name).is_absolute() or name.startswith("~") or not path.is_relative_to(root):
        raise ModelError(f"it needs the file {one_line(name, 120)!r}, which is outside of what it came with")
    return path
