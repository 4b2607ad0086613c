"""The kinematics files of JIGSAWS: four tools of a da Vinci, 76 numbers a row, 30 rows a second, no header."""

import warnings
from typing import BinaryIO, Literal

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import one_line
from spherical_wrist.reference.recorded_rows import RowError

Arm = Literal["slave_right", "slave_left", "master_right", "master_left"]

RATE = 30.0
"""Rows in a second [Hz]."""
SMOOTHING = 0.04
"""Smoothing [s] where none is given."""
WIDTH = 76
FIRST = {"master_left": 0, "master_right": 19, "slave_left": 38, "slave_right": 57}
"""First of an arm's 19 columns: position (3), rotation matrix row by row (9), linear velocity (3), rotational velocity
(3) and gripper angle (1) of the tool's tip (Gao et al., JHU-ISI Gesture and Skill Assessment Working Set, 2014)."""
LAST_ROW = 100_000
"""Most rows that are read: almost an hour."""


def is_jigsaws(line: bytes) -> bool:
    """Return True if a line of a file has 76 numbers."""
    fields = line.split()
    if len(fields) != WIDTH:
        return False
    try:
        for field in fields:
            float(field)
    except ValueError:
        return False
    return True


def read_jigsaws(file: BinaryIO, arm: Arm) -> Array:
    """Return rotation matrices (n, 9) of one arm.

    Raises:
        RowError: a row does not have 76 numbers, or there are too many rows.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rows: Array = np.loadtxt(file, ndmin=2, max_rows=LAST_ROW + 1, comments=None)
    except ValueError as error:
        raise RowError(f"not all of its rows are the {WIDTH} numbers of a JIGSAWS file ({one_line(error)})") from None
    if len(rows) > LAST_ROW:
        raise RowError(f"it has more than {LAST_ROW} rows; cut it")
    first = FIRST[arm] + 3
    return rows[:, first : first + 9]
