"""Where the tool is: positions and tilt from attitudes."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def rotated(attitude: Array, vector: Array) -> Array:
    """R(q) v for quaternions (n, 4) and one body-frame vector (3,): vectors (n, 3) in the mount's frame."""
    w, x, y, z = attitude.T
    a, b, c = vector
    # t = 2 u × v, then v + w t + u × t, spelt out: np.cross would take ten times as long
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    turned = (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)
    return np.stack(turned, axis=1)


def tip_position(attitude: Array, anchor: Array, mount: Array, lever: Array) -> Array:
    """Tool tip in the world [m], (n, 3): the centre of the ball joint plus the turned lever.

    Args:
        attitude: quaternions (n, 4), body → mount.
        anchor: centre of the ball joint in the world [m].
        mount: rotation (3, 3) from the mount to the world.
        lever: from that centre to the tip, body frame [m].
    """
    turned = rotated(attitude, lever)
    return anchor + (turned if np.array_equal(mount, np.eye(3)) else turned @ mount.T)


def tilt(attitude: Array, lever: Array) -> Array:
    """Angle [rad], (n,), between the lever to the tool tip and where it points at the identity. Spin does not count."""
    turned = rotated(attitude, lever)
    angle: Array = np.arctan2(np.linalg.norm(np.cross(turned, lever), axis=1), turned @ lever)
    return angle
