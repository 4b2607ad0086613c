"""Computed torque with a disturbance observer, which compensates the torque that the nominal model misses."""

from math import exp
from typing import Any, ClassVar, Literal

from spherical_wrist.control.computed_torque import ComputedTorque, computed_torque
from spherical_wrist.control.contract import Bound, Command, LawStatus, Signal, choice
from spherical_wrist.control.past_period import PastPeriod, missed_torque, remember
from spherical_wrist.control.torque_limit import LimitAwareLaw, limit_of, limited
from spherical_wrist.parameters import NonNegativeVector, Positive, PositiveVector, Vector, inherited, quantity

DisturbanceModel = Literal["constant", "ramp"]
RAMP = choice(DisturbanceModel, "ramp")


class ComputedTorqueObserver(LimitAwareLaw, ComputedTorque):
    """Computed torque with a disturbance observer: τ = H (q̈_d + Kv ė + Kp e) + N − d̂.

    d [N·m], body frame, is the torque that the plant gets beyond the nominal model, H ω̇ = τ − N + d, seen once a period
    as its mean d̄ over the period that just ended, from the change of the momentum H ė (see ``past_period``). With
    p = exp(−L T), L the bandwidth and T the period, and d̂, v̂ the law's state,

        constant:  d̂ ← d̂ + (1 − p) (d̄ − d̂),
        ramp:      r = d̄ − (d̂ + T v̂),   d̂ ← d̂ + T v̂ + (1 − p²) r,   v̂ ← v̂ + (1 − p)² r / T,

    and −(d̂ + T v̂) in the torque, d̂ belonging to one period ago. The first is the nonlinear disturbance observer with an
    auxiliary vector H ė L (Chen, Ballance, Gawthrop and O'Reilly, 2000), in momentum form (De Luca and Mattone, 2003),
    or equally the first-order Q-filter of Ohnishi (Ohnishi, Shibata and Murakami, 1996); the second takes the
    disturbance for the output of a double integrator (Chen, 2004, who allows any such exogenous system).

    Derivation: the error d − d̂ of the estimate obeys the same recursion with d as its input, so it has the poles p, one
    or two of them: a constant d is found as exp(−L t), and the ramp model follows a ramp without error. What is left of
    d drives eq. (15): ë + Kv ė + Kp e = −H⁻¹ (d − d̂).

    Assumptions: nominal inertia; d does not depend on the error. Stability: then estimate and error are in cascade and
    stable for Kp, Kv, L > 0. On a plant m times as heavy the estimate depends on the error, and the margins decide:
    the defaults are those that ``wrist design`` found. The estimate counts only torque within ``torque_limit``, and
    does not exceed it.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(2.8e-5, 5.1e-5)

    class State(PastPeriod):
        """Past period, and the estimated disturbance."""

        estimate: Vector = quantity(0.0, "N·m", "estimated disturbance d̂")
        growth: Vector = quantity(0.0, "N·m", "its growth T v̂ in a period")

    Kp: PositiveVector = inherited(ComputedTorque, "Kp", 3886.0, searched=(1000.0, 100000.0))
    Kv: NonNegativeVector = quantity(107.2, "1/s", "derivative gain per axis", searched=(30.0, 1000.0))
    bandwidth: Positive = quantity(51.04, "1/s", "bandwidth L of the observer", searched=(20.0, 1000.0))
    disturbance_model: DisturbanceModel = quantity("ramp", "", "model of the disturbance in the observer")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        pole = exp(-parameters.bandwidth * signal.period)
        for i in range(3):
            estimate, growth = state.estimate[i], state.growth[i]
            missed, limit = missed_torque(signal, i, state), limit_of(signal, i, parameters.torque_limit)
            if parameters.disturbance_model == RAMP:
                innovation = missed - (estimate + growth)
                estimate += growth + (1.0 - pole * pole) * innovation
                growth += (1.0 - pole) * (1.0 - pole) * innovation
            else:
                estimate += (1.0 - pole) * (missed - estimate)
            state.estimate[i] = limited(estimate, limit)
            state.growth[i] = growth if abs(estimate) < limit else 0.0
            command.torque[i] -= state.estimate[i] + state.growth[i]
        remember(signal, command, parameters.torque_limit, state)
