"""Control laws: the contract, and one law a file."""

from spherical_wrist.control.adaptive_fuzzy_sliding_computed_torque import AdaptiveFuzzySlidingComputedTorque
from spherical_wrist.control.boundary_layer_sliding_mode import BoundaryLayerSlidingMode
from spherical_wrist.control.computed_torque import ComputedTorque
from spherical_wrist.control.computed_torque_integral import ComputedTorqueIntegral
from spherical_wrist.control.computed_torque_observer import ComputedTorqueObserver
from spherical_wrist.control.contract import Command, Law, LawState, ModelBasedLaw, Signal, choice
from spherical_wrist.control.fuzzy_integral_sliding import FuzzyIntegralSliding
from spherical_wrist.control.fuzzy_observer_sliding import FuzzyObserverSliding
from spherical_wrist.control.fuzzy_sliding_computed_torque import FuzzySlidingComputedTorque
from spherical_wrist.control.geometric_tracking import GeometricTracking
from spherical_wrist.control.indi import INDI
from spherical_wrist.control.l1_adaptive import L1Adaptive
from spherical_wrist.control.linear_adrc import LinearADRC
from spherical_wrist.control.linear_mpc import LinearMPC
from spherical_wrist.control.lqg import LQG
from spherical_wrist.control.pd import PD
from spherical_wrist.control.rise import RISE
from spherical_wrist.control.sliding_computed_torque import SlidingComputedTorque
from spherical_wrist.control.sliding_mode import SlidingMode
from spherical_wrist.control.slotine_li import SlotineLi
from spherical_wrist.control.super_twisting import SuperTwisting
from spherical_wrist.control.switching import switch
from spherical_wrist.control.time_delay_control import TimeDelayControl

__all__ = [
    "INDI",
    "LQG",
    "PD",
    "RISE",
    "AdaptiveFuzzySlidingComputedTorque",
    "BoundaryLayerSlidingMode",
    "Command",
    "ComputedTorque",
    "ComputedTorqueIntegral",
    "ComputedTorqueObserver",
    "FuzzyIntegralSliding",
    "FuzzyObserverSliding",
    "FuzzySlidingComputedTorque",
    "GeometricTracking",
    "L1Adaptive",
    "Law",
    "LawState",
    "LinearADRC",
    "LinearMPC",
    "ModelBasedLaw",
    "Signal",
    "SlidingComputedTorque",
    "SlidingMode",
    "SlotineLi",
    "SuperTwisting",
    "TimeDelayControl",
    "choice",
    "switch",
]
