"""A closed loop made of its parts, advanced in chunks: arrays in, loop, series out."""

from typing import Any, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation import Actuation
from spherical_wrist.actuation.drive import drive_of
from spherical_wrist.control.contract import COMMAND, SIGNAL, Law
from spherical_wrist.disturbance import Torque
from spherical_wrist.errors import LawError, one_line
from spherical_wrist.libmujoco import drop_step_timer, warnings_kept_in_data
from spherical_wrist.sensing.measure import sensor_of
from spherical_wrist.sensing.samples import Samples
from spherical_wrist.simulation import loop
from spherical_wrist.simulation.diagnosis import check_step
from spherical_wrist.simulation.engine import Engine, interpreted_engine
from spherical_wrist.simulation.hardware import Hardware
from spherical_wrist.simulation.instant import model_ahead, sense
from spherical_wrist.simulation.logged import Logged
from spherical_wrist.simulation.nominal import Motion, NominalModel
from spherical_wrist.simulation.outcome import Outcome, Status
from spherical_wrist.simulation.parts import Inputs, Parts, Source
from spherical_wrist.simulation.series import Series
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.simulation.workbench import Machine, Workbench, machine_of
from spherical_wrist.so3 import Vector3, quaternion_exp, quaternion_product, relative_attitude, rotate
from spherical_wrist.wrist import Wrist

Array = npt.NDArray[np.float64]

RATE_LIMIT = 1000.0
"""Rate [rad/s] beyond which a run counts as diverged: a radian per millisecond, far from any wrist's."""

CHUNK = 8192
"""Control periods that are simulated at a time, which bounds the memory of a run however long it is."""

MOST_STEPS = 16 * CHUNK
"""Physics steps between two answers to who asks to stop, and rows of the disturbance in memory."""


class Start(NamedTuple):
    """Where the plant starts, relative to the reference.

    Attributes:
        error: attitude error e [rad].
        rate_error: rate error ė [rad/s].
    """

    error: Vector3 = (0.0, 0.0, 0.0)
    rate_error: Vector3 = (0.0, 0.0, 0.0)


