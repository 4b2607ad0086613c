"""Compatibility room: every use of a private part of another library, behind one function each.

Nothing outside this room uses a private name of another library; a test checks it. Each function says why there is no
public way. Where a library lacks the part, the error names the library, its version and the versions to install.
"""

import re
from typing import Any

from spherical_wrist.errors import WristError

PACKAGE = "spherical-wrist"


class MissingPartError(WristError):
    """A library lacks a part that this package needs.

    Args:
        library: name of the distribution, such as ``"rerun-sdk"``.
        part: the missing part.
    """

    def __init__(self, library: str, part: str) -> None:
        super().__init__(f"{library} {_installed(library)} lacks {part}: install {library}{supported(library)}")


def private(library: str, owner: Any, name: str) -> Any:
    """Return a private part of a library.

    Args:
        library: name of the distribution.
        owner: module, class or object that has it.
        name: dotted name of the part within the owner.

    Raises:
        MissingPartError: the library lacks it.
    """
    found = owner
    for part in name.split("."):
        try:
            found = getattr(found, part)
        except AttributeError:
            raise MissingPartError(library, f"{getattr(owner, '__name__', type(owner).__name__)}.{name}") from None
    return found


def supported(library: str) -> str:
    """Return the versions of a library that this package declares, such as ``">=4.0,<5"``; empty if none are known."""
    from importlib import metadata  # takes 10 ms, and only errors need it

    try:
        requirements = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:  # run from a source tree
        return ""
    for requirement in requirements:
        found = re.match(rf"{re.escape(library)}(?![\w.-])\s*([^;\s]*)", requirement)
        if found:
            return ",".join(sorted(found[1].split(","), reverse=True))  # the lower bound first
    return ""


def _installed(library: str) -> str:
    from importlib import metadata

    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "(unknown version)"
