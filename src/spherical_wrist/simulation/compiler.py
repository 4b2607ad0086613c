"""Plain Python functions compiled by numba, with the functions that they name, and cached on disk.

The only room that imports numba, and it does so when the first function is compiled: ``import spherical_wrist`` stays
quick. Numba's disk cache looks at a function's own file only. Here the name under which a function is cached carries a
digest of everything that it was compiled from, so that an edit of any helper is seen.
"""

import hashlib
import marshal
import re
import sys
import threading
import types
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.control.contract import Law
from spherical_wrist.dynamics import inverse_dynamics, pointer
from spherical_wrist.errors import LawError, one_line
from spherical_wrist.libmujoco import library
from spherical_wrist.simulation.gauge import gauge
from spherical_wrist.simulation.intrinsics import intrinsics
from spherical_wrist.simulation.loop import close_loop
from spherical_wrist.simulation.physics import ARGUMENTS
from spherical_wrist.simulation.signatures import arrays, signatures

Function = Callable[..., Any]


@cache
def _numba() -> Any:
    import llvmlite.binding
    import numba

    # cached machine code refers to these symbols by name; without the library it would jump into nothing
    llvmlite.binding.load_library_permanently(str(library()))
    return numba


@cache
def _signatures() -> Any:
    return signatures(_numba())


@cache
def _intrinsics() -> dict[Function, Any]:
    return intrinsics(_numba(), _signatures().law, _signatures().loop)


def _address(array: Any) -> Any:
    return array.ctypes.data


class _Source:
    """A function, the functions that it names, and a digest of all that they are made of."""

    def __init__(self) -> None:
        self.digest = hashlib.sha256()
        self.compiled: dict[Function, Any] = {}
        self.open: set[Function] = set()

    def translate(self, function: Function) -> types.FunctionType:
        """The function with its globals replaced by their compiled forms."""
        name = function.__name__
        if function.__closure__:
            raise LawError(f"{name} uses variables of an enclosing function: move them to module level")
        if function.__code__.co_kwonlyargcount:
            raise LawError(f"{name} has keyword-only arguments, which cannot be compiled: leave out the *")
        code = function.__code__
        file = Path(code.co_filename)
        self.digest.update(file.read_bytes() if file.is_file() else marshal.dumps(code))
        self.digest.update(repr(function.__defaults__).encode())
        if file.is_file() and _foreign(function):
            self.add_neighbours(file.resolve().parent)
        scope = dict(function.__globals__)
        for name in sorted(_names(code)):
            if name in scope:
                scope[name] = self.replacement(name, scope[name])
        copy = types.FunctionType(code, scope, function.__name__, function.__defaults__)
        copy.__qualname__ = function.__qualname__
        return copy

    def add_neighbours(self, folder: Path) -> None:
        """Digests every module loaded from a user's folder: what a law takes from them may have come from others."""
        for name in sorted(sys.modules):
            file = Path(getattr(sys.modules[name], "__file__", None) or "")
            if file.suffix == ".py" and file.is_relative_to(folder) and not file.is_relative_to(sys.prefix):
                self.digest.update(file.read_bytes())

    def replacement(self, name: str, value: Any) -> Any:
        numba = _numba()
        t = numba.core.types
        if value is pointer:
            return numba.njit(_address)
        if name in ARGUMENTS and value is getattr(mujoco, name):
            words = [t.intp] * ARGUMENTS[name]
            return t.ExternalFunction(name, t.void(*words))
        if isinstance(value, types.FunctionType):
            if value in _intrinsics():
                self.digest.update(f"{_signatures().law}{_signatures().loop}".encode())  # of what lies at an address
                return _intrinsics()[value]
            if value in self.open:
                raise LawError(f"{name} calls itself, which cannot be compiled: write a loop")
            if value not in self.compiled:
                self.open.add(value)
                # a user's law may index out of range, which unchecked would write into foreign memory
                options = {"nogil": True, "error_model": "numpy", "boundscheck": _foreign(value)}
                self.compiled[value] = numba.njit(**options)(self.translate(value))
                self.open.remove(value)
            return self.compiled[value]
        self.digest.update(f"{name}=".encode())
        if isinstance(value, types.ModuleType):
            file = Path(getattr(value, "__file__", None) or "")
            self.digest.update(file.read_bytes() if file.suffix == ".py" else b"")
        elif isinstance(value, np.ndarray):
            self.digest.update(f"{value.dtype.descr}{value.shape}".encode() + value.tobytes())
        elif not isinstance(value, type):
            self.digest.update(repr(value).encode())
        return value


