"""Forward kinematics: position of the tool tip from attitudes."""

import numpy as np

from spherical_wrist.arrays import Array


def rotated(attitude: Array, vector: Array) -> Array:
    """Compute R(q) v for quaternions (n, 4) and one body-frame vector (3,): vectors (n, 3) in the mount's frame."""
    w, x, y, z = attitude.T
    a, b, c = vector
    # t = 2 u × v, then v + w t + u × t; np.cross would take ten times as long
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    turned = (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)
    return np.stack(turned, axis=1)


def tip_position(attitude: Array, anchor: Array, mount: Array, lever: Array) -> Array:
    """Compute the tool tip in the world [m], (n, 3): centre of the ball joint plus rotated lever.

    Args:
        attitude: quaternions (n, 4), body → mount.
        anchor: centre of the ball joint in the world [m].
        mount: rotation (3, 3) from the mount to the world.
        lever: vector from that centre to the tip, body frame [m].
    """
    turned = rotated(attitude, lever)
    return anchor + (turned if np.array_equal(mount, np.eye(3)) else turned @ mount.T)
