"""Raw symbols of libmujoco, the C library below MuJoCo's Python bindings."""

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mujoco

from spherical_wrist.compat import MissingPartError, private

LIBRARY = "mujoco"


@cache
def library() -> Path:
    """Return the path of the shared library that the mujoco package has loaded; its bindings do not tell.

    Raises:
        MissingPartError: there is no such library where the wheels put it.
    """
    folder = Path(mujoco.__file__).parent
    found = [*folder.glob("libmujoco.so*"), *folder.glob("libmujoco*.dylib"), *folder.glob("mujoco.dll")]
    if not found:
        raise MissingPartError(LIBRARY, "its C library beside mujoco/__init__.py (the wheels have it)")
    return found[0]


def address_of(owner: mujoco.MjModel | mujoco.MjData) -> int:
    """Return the address of the C struct behind a model or its data, which compiled code passes to libmujoco."""
    return int(private(LIBRARY, owner, "_address"))


@cache
def _pointer(name: str) -> ctypes.c_void_p:
    """Return a global pointer of the library by its symbol: the bindings wrap the handlers, but cannot restore them."""
    try:
        return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library())), name)
    except ValueError:
        raise MissingPartError(LIBRARY, f"the symbol {name}") from None


@cache
def _ignore() -> int | None:
    """Return the address of a C function that takes a text and does nothing.

    One in Python would wait for Python's lock, for ever where MuJoCo warns from a thread of its own while its caller
    holds the lock and waits for that thread.
    """
    return ctypes.cast(ctypes.CDLL(None).strlen, ctypes.c_void_p).value


@cache
def _clear_handler() -> Callable[[], Any]:
    """Return a function that removes the message handler that this thread may have left in libmujoco.

    MuJoCo's bindings leave theirs there when memory ran out in the middle of a call (a C++ exception). The next call
    would take it for the handler to pass warnings on to, and a warning would loop in it for ever.
    """
    function = getattr(ctypes.CDLL(str(library())), "_mjPRIVATE_setTlsLogHandler", None)
    if function is None:  # a version without handlers for each thread has nothing to remove
        return lambda: None
    function.argtypes, function.restype = [ctypes.c_void_p], ctypes.c_void_p
    return lambda: function(None)


_silence = threading.Lock()
_silent: list[int | None] = []


@contextmanager
def warnings_kept_in_data() -> Iterator[None]:
    """Count MuJoCo's warnings in ``MjData.warning`` only.

    MuJoCo would also print them and add to a file MUJOCO_LOG.TXT in the working directory. The handler belongs to the
    whole process: the first thread that enters replaces it, and the last one that leaves restores it.
    """
    handler = _pointer("mju_user_warning")
    _clear_handler()()
    with _silence:
        _silent.append(_silent[0] if _silent else handler.value)
        handler.value = _ignore()
    try:
        yield
    finally:
        with _silence:
            before = _silent.pop()
            if not _silent:
                handler.value = before


@cache
def drop_step_timer() -> None:
    """Clear the profiling clock that the bindings install into libmujoco, a third of the cost of a step.

    It is global to the process: afterwards ``MjData.timer`` stays at zero in every model.
    ``mujoco.set_mjcb_time(None)`` would leave the clock in place.
    """
    _pointer("mjcb_time").value = None
