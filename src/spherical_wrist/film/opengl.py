"""An OpenGL context without a window.

MuJoCo's own ``Renderer`` takes the kind of context that ``MUJOCO_GL`` named when mujoco was first imported, and without
it a window system's, which a machine without a screen has not. Here the kind is chosen when it is needed.
"""

import os
import platform
import warnings
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from spherical_wrist.errors import one_line
from spherical_wrist.film.errors import FilmError

OFF = ("disable", "disabled", "off", "false", "0")
"""Values of MUJOCO_GL with which nothing is to be rendered."""

_ADVICE = {
    "Linux": "on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri libopengl0; or apt install libosmesa6 and set "
    "MUJOCO_GL=osmesa",
    "Darwin": "unset MUJOCO_GL and PYOPENGL_PLATFORM, to use the one of the system",
}


def open_context(width: int, height: int) -> Any:
    """Makes a context that is current in this thread, of the kind that ``MUJOCO_GL`` names.

    Without it, on Linux: EGL, which needs no screen, and failing that a hidden window, if there is a screen. Elsewhere:
    that of the system.

    Args:
        width: of the pictures [px]. Only some kinds of context ask for it.
        height: likewise.

    Returns:
        The context, with ``make_current()`` and ``free()``.

    Raises:
        FilmError: there is no OpenGL here, or ``MUJOCO_GL`` forbids it.
    """
    problems = []
    for kind in _kinds():
        try:
            with warnings.catch_warnings(action="ignore"):  # GLFW warns of what then fails
                context = import_module(f"mujoco.{kind}").GLContext(width, height)
                context.make_current()
            return context
        except Exception as error:  # every library in between has its own way to say that it is not there
            problems.append(f"{kind}: {one_line(error, 160)}")
    advice = _ADVICE.get(platform.system(), "install an OpenGL driver")
    raise FilmError(f"no OpenGL to render with ({'; '.join(problems)}); {advice}")


def _kinds() -> Iterator[str]:
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in OFF:
        raise FilmError(f"MUJOCO_GL={wanted} forbids rendering; unset it, or set it to egl or osmesa")
    system = platform.system()
    if wanted in ("egl", "osmesa", "cgl", "glfw"):
        yield wanted
    elif system == "Darwin":
        yield from ("cgl", "glfw")
    elif system != "Linux" or wanted:
        yield "glfw"
    else:
        yield "egl"
        if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
            yield "glfw"
