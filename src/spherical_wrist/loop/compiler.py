"""Plain Python functions as machine code, compiled once and then read from the cache on disk.

The name under which machine code is kept is a digest of everything that it was compiled from: the package's own
sources, a user's files, dtypes, versions and the processor. A process that finds all of it never imports numba.
"""

import hashlib
import marshal
import os
import platform
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

from spherical_wrist.channels import COMMAND, LOG
from spherical_wrist.control.contract import Law
from spherical_wrist.dynamics import inverse_dynamics
from spherical_wrist.errors import LawError, WristError, one_line
from spherical_wrist.loop import object_cache
from spherical_wrist.loop.machine_code import Compiled, MachineCode, load, processor, processor_features
from spherical_wrist.measure.metrics import TOTALS, accumulate
from spherical_wrist.stages import detail, notice, stage
from spherical_wrist.versions import package_version

Function = Callable[..., Any]

PACKAGE = Path(__file__).parents[1]
SOURCES = (
    "so3.py", "channels.py", "dynamics.py", "measure/metrics.py", "compat/numba.py",
    "actuation", "control", "environment", "fuzzy", "loop", "sensing",
)  # fmt: skip
"""Files and rooms of the package whose functions, dtypes and constants go into machine code."""

PACKAGES = ("numba", "llvmlite")
"""Packages that machine code depends on, besides those that are imported anyway."""

_compiling = threading.RLock()


def compiled_inverse_dynamics() -> Compiled:
    """Return ``inverse_dynamics`` compiled."""
    return _package_function(inverse_dynamics, "inverse")


def compiled_accumulate() -> Compiled:
    """Return ``accumulate`` compiled."""
    return _package_function(accumulate, "accumulate")


def entry(function: Function, *kinds: npt.DTypeLike) -> Compiled:
    """Return a function of the package compiled.

    Args:
        function: function of contiguous arrays that returns None or an integer.
        kinds: their dtypes: an array of records has one dimension, one of numbers two.
    """
    return _package_function(function, kinds)


@cache
def _package_function(function: types.FunctionType, signature: str | tuple[npt.DTypeLike, ...]) -> Compiled:
    digest = _digest()
    kinds = signature if isinstance(signature, str) else [np.dtype(kind).descr for kind in signature]
    digest.update(f"{function.__module__}.{function.__qualname__} {kinds}".encode())
    return _machine_code(digest.hexdigest(), function, signature)


_laws: dict[tuple[Function, np.dtype[Any], np.dtype[Any]], Compiled] = {}


def compiled_law(law: Law) -> Compiled:
    """Return the step of a law compiled; it takes parameters and state packed, so that every law has one signature.

    Raises:
        LawError: numba cannot compile it; the message has numba's reason.
    """
    step, layout, state = type(law).step, law.layout(), law.state_layout()
    key = step, layout, state
    if key in _laws:
        return _laws[key]
    with _compiling:  # one thread at a time; those that waited find what the first one made
        if key in _laws:
            return _laws[key]
        digest = _digest()
        digest.update(f"{step.__module__}.{step.__qualname__} {layout.descr} {state.descr}".encode())
        if _foreign(step):
            try:
                assert isinstance(step, types.FunctionType)
                _digest_user_function(step, digest, ())
            except LawError as error:
                raise LawError(f"law {law.name!r} cannot be compiled: {error}") from None
        scope = {**globals(), "_step": step, "_LAYOUT": layout, "_STATE": state}
        adapter = types.FunctionType(_unpack_and_step.__code__, scope, "step")
        adapter.__qualname__ = type(law).__name__
        try:
            _laws[key] = _machine_code(digest.hexdigest(), adapter, "law")
        except (WristError, MemoryError, ImportError, OSError):  # no fault of the law
            raise
        except Exception as error:  # numba raises all sorts of things at code that it cannot compile
            advice = "step may use numbers, arrays, loops, math and numpy"
            raise LawError(f"law {law.name!r} cannot be compiled ({advice}): {_reason(error)}") from None
    return _laws[key]


# stand-ins for what compiled_law puts in their place, law by law
_LAYOUT: Any = None
_STATE: Any = None
_step: Any = None


def _unpack_and_step(signal: Any, packed: Any, state: Any, command: Any) -> None:
    _step(signal, packed.view(_LAYOUT)[0], state.view(_STATE)[0], command)


# --- from the cache, or compiled


