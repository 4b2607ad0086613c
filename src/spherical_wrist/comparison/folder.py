"""Folders of results."""

from pathlib import Path

from spherical_wrist.errors import ParameterError


def make_folder(folder: Path) -> None:
    """Makes a folder where there is none.

    Raises:
        ParameterError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(f"folder {str(folder)!r} cannot be made: {error.strerror or error}") from None
