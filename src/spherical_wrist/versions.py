"""Versions of installed packages, read once and without importing the package."""

import re
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution


@cache
def package_version(package: str) -> str:
    """Return the version of a package; ``"unknown"`` if it is not installed, as in a plain source tree.

    ``importlib.metadata.version`` would parse the whole description of the package, which takes milliseconds.
    """
    try:
        found = distribution(package)
    except PackageNotFoundError:
        return "unknown"
    header = re.search(r"^Version:\s*(\S+)", found.read_text("METADATA") or "", re.MULTILINE)
    return header[1] if header else found.version
