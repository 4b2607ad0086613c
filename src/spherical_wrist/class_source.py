"""Source of a class that is defined in a module, a script, a notebook or an interactive session, as a file of its own.

Such a file has the class and everything of the user's that it names: functions, classes, constants with the values
that they have, and imports. Nothing else of the module is in it, so that a script does not run again where its law is
loaded. Modules of the user's own that are imported as modules are files beside it.
"""

import ast
import builtins
import linecache
import symtable
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sized
from functools import cached_property, lru_cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from spherical_wrist.errors import one_line

_PLAIN = (bool, int, float, str, bytes, type(None))
_LONGEST = 100_000
"""Most characters of a constant: an array of 5,000 numbers."""


class SourceError(Exception):
    """Source that is not known, or not whole; the message says why, in a phrase."""


def class_source(member: type) -> tuple[bytes, Mapping[str, bytes]]:
    """Return the text of a file that defines a class, and the contents of the modules beside it by relative path.

    Raises:
        SourceError: the source of something is not known, or something has a value that cannot be written down.
    """
    collector = _Collector()
    try:
        collector.add(member)
    except (TypeError, ValueError, AttributeError, OSError, RuntimeError, SyntaxError) as error:  # of odd definitions
        raise SourceError(f"the source of {member.__name__!r} is not understood: {one_line(error, 100)}") from None
    future = "from __future__ import annotations\n\n" if collector.postponed else ""
    text = future + "\n".join(sorted(collector.imports)) + "\n\n\n" + "\n\n\n".join(collector.texts) + "\n"
    _check(text, member)
    return text.encode(), collector.modules


class _Collector:
    """Collects the sources of definitions, those that others need first.

    Attributes:
        imports: import statements.
        texts: definitions.
        modules: contents of modules of the user's own, by relative path.
        postponed: True if annotations are not evaluated.
    """

    def __init__(self) -> None:
        self.imports: set[str] = set()
        self.texts: list[str] = []
        self.modules: dict[str, bytes] = {}
        self.postponed = False
        self._values: dict[str, Any] = {}

    def add(self, definition: type | FunctionType) -> str:
        """Add a class or function of the user's; return its name."""
        name = definition.__name__
        if self._known(name, definition):
            return name
        text = _definition(definition)
        self.postponed |= any(code.co_flags & _POSTPONED for code in map(_code, _functions(definition)))
        self._add_text(text, definition)
        return name

    def _add_text(self, text: str, near: type | FunctionType) -> None:
        """Add the text of a statement after the definitions of the names in it, as seen from a class or function."""
        for name in sorted(_names(text)):
            value = _lookup(near, name)
            if value is not _NOTHING:
                self._add_value(name, value, near)
        self.texts.append(text)

    def _known(self, name: str, value: Any) -> bool:
        if name in self._values:
            if self._values[name] is value:
                return True
            raise SourceError(f"two things in it have the name {name!r}")
        self._values[name] = value
        return False

    def _add_value(self, name: str, value: Any, near: type | FunctionType) -> None:
        """Add the definition of a name."""
        if isinstance(value, ModuleType):
            if not self._known(name, value):
                self._add_module(name, value)
        elif isinstance(value, type | FunctionType) and _is_own(value):
            original = self.add(value)
            if original != name and not self._known(name, value):
                self.texts.append(f"{name} = {original}")
        elif not self._known(name, value):
            self._add_other(name, value, near)

    def _add_module(self, name: str, module: ModuleType) -> None:
        own = _own_file(module.__name__)
        if own is not None:
            self._add_file(module.__name__, own)
        self.imports.add(f"import {module.__name__}" + ("" if name == module.__name__ else f" as {name}"))

    def _add_file(self, name: str, file: Path) -> None:
        """Add a module of the user's own, and those of its own folder that were loaded with it."""
        if "." in name or file.name == "__init__.py":
            raise SourceError(f"it imports {name!r} from a package of its own")
        for each in list(sys.modules):
            beside = _own_file(each)
            if beside is not None and beside.parent == file.parent and "." not in each and each != "__main__":
                self.modules[beside.name] = beside.read_bytes()

    def _add_other(self, name: str, value: Any, near: type | FunctionType) -> None:
        """Add a constant, or the import of a definition of an installed module or of the package."""
        offer = _offer(name, value)
        if offer is not None:
            home, original = offer
            self.imports.add(f"from {home} import {original}" + (f" as {name}" if original != name else ""))
            return
        written = _written(value)
        if written is not None:
            self.imports.add("import numpy")
            self.texts.append(f"{name} = {written}")
        elif isinstance(value, np.ndarray):  # its statement may read a file
            raise SourceError(f"{name!r} is an array that is too large, or not of numbers")
        elif (statement := _assignment(near, name)) is not None:
            self._add_text(statement, near)
        else:
            raise SourceError(f"{name!r} is a {type(value).__name__}, which cannot be written down")


