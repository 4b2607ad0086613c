"""Description of the sensors: faults and their size.

From the true attitude q(t) and rate ω(t) at the control instants t_k, the controller gets, in this order,

==================  ===================================================================================================
part                effect
==================  ===================================================================================================
delay δ             the sample of instant t_k is q(t_k − δ), ω(t_k − δ); between instants a cubic, and linear
attitude_noise σ    q ⊗ exp(ν), ν ~ N(0, σ² I): white from sample to sample, independent on the axes
attitude_quantum Δ  exp(Δ round(log(q) / Δ)), component by component: an error uniform within ±Δ/2
rate_noise, bias    ω + b + ν, ν ~ N(0, σ² I)
rate = estimated    no rate sensor: ω̂ += s / (s + T_f) (log(q'⁻¹ q) / s − ω̂), from the sample q' of s seconds before;
                    it starts from the true rate
loss p              each sample but the first is lost with probability p; the one before stays in force
==================  ===================================================================================================

Where the samples are ``timestamped``, their age a_k (the delay and the periods lost) is known: the controller forms its
errors with the reference at t_k − a_k, and a law with prediction takes its model a_k further ahead. An estimated rate
is half the time between its two samples, and T_f, older still: it is compared with the desired rate of that time.
Before the start there is nothing to see but the start: no sample is older than the run. Sources and realistic values
are in ``models/README.md``.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from spherical_wrist.parameters import Member, NonNegative, Vector, inherited, quantity

Probability = Annotated[float, Field(ge=0, lt=1)]
Delay = Annotated[float, Field(ge=0, le=1)]


class Sensing(Member):
    """Sensors of attitude and rate."""

    kind: ClassVar[str] = "sensing"
    abstract: ClassVar[bool] = True

    attitude_noise: NonNegative = quantity(
        0.0, "rad", "standard deviation of the attitude, per axis and sample", random=True
    )
    attitude_quantum: NonNegative = quantity(0.0, "rad", "resolution of the attitude, per component of its log")
    rate_noise: NonNegative = quantity(
        0.0, "rad/s", "standard deviation of the rate, per axis and sample", acts_with={"rate": "measured"}, random=True
    )
    rate_bias: Vector = quantity(
        (0.0, 0.0, 0.0), "rad/s", "constant error of the rate, per axis", acts_with={"rate": "measured"}
    )
    rate: Literal["measured", "estimated"] = quantity(
        "measured", "", "by a sensor of its own, or from attitude samples"
    )
    rate_filter: NonNegative = quantity(
        0.0, "s", "time constant T_f of the filter on an estimated rate", acts_with={"rate": "estimated"}
    )
    delay: Delay = quantity(0.0, "s", "age of a sample, any fraction of periods")
    loss: Probability = quantity(0.0, "", "probability that a sample is lost", percent=True, random=True)
    timestamped: bool = quantity(
        True,
        "",
        "the age of samples is known, and accounted for",
        acts_with={"delay": True, "loss": True, "rate": "estimated"},
    )

    @property
    def ideal(self) -> bool:
        """True if no sensor fault is enabled: the controller sees the true state."""
        return not self.acting


class Ideal(Sensing):
    """Sensors without a fault, except those that are set."""


class Realistic(Sensing):
    """A 16-bit orientation sensor of one arc minute, a MEMS gyroscope, and a bus that costs half a millisecond.

    One arc minute (2.9·10⁻⁴ rad) is what Hall and eddy-current sensors in a ball joint reach about the axes across it:
    1′8″ and 2′15″ RMS, against 29′6″ about the joint's own axis (Sensors 24(1):90, 2024, doi:10.3390/s24010090). That
    all of it is white noise, and alike about every axis, is an assumption. 2π/2¹⁶ is the resolution of 16 bits over a
    turn. The gyroscope's noise is 2.8·10⁻³ °/s/√Hz (TDK InvenSense, data sheet of the ICM-42688-P) over 500 Hz. What is
    left of its bias after calibration at rest, the delay and the loss are assumptions.
    """

    attitude_noise: NonNegative = inherited(Sensing, "attitude_noise", 2.9e-4)
    attitude_quantum: NonNegative = inherited(Sensing, "attitude_quantum", 9.6e-5)
    rate_noise: NonNegative = inherited(Sensing, "rate_noise", 1.1e-3)
    rate_bias: Vector = inherited(Sensing, "rate_bias", (1e-3, 1e-3, 1e-3))
    delay: Delay = inherited(Sensing, "delay", 5e-4)
    loss: Probability = inherited(Sensing, "loss", 1e-3)
