"""MJCF files: reading, compiling, and their dependencies."""

import os
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import mujoco
import numpy as np

from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.files import read_whole
from spherical_wrist.package_files import package_files
from spherical_wrist.wrist.named_files import slashed

ADVICE = "`wrist guide wrist` lists what a wrist model needs"


REFUSALS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError)
"""Errors that MuJoCo raises for an invalid model; RuntimeError if its bindings do not know the reason."""

_PHYSICAL = (
    "timestep", "gravity", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos",
    "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "site_pos", "actuator_gear", "actuator_gainprm",
    "geom_pos", "geom_size",
)  # fmt: skip
"""Fields used in computations or drawing that MuJoCo copies from a file unchecked, even if they are not finite."""

LARGEST = 2**24
"""Largest number of cells, pixels or values that a model file may ask for: 4096 × 4096."""

_HEIGHT_FIELD = re.compile(rb"<hfield\b[^>]*>")
_ROWS_COLUMNS = re.compile(rb"""\b(nrow|ncol)\s*=\s*["']\s*\+?(\d{1,10})""")
_TEXT = re.compile(rb"""(?i)<(include|model)\b[^>]*\bfile\s*=\s*["']([^"']+)["']""")
COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
"""Comment in a text of MJCF."""


def _check_sizes(name: str, sizes: dict[str, int]) -> None:
    """Refuse sizes for which MuJoCo would allocate gigabytes: a few letters in a file must not fill the memory."""
    for quantity, size in sizes.items():
        if size > LARGEST:
            raise ModelError(f"model {name!r} asks for {size:,} {quantity}: make it {LARGEST:,} or less")


def _height_field_cells(path: Path) -> int:
    """Add up the cells of the height fields in a file and in those that it includes or attaches.

    MuJoCo allocates them while it parses, so they are looked up in the text.

    Raises:
        ModelError: a file includes or attaches itself, by which MuJoCo would end the process; or it is an archive.
        OSError: a file cannot be read.
    """
    cells, read, named_by = 0, set[tuple[Path, Path]](), TopologicalSorter[Path]()
    path = Path(os.path.normpath(Path.cwd() / path))
    waiting = [(path, path)]
    while waiting:
        file, main = waiting.pop()
        if (file, main) in read or not file.exists():
            continue
        read.add((file, main))
        text = COMMENT.sub(b"", read_whole(file))  # which also refuses pipes, where MuJoCo would wait
        if text.startswith(b"PK\3\4"):
            raise ModelError(f"model {str(file)!r} is an archive: unpack it, and give the MJCF file in it")
        for element in _HEIGHT_FIELD.findall(text):
            sizes = dict(_ROWS_COLUMNS.findall(element))
            cells += int(sizes.get(b"nrow", 0)) * int(sizes.get(b"ncol", 0))
        for tag, name in _TEXT.findall(text):
            named = text_named(tag.decode().lower(), slashed(os.fsdecode(name)), file, main)
            named_by.add(file, named)
            waiting.append((named, named if tag == b"model" else main))
    try:
        named_by.prepare()
    except CycleError as error:
        raise ModelError(f"model {str(path)!r}: {error.args[1][0].name!r} includes or attaches itself") from None
    return cells


def text_named(tag: str, name: str, text: Path, main: Path) -> Path:
    """Return the MJCF file that an element of another one names.

    Args:
        tag: ``include`` or ``model``.
        name: what it names, with slashes.
        text: file that the element is in.
        main: MJCF file of the model, which may be the same.

    Returns:
        The first file that is there, where MuJoCo looks for it; the first place without any.
    """
    bases = (text.parent, main.parent) if tag == "model" else (main.parent, text.parent)
    places = [Path(os.path.normpath(base / name)) for base in bases]
    return next((each for each in places if each.is_file()), places[0])


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
        cells = _height_field_cells(path)
    except OSError as error:
        raise ModelError(f"model {str(path)!r} cannot be read: {error.filename!r}: {error.strerror}") from None
    _check_sizes(str(path), {"cells of height fields": cells})
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
    _check_sizes(name, _sizes(spec))
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
