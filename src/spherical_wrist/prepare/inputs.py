"""Inputs of the loop, sampled in chunks: reference, sensor faults, disturbance."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from spherical_wrist.disturbance import Torque
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.rollout import Inputs
from spherical_wrist.sensing.samples import Samples


class HasMotion(Protocol):
    """Interface of a reference, or of a cached or checked one."""

    def motion(self, time: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
        """See :meth:`spherical_wrist.reference.base.Reference.motion`."""


class CachedMotion(NamedTuple):
    """Reference with cached samples.

    Attributes:
        motion: cached :meth:`HasMotion.motion`.
    """

    motion: Callable[[npt.NDArray[np.float64]], npt.NDArray[Any]]


class InputSource(NamedTuple):
    """Source of the inputs of a run: reference, sensor faults, disturbance.

    Attributes:
        timing: control and physics periods.
        reference: desired motion.
        disturbance: torque on the plant's joint.
        samples: sensor faults.
        timestamped: True if samples can be old and the controller knows their age.
        ahead: time from a control instant to the time for which the model is evaluated [s]; 0 for no prediction.
    """

    timing: Timing
    reference: HasMotion
    disturbance: Torque
    samples: Samples
    timestamped: bool
    ahead: float

    def draw(self, first: int, last: int) -> Inputs:
        """Sample the inputs of control instants ``first`` to ``last`` − 1. Calls must be in order, without gaps."""
        time = self.timing.instants(first, last)
        desired = self.reference.motion(time)
        faults = self.samples.draw(time)
        aged = self.timestamped and bool(faults["age"].any())
        seen = self.reference.motion(time - faults["age"]) if aged else desired
        later = self.reference.motion(time + self.ahead) if self.ahead > 0.0 else desired
        return Inputs(time, desired, seen, later, faults, self.disturbance(self.timing.steps(first, last)))