class ClosedLoop:
    """One run in progress.

    Args:
        plant: the true wrist.
        nominal: what the controller believes.
        law: control law.
        reference: desired motion.
        disturbance: torque on the plant's joint.
        timing: control and physics periods.
        engine: how to run it.
        start: initial errors.
        hardware: sensors and motors; ideal ones where none are given.
        bench: where laws are prepared; one of its own where none is given.
        machine: the plant and the nominal model, ready for the loop, where they are not to be made here of ``plant``
            and ``nominal``; ``plant`` then says only what its motors and its tool are.

    Attributes:
        sample: control instants simulated so far.
        outcome: None while running; then how the run ended.

    Raises:
        LawError: the law raises, writes no torque, or cannot be compiled.
        ModelError: MuJoCo cannot step the plant.
    """

    def __init__(
        self,
        plant: Wrist,
        nominal: Wrist,
        law: Law,
        reference: Motion,
        disturbance: Torque,
        timing: Timing,
        engine: Engine,
        start: Start,
        hardware: Hardware | None = None,
        bench: Workbench | None = None,
        machine: Machine | None = None,
    ) -> None:
        drop_step_timer()
        self.sample = 0
        self.outcome: Outcome | None = None
        self._wrist, self._law, self._reference = plant, law, reference
        self._timing, self._engine = timing, engine
        self._hardware = hardware or Hardware()
        sensing, actuation, seed = self._hardware
        self._settings = _settings(law, timing, actuation)
        samples = Samples(sensing, timing.control_period, seed)
        ahead = float(self._settings["ahead"][0])
        aged = sensing.timestamped and not sensing.perfect
        self._source = Source(timing, reference, disturbance, samples, aged, ahead)
        self._sensor = sensor_of(sensing, timing.control_period)
        limits, periods = (plant.lower, plant.upper), (timing.control_period, timing.physics_period)
        self._drive = drive_of(actuation, plant.motors, *limits, *periods, seed)
        self._state = _initial_state(law)
        self._signal, self._command = np.zeros(1, SIGNAL), np.zeros(1, COMMAND)
        # the compiled loop holds addresses: these keep what is there alive
        self._model, self._data, self._nominal = machine or machine_of(plant, nominal, timing, engine)
        self._plant = loop.Plant(
            engine.handle(self._model),
            engine.handle(self._data),
            self._data.qpos,
            self._data.qvel,
            self._data.ctrl,
            self._data.qfrc_applied,
            self._data.warning.number,
        )
        self._place(start)
        self._bench = bench or Workbench(engine)
        if type(law) not in self._bench.tried:
            self._try_law(nominal)
            self._bench.tried.add(type(law))
        _, self._parameters, self._step = self._bench.law(law)

    def advance(self, samples: int = CHUNK) -> Series:
        """The series of what :meth:`run` logs."""
        return self.series(self.run(samples))

    def series(self, logged: Logged) -> Series:
        """Something logged as a series."""
        return logged.series(self._wrist, self._hardware)

    def run(self, samples: int = CHUNK) -> Logged:
        """Simulates up to ``samples`` control periods; what was logged in them is valid until the next call.

        Sets ``outcome`` when the run completes or diverges; the series of a diverged run ends where it did.

        Raises:
            LawError: the law raised, or wrote a torque that is not finite.
        """
        engine, inputs = self._engine, self.next_inputs(samples)
        log = self._bench.log(len(inputs.time))
        states = np.empty((len(log), self._law.state_size))
        currents = np.empty((len(log), len(self._drive.coils)))
        arguments = (*self.parts.handed(engine, inputs), engine.records(log), states, currents)
        try:
            with warnings_kept_in_data():
                progress = engine.close_loop(*arguments)
        except Exception as error:  # nothing in the loop raises but a law, which may raise anything
            self.blame(f"raised {type(error).__name__}: {one_line(error)}")
        self.conclude(*progress)
        rows = (inputs.time, inputs.desired, inputs.disturbance[:: self._timing.substeps], log, states, currents)
        return Logged(*rows).first(progress.logged)

    def next_inputs(self, samples: int, steps: int = MOST_STEPS) -> Inputs:
        """The inputs of up to so many control periods, and physics steps, from now on; the loop is told of them."""
        samples = min(samples, max(1, steps // self._timing.substeps))
        last = min(self.sample + samples, self._timing.samples) if self.outcome is None else self.sample
        self._settings["first"] = self.sample
        return self.draw(self.sample, last)

    def draw(self, first: int, last: int) -> Inputs:
        """The inputs of the control instants ``first`` up to but not including ``last``; each once, in turn."""
        return self._source.draw(first, last)

    @property
    def parts(self) -> Parts:
        """What the loop works on."""
        rest = (self._sensor, self._drive, self._settings, self._signal, self._command)
        return Parts(self._step, self._parameters, self._state, self._plant, self._nominal.handles, *rest)

    def conclude(self, logged: int, status: int) -> None:
        """Takes how far the loop came in so many more control periods, and why it stopped; sets ``outcome``.

        Raises:
            LawError: the law wrote a torque that is not finite.
        """
        self.sample += logged
        time = self.sample * self._timing.control_period
        if status == loop.NO_TORQUE:
            self.blame("wrote a torque that is not finite")
        if status == loop.TOO_FAST:
            speed = float(np.linalg.norm(self._data.qvel))
            reason = f"the wrist turns at {speed:.4g} rad/s, beyond {RATE_LIMIT:g} rad/s"
            self.outcome = Outcome(Status.DIVERGED, time, reason)
        elif status == loop.UNSTABLE:
            self.outcome = Outcome(Status.DIVERGED, time, "the physics became unstable (state not finite or huge)")
        elif self.sample == self._timing.samples:
            self.outcome = Outcome(Status.COMPLETED, time)

    def blame(self, fault: str) -> NoReturn:
        """Raises for the present instant, in the law's own words where one plain step shows them.

        Raises:
            LawError: always.
        """
        check_step(self._law, self._signal, self._state)
        time = float(self._signal["time"][0])
        raise LawError(f"law {self._law.name!r} at t = {time:.6g} s {fault}")

    def _try_law(self, nominal: Wrist) -> None:
        """One control instant in plain Python: what a law gets wrong raises there, and might not when compiled."""
        engine = interpreted_engine()
        desired = engine.records(self._reference.motion(np.zeros(1)))
        signal, settings = engine.record(self._signal), engine.record(self._settings)
        q, w = tuple(map(float, self._data.qpos)), tuple(map(float, self._data.qvel))
        trial = NominalModel(nominal, self._timing, engine)
        sense(signal, settings, 0, q, w, desired[0], 0.0)
        scale = float(self._settings["rate_scale"][0])
        model_ahead(signal, scale, trial.handles, q, w, desired[0], desired[0], 0.0)
        check_step(self._law, self._signal, self._state)

    def _place(self, start: Start) -> None:
        """Puts the plant where its errors are those of ``start``."""
        desired = self._reference.motion(np.zeros(1))[0]
        w, x, y, z = map(float, desired["attitude"])
        a, b, c = map(float, desired["rate"])
        q_d, w_d = (w, x, y, z), (a, b, c)
        back = (-start.error[0], -start.error[1], -start.error[2])
        q = quaternion_product(q_d, quaternion_exp(back))
        carried = rotate(relative_attitude(q, q_d), w_d)
        self._data.qpos[:] = q
        self._data.qvel[:] = np.subtract(carried, start.rate_error)


def _settings(law: Law, timing: Timing, actuation: Actuation) -> npt.NDArray[Any]:
    settings = np.zeros(1, loop.SETTINGS)
    settings["period"] = timing.control_period
    settings["substeps"] = timing.substeps
    settings["ahead"] = 0.5 * timing.control_period + actuation.lag if law.looks_ahead else 0.0
    settings["rate_scale"] = 0.0 if law.gravity_only else 1.0
    settings["rate_limit"] = RATE_LIMIT
    return settings


def _initial_state(law: Law) -> Array:
    state = np.array(law.initial_state(), dtype=np.float64)
    if state.shape != (law.state_size,):
        raise LawError(
            f"law {law.name!r}: its initial state has shape {state.shape}, its state_size is {law.state_size}"
        )
    return state if law.state_size else np.zeros(1)
