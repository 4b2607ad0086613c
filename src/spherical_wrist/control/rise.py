"""RISE: the robust integral of the sign of the error, whose torque is continuous."""

from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, LawState, LawStatus, Signal
from spherical_wrist.control.sliding_mode import equivalent_torque
from spherical_wrist.control.switching import SwitchingName, switch
from spherical_wrist.control.torque_limit import LimitAwareLaw, integrated, limit_of
from spherical_wrist.parameters import NonNegativeVector, Positive, PositiveVector, Vector, quantity


class RISE(LimitAwareLaw):
    """RISE: τ = H (q̈_d + λ ė + k S) + N + w, ẇ = H (k α S + β sw(S/φ)), with S = ė + λ e.

    H [kg·m²] and N [N·m] are the nominal model's, q̈_d the feed-forward [rad/s²], e [rad] and ė [rad/s] the errors, all
    in the body frame; w [N·m] is ``integral`` of the law's state. Xian, Dawson, de Queiroz and Chen (2004) have e₂ for
    S, k_s + 1 for k, and k (S − S(0)) for k S, which is another start of the integral only.

    Derivation: with d the torque beyond the nominal model, H ω̇ = τ − N + d, and r = Ṡ + α S, the law makes

        ṙ = −k r + α Ṡ − β sgn(S) − δ̇,    δ = H⁻¹ d.

    For |δ̇| and |δ̈| bounded and β > |δ̇| + |δ̈| / α the integral of r (−δ̇ − β sgn S) is at most β |S(0)| + S(0) δ̇(0): what
    is left of that bound is a P ≥ 0 with Ṗ = r (δ̇ + β sgn S). Then V = ½ S² + ½ r² + P has, with Ṡ = r − α S,

        V̇ = −α S² − (k − α) r² + (1 − α²) r S,

    which for k large enough is negative for all S and r but zero. S, and after it e, tend to zero, whatever d itself,
    with a torque that is an integral of the sign, hence continuous.

    Chosen before continuous twisting (Torres-González, Sánchez, Fridman and Moreno, 2017), which has |e|^⅓ in its
    torque: of infinite slope at zero, where the attitude has noise. Here noise meets linear gains and an integral.

    Assumptions: nominal inertia, bounded ḋ and d̈; ``sign`` needs to switch arbitrarily fast. Held for a period T its
    integral moves in steps of β T. Within a layer φ the law is linear: a PID with the integral gain k α + β / φ, for
    which S̈ + k Ṡ + (k α + β/φ) S = −δ̇; stable, and a slow d leaves S = δ̇ / (k α + β / φ). Outside it is that of Xian.
    The integral stops at the limits of the motors, and while the whole torque is beyond them. It is updated first: the
    torque of a sample contains what that sample adds to w.

    Defaults by ``wrist design``, in the layer. Known lateness is not compensated.
    """

    status: ClassVar[LawStatus] = "rival"
    has_surface: ClassVar[bool] = True
    tracks_to: ClassVar[Bound] = Bound(6.5e-5, 1.0e-4)

    class State(LawState):
        """Memory of the integral."""

        integral: Vector = quantity(0.0, "N·m", "integral torque w")

    slope: Positive = quantity(53.57, "1/s", "slope λ of S (α₁)", searched=(20.0, 500.0))
    K: Positive = quantity(129.4, "1/s", "gain k of S (k_s + 1)", searched=(20.0, 500.0))
    integral_rate: Positive = quantity(116.2, "1/s", "rate α of the linear integral (α₂)", searched=(10.0, 500.0))
    sign_gain: NonNegativeVector = quantity(
        261.9, "rad/s³", "gain β of the integral of the sign, per axis", searched=(30.0, 3000.0)
    )
    switching: SwitchingName = quantity("saturation", "", "switching function")
    phi: PositiveVector = quantity(
        0.1141, "rad/s", "boundary layer φ per axis; sign only reports with it", searched=(0.03, 1.0)
    )

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        equivalent_torque(signal, parameters.slope, command)
        for i in range(3):
            command.slope[i] = parameters.slope
            command.surface[i] = parameters.slope * signal.error[i] + signal.rate_error[i]
        for i in range(3):
            change = 0.0
            for j in range(3):
                surface = command.surface[j]
                push = parameters.sign_gain[j] * switch(parameters.switching, surface, parameters.phi[j])
                command.torque[i] += signal.H[i, j] * parameters.K * surface
                change += signal.period * signal.H[i, j] * (parameters.K * parameters.integral_rate * surface + push)
            limit = limit_of(signal, i, parameters.torque_limit)
            state.integral[i] = integrated(state.integral[i], change, command.torque[i], limit)
            command.torque[i] += state.integral[i]
