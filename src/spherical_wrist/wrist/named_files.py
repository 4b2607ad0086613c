"""Names of files in MJCF: those of a model to be sent elsewhere, and those of a model that comes from elsewhere.

MuJoCo opens whatever a model names, wherever it is. The names are therefore looked up in the text before MuJoCo parses.
"""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import escape, unescape

from spherical_wrist.errors import ModelError, one_line

FILE, FOLDER = re.compile(r"file(?!name)\w*"), re.compile(r"(mesh|texture|asset)dir")
"""Attributes of MJCF that name files (``file``, ``fileright`` ...), and folders of files."""
_NAMED = re.compile(rb"""\b(file(?!name)\w*|(?:mesh|texture|asset)dir)(\s*=\s*)(["'])(.*?)\3""", re.DOTALL)
_ELEMENT = re.compile(rb"""<(\w+)((?:[^<>"']|"[^"]*"|'[^']*')*)>""")
_QUOTES = {"&quot;": '"', "&apos;": "'"}


def portable(files: Mapping[Path, bytes]) -> tuple[Mapping[Path, bytes], Path]:
    """Write absolute names, and those by way of symbolic links, relative, so that a model can be moved with its files.

    Args:
        files: contents of an MJCF file and of all files that it needs, by resolved path, the file itself first.

    Returns:
        The contents, changed where such names stand, and the folder that all names stay within.
    """
    main = next(iter(files))
    texts = {file: content for file, content in files.items() if file == main or content.lstrip()[:1] == b"<"}
    named = [(key, _plain(value)) for text in texts.values() for key, _, _, value in _NAMED.findall(text)]
    folders = [main.parent / value for key, value in named if FOLDER.fullmatch(key.decode())]
    used = [each.resolve() for each in folders if any(file.is_relative_to(each.resolve()) for file in files)]
    root = Path(os.path.commonpath([*(file.parent for file in files), *used]))

    def rewritten(here: Path, element: bytes, key: str, value: str) -> str:
        if FOLDER.fullmatch(key):
            return _moved(main.parent, value)
        beside = (main.parent, here.parent) if element == b"include" else (*folders, main.parent, here.parent)
        base = next((base for base in beside if (base / value).resolve() in files), None)
        return value if base is None else _moved(base, value)

    def changed(here: Path, content: bytes) -> bytes:
        def named_in(element: re.Match[bytes]) -> bytes:
            def replaced(found: re.Match[bytes]) -> bytes:
                key, equals, quote, value = found.groups()
                plain = _plain(value)
                new = rewritten(here, element[1], key.decode(), plain)
                return found[0] if new == plain else key + equals + quote + _written(new, quote) + quote

            return _NAMED.sub(replaced, element[0])

        return _ELEMENT.sub(named_in, content)

    return {file: changed(file, content) if file in texts else content for file, content in files.items()}, root


def _moved(base: Path, name: str) -> str:
    """Return the same name where it is relative and without symbolic links, else a relative one of the same file."""
    base, target = base.resolve(), (base / name).resolve()
    straight = not Path(name).is_absolute() and Path(os.path.normpath(base / name)) == target
    return name if straight else Path(os.path.relpath(target, base)).as_posix()


def _plain(value: bytes) -> str:
    return unescape(os.fsdecode(value), _QUOTES)


def _written(name: str, quote: bytes) -> bytes:
    return os.fsencode(escape(name, {'"': "&quot;"} if quote == b'"' else {"'": "&apos;"}))


def check_confined(model: Path, folder: Path) -> None:
    """Check that an MJCF file, and those that it includes, name only files within a folder.

    A name is looked for in every place that MuJoCo may look in: beside the model, beside the including file, and in the
    folders of assets. None of them may lie outside.

    Args:
        model: MJCF file in the folder.
        folder: folder without symbolic links, such as one that an archive was unpacked to.

    Raises:
        ModelError: a file is named outside of it, or a file is no XML.
    """
    root, elements, waiting, read = folder.resolve(), [], [model.resolve()], set[Path]()
    while waiting:
        file = waiting.pop()
        if file in read or not file.is_file():
            continue
        read.add(file)
        try:
            found = list(ElementTree.fromstring(file.read_bytes()).iter())
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            raise ModelError(f"{file.name!r} is not valid MJCF: {one_line(error)}") from None
        elements += [(file.parent, element) for element in found]
        for element in found:
            if element.tag == "include":
                bases = {model.resolve().parent, file.parent}
                waiting += [_within(base, element.get("file", ""), root) for base in bases]
    dirs = [value for _, element in elements for key, value in element.items() if FOLDER.fullmatch(key)]
    for here, element in elements:
        bases = {model.resolve().parent, here}
        for base in (*bases, *(_within(base, each, root) for base in bases for each in dirs)):
            for key, value in element.items():
                if FILE.fullmatch(key):
                    _within(base, value, root)


def _within(base: Path, name: str, root: Path) -> Path:
    try:
        path = (base / name).resolve()
    except (OSError, ValueError, RuntimeError):
        path = Path("/")
    if Path(name).is_absolute() or name.startswith("~") or not path.is_relative_to(root):
        raise ModelError(f"it needs the file {one_line(name, 120)!r}, which is outside of what it came with")
    return path
