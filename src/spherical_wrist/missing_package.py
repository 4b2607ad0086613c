"""Error for a package that is not installed, with the command that installs it where this one runs."""

import shlex
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

from spherical_wrist.errors import ParameterError


def missing(what: str, extra: str) -> ParameterError:
    """Return the error for a package of an extra that is not installed.

    Args:
        what: what needs it, such as ``"tuning needs Optuna"``.
        extra: extra of this package that brings it.
    """
    return ParameterError(f"{what}: {installing(extra)}")


def installing(extra: str) -> str:
    """Return the command that installs an extra into the environment of this interpreter, for a POSIX shell.

    It is pip's by its interpreter, because the ``pip`` of the shell may be that of another environment; and uv's in an
    environment without pip, as uv makes them.
    """
    wanted = f"'spherical-wrist[{extra}]'"
    beside = Path(sys.executable).parent
    found = shutil.which("pip")
    if found is not None and Path(found).parent == beside:
        return f"pip install {wanted}"
    python = shlex.quote(_shortest(Path(sys.executable)))
    if find_spec("pip") is not None:
        return f"{python} -m pip install {wanted}"
    return f"uv pip install --python {python} {wanted}"


def _shortest(path: Path) -> str:
    try:
        inside = path.relative_to(Path.cwd())
    except (OSError, ValueError):  # elsewhere, or the working directory was deleted
        return str(path)
    return str(inside)
