"""The surface of a beating heart, followed by the tool's tip."""

from math import hypot
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from spherical_wrist.arrays import Array
from spherical_wrist.parameters import NonNegative, Positive, quantity
from spherical_wrist.reference.base import Reference
from spherical_wrist.reference.curve import motion_of_curve
from spherical_wrist.reference.heart_rhythm import sinus_rhythm, variability, with_premature_beats
from spherical_wrist.reference.jet import Jet, wave


def _per_direction(value: Any) -> Any:
    """Expand one number to both directions."""
    return (value, value) if isinstance(value, bool | int | float) else value


def _not_silent(harmonics: tuple[float, ...]) -> tuple[float, ...]:
    if sum(harmonics) <= 0.0:
        raise ValueError("one of them must be greater than 0")
    return harmonics


Pair = Annotated[tuple[NonNegative, NonNegative], BeforeValidator(_per_direction)]
Harmonics = Annotated[tuple[NonNegative, ...], Field(min_length=1, max_length=20), AfterValidator(_not_silent)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class BeatingHeart(Reference):
    """A point on the heart's surface, followed by the tip: respiration, and a heartbeat that it modulates.

    In the plane tangent to the tip's sphere at the identity, the point moves by

        x = R_x r + C_x (1 + m r) Σ a_k cos(2π k ϕ) / Σ a_k,
        y = R_y r + C_y (1 + m r) Σ a_k sin(2π k ϕ) / Σ a_k,   r = sin(2π f_r t),

    in mm, with the number of beats ϕ(t). The wrist turns its tool, which points along −z, by the shortest way to where
    the tip's coordinates in that plane are x and y exactly: for small motions a tilt of displacement over lever. About
    the tool it spins by ``twist``·(1 + m r) Σ a_k cos(2π k ϕ) / Σ a_k, as the heart wrings itself with each beat.
    Attitude, rate and acceleration are exact derivatives of one another, through premature beats too.

    ϕ grows by ``heart_rate``, whose variability is a sum of seeded tones in the two bands of the Task Force (1996), and
    ``premature`` beats come early, with the full compensatory pause after them; see
    :mod:`spherical_wrist.reference.heart_rhythm`. The waveform is stretched with its beat: the pause is no standstill.

    Sources: two components, the heartbeat's harmonics modulated in amplitude by respiration, from spectra measured in
    vivo (chapter 6 of Chesi and Hashimoto, eds., Visual Servoing via Advanced Numerical Methods, 2010; prediction and
    control of such motion in Ginhoux et al., IEEE Transactions on Robotics, 2005, and Bachta et al., ibid., 2011).
    Heart at 1.5 Hz and respiration at 0.3 Hz: an anaesthetised pig (Measurements of heart motion using accelerometers,
    IEEE EMBS, 2004). Heart rates of 35 to 90 per minute, 0.58 to 1.5 Hz, were tested by Jacobs et al. (Annals of
    Thoracic Surgery 76, 2003). Ratio of the bands: the default of McSharry et al.'s synthetic heart (IEEE Transactions
    on Biomedical Engineering, 2003). Amplitudes of millimetres, those of the harmonics, the depth of modulation, the
    twist, the standard deviation under anaesthesia and the coupling are assumptions of the usual order.
    """

    breath: Pair = quantity((2.0, 4.0), "mm", "R, of respiration along x and y")
    breath_rate: Positive = quantity(0.3, "Hz", "f_r, breaths per second")
    heartbeat: Pair = quantity((4.0, 3.0), "mm", "C, of the heartbeat along x and y, its peak along x")
    harmonics: Harmonics = quantity(
        (1.0, 0.5, 0.25, 0.12, 0.06), "", "a, relative amplitudes of the heartbeat's harmonics"
    )
    modulation: Fraction = quantity(
        0.2, "", "m, share of the heartbeat's amplitude that respiration modulates", percent=True
    )
    twist: NonNegative = quantity(0.05, "rad", "spin about the tool with each beat, its peak")
    heart_rate: Annotated[float, Field(ge=0.5, le=4.0)] = quantity(1.5, "Hz", "beats per second, on average")
    deviation: NonNegative = quantity(0.02, "s", "standard deviation of the intervals between normal beats (SDNN)")
    low_to_high: NonNegative = quantity(
        0.5, "", "power of slow (0.04–0.15 Hz) over fast (0.15–0.4 Hz) variability", acts_with={"deviation": True}
    )
    premature: Annotated[float, Field(ge=0, le=0.5)] = quantity(0.0, "", "probability that a beat is premature")
    coupling: Annotated[float, Field(ge=0.3, le=1)] = quantity(
        0.6, "", "share of the interval after which a premature beat comes", acts_with={"premature": True}
    )
    lever: Positive = quantity(0.115, "m", "distance from the joint to the tool's tip")
    seed: Annotated[int, Field(ge=0, lt=2**64)] | None = quantity(
        None,
        "",
        "seed of variability and premature beats; the experiment's where none is given",
        acts_with={"deviation": True, "premature": True},
    )

    @model_validator(mode="after")
    def _can_be_followed(self) -> Self:
        farthest = [r + c * (1.0 + self.modulation) for r, c in zip(self.breath, self.heartbeat, strict=True)]
        reach = hypot(*farthest)
        if reach > 900.0 * self.lever:
            raise ValueError(
                f"a lever of {self.lever:g} m cannot follow a motion of up to {reach:.3g} mm: "
                "give smaller amplitudes, or a longer lever"
            )
        if self.deviation * self.heart_rate > 0.1:
            raise ValueError(
                f"deviation = {self.deviation:g} s: at most a tenth of the interval, {1.0 / self.heart_rate:.3g} s"
            )
        return self

    def drawn(self, random: np.random.Generator) -> Reference:
        """Return the reference with a seed, drawn if none is given."""
        return self.replaced(seed=int(random.integers(2**32))) if self.seed is None else self

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`; without a seed, that of seed 0."""
        x, y, spin = self._course(time)
        along, across = x.scaled(1e-3 / self.lever), y.scaled(1e-3 / self.lever)
        # the quaternion of the shortest turn from −z to (x, y, −h) is (1 + h, y, −x, 0), but for its length
        square = along * along + across * across
        h = np.sqrt(1.0 - square.value)
        tall = square.through(1.0 + h, -0.5 / h, -0.25 / h**3)
        cosine, sine = np.cos(0.5 * spin.value), np.sin(0.5 * spin.value)
        c, s = spin.through(cosine, -0.5 * sine, -0.25 * cosine), spin.through(sine, 0.5 * cosine, -0.25 * sine)
        turned = (tall * c, across * c - along * s, (along * c + across * s).scaled(-1.0), tall * s)
        return motion_of_curve(
            np.stack([part.value for part in turned], axis=1),
            np.stack([part.rate for part in turned], axis=1),
            np.stack([part.acceleration for part in turned], axis=1),
        )

    def displacement(self, time: Array) -> Array:
        """Return the coordinates x and y [mm], (n, 2), of the point on the heart at ``time`` [s], (n,)."""
        x, y, _ = self._course(time)
        return np.stack([x.value, y.value], axis=1)

    def beats(self, time: Array) -> Jet:
        """Return ϕ: beats since t = 0 as a continuous number, the heart rate [Hz] and its change [Hz/s]."""
        seed = self.seed or 0
        tones = variability(self.heart_rate, self.deviation, self.low_to_high, seed)
        return with_premature_beats(sinus_rhythm(time, self.heart_rate, tones), self.premature, self.coupling, seed)

    def _course(self, time: Array) -> tuple[Jet, Jet, Jet]:
        """Return the coordinates x and y [mm], and the spin [rad]."""
        breath = wave(time, self.breath_rate)
        strength = breath.scaled(self.modulation, 1.0)
        cosine, sine = _beat(self.beats(time).scaled(2.0 * np.pi), self.harmonics)
        cosine, sine = strength * cosine, strength * sine
        (breath_x, breath_y), (beat_x, beat_y) = self.breath, self.heartbeat
        x = breath.scaled(breath_x) + cosine.scaled(beat_x)
        y = breath.scaled(breath_y) + sine.scaled(beat_y)
        return x, y, cosine.scaled(self.twist)


def _beat(phase: Jet, harmonics: tuple[float, ...]) -> tuple[Jet, Jet]:
    """Return Σ a_k cos kϕ / Σ a_k and Σ a_k sin kϕ / Σ a_k for a phase ϕ [rad]."""
    derivatives = np.zeros((2, 3, len(phase.value)))
    for k, weight in enumerate(harmonics, start=1):
        a = weight / sum(harmonics)
        cosine, sine = a * np.cos(k * phase.value), a * np.sin(k * phase.value)
        derivatives[0] += cosine, -k * sine, -(k**2) * cosine
        derivatives[1] += sine, k * cosine, -(k**2) * sine
    return phase.through(*derivatives[0]), phase.through(*derivatives[1])
