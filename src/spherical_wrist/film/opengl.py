"""OpenGL without a window.

MuJoCo's own ``Renderer`` takes the kind of OpenGL that ``MUJOCO_GL`` named when mujoco was first imported, and without
it that of the window system, which a machine without a screen does not have. Here the kind is chosen when it is needed,
however mujoco was imported.
"""

import os
import platform
import warnings
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import one_line
from spherical_wrist.film.errors import FilmError

Picture = npt.NDArray[np.uint8]
"""Rows from the top, columns, and red, green, blue."""

KINDS = {"Linux": ("egl", "osmesa", "glfw"), "Darwin": ("cgl", "glfw")}
"""Kinds of OpenGL that MUJOCO_GL may name, by system; on other systems only GLFW."""

OFF = ("disable", "disabled", "off", "false", "0")
ANY = ("", "enable", "enabled", "on", "true", "1")
"""Values of MUJOCO_GL that forbid rendering, and that allow any kind."""

_ADVICE = {
    "Linux": "on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri libopengl0; or apt install libosmesa6 and set "
    "MUJOCO_GL=osmesa",
    "Darwin": "unset MUJOCO_GL and PYOPENGL_PLATFORM, to use that of the system",
}


class Renderer:
    """Renders scenes, with the kind of OpenGL that ``MUJOCO_GL`` names.

    Without it, on Linux: EGL, which needs no screen, and failing that a hidden window, if there is a screen. Elsewhere:
    that of the system.

    Args:
        model: of the scenes.
        size: width and height of the pictures [px].

    Raises:
        FilmError: there is no OpenGL here that makes such pictures, or ``MUJOCO_GL`` forbids it.
    """

    def __init__(self, model: mujoco.MjModel, size: tuple[int, int]) -> None:
        self._view = mujoco.MjrRect(0, 0, *size)
        problems = []
        for kind in _kinds():
            try:
                self._gl, self._context = _opened(kind, model, size)
                return
            except Exception as error:  # every library in between has its own way to say that it is not there
                problems.append(f"{kind}: {one_line(error, 120)}")
        wide, high = size
        advice = _ADVICE.get(platform.system(), "install an OpenGL driver")
        raise FilmError(f"no OpenGL here renders pictures of {wide}x{high} ({'; '.join(problems)}); {advice}")

    def picture(self, scene: mujoco.MjvScene) -> Picture:
        """Render a scene."""
        self._gl.make_current()
        pixels = np.empty((self._view.height, self._view.width, 3), np.uint8)
        mujoco.mjr_render(self._view, scene, self._context)
        mujoco.mjr_readPixels(pixels, None, self._view, self._context)
        return np.ascontiguousarray(pixels[::-1])  # OpenGL's rows begin at the bottom

    def close(self) -> None:
        """Free the OpenGL context."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def _kinds() -> Iterator[str]:
    system = platform.system()
    kinds = KINDS.get(system, ("glfw",))
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in OFF:
        raise FilmError(f"MUJOCO_GL={wanted} forbids rendering: unset it, or set it to {' or '.join(kinds)}")
    if wanted in kinds:
        yield wanted
    elif wanted not in ANY:
        raise FilmError(f"MUJOCO_GL={wanted} is not known: unset it, or set it to {' or '.join(kinds)}")
    else:
        yield kinds[0]
        if system != "Linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
            yield from (kind for kind in kinds[1:] if kind == "glfw")


def _opened(kind: str, model: mujoco.MjModel, size: tuple[int, int]) -> tuple[Any, mujoco.MjrContext]:
    with warnings.catch_warnings(action="ignore"):  # GLFW warns of what then fails
        gl = import_module(f"mujoco.{kind}").GLContext(*size)
        gl.make_current()
    try:
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
    except Exception:
        gl.free()
        raise
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    return gl, context
