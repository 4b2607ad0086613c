"""Check of a recording before anything of it is interpreted.

Rerun reads a truncated file as far as it goes, and a damaged byte can end the whole process inside its reader.
"""

from pathlib import Path

from spherical_wrist.compat.rrd import unpacked_size
from spherical_wrist.errors import RecordingError, one_line
from spherical_wrist.files import read_whole
from spherical_wrist.memory import memory
from spherical_wrist.seal import Seal, seal_of

_BEGIN, _END = b"RRF2", b"RRF2FOOT"

COPIES = 4
"""Times that everything in a recording is in memory while it is read."""


def check_seal(path: Path) -> None:
    """Check that a file is a recording that nothing has changed since it was written, and that fits into memory.

    Raises:
        RecordingError: it cannot be read, is no recording of this package, is truncated or damaged, or is too large for
            this machine.
    """
    name = f"recording {str(path)!r}"
    if not path.is_file():
        found = "it is not a file" if path.exists() else "there is no such file"
        raise RecordingError(f"{name} cannot be read: {found}; give the path of an .rrd file")
    try:
        _check_size(name, path.stat().st_size)
        content = read_whole(path)
    except OSError as error:
        raise RecordingError(f"{name} cannot be read: {error.strerror or error}; check its permissions") from None
    if not content:
        raise RecordingError(f"{name} is empty; record the run again")
    if not content.startswith(_BEGIN):
        raise RecordingError(f"{name} is not a Rerun file of the kind that this version reads")
    if _END not in content[-2 * len(_END) :]:
        raise RecordingError(f"{name} is truncated; record the run again")
    seal = seal_of(content)
    if seal is Seal.MISSING:
        raise RecordingError(f"{name} was not made by spherical-wrist, or it is damaged")
    if seal is Seal.BROKEN:
        raise RecordingError(f"{name} is damaged or was changed: it does not match its checksum; record the run again")
    try:
        _check_size(name, unpacked_size(content, memory()))
    except ValueError as error:
        raise RecordingError(f"{name} cannot be read: {one_line(error, 100)}") from None


def _check_size(name: str, size: int) -> None:
    if COPIES * size > memory():
        raise RecordingError(
            f"{name} holds more than {size / 1e9:.3g} GB, for which {memory() / 1e9:.3g} GB of memory are too little"
        )
