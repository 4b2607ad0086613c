"""Laws, references and disturbances from a user's own Python file."""

import hashlib
import importlib.util
import re
import sys
import traceback
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

from spherical_wrist.errors import UnknownNameError, as_exception, listed, one_line
from spherical_wrist.files import read_whole

if TYPE_CHECKING:
    from spherical_wrist.parameters import Member


MOST_FILES, LARGEST = 50, 1_000_000
"""Files of a folder that are looked through for a class, and the size [bytes] up to which they are."""

MODULE = "user_law_"
"""Beginning of the names of modules that are users' files."""


class UserFile(NamedTuple):
    """A user's file as it was loaded.

    Attributes:
        module: the loaded module.
        files: the file and the modules of its own folder that came in with it, as they were read then.
    """

    module: ModuleType
    files: Mapping[Path, bytes]


def member_from_file(address: str, family: "type[Member]") -> "type[Member]":
    """Return the member of a family that ``path/to/file.py:Name`` stands for, or ``path/to/file.py`` with one member.

    Args:
        address: file and name; the name is that of the class, or the same in snake case.
        family: such as ``Law``, the class that the members derive from.

    Raises:
        WristError: of the family's kind: there is no such file, running it raises, or it defines no member.
        UnknownNameError: it defines none of that name; the message has those that it does.
    """
    kind = family.kind
    file, _, name = (address, "", "") if address.endswith(".py") else address.rpartition(":")
    path = Path(file).expanduser().resolve()
    if path.suffix != ".py":  # Python would also run bytecode
        raise family.fault(f"{kind} {address!r}: {file!r} is not a Python file; give path/to/file.py:Name")
    if not path.is_file():
        raise family.fault(f"{kind} {address!r}: no such file {file!r}; give path/to/file.py:Name")
    try:
        loaded = _loaded(path, read_whole(path))
    except _FileError as error:
        raise family.fault(f"{kind} file {str(path)!r}{error}") from None
    except OSError as error:
        raise family.fault(f"{kind} file {str(path)!r} cannot be read: {error.strerror or error}") from None
    members = {
        member.__name__: member
        for member in vars(loaded.module).values()
        if isinstance(member, type) and issubclass(member, family) and member.__module__ == loaded.module.__name__
    }
    if not members:
        raise family.fault(f"{kind} {address!r}: the file defines no subclass of {_import_path(family)}")
    addresses = [f"{file}:{each}" for each in members]
    for member in members.values():
        if name in (member.__name__, member.name) or (not name and len(members) == 1):
            member.address, member.files = f"{path}:{member.__name__}", loaded.files
            return member
    if name:
        raise UnknownNameError(kind, name, members, f" in {file}")
    raise family.fault(f"{kind} {file!r}: the file has several, give one of them: {listed(addresses)}")


def file_with_class(name: str, folder: Path) -> str:
    """Return the Python file of a folder that defines a class, as ``file.py:Name``; empty if there is none.

    The files are read, not run.
    """
    if not name.isidentifier():
        return ""
    defined = re.compile(rf"^class {name}\b", re.MULTILINE)
    for path in sorted(folder.glob("*.py"))[:MOST_FILES]:
        try:
            if path.stat().st_size <= LARGEST and defined.search(path.read_text(encoding="utf-8")):
                return f"{path.name}:{name}"
        except (OSError, ValueError):
            continue
    return ""


def user_line(error: BaseException) -> str:
    """Return the last line of a user's file that an error passed through, as text; empty if there is none."""
    places = [
        f"{frame.f_code.co_filename!r}, line {line}"
        for frame, line in traceback.walk_tb(error.__traceback__)
        if str(frame.f_globals.get("__name__")).startswith(MODULE)
    ]
    return places[-1] if places else ""


class _FileError(Exception):
    """A user's file cannot be loaded; the message follows its name."""


_helpers: set[str] = set()
"""Modules that the last file imported from its own folder; the next one's may have the same names."""


@cache
def _loaded(path: Path, content: bytes) -> UserFile:
    """Return the file as a module; the content is part of the key, so that an edited file is loaded anew.

    Raises:
        _FileError: it raises.
    """
    # the name must be the same in every process: compiled code that is cached on disk refers to it
    name = f"{MODULE}{hashlib.sha256(content).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    for helper in _helpers:
        sys.modules.pop(helper, None)
    before = set(sys.modules)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))  # its own helpers, as if it were run as a script
    files = {path: content}
    try:
        spec.loader.exec_module(module)
    except BaseException as error:  # a user's file may raise anything, SystemExit too
        del sys.modules[name]
        as_exception(error)
        line = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
        raise _FileError(f"{line}: {type(error).__name__}: {one_line(error)}") from None
    finally:
        sys.path.remove(str(path.parent))
        for each in set(sys.modules) - before - {name}:
            if helper_file := _file_in(sys.modules[each], path.parent):
                _helpers.add(each)
                files[helper_file] = helper_file.read_bytes()
    return UserFile(module, files)


def _import_path(family: type) -> str:
    """Return the import path of a class: the package that offers it, else its own module."""
    package = family.__module__.rpartition(".")[0]
    offered = getattr(sys.modules.get(package), family.__name__, None) is family
    return f"{package if offered else family.__module__}.{family.__name__}"


def _file_in(module: ModuleType, folder: Path) -> Path | None:
    """Return the file of a module that lies in a folder of the user's; None of others."""
    file = Path(getattr(module, "__file__", None) or "").resolve()
    own = file.suffix == ".py" and file.is_relative_to(folder) and not file.is_relative_to(Path(sys.prefix).resolve())
    return file if own else None