_NOTHING = object()
_POSTPONED = 0x1000000
"""Flag of code in a module with ``from __future__ import annotations``."""


def _is_own(definition: Any) -> bool:
    """Return True for a class or function of the user's: not of the package, nor of an installed module."""
    home = str(getattr(definition, "__module__", None))
    if home.partition(".")[0] in ("spherical_wrist", "builtins"):
        return False
    loaded = getattr(sys.modules.get(home), "__spec__", None) is not None  # a script or a notebook is not
    return home == "__main__" or not loaded or _own_file(home) is not None


def _own_file(name: str) -> Path | None:
    """Return the file of a loaded module that is neither installed nor part of Python; None for others."""
    file = getattr(sys.modules.get(name), "__file__", None)
    if not file or not file.endswith(".py") or name.partition(".")[0] in (*sys.stdlib_module_names, "spherical_wrist"):
        return None
    return _not_installed(file)


@lru_cache
def _not_installed(file: str) -> Path | None:
    path = Path(file).resolve()
    return None if path.is_relative_to(Path(sys.prefix).resolve()) else path


def _offer(name: str, value: Any) -> tuple[str, str] | None:
    """Return the module that offers an object, and its name there; None for those that none offers."""
    home, original = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    offers = [(str(home).rpartition(".")[0], original), (home, original), *((each, name) for each in _OFFERING)]
    for module, attribute in offers:
        if module and attribute and getattr(sys.modules.get(module), attribute, _NOTHING) is value:
            return module, attribute
    return None


_OFFERING = ("numpy", "math", "typing", "spherical_wrist.control", "spherical_wrist.parameters")
"""Modules whose objects do not all say where they come from."""


def _functions(definition: type | FunctionType) -> Iterator[FunctionType]:
    """Yield the functions that a class or function consists of."""
    if isinstance(definition, FunctionType):
        yield definition
        return
    for value in list(vars(definition).values()):
        inner = value
        if isinstance(value, staticmethod | classmethod):
            inner = value.__func__
        elif isinstance(value, property | cached_property):
            inner = value.fget if isinstance(value, property) else value.func
        if isinstance(inner, FunctionType) and inner.__module__ == definition.__module__:
            yield inner


def _code(function: FunctionType) -> CodeType:
    return function.__code__


def _lookup(definition: type | FunctionType, name: str) -> Any:
    """Return the value of a name where a class or function was defined; nothing for unknown names."""
    home = vars(sys.modules[definition.__module__]) if definition.__module__ in sys.modules else {}
    for function in _functions(definition):
        inner = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
        if name in inner and name != "__class__":
            return inner[name].cell_contents
        home = function.__globals__
    found = home.get(name, _NOTHING)
    if found is _NOTHING and not hasattr(builtins, name) and isinstance(definition, type):
        return next((base for base in definition.__mro__ if base.__name__ == name), _NOTHING)
    return found


def _names(text: str) -> set[str]:
    """Return the names that a statement takes from outside of it."""
    waiting, found = [symtable.symtable(text, "", "exec")], set()
    while waiting:
        scope = waiting.pop()
        waiting += scope.get_children()
        inside = scope.get_type() == "function"
        found |= {
            each.get_name() for each in scope.get_symbols() if each.is_referenced() and not (inside and each.is_local())
        }
    annotations = (getattr(node, "annotation", None) for node in ast.walk(ast.parse(text)))
    named = (node for each in annotations if each is not None for node in ast.walk(each))
    return found | {node.id for node in named if isinstance(node, ast.Name)}


