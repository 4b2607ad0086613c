"""MJCF files: reading, compiling, and what they depend on."""

from pathlib import Path

import mujoco
import numpy as np

from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.libmujoco import warnings_kept_in_data

ADVICE = "`wrist guide wrist` tells what a wrist model needs"


REFUSALS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError)
"""What MuJoCo raises at a model that it cannot take; RuntimeError where its bindings do not know why."""

_PHYSICAL = (
    "timestep", "gravity", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos",
    "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "site_pos", "actuator_gear", "actuator_gainprm",
    "geom_pos", "geom_size",
)  # fmt: skip
"""What is computed with or drawn, and MuJoCo takes from a file as it is, even where it is not a number."""


def _reason(error: BaseException) -> str:
    text = one_line(error)
    return "MuJoCo cannot say why; there may be too little memory" if "unknown exception" in text else text


def default_model() -> Path:
    """The MJCF file of the wrist that comes with the package."""
    here = Path(__file__).resolve()
    installed = here.parents[1] / "models" / "wrist.xml"
    return installed if installed.exists() else here.parents[3] / "models" / "wrist.xml"


@warnings_kept_in_data()
def read_spec(path: Path) -> mujoco.MjSpec:
    """Parses an MJCF file.

    Raises:
        ModelError: the file cannot be read or is not MJCF.
    """
    if not path.is_file():
        raise ModelError(f"model {str(path)!r}: no such file; give the path of an MJCF file")
    if not str(path).isprintable():  # bytes that are no letters, or a zero in it
        raise ModelError(f"model {str(path)!r}: MuJoCo cannot open a file of such a name; rename it")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except REFUSALS as error:
        raise ModelError(f"model {str(path)!r} is not valid MJCF: {_reason(error)}") from None


@warnings_kept_in_data()
def compiled(spec: mujoco.MjSpec, name: str) -> mujoco.MjModel:
    """Compiles a description.

    Raises:
        ModelError: it does not compile, or has numbers that MuJoCo cannot compute with.
    """
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


def dependencies(path: Path) -> list[Path]:
    """An MJCF file and every file that it includes or takes shapes and pictures from, resolved; the file itself first.

    Raises:
        ModelError: the file is not valid MJCF, or names files that are not there.
    """
    read_spec(path)
    try:
        named = mujoco.mju_getXMLDependencies(str(path))
    except REFUSALS as error:
        raise ModelError(f"model {str(path)!r}: its files cannot be found: {one_line(error)}") from None
    files = dict.fromkeys([path.resolve(), *(Path(each).resolve() for each in named)])
    missing = [str(file) for file in files if not file.is_file()]
    if missing:
        raise ModelError(f"model {str(path)!r} needs {missing[0]!r}, which is not there")
    return list(files)
