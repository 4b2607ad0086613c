"""Desired motions of the wrist with exact attitude, rate and acceleration."""

from spherical_wrist.reference.angles import Lissajous, Sinusoid, motion_of_angles
from spherical_wrist.reference.base import Reference, motion_of
from spherical_wrist.reference.beating_heart import BeatingHeart
from spherical_wrist.reference.chirp import Chirp
from spherical_wrist.reference.recorded import Recorded
from spherical_wrist.reference.slew import Hold, Step
from spherical_wrist.reference.suture import Suture

__all__ = [
    "BeatingHeart",
    "Chirp",
    "Hold",
    "Lissajous",
    "Recorded",
    "Reference",
    "Sinusoid",
    "Step",
    "Suture",
    "motion_of",
    "motion_of_angles",
]