def _machine_code(key: str, function: types.FunctionType, signature: str | tuple[npt.DTypeLike, ...]) -> Compiled:
    """Return a function from the cache; compile it first if it is not there, or damaged."""
    with _compiling:
        kept = object_cache.read(key)
        found = _loaded(kept) if kept else None
        if found is None:
            from spherical_wrist.compat.numba import compiled_files
            from spherical_wrist.loop.numba_backend import emit

            notice(f"compiling {function.__qualname__} (once; kept in the cache) ...")
            with stage(f"compiled {function.__qualname__}"):
                made = emit(function, signature, _foreign)
            undeclared = {file for file in compiled_files() if file.is_relative_to(PACKAGE)} - set(source_files())
            if undeclared:
                raise WristError(f"machine code comes from {min(undeclared)}: add it to SOURCES in {__file__}")
            object_cache.write(key, made)
            found = _loaded(made)
        else:
            detail(f"{function.__qualname__}: machine code from the cache")
        if found is None:
            raise WristError(
                f"compiled code of {function.__qualname__} calls functions that this process does not have"
            )
        return found


def _loaded(code: MachineCode) -> Compiled | None:
    found = load(code)
    if found is None:  # it may call functions of numba's, as laws that allocate arrays do
        from spherical_wrist.compat.numba import provide_runtime

        provide_runtime()
        found = load(code)
    return found


# --- the digest


def _digest() -> Any:
    return _common_digest().copy()


@cache
def _common_digest() -> Any:
    """Digest everything that all machine code depends on."""
    settings = sorted(
        item for item in os.environ.items() if item[0].startswith("NUMBA_") and item[0] != "NUMBA_CACHE_DIR"
    )
    versions = (platform.python_version(), np.__version__, mujoco.__version__, *map(package_version, PACKAGES))
    tables = COMMAND.descr, LOG.descr, TOTALS.descr  # which a program may have added to
    digest = hashlib.sha256(repr((versions, processor(), processor_features(), settings, tables)).encode())
    for path in source_files():
        digest.update(path.read_bytes())
    return digest


def source_files() -> list[Path]:
    """Return the files of the package that machine code may come from."""
    places = [PACKAGE / source for source in SOURCES]
    return [file for place in places for file in ([place] if place.is_file() else sorted(place.glob("*.py")))]


def _foreign(function: Any) -> bool:
    """Return True for a function that is not part of this package."""
    return not str(function.__module__).startswith("spherical_wrist.")


def _digest_user_function(function: types.FunctionType, digest: Any, callers: tuple[Function, ...]) -> None:
    """Digest a user's function, and the user's functions and constants that it names.

    The files of the law and of its folder are not enough: a cell of a notebook has no file, and what a module got from
    elsewhere may have another value than its source says. Names that occur in the code are looked up as Python would.

    Args:
        function: function of a user.
        digest: updated.
        callers: functions on the way to this one.

    Raises:
        LawError: the function cannot be compiled, for a reason that numba's message would not tell.
    """
    code, name = function.__code__, function.__name__
    if function.__closure__:
        raise LawError(f"{name} uses variables of an enclosing function: move them to module level")
    if code.co_kwonlyargcount:
        raise LawError(f"{name} has keyword-only arguments, which cannot be compiled: leave out the *")
    if function in callers:
        raise LawError(f"{name} calls itself, which cannot be compiled: write a loop")
    file = Path(code.co_filename)
    digest.update(file.read_bytes() if file.is_file() else marshal.dumps(code))
    digest.update(repr(function.__defaults__).encode())
    if file.is_file():
        _digest_folder(file.resolve().parent, digest)
    for each in sorted(_names(code) & function.__globals__.keys()):
        value = function.__globals__[each]
        digest.update(f"{each}=".encode())
        if isinstance(value, types.FunctionType):
            if _foreign(value) and not _installed(value.__code__.co_filename):
                _digest_user_function(value, digest, (*callers, function))
        elif isinstance(value, types.ModuleType):
            source = Path(getattr(value, "__file__", None) or "")
            digest.update(source.read_bytes() if source.suffix == ".py" else b"")
        elif isinstance(value, np.ndarray):
            digest.update(f"{value.dtype.descr}{value.shape}".encode() + value.tobytes())
        elif not isinstance(value, type):
            digest.update(repr(value).encode())


def _digest_folder(folder: Path, digest: Any) -> None:
    """Digest every module loaded from a user's folder, since a law may take from any of them."""
    for name in sorted(sys.modules):
        file = getattr(sys.modules[name], "__file__", None) or ""
        if file.endswith(".py") and Path(file).is_relative_to(folder) and not _installed(file):
            digest.update(Path(file).read_bytes())


def _installed(file: str) -> bool:
    """Return True for a file of an installed package."""
    return Path(file).is_relative_to(sys.prefix)


def _names(code: types.CodeType) -> set[str]:
    """Return the global names that a function and the functions nested in it may refer to."""
    nested = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return set(code.co_names).union(*map(_names, nested))


def _reason(error: Exception) -> str:
    """Return numba's own reason and the place in the law, without the pages around them."""
    if isinstance(error, KeyError):
        return f"signal, parameters, state or command has no field {error}"
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
