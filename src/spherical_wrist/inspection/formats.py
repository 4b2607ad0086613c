"""The kinds of files that recordings are shown as; their names' ends say which."""

from collections.abc import Sequence
from pathlib import Path

from spherical_wrist.errors import ParameterError

IMAGES = (".png", ".svg")
EXPORTS = (".csv", ".parquet", ".npz")


def check_suffix(path: Path, what: str, valid: Sequence[str]) -> None:
    """Refuse a file whose name does not say what to make.

    Args:
        path: the file.
        what: what it would be, such as ``picture``.
        valid: the ends that are, in small letters.

    Raises:
        ParameterError: its name has another end, or none.
    """
    if path.suffix.lower() not in valid:
        raise ParameterError(f"{what} {str(path)!r}: its name must end in {', '.join(valid[:-1])} or {valid[-1]}")