def _definition(definition: type | FunctionType) -> str:
    """Return the text of a class or function.

    Raises:
        SourceError: its source is not known, as in an interactive session.
    """
    name, kind = definition.__name__, ast.ClassDef if isinstance(definition, type) else ast.FunctionDef
    codes = [function.__code__ for function in _functions(definition)]
    for lines in _sources(definition):
        for node in ast.walk(_parsed("".join(lines))):
            if isinstance(node, kind) and node.name == name:
                begin, end = min([node.lineno, *(each.lineno for each in node.decorator_list)]), node.end_lineno or 0
                if all(begin <= code.co_firstlineno <= end for code in codes):
                    return textwrap.dedent("".join(lines[begin - 1 : end])).rstrip()
    raise SourceError(f"the source of {name!r} is not known, as in an interactive session")


def _sources(definition: type | FunctionType) -> Iterator[list[str]]:
    """Yield the lines of the file or the cell where a class or function is defined."""
    files = [function.__code__.co_filename for function in _functions(definition)]
    module = getattr(sys.modules.get(definition.__module__), "__file__", None)
    for file in dict.fromkeys([*files, *([module] if module else [])]):
        yield linecache.getlines(file)
    yield from _cells()


def _cells() -> Iterator[list[str]]:
    """Yield the lines of the cells of a notebook, the last one first."""
    for file, entry in reversed(list(linecache.cache.items())):
        if len(entry) > 2 and not Path(file).is_file():
            yield entry[2]


def _assignment(near: type | FunctionType, name: str) -> str | None:
    """Return the last statement that gives a name its value, in the file or the cells of a class; None without one."""
    for lines in _sources(near):
        for node in reversed(getattr(_parsed("".join(lines)), "body", [])):
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            if any(isinstance(each, ast.Name) and each.id == name for each in targets):
                return "".join(lines[node.lineno - 1 : node.end_lineno]).rstrip()
    return None


@lru_cache(maxsize=8)
def _parsed(text: str) -> ast.AST:
    try:
        return ast.parse(text)
    except SyntaxError:  # a cell of a notebook with commands of the notebook's
        return ast.Module([], [])


_ODD = ("nan", "inf", "-inf")


def _written(value: Any) -> str | None:
    """Write a constant so that Python reads the same value; None for others, and for long ones."""
    written: str | None = None
    if (value.size if isinstance(value, np.ndarray) else len(value) if isinstance(value, Sized) else 0) > _LONGEST:
        return None
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biuf":
        scalar = "[()]" if isinstance(value, np.generic) else ""
        numbers = _written(value.ravel().tolist())
        written = numbers and f"numpy.asarray({numbers}, dtype={value.dtype.str!r}).reshape({value.shape}){scalar}"
    elif type(value) is dict:
        pairs = [_written(list(pair)) for pair in value.items()]
        written = None if None in pairs else f"dict([{', '.join(map(str, pairs))}])"
    elif type(value) in (tuple, list):
        entries = [_written(each) for each in value]
        inner = ", ".join(map(str, entries))
        whole = f"[{inner}]" if type(value) is list else f"({inner}{',' * (len(value) == 1)})"
        written = None if None in entries else whole
    elif type(value) in _PLAIN:
        written = f"float({repr(value)!r})" if repr(value) in _ODD else repr(value)
    return written if written is None or len(written) <= _LONGEST else None


@lru_cache(maxsize=64)
def _check(text: str, member: type) -> None:
    """Check that a text defines the same class.

    Raises:
        SourceError: it does not.
    """
    module = sys.modules[_TRIAL] = ModuleType(_TRIAL)
    try:
        exec(compile(text, f"<source of {member.__name__}>", "exec"), vars(module))  # definitions that are here already
    except Exception as error:
        raise SourceError(f"the source of {member.__name__!r} does not stand alone: {one_line(error, 100)}") from None
    finally:
        del sys.modules[_TRIAL]
    made = getattr(module, member.__name__)
    for mine, own in zip(_functions(made), _functions(member), strict=True):
        if mine.__code__.co_code != own.__code__.co_code:
            raise SourceError(f"the source of {member.__name__!r} has changed since it was run")


_TRIAL = "source_of_a_class"
