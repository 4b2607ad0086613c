"""What a run of the loop is made of: parts that last from call to call, and inputs that are drawn piece by piece."""

from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation.drive import Drive
from spherical_wrist.disturbance import Torque
from spherical_wrist.dynamics import Nominal
from spherical_wrist.sensing.measure import Sensor
from spherical_wrist.sensing.samples import Samples
from spherical_wrist.simulation.engine import Engine
from spherical_wrist.simulation.loop import Plant
from spherical_wrist.simulation.nominal import Motion
from spherical_wrist.simulation.timing import Timing

Array = npt.NDArray[np.float64]


class Inputs(NamedTuple):
    """What is known before consecutive control instants are played.

    Attributes:
        time: control instants [s], (n,).
        desired: the reference as MOTION (n,).
        seen: the reference at the times of the samples in force (n,).
        ahead: the reference at the instants for which model and feed-forward are evaluated (n,).
        samples: the faults of the samples, SAMPLE (n,).
        disturbance: torque on the joint [N·m] during each physics step (n · substeps, 3).
    """

    time: Array
    desired: npt.NDArray[Any]
    seen: npt.NDArray[Any]
    ahead: npt.NDArray[Any]
    samples: npt.NDArray[Any]
    disturbance: Array

    def then(self, later: "Inputs", first: int, substeps: int) -> Self:
        """The instants from the one in row ``first`` on, and after them those of ``later``."""
        starts = [first] * (len(self) - 1) + [first * substeps]
        joined = (np.concatenate([old[start:], new]) for old, new, start in zip(self, later, starts, strict=True))
        return type(self)(*joined)


class Parts(NamedTuple):
    """What :func:`spherical_wrist.simulation.loop.close_loop` takes that lasts from call to call; records as arrays."""

    law: Any
    parameters: Array
    state: Array
    plant: Plant
    nominal: Nominal
    sensor: Sensor
    drive: Drive
    settings: npt.NDArray[Any]
    signal: npt.NDArray[Any]
    command: npt.NDArray[Any]

    def handed(self, engine: Engine, inputs: Inputs) -> tuple[Any, ...]:
        """The arguments of the loop but for the arrays that it writes its log into."""
        sensor, drive = (each._replace(settings=engine.record(each.settings)) for each in (self.sensor, self.drive))
        drawn = (inputs.desired, inputs.seen, inputs.ahead, inputs.samples)
        return (
            *(self.law, self.parameters, self.state, self.plant, self.nominal, sensor, drive),
            engine.record(self.settings),
            *map(engine.records, drawn),
            inputs.disturbance,
            *map(engine.record, (self.signal, self.command)),
        )


class Source(NamedTuple):
    """Where inputs come from: functions of time, and samples that are drawn in turn.

    Attributes:
        timing: control and physics periods.
        reference: desired motion.
        disturbance: torque on the plant's joint.
        samples: the faults of the samples.
        timestamped: the controller sees something old, and knows its age.
        ahead: how far ahead of an instant the law wants its model [s]; 0 for none.
    """

    timing: Timing
    reference: Motion
    disturbance: Torque
    samples: Samples
    timestamped: bool
    ahead: float

    def draw(self, first: int, last: int) -> Inputs:
        """The inputs of the control instants ``first`` up to but not including ``last``; each once, in turn."""
        time = self.timing.instants(first, last)
        desired = self.reference.motion(time)
        faults = self.samples.draw(time)
        aged = self.timestamped and bool(faults["age"].any())
        seen = self.reference.motion(time - faults["age"]) if aged else desired
        later = self.reference.motion(time + self.ahead) if self.ahead > 0.0 else desired
        return Inputs(time, desired, seen, later, faults, self.disturbance(self.timing.steps(first, last)))
