"""MJCF files: reading, compiling, and what they depend on."""

from pathlib import Path

import mujoco

from spherical_wrist.errors import ModelError, one_line

ADVICE = "`wrist guide wrist` tells what a wrist model needs"


def default_model() -> Path:
    """The MJCF file of the wrist that comes with the package."""
    here = Path(__file__).resolve()
    installed = here.parents[1] / "models" / "wrist.xml"
    return installed if installed.exists() else here.parents[3] / "models" / "wrist.xml"


def read_spec(path: Path) -> mujoco.MjSpec:
    """Parses an MJCF file.

    Raises:
        ModelError: the file cannot be read or is not MJCF.
    """
    if not path.is_file():
        raise ModelError(f"model {str(path)!r}: no such file; give the path of an MJCF file")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        raise ModelError(f"model {str(path)!r} is not valid MJCF: {one_line(error)}") from None


def compiled(spec: mujoco.MjSpec, name: str) -> mujoco.MjModel:
    """Compiles a description.

    Raises:
        ModelError: it does not compile.
    """
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(f"model {name!r} does not compile: {one_line(error)}") from None


def dependencies(path: Path) -> list[Path]:
    """An MJCF file and every file that it includes or takes shapes and pictures from, resolved; the file itself first.

    Raises:
        ModelError: the file is not valid MJCF, or names files that are not there.
    """
    read_spec(path)
    try:
        named = mujoco.mju_getXMLDependencies(str(path))
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        raise ModelError(f"model {str(path)!r}: its files cannot be found: {one_line(error)}") from None
    files = dict.fromkeys([path.resolve(), *(Path(each).resolve() for each in named)])
    missing = [str(file) for file in files if not file.is_file()]
    if missing:
        raise ModelError(f"model {str(path)!r} needs {missing[0]!r}, which is not there")
    return list(files)
