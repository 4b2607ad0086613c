"""The 3D scene: the wrist as it moves, a ghost at the desired attitude, and the trails of the tool tip."""

import mujoco
import numpy as np
import numpy.typing as npt
import rerun as rr

from spherical_wrist.colours import ACTUAL, rgb
from spherical_wrist.colours import DESIRED as DESIRED_ATTITUDE
from spherical_wrist.measure.series import Series
from spherical_wrist.recording.geometry import Drawable, solid, visible_geoms, wires
from spherical_wrist.recording.layout import BASE, DESIRED, TIMELINE, TIPS, WORLD, WRIST
from spherical_wrist.so3 import inverses, products

ACTUAL_COLOUR, DESIRED_COLOUR = rgb(ACTUAL), rgb(DESIRED_ATTITUDE)
PERIOD = 0.01
"""Least time between two poses [s]. The exact attitude is among the arrays; this is for the eye."""

_FAR = 1e6
"""No tool tip is that far away [m]; a run that diverges may say so."""


def draw_wrist(recording: rr.RecordingStream, wrist: Drawable) -> None:
    """Send the static data: the geometry, and the look of the trails."""
    recording.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _draw_geometry(recording, wrist)
    for entity, colour, radius in zip(TIPS.values(), (ACTUAL_COLOUR, DESIRED_COLOUR), (0.0009, 0.0006), strict=True):
        recording.log(entity, rr.LineStrips3D.from_fields(colors=[colour], radii=[radius]), static=True)


def draw_motion(
    recording: rr.RecordingStream, series: Series, wrist: Drawable, before: Series | None = None
) -> Series | None:
    """Send the motion, or the next piece of it.

    Args:
        recording: where to.
        series: the motion. Rows that have no pose to show, as after a divergence, are left out.
        wrist: what moves.
        before: what this returned for the piece before, whose trails go on.

    Returns:
        The last row that is shown, or ``before`` where none is.
    """
    rows = _rows_to_show(series)
    time = [timeline(series.time[rows])]
    for entity, attitude in ((WRIST, series.attitude), (DESIRED, series.desired_attitude)):
        turns = _world_turns(attitude[rows], wrist)
        places = np.broadcast_to(wrist.anchor, (len(rows), 3))
        recording.send_columns(entity, time, rr.Transform3D.columns(translation=places, quaternion=turns))
    for name, entity in TIPS.items():
        # one piece per row, from the row before: within a time range they join up to a trail
        points = getattr(series, name)[rows].astype(np.float32)
        begin = points[:1] if before is None else getattr(before, name).astype(np.float32)
        pieces = np.stack([np.concatenate([begin, points])[: len(points)], points], axis=1)
        recording.send_columns(entity, time, rr.LineStrips3D.columns(strips=pieces))
    return series.rows(slice(int(rows[-1]), int(rows[-1]) + 1)) if len(rows) else before


def _world_turns(attitude: npt.NDArray[np.float64], wrist: Drawable) -> npt.NDArray[np.float64]:
    """Quaternions (x, y, z, w) that turn the wrist, as it lies in the world at its start, to attitudes (n, 4)."""
    if np.array_equal(wrist.mount, np.eye(3)):
        return np.roll(attitude, -1, axis=1)
    mount = np.empty(4)
    mujoco.mju_mat2Quat(mount, wrist.mount.ravel())
    return np.roll(products(products(mount, attitude), inverses(mount)), -1, axis=1)


def timeline(time: npt.NDArray[np.float64]) -> rr.TimeColumn:
    """Control instants [s] as a timeline, rounded to nanoseconds."""
    return rr.TimeColumn(TIMELINE, duration=np.rint(1e9 * time).astype("timedelta64[ns]"))


def _draw_geometry(recording: rr.RecordingStream, wrist: Drawable) -> None:
    geoms = list(visible_geoms(wrist))
    for geom in geoms:
        shape = solid(wrist.model, geom)
        if shape is not None:
            name = rr.escape_entity_path_part(geom.name)
            recording.log(f"{WRIST if geom.moving else BASE}/{name}", shape, static=True)
    for name, ghost in wires(wrist.model, [geom for geom in geoms if geom.moving], DESIRED_COLOUR):
        recording.log(f"{DESIRED}/{rr.escape_entity_path_part(name)}", ghost, static=True)


def _rows_to_show(series: Series) -> npt.NDArray[np.intp]:
    period = float(np.median(np.diff(series.time))) if len(series) > 1 else PERIOD
    step = max(1, round(PERIOD / period)) if period > 0.0 else 1
    rows = np.arange(0, len(series), step)
    shown = np.ones(len(rows), dtype=bool)
    for attitude in (series.attitude[rows], series.desired_attitude[rows]):
        shown &= np.abs(attitude).max(axis=1) < 2.0  # before the norm, which could overflow; False for NaN
        shown[shown] &= np.abs(np.linalg.norm(attitude[shown], axis=1) - 1.0) < 0.1
    for tip in (series.tip[rows], series.desired_tip[rows]):
        shown &= np.abs(tip).max(axis=1) < _FAR
    return rows[shown]
