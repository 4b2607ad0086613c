"""The arrays of a series as they are recorded."""

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import RecordingError
from spherical_wrist.simulation.series import WIDTHS, Series

_ETERNITY = 3.15e9


def arrays_of(series: Series) -> dict[str, npt.NDArray[np.float64]]:
    """The arrays of a series by name, contiguous.

    Raises:
        RecordingError: there are no rows, an array has not the shape that a series needs, or a time is not finite.
    """
    rows = len(series)
    if not rows:
        raise RecordingError("a series without rows cannot be recorded: let the run make at least one step")
    arrays = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in series.arrays().items()}
    for name, array in arrays.items():
        expected = (rows, WIDTHS.get(name, array.shape[-1])) if WIDTHS.get(name, 1) else (rows,)
        if array.shape != expected:
            raise RecordingError(f"the array {name!r} of the series has shape {array.shape}; it must be {expected}")
    if not (np.abs(arrays["time"]) < _ETERNITY).all():
        raise RecordingError("the series has times that are not finite, or beyond 100 years: they fit no timeline")
    return arrays
