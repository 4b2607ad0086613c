"""libmujoco itself: where it lies, and what it keeps for the whole process.

The only room that touches raw symbols of the library.
"""

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mujoco

from spherical_wrist.errors import ModelError


@cache
def library() -> Path:
    """The shared library that the mujoco package has loaded.

    Raises:
        ModelError: the mujoco package has no such library where its wheels put it.
    """
    folder = Path(mujoco.__file__).parent
    found = [*folder.glob("libmujoco.so*"), *folder.glob("libmujoco*.dylib"), *folder.glob("mujoco.dll")]
    if not found:
        raise ModelError(f"no libmujoco beside {folder.name}/__init__.py: install mujoco from its wheel")
    return found[0]


@cache
def _pointer(name: str) -> ctypes.c_void_p:
    """A pointer that the library keeps under a name."""
    return ctypes.c_void_p.in_dll(ctypes.CDLL(str(library())), name)


@cache
def _ignore() -> int | None:
    """Address of a C function that takes a text and does nothing.

    One in Python would wait for Python's lock, for ever where MuJoCo warns from a thread of its own while its caller
    holds the lock and waits for that thread.
    """
    return ctypes.cast(ctypes.CDLL(None).strlen, ctypes.c_void_p).value


@cache
def _forget_handler() -> Callable[[], Any]:
    """Takes the handler of messages that this thread may have out of libmujoco.

    MuJoCo's bindings leave theirs there where memory ran out in the middle of a call (an exception of C++): the next
    call would take it for the one to hand warnings on to, and a warning go round in it for ever.
    """
    function = getattr(ctypes.CDLL(str(library())), "_mjPRIVATE_setTlsLogHandler", None)
    if function is None:
        return lambda: None
    function.argtypes, function.restype = [ctypes.c_void_p], ctypes.c_void_p
    return lambda: function(None)


_silence = threading.Lock()
_silent: list[int | None] = []


@contextmanager
def warnings_kept_in_data() -> Iterator[None]:
    """Within it, MuJoCo's warnings are only counted in ``MjData.warning``.

    Otherwise it would also print them and add to a file MUJOCO_LOG.TXT in the working directory. The handler belongs to
    the whole process: the first thread that comes in replaces it, and the last one that goes out puts it back.
    """
    handler = _pointer("mju_user_warning")
    _forget_handler()()
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
    """Clears the profiling clock that the bindings install into libmujoco, a third of the cost of a step.

    It is global to the process: afterwards ``MjData.timer`` stays at zero in every model.
    ``mujoco.set_mjcb_time(None)`` would leave the clock in place.
    """
    _pointer("mjcb_time").value = None
