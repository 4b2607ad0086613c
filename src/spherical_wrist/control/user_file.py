"""Laws from a user's own Python file."""

import hashlib
import importlib.util
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from spherical_wrist.errors import LawError, UnknownNameError, one_line

if TYPE_CHECKING:
    from spherical_wrist.control.contract import Law


def law_from_file(address: str, base: "type[Law]") -> "type[Law]":
    """The subclass of ``base`` that ``path/to/file.py:Name`` stands for.

    Args:
        address: file and name; the name is that of the class, or the same in snake case.
        base: the class that laws derive from.

    Raises:
        LawError: there is no such file, running it raises, or it defines no law.
        UnknownNameError: it defines no law of that name; the message has those that it does.
    """
    file, _, name = address.rpartition(":")
    path = Path(file).expanduser().resolve()
    if not path.is_file():
        raise LawError(f"law {address!r}: no such file {file!r}; give path/to/file.py:Name")
    module = _module(path, path.read_bytes())
    laws = {
        law.__name__: law
        for law in vars(module).values()
        if isinstance(law, type) and issubclass(law, base) and law.__module__ == module.__name__
    }
    if not laws:
        raise LawError(f"law {address!r}: the file defines no subclass of spherical_wrist.control.Law")
    for law in laws.values():
        if name in (law.__name__, law.name):
            law.address = f"{path}:{law.__name__}"
            return law
    raise UnknownNameError("law", name, laws, f" in {file}")


_helpers: set[str] = set()
"""Modules that the last law file imported from its own folder; the next one's may have the same names."""


@cache
def _module(path: Path, content: bytes) -> ModuleType:
    """The file as a module; the content is part of the key, so that an edited file is loaded anew."""
    # the name must be the same in every process: compiled code that is cached on disk refers to it
    name = f"user_law_{hashlib.sha256(content).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise LawError(f"law file {str(path)!r} is not a Python file")
    for helper in _helpers:
        sys.modules.pop(helper, None)
    before = set(sys.modules)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))  # its own helpers, as if it were run as a script
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # a user's file may raise anything
        del sys.modules[name]
        where = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
        raise LawError(f"law file {str(path)!r}{where}: {type(error).__name__}: {one_line(error)}") from None
    finally:
        sys.path.remove(str(path.parent))
        fresh = set(sys.modules) - before - {name}
        _helpers.update(each for each in fresh if _lies_in(sys.modules[each], path.parent))
    return module


def _lies_in(module: ModuleType, folder: Path) -> bool:
    file = getattr(module, "__file__", None)
    return file is not None and Path(file).resolve().parent == folder
