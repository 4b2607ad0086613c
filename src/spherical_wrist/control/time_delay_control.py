"""Time-delay control: the torque that the model missed one period ago is taken for the one that it misses now."""

from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawStatus, Signal
from spherical_wrist.control.past_period import PastPeriod, rate_error_change, remember
from spherical_wrist.control.torque_limit import LimitAwareLaw, limit_of, limited
from spherical_wrist.parameters import NonNegativeVector, Positive, PositiveVector, quantity


class TimeDelayControl(LimitAwareLaw):
    """Time-delay control: τ = H q̈_d + N + M̄ (Kv ė + Kp e) + ĥ, ĥ = δ⁻ + M̄ (ė − ė⁻) / T.

    ⁻ marks what was one period T ago. δ = τ − H q̈_d − N [N·m], body frame, is the commanded torque beyond that of the
    nominal model (H, N) on the reference, and M̄ = s H a share s of the nominal inertia (Youcef-Toumi and Ito, 1990;
    Hsia and Gao, 1990, who take M̄ for a constant diagonal matrix).

    Derivation: whatever the plant, H* ω̇ + N* = τ + d can be written M̄ dė/dt = −δ + h, where h gathers everything that
    is not known. It is δ + M̄ dė/dt, which is known for the period that just ended, and h is slow: ĥ(t) = h(t − T). The
    law then leaves M̄ (dė/dt + Kv ė + Kp e) = h(t) − h(t − T), of the order of T. A constant torque d is balanced
    completely, ĥ = −d.

    Assumptions: h changes little within a period. Stability: the error of ĥ shrinks by 1 − s H/H* a period, so that
    s < 2 H*/H is necessary, and sufficient for a short enough period (Hsia and Gao, 1990); a small s is a small loop
    gain, for hardware with delays. Summed up, δ = (s H / T) (ė + Kv e + Kp ∫ e dt): a PID around feedback linearisation
    (Chang and Jung, 2009), in which the attitude error enters through an integral only.

    Defaults by ``wrist design``. ĥ counts only torque within ``torque_limit``, and does not
    exceed it.
    """

    status: ClassVar[LawStatus] = "rival"
    tracks_to: ClassVar[Bound] = Bound(6.4e-5, 9.8e-5)

    State = PastPeriod

    Kp: PositiveVector = quantity(4834.0, "1/s²", "proportional gain per axis", searched=(1000.0, 100000.0))
    Kv: NonNegativeVector = quantity(119.6, "1/s", "derivative gain per axis", searched=(30.0, 1000.0))
    inertia_share: Positive = quantity(0.1963, "", "share s of the nominal inertia that M̄ is", searched=(0.05, 1.0))

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        for i in range(3):
            command.torque[i] = signal.N[i]
            needed = state.deviation[i]
            for j in range(3):
                share = parameters.inertia_share * signal.H[i, j]
                wanted = parameters.Kv[j] * signal.rate_error[j] + parameters.Kp[j] * signal.error[j]
                command.torque[i] += signal.H[i, j] * signal.feed_forward[j] + share * wanted
                needed += share * rate_error_change(signal, j, state)
            command.torque[i] += limited(needed, limit_of(signal, i, parameters.torque_limit))
        remember(signal, command, parameters.torque_limit, state)
