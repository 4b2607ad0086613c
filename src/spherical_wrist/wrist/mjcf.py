"""MJCF files: reading, compiling, and their dependencies."""

import os
from pathlib import Path

import mujoco
import numpy as np

from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.package_files import package_files
from spherical_wrist.wrist.model_sizes import LARGEST, check_sizes

ADVICE = "`wrist guide wrist` lists what a wrist model needs"


REFUSALS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError)
"""Errors that MuJoCo raises for an invalid model; RuntimeError if its bindings do not know the reason."""

_PHYSICAL = (
    "timestep", "gravity", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos",
    "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "site_pos", "actuator_gear", "actuator_gainprm",
    "geom_pos", "geom_size",
)  # fmt: skip
"""Fields used in computations or drawing that MuJoCo copies from a file unchecked, even if they are not finite."""


def _check_spec(name: str, sizes: dict[str, int]) -> None:
    """Refuse sizes for which MuJoCo would allocate gigabytes: a few letters in a file must not fill the memory."""
    for quantity, size in sizes.items():
        if size > LARGEST:
            raise ModelError(f"model {name!r} asks for {size:,} {quantity}: make it {LARGEST:,} or less")


def _sizes(spec: mujoco.MjSpec) -> dict[str, int]:
    """Return the sizes that a description asks for, by what is counted."""
    return {
        "cells of height fields": sum(each.nrow * each.ncol for each in spec.hfields),
        "pixels of textures": sum(each.width * each.height for each in spec.textures),
        "values of sensors": sum(max(each.dim, 0) for each in spec.sensors),
        "values of user data (nuserdata)": spec.nuserdata,
        "key frames (nkey)": spec.nkey,
    }


def _reason(error: BaseException) -> str:
    text = one_line(error)
    return "MuJoCo cannot say why; there may be too little memory" if "unknown exception" in text else text


def default_model() -> Path:
    """Return the MJCF file of the wrist that comes with the package."""
    return package_files("model")["wrist"]


@warnings_kept_in_data()
def read_spec(path: Path) -> mujoco.MjSpec:
    """Parse an MJCF file.

    Raises:
        ModelError: the file cannot be read, is not MJCF, or needs too much memory.
    """
    if not path.is_file():
        raise ModelError(f"model {str(path)!r}: no such file; give the path of an MJCF file")
    if not str(path).isprintable():  # undecodable bytes, or a zero in it
        raise ModelError(f"model {str(path)!r}: MuJoCo cannot open a file of such a name; rename it")
    try:
        check_sizes(Path(os.path.normpath(Path.cwd() / path)))
    except OSError as error:
        raise ModelError(f"model {str(path)!r} cannot be read: {error.filename!r}: {error.strerror}") from None
    try:
        return mujoco.MjSpec.from_file(str(path))
    except REFUSALS as error:
        raise ModelError(f"model {str(path)!r} is not valid MJCF: {_reason(error)}") from None


@warnings_kept_in_data()
def compiled(spec: mujoco.MjSpec, name: str) -> mujoco.MjModel:
    """Compile a description.

    Raises:
        ModelError: it does not compile, or has numbers that are not finite or too large for MuJoCo.
    """
    _check_spec(name, _sizes(spec))
    try:
        model = spec.compile()
    except REFUSALS as error:
        raise ModelError(f"model {name!r} does not compile: {_reason(error)}") from None
    for place in _PHYSICAL:
        owner = model.opt if place in ("gravity", "timestep") else model
        values = np.abs(np.ravel(getattr(owner, place)))
        if not (values <= mujoco.mjMAXVAL).all():
            raise ModelError(
                f"model {name!r} has {place} = {values.max():g}: finite numbers below {mujoco.mjMAXVAL:g} are needed"
            )
    return model