def _foreign(function: Function) -> bool:
    """Whether a function is none of this package's."""
    return not str(function.__module__).startswith("spherical_wrist.")


def _names(code: types.CodeType) -> set[str]:
    """Global names that a function and the functions nested in it may refer to."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def _compile(function: types.FunctionType, signature: Any, source: _Source) -> Any:
    function.__qualname__ = f"{function.__qualname__}-{source.digest.hexdigest()[:16]}"
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
    try:
        compiled = _numba().njit(cache=True, **options)(function)
    except RuntimeError:  # no folder to keep a cache in
        compiled = _numba().njit(**options)(function)
    compiled.compile(signature)
    compiled.disable_compile()
    return compiled


def compiled_loop() -> Any:
    """``close_loop`` compiled; model and data are passed as addresses."""
    with _compiling:
        return _compiled_once(close_loop, "loop")


def compiled_inverse_dynamics() -> Any:
    """``inverse_dynamics`` compiled."""
    with _compiling:
        return _compiled_once(inverse_dynamics, "inverse")


def compiled_gauge() -> Any:
    """``gauge`` compiled."""
    with _compiling:
        return _compiled_once(gauge, "gauge")


def compiled(function: Function, *kinds: npt.DTypeLike) -> Any:
    """A function of arrays compiled: contiguous ones, of one dimension of records, of two of numbers."""
    with _compiling:
        return _compiled_once(function, kinds)


@cache
def _compiled_once(function: Function, signature: Any) -> Any:
    source, named = _Source(), isinstance(signature, str)
    arguments = getattr(_signatures(), signature) if named else arrays(_numba(), signature)
    return _compile(source.translate(function), arguments, source)


_laws: dict[tuple[Function, np.dtype[Any]], Any] = {}
_compiling = threading.RLock()


def compiled_law(law: Law) -> Any:
    """The law's step compiled, taking its parameters packed: one signature for every law.

    Raises:
        LawError: numba cannot compile it; the message has numba's reason.
    """
    key = (type(law).step, law.layout())
    if key in _laws:
        return _laws[key]
    with _compiling:  # one thread at a time; those that waited find what the first one made
        if key in _laws:
            return _laws[key]
        source = _Source()
        try:
            step = source.replacement("step", type(law).step)
        except LawError as error:
            raise LawError(f"law {law.name!r} cannot be compiled: {error}") from None
        source.digest.update(repr(law.layout().descr).encode())
        scope = {**globals(), "_step": step, "_LAYOUT": law.layout()}
        adapter = types.FunctionType(_unpack_and_step.__code__, scope, "step")
        adapter.__qualname__ = type(law).__name__
        try:
            _laws[key] = _compile(adapter, _signatures().law, source)
        except Exception as error:  # numba raises all sorts of things at code that it cannot compile
            advice = "step may use numbers, arrays, loops, math and numpy"
            raise LawError(f"law {law.name!r} cannot be compiled ({advice}): {_reason(error)}") from None
    return _laws[key]


# stand-ins for what compiled_law puts in their place, law by law
_LAYOUT: Any = None
_step: Any = None


@cache
def address(function: Any) -> int:
    """Where something compiled lies, for ``law_at`` and ``loop_at`` of :mod:`spherical_wrist.simulation.addresses`."""
    [result] = function.overloads.values()
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def _unpack_and_step(signal: Any, packed: Any, state: Any, command: Any) -> None:
    _step(signal, packed.view(_LAYOUT)[0], state, command)


def _reason(error: Exception) -> str:
    """Numba's own reason and the place in the law, without the pages around them."""
    if isinstance(error, KeyError):
        return f"signal, parameters or command has no field {error}"
    telling: list[str] = []
    for line in map(str.strip, str(error).splitlines()):
        if line.startswith(("During:", "File ")):
            place = re.fullmatch(r'File "(.*)", (line \d+):', line)
            if place and Path(place[1]).name != Path(__file__).name:
                telling.append(f"({Path(place[1]).name}, {place[2]})")
            break
        if line and not line.startswith("Failed in"):
            telling.append(line)
    return one_line(" ".join(telling))
