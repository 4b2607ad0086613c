"""Imports that other libraries make on the side, left out by ``wrist run``, which they make a third slower."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def import_mujoco_without_window() -> None:
    """Import mujoco without GLFW, the library of windows.

    Importing GLFW starts a process to ask for its version: 0.08 s. MuJoCo reads ``MUJOCO_GL`` when it is imported; its
    ``Renderer`` is of no use then, but films are not made with it.
    """
    given = os.environ.get("MUJOCO_GL")
    os.environ["MUJOCO_GL"] = "disable"
    try:
        import mujoco  # noqa: F401
    finally:
        if given is None:
            del os.environ["MUJOCO_GL"]
        else:
            os.environ["MUJOCO_GL"] = given


@contextmanager
def pandas_hidden() -> Iterator[None]:
    """Hide pandas from the imports inside, if it is not imported yet.

    Pyarrow imports pandas, where it is installed, before it converts any value, to see whether it is one of pandas':
    0.35 s. There is no setting against it. A pyarrow that has not found pandas does not look again, so that this is for
    the command line alone, and for after a user's code has run.
    """
    sys.meta_path.insert(0, hides := _PandasHidden())
    try:
        yield
    finally:
        sys.meta_path.remove(hides)


class _PandasHidden:
    """Finder that finds pandas nowhere."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> None:
        """Refuse pandas; leave other modules to the other finders."""
        if fullname == "pandas":
            raise ModuleNotFoundError(f"{fullname} is hidden", name=fullname)
