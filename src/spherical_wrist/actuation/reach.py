"""Share of the motors' limits that a torque takes."""

import numpy as np

from spherical_wrist.actuation.drive import Drive
from spherical_wrist.arrays import Array


def utilisation(drive: Drive, attitude: Array, torque: Array) -> Array:
    """Compute the share of its limit that the motor or coil closest to it needs; above 1, the torque is cut.

    The same as :func:`.set_torque_command` finds at one instant, without the resolution of the torque.

    Args:
        drive: motors.
        attitude: attitudes in which they act, (n, 4).
        torque: body-frame torques [N·m], (n, 3).

    Returns:
        Shares (n,); infinity where the coils cannot make the torque.
    """
    settings = drive.settings[0]
    control = torque @ settings["controls"].T
    limit = np.where(control < 0.0, settings["lower"], settings["upper"])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(control == 0.0, 0.0, control / limit).max(axis=1)
    if len(drive.coils):
        share = np.maximum(share, _currents(drive, attitude, torque) / settings["limit"])
    return np.asarray(share, dtype=np.float64)


def _currents(drive: Drive, attitude: Array, torque: Array) -> Array:
    """Return the largest of the currents of least norm [A], (n,); infinity where the torque map has not rank three."""
    order = int(drive.settings["order"][0])
    w, x, y, z = attitude.T
    turn = np.empty((len(attitude), 3, 3))  # body to world
    turn[:, 0] = np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)], axis=1)
    turn[:, 1] = np.stack([2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)], axis=1)
    turn[:, 2] = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1)
    seen = drive.coils @ turn  # the coils' directions in the body frame, (n, N, 3)
    field = (seen[..., 0] + 1j * seen[..., 1]) ** (order - 1)
    gradient = np.stack([field.real, -field.imag, np.zeros_like(field.real)], axis=-1)
    maps = drive.believed[:, None] * np.cross(gradient, seen)
    gram = np.einsum("nji,njk->nik", maps, maps)
    scale = np.trace(gram, axis1=1, axis2=2)
    solvable = np.linalg.det(gram) > 1e-14 * scale**3
    largest = np.full(len(torque), np.inf)
    factors = np.linalg.solve(gram[solvable], torque[solvable, :, None])
    largest[solvable] = np.abs(maps[solvable] @ factors)[..., 0].max(axis=1, initial=0.0)
    return largest
