"""Reference against the limits of the wrist's motors."""

import numpy as np

from spherical_wrist.actuation.drive import Drive
from spherical_wrist.actuation.reach import utilisation
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.prepare.inputs import HasMotion
from spherical_wrist.prepare.nominal import NominalModel

PIECE = 4096
"""Control instants that are looked at together, which bounds the memory."""


def reach_warnings(nominal: NominalModel, reference: HasMotion, timing: Timing, drive: Drive) -> tuple[str, ...]:
    """Return a sentence if the nominal wrist alone, with nothing to disturb it, needs more torque than its motors give.

    Args:
        nominal: nominal model.
        reference: desired motion.
        timing: timing of the run.
        drive: motors.
    """
    beyond, first, largest, worst, torque_there = 0, 0.0, 0.0, 0.0, 0.0
    for start in range(0, timing.samples, PIECE):
        time = timing.instants(start, min(start + PIECE, timing.samples))
        torque = nominal.torque(reference, time)
        share = utilisation(drive, reference.motion(time)["attitude"], torque)
        over = share > 1.0
        if over.any() and not beyond:
            first = float(time[over.argmax()])
        beyond += int(np.count_nonzero(over))
        k = int(share.argmax())
        if share[k] > largest:
            largest, worst, torque_there = float(share[k]), float(time[k]), float(np.linalg.norm(torque[k]))
    if not beyond:
        return ()
    size = f"{largest:.3g} × what they give" if np.isfinite(largest) else "what their coils cannot make"
    sentence = (
        f"the reference alone needs more torque than the motors give: up to {size} ({torque_there:.3g} N·m at "
        f"{worst:.4g} s), beyond their limits from {first:.4g} s on for {100.0 * beyond / timing.samples:.3g} % of the "
        "time: no law can follow it there; give a gentler reference or stronger motors"
    )
    return (sentence,)
