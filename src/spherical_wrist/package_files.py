"""Models and motions that come with the package, and their names.

In place of a path, the name of such a file is enough: ``--model slender_hand``, ``--reference recorded:hand_held``.
"""

from functools import cache
from pathlib import Path

KINDS = {"model": ".xml", "motion": ".csv"}
"""Kinds of files, and how their names end."""


@cache
def package_files(kind: str) -> dict[str, Path]:
    """Return the files of a kind that come with the package, by name."""
    here = Path(__file__).resolve().parent
    installed = here / "models"  # in a wheel; in the repository, the folder lies beside src
    folder = installed if installed.is_dir() else here.parents[1] / "models"
    return {file.stem: file for file in sorted(folder.glob(f"*{KINDS[kind]}"))}


def named_file(kind: str, given: Path) -> Path:
    """Return the file that comes with the package under this name, and any other path as it is."""
    return package_files(kind).get(str(given), given)


def shortest_name(file: str) -> str:
    """Return the name of a file that comes with the package, and any other text as it is."""
    known = {str(path): name for kind in KINDS for name, path in package_files(kind).items()}
    return known.get(file, file)
