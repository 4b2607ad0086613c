"""Cogging torque, which pulls a rotor towards preferred attitudes."""

from math import sin, sqrt, tan

from spherical_wrist.so3 import Quaternion, Vector3, cross, quaternion_log


def cogging_torque(attitude: Quaternion, amplitude: float, detents: int) -> Vector3:
    """Return the torque [N·m], body frame, of the potential U(θ) = −(A/n) Σ cos(n θ_i) of θ = log(q).

    A turn at the body rate ω moves θ by J⁻¹ ω, J the right Jacobian of SO(3), so the torque that does the work −dU is
    τ = −J⁻ᵀ ∂U/∂θ = −A J⁻ᵀ sin(n θ), with J⁻ᵀ v = v − ½ θ × v + c θ × (θ × v) and c = (1 − ½ |θ| cot ½|θ|) / |θ|².
    About one axis alone it is −A sin(n θ). It is conservative, and continuous but at half a turn.

    Args:
        attitude: of the rotor.
        amplitude: A [N·m].
        detents: n, periods per turn.
    """
    t = quaternion_log(attitude)
    v = (-amplitude * sin(detents * t[0]), -amplitude * sin(detents * t[1]), -amplitude * sin(detents * t[2]))
    angle = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    # below 1e-3 the next term of the series is under the rounding of the first
    c = 1.0 / 12.0 + angle * angle / 720.0 if angle < 1e-3 else (1.0 - 0.5 * angle / tan(0.5 * angle)) / (angle * angle)
    first = cross(t, v)
    second = cross(t, first)
    return (
        v[0] - 0.5 * first[0] + c * second[0],
        v[1] - 0.5 * first[1] + c * second[1],
        v[2] - 0.5 * first[2] + c * second[2],
    )
