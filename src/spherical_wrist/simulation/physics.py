"""libmujoco itself: where it lies, its C functions by name, and models tuned for the loop.

The only room that touches raw symbols of the library.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import mujoco

from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.wrist import Wrist

ARGUMENTS = {
    "mj_step": 2,
    "mj_kinematics": 2,
    "mj_comPos": 2,
    "mj_crb": 2,
    "mj_comVel": 2,
    "mj_passive": 2,
    "mj_fullM": 3,
    "mj_rne": 4,
}
"""C functions that the compiled loop calls, with their number of arguments, all of them passed as machine words."""


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


_WarningHandler = ctypes.CFUNCTYPE(None, ctypes.c_char_p)
_ignore = _WarningHandler(lambda text: None)
_silence = threading.Lock()
_silent: list[int | None] = []


@contextmanager
def warnings_kept_in_data() -> Iterator[None]:
    """Within it, MuJoCo's warnings are only counted in ``MjData.warning``.

    Otherwise it would also print them and add to a file MUJOCO_LOG.TXT in the working directory. The handler belongs to
    the whole process: the first thread that comes in replaces it, and the last one that goes out puts it back.
    """
    handler = _pointer("mju_user_warning")
    with _silence:
        _silent.append(_silent[0] if _silent else handler.value)
        handler.value = ctypes.cast(_ignore, ctypes.c_void_p).value
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


def physics_model(wrist: Wrist, timestep: float) -> mujoco.MjModel:
    """The wrist as the loop steps it: the same dynamics, without what the loop does not read.

    Purely visual geometry is left out, welded bodies are one body, sensors are not evaluated, and the stages for
    contacts and constraints are off where the model has nothing for them. A state that went bad is left as it is
    instead of being reset silently.

    Args:
        wrist: plant or nominal wrist.
        timestep: physics step [s].

    Raises:
        ModelError: MuJoCo refuses the model, or cannot step it.
    """
    model = loop_model(wrist.spec.copy(), timestep)
    try_step(model, mujoco.MjData(model))
    return model


def loop_model(spec: mujoco.MjSpec, timestep: float) -> mujoco.MjModel:
    """See :func:`physics_model`; the description is changed, and the model not tried yet.

    Raises:
        ModelError: MuJoCo refuses the model.
    """
    spec.compiler.discardvisual = True
    spec.compiler.fusestatic = True
    spec.option.timestep = timestep
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError):  # inertia that must come from geometry, all of it visual
        spec.compiler.discardvisual = False
        model = _compiled(spec)
    switch_off(model)
    return model


def switch_off(model: mujoco.MjModel) -> None:
    """Disables the stages of a step that a model has nothing for, and the silent reset of a state that went bad."""
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= off.mjDSBL_SENSOR | off.mjDSBL_AUTORESET
    touching = bool(model.npair or any(model.geom_contype | model.geom_conaffinity))
    if not touching:
        model.opt.disableflags |= off.mjDSBL_CONTACT
    if not (touching or model.neq or model.ntendon or any(model.jnt_limited) or any(model.dof_frictionloss > 0.0)):
        model.opt.disableflags |= off.mjDSBL_CONSTRAINT


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(f"MuJoCo cannot compile the wrist: {one_line(error)}") from None


def try_step(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Steps a model once through the bindings, where an error raises: inside compiled code it would end the process.

    Raises:
        ModelError: MuJoCo cannot step it.
    """
    try:
        mujoco.mj_step(model, data)
    except mujoco.FatalError as error:
        raise ModelError(f"MuJoCo cannot step the wrist: {one_line(error)}") from None
