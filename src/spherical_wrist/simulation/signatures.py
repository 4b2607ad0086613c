"""Types of the arguments of what is compiled, in numba's terms. Numba itself is handed in: it is imported elsewhere."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation.drive import DRIVE, Drive
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION, Nominal
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.simulation.gauge import TOTALS, WINDOW
from spherical_wrist.simulation.loop import LOG, SETTINGS, Plant, Progress


def signatures(numba: Any) -> SimpleNamespace:
    """The signatures of a law's step, of the loop, of the inverse dynamics and of the gauge, by these names."""
    t = numba.core.types
    vector, matrix = t.Array(t.float64, 1, "C"), t.Array(t.float64, 2, "C")
    record = numba.from_dtype
    plant = t.NamedTuple([t.intp, t.intp, vector, vector, vector, vector, t.Array(t.int32, 1, "A")], Plant)
    nominal = t.NamedTuple([t.intp, t.intp, vector, vector, vector], Nominal)
    sensor = t.NamedTuple([record(SENSOR), matrix], Sensor)
    drive = t.NamedTuple([record(DRIVE), vector, vector, matrix, vector, vector, matrix], Drive)
    motion, sample, log = (t.Array(record(dtype), 1, "C") for dtype in (MOTION, SAMPLE, LOG))
    law = t.void(record(SIGNAL), vector, vector, record(COMMAND))
    progress = t.NamedUniTuple(t.int64, 2, Progress)
    loop = progress(
        t.FunctionType(law), vector, vector, plant, nominal, sensor, drive, record(SETTINGS),
        motion, motion, motion, sample, matrix, record(SIGNAL), record(COMMAND), log, matrix, matrix,
    )  # fmt: skip
    inverse, gauged = (nominal, motion, matrix, matrix), (record(WINDOW), record(TOTALS), vector, motion, log, matrix)
    return SimpleNamespace(law=law, loop=loop, inverse=inverse, gauge=gauged)


def arrays(numba: Any, kinds: tuple[npt.DTypeLike, ...]) -> tuple[Any, ...]:
    """The signature of a function of contiguous arrays: of one dimension of records, of two of numbers."""
    t, dtypes = numba.core.types, [np.dtype(kind) for kind in kinds]
    return tuple(t.Array(numba.from_dtype(dtype), 1 if dtype.names else 2, "C") for dtype in dtypes)
