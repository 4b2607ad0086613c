"""Requirements of some tests on the machine: they skip where one is missing, and fail where CI installs it.

Called first thing in a test or a fixture: ``needs.vulkan()``.
"""

import ctypes
import importlib.util
import os
import shutil
import subprocess
import sys
from functools import cache
from typing import NoReturn

import pytest


def vulkan() -> None:
    """Require a Vulkan device, of software or not, with which the native viewer draws."""
    if not _vulkan_devices():
        _missing("no Vulkan device: apt-get install libvulkan1 mesa-vulkan-drivers")


def opengl() -> None:
    """Require an OpenGL that draws without a display, through EGL, with which MuJoCo renders."""
    if not _renders():
        _missing("no OpenGL through EGL: apt-get install libegl1 libgl1-mesa-dri libopengl0")


def chromium() -> None:
    """Require Chromium, its driver, and selenium; :func:`program` returns the paths of the two."""
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        _missing("no Chromium: apt-get install chromium chromium-driver")
    if importlib.util.find_spec("selenium") is None:
        _missing("no selenium: it is in the dependency group 'test'")


def program(name: str) -> str:
    """Return the path of a program that a test needs, once it is known to be there."""
    return shutil.which(name) or name


def _missing(reason: str) -> NoReturn:
    if "CI" in os.environ:
        pytest.fail(reason)
    pytest.skip(reason)


@cache
def _vulkan_devices() -> int:
    """Return the number of devices that the Vulkan loader finds."""
    try:
        library = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return 0
    structure = (ctypes.c_uint64 * 8)(1)  # VkInstanceCreateInfo: its type, and nothing wanted
    instance, count = ctypes.c_void_p(), ctypes.c_uint32()
    if library.vkCreateInstance(structure, None, ctypes.byref(instance)):
        return 0
    library.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    library.vkDestroyInstance(instance, None)
    return count.value


@cache
def _renders() -> bool:
    """Return True if MuJoCo gets a context; asked in a process of its own, since libraries stay loaded."""
    code = "import mujoco; mujoco.GLContext(8, 8).make_current()"
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    return (
        subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=False).returncode == 0
    )
