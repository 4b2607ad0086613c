"""Mismatch torque Δ of a run: the torque that keeps S of the plant constant, minus that of the model-based part.

The plant obeys H ω̇ + N = τ + d, with the disturbance and dry friction in d; to keep S it needs τ* = H a_r + N − d, as
``motion`` defines a_r. A law τ = τ̂ + K sw(S / φ) of a model-based and a switching part therefore gives

    H Ṡ = τ* − τ = Δ − K sw(S / φ),    Δ = τ* − τ̂.

So the paper's symbols of eq. (37)–(42) read as follows. "H Ṡ + N S", which (37) sets against τ, is τ*: as it stands it
lacks the desired motion, and the same line with H a_r + N is exact. "Ĥ Ṡ + N̂ S" of (39) is τ̂, for eq. (38) with the
PD term of eq. (34) in it, which helps where it pushes towards S = 0. "H̃ Ṡ + Ñ S" is Δ. Its inertial share "H̃ Ṡ" is
(H − Ĥ) a_r; the rest, for "Ñ S", is (N − N̂) − d, with whatever τ̂ supplies beside Ĥ a_r + N̂.

A motor limit cuts torque from τ: here all of that is missing from τ̂, and so part of Δ, because no K compensates for it.
A law that predicts half a period ahead supplies the torque that is needed then: that difference, at most
½ T |dτ*/dt|, is part of Δ as well. The recorded state is taken as the true one.
"""

from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.control import Law, switch
from spherical_wrist.control.switching import SATURATION, SIGN, TANH
from spherical_wrist.errors import ParameterError
from spherical_wrist.paper.lyapunov.motion import surface_motion
from spherical_wrist.simulation.run import Run

KINDS = {"sign": SIGN, "saturation": SATURATION, "tanh": TANH}


class Mismatch(NamedTuple):
    """Torques on S along a run of n control instants; body frame.

    Attributes:
        K: switching gain per axis [N·m], (3,).
        phi: boundary layer [rad/s], (3,); zero for ``sign``.
        edge: σ, the switching function at the edge of its layer: tanh 1 for ``tanh``, else 1.
        H: inertia matrix of the plant [kg·m²], (3, 3).
        total: Δ [N·m] just after each control instant, (n, 3).
        inertial: its share (H − Ĥ) a_r [N·m], (n, 3).
        after: H Ṡ = Δ − K sw(S / φ) [N·m] just after each control instant, (n, 3).
        before: H Ṡ [N·m] just before instants 1 … n − 1, (n − 1, 3).
    """

    K: Array
    phi: Array
    edge: float
    H: Array
    total: Array
    inertial: Array
    after: Array
    before: Array


def mismatch(run: Run) -> Mismatch:
    """Compute the mismatch torque of a run from the plant's own model.

    Raises:
        ParameterError: the law has no sliding surface or no switching gain, or the run has not every control instant.
    """
    _check(run)
    law: Any = run.experiment.law
    K, phi, kind = np.array(law.K), np.array(law.phi), KINDS[law.switching]
    moved = surface_motion(run)
    after, before = moved.after @ moved.H.T, moved.before @ moved.H.T
    switched = np.array([[switch(kind, s, p) for s, p in zip(row, law.phi, strict=True)] for row in run.surface])
    return Mismatch(
        K=K,
        phi=phi if kind != SIGN else np.zeros(3),
        edge=switch(kind, 1.0, 1.0),
        H=moved.H,
        total=after + K * switched,
        inertial=moved.steady @ (moved.H - moved.H_nominal).T,
        after=after,
        before=before,
    )


def _check(run: Run) -> None:
    law: Law = run.experiment.law
    if len(run) < 2 or run.every != 1:
        kept = f"every {run.every}th control instant" if run.every != 1 else f"{len(run)} control instants"
        raise ParameterError(
            f"the Lyapunov monitor needs every control instant of a run and at least two; this one has {kept}: "
            "simulate with record_every=1 and keep_series=True"
        )
    if {"measured_attitude", "commanded_torque"} & run.channels.keys():
        raise ParameterError(
            "the Lyapunov monitor follows the surface of the true state and the torque that the law asked for: "
            "simulate with ideal sensing and actuation"
        )
    slides = {"surface", "slope"} <= run.channels.keys()
    if not slides or np.isnan(run.surface).any() or np.isnan(run.slope).any():
        raise ParameterError(
            f"law {law.name!r} has no sliding surface for the Lyapunov monitor: take one that records surface and "
            "slope, such as sliding_mode"
        )
    missing = [name for name in ("K", "phi", "switching") if not hasattr(law, name)]
    if missing:
        raise ParameterError(
            f"law {law.name!r} has a sliding surface but no {', '.join(missing)}: the Lyapunov monitor needs its "
            "switching part to be K sw(S / φ)"
        )
