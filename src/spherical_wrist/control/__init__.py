"""Control laws: the contract, and one law a file."""

from spherical_wrist.control.adaptive_fuzzy_sliding_computed_torque import AdaptiveFuzzySlidingComputedTorque
from spherical_wrist.control.computed_torque import ComputedTorque
from spherical_wrist.control.contract import Command, Law, ModelBasedLaw, Signal
from spherical_wrist.control.fuzzy_sliding_computed_torque import FuzzySlidingComputedTorque
from spherical_wrist.control.pd import PD
from spherical_wrist.control.sliding_computed_torque import SlidingComputedTorque
from spherical_wrist.control.sliding_mode import SlidingMode
from spherical_wrist.control.switching import switch

__all__ = [
    "PD",
    "AdaptiveFuzzySlidingComputedTorque",
    "Command",
    "ComputedTorque",
    "FuzzySlidingComputedTorque",
    "Law",
    "ModelBasedLaw",
    "Signal",
    "SlidingComputedTorque",
    "SlidingMode",
    "switch",
]
