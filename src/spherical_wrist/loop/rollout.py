"""Rollouts: the arrays of one run of the loop, and the driver that runs many of them in one compiled call.

All runs go through :func:`run_chunk`, and those of environments through :func:`advance`.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation.drive import DRIVE, Drive
from spherical_wrist.arrays import Array
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION, Nominal
from spherical_wrist.loop.addresses import (
    ARRAY,
    array_address,
    array_addresses,
    counters,
    law_at,
    numbers,
    records,
    table,
)
from spherical_wrist.loop.compiler import entry
from spherical_wrist.loop.constraints import CONSTRAINTS, STATE, Constraints
from spherical_wrist.loop.engine import Engine
from spherical_wrist.loop.loop import LOG, RAISED, SETTINGS, Plant, Progress, close_loop
from spherical_wrist.loop.machine_code import Compiled
from spherical_wrist.measure.logged import Logged
from spherical_wrist.measure.metrics import METRIC_SETTINGS, TOTALS, accumulate
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE


class Inputs(NamedTuple):
    """Inputs of consecutive control instants, sampled before the loop runs.

    Attributes:
        time: control instants [s], (n,).
        desired: reference at the control instants, MOTION (n,).
        seen: reference at the times of the samples that the law gets, MOTION (n,).
        ahead: reference at the times for which model and feed-forward are evaluated, MOTION (n,).
        samples: sensor faults, SAMPLE (n,).
        disturbance: torque on the joint [N·m] during each physics step (n · substeps, 3).
    """

    time: Array
    desired: npt.NDArray[Any]
    seen: npt.NDArray[Any]
    ahead: npt.NDArray[Any]
    samples: npt.NDArray[Any]
    disturbance: Array

    def then(self, later: "Inputs", first: int, substeps: int) -> Self:
        """Drop the rows before ``first``, and append the rows of ``later``."""
        starts = [first] * (len(self) - 1) + [first * substeps]
        joined = (np.concatenate([old[start:], new]) for old, new, start in zip(self, later, starts, strict=True))
        return type(self)(*joined)


class LoopArguments(NamedTuple):
    """Arguments of :func:`spherical_wrist.loop.loop.close_loop` that stay the same between calls; records as arrays."""

    law: Any
    parameters: Array
    state: Array
    plant: Plant
    constraints: Constraints
    nominal: Nominal
    sensor: Sensor
    drive: Drive
    settings: npt.NDArray[Any]
    signal: npt.NDArray[Any]
    command: npt.NDArray[Any]


class Rollout(NamedTuple):
    """One run of the loop, for the control instants whose inputs are sampled.

    Attributes:
        parts: models, law, sensors and motors.
        inputs: inputs of the control instants to run.
        metric_settings: settings of the metrics, METRIC_SETTINGS (1,).
        totals: sums of the metrics, TOTALS (1,), updated.
        widths: size of the law's state, and number of coil currents.
    """

    parts: LoopArguments
    inputs: Inputs
    metric_settings: npt.NDArray[Any]
    totals: npt.NDArray[Any]
    widths: tuple[int, int]


def _fields(kind: Any, **others: npt.DTypeLike) -> npt.DTypeLike:
    """Return a dtype with the fields of a named tuple, all of dtype ARRAY except those in ``others``."""
    return np.dtype([(name, others.get(name, ARRAY)) for name in kind._fields], align=True)


RUN = np.dtype(
    [
        (
            "parts",
            _fields(
                LoopArguments,
                law="i8",
                plant=_fields(Plant, model="i8", data="i8"),
                constraints=_fields(Constraints),
                nominal=_fields(Nominal, model="i8", data="i8"),
                sensor=_fields(Sensor),
                drive=_fields(Drive),
            ),
        ),
        ("inputs", _fields(Inputs)),
        ("log", ARRAY),
        ("states", ARRAY),
        ("currents", ARRAY),
        ("metric_settings", ARRAY),
        ("totals", ARRAY),
        ("logged", "i8"),
        ("status", "i8"),
    ],
    align=True,
)
"""Run record: addresses of the law and of all arrays of a run, and its progress, written by :func:`run_all`.

``status`` is UNFINISHED where the law of a run has raised, and for runs after it.
"""

UNFINISHED = -1


class LogMemory(NamedTuple):
    """Memory for the log of a rollout.

    Attributes:
        log: LOG (n,).
        states: state of the law before each step, (n, size of the state).
        currents: coil currents [A], (n, coils).
    """

    log: npt.NDArray[Any]
    states: Array
    currents: Array


def fill_run_record(
    run: Any, parts: LoopArguments, memory: LogMemory, metric_settings: npt.NDArray[Any], totals: npt.NDArray[Any]
) -> None:
    """Fill a RUN record, except for its inputs. The caller must keep all arrays alive."""
    run["parts"] = array_addresses(parts._replace(law=parts.law.address))
    run["log"], run["states"], run["currents"] = map(array_address, memory)
    run["metric_settings"], run["totals"] = array_address(metric_settings), array_address(totals)


class Chunk(NamedTuple):
    """Result of one chunk of several rollouts.

    Attributes:
        progress: progress of each rollout.
        faults: exceptions that laws raised, by index of the rollout.
        logged: log of a single rollout, valid until the memory is used again; None for several, which share the memory.
    """

    progress: list[Progress]
    faults: dict[int, Exception]
    logged: Logged | None


def run_chunk(rollouts: Sequence[Rollout], engine: Engine, log: npt.NDArray[Any]) -> Chunk:
    """Run every rollout to the end of its inputs, or until it stops or its law raises, and add to its metrics.

    All rollouts use the same log memory in turn, so that it stays in the processor's cache.

    Args:
        rollouts: rollouts to run.
        engine: compiled or interpreted.
        log: LOG, at least as long as the longest inputs.
    """
    counts = [len(rollout.inputs.time) for rollout in rollouts]
    widths = np.array([rollout.widths for rollout in rollouts])
    sizes = (widths * np.array(counts)[:, None]).max(axis=0)
    states, currents = (np.empty(size) for size in sizes)
    memories = [
        LogMemory(log[:n], states[: n * a].reshape(n, a), currents[: n * b].reshape(n, b))
        for n, (a, b) in zip(counts, widths.tolist(), strict=True)
    ]
    run_rollouts = _run_compiled if engine.compiled else _run_interpreted
    faults: dict[int, Exception] = {}
    progress = run_rollouts(rollouts, memories, engine, faults)
    if len(rollouts) > 1:
        return Chunk(progress, faults, None)
    [rollout], [memory], [reached] = rollouts, memories, progress
    inputs, substeps = rollout.inputs, int(rollout.parts.settings["substeps"][0])
    logged = Logged(inputs.time, inputs.desired, inputs.disturbance[::substeps], *memory)
    return Chunk(progress, faults, logged.first(reached.logged))


def compiled_run_all() -> Compiled:
    """Return :func:`run_all` compiled."""
    return entry(run_all, RUN)


def _run_compiled(
    rollouts: Sequence[Rollout], memories: Sequence[LogMemory], engine: Engine, faults: dict[int, Exception]
) -> list[Progress]:
    runs = np.zeros(len(rollouts), RUN)
    for run, rollout, memory in zip(runs, rollouts, memories, strict=True):
        fill_run_record(run, rollout.parts, memory, rollout.metric_settings, rollout.totals)
        run["inputs"] = array_addresses(rollout.inputs)
    compiled = compiled_run_all()
    first = 0
    while first < len(runs):
        try:
            compiled(runs[first:])
            break
        except Exception as error:  # only a law can raise in the loop, and it can raise anything
            first += int((runs["status"][first:] == UNFINISHED).argmax())
            faults[first] = error
            runs[first]["logged"], runs[first]["status"] = _raised(rollouts[first], memories[first], engine)
            first += 1
    return [Progress(int(run["logged"]), int(run["status"])) for run in runs]


def _raised(rollout: Rollout, memory: LogMemory, engine: Engine) -> Progress:
    """Return the progress of a rollout whose law just raised, and add the rows before that to its metrics.

    The rows are still in the log memory. Their number follows from the time that the law was told.
    """
    settings, signal = rollout.parts.settings, rollout.parts.signal
    done = round(float(signal["time"][0] / settings["period"][0])) - int(settings["first"][0])
    _accumulate(rollout, memory, engine, done)
    settings["first"] += done
    return Progress(done, RAISED)


def _accumulate(rollout: Rollout, memory: LogMemory, engine: Engine, done: int) -> None:
    """Add the first rows of a log to the metrics of a rollout."""
    record, records = engine.record, engine.records
    engine.accumulate(
        *(record(rollout.metric_settings), record(rollout.totals), rollout.inputs.time[:done]),
        *(records(rollout.inputs.desired[:done]), records(memory.log[:done]), memory.currents[:done]),
    )


def _run_interpreted(
    rollouts: Sequence[Rollout], memories: Sequence[LogMemory], engine: Engine, faults: dict[int, Exception]
) -> list[Progress]:
    results: list[Progress] = []
    for index, (rollout, memory) in enumerate(zip(rollouts, memories, strict=True)):
        parts, inputs = rollout.parts, rollout.inputs
        record, records = engine.record, engine.records
        arguments = parts._replace(
            constraints=parts.constraints._replace(
                sums=record(parts.constraints.sums), states=records(parts.constraints.states)
            ),
            sensor=parts.sensor._replace(settings=record(parts.sensor.settings)),
            drive=parts.drive._replace(settings=record(parts.drive.settings)),
            settings=record(parts.settings), signal=record(parts.signal), command=record(parts.command),
        )  # fmt: skip
        try:
            progress = close_loop(
                desired=records(inputs.desired), seen=records(inputs.seen), ahead=records(inputs.ahead),
                samples=records(inputs.samples), disturbance=inputs.disturbance,
                log=records(memory.log), states=memory.states, currents=memory.currents, **arguments._asdict(),
            )  # fmt: skip
        except Exception as error:  # only a law can raise in the loop, and it can raise anything
            faults[index] = error
            results.append(_raised(rollout, memory, engine))
            continue
        _accumulate(rollout, memory, engine, progress.logged)
        results.append(progress)
    return results


def run_all(runs: Any) -> None:
    """Run every run to the end of its inputs, or until it stops; compiled.

    Args:
        runs: RUN (n,).
    """
    for i in range(len(runs)):
        runs[i].status = UNFINISHED
    for i in range(len(runs)):
        run = runs[i]
        progress = advance(run, 0, run.inputs.desired.rows)
        run.logged, run.status = progress.logged, progress.status


def advance(run: Any, first: int, count: int) -> Progress:
    """Run the next ``count`` control periods of a run, from row ``first`` of its inputs, and add to its metrics.

    Compiled.

    Args:
        run: RUN record.
        first: row of the present control instant.
        count: number of control periods, at most the length of the log.
    """
    parts, inputs, last = run.parts, run.inputs, first + count
    plant, constraints, nominal, sensor, drive = (
        parts.plant, parts.constraints, parts.nominal, parts.sensor, parts.drive,
    )  # fmt: skip
    settings = records(parts.settings, SETTINGS)[0]
    desired, log = records(inputs.desired, MOTION)[first:last], records(run.log, LOG)[:count]
    currents = table(run.currents)[:count]
    progress = close_loop(
        law_at(parts.law),
        numbers(parts.parameters),
        numbers(parts.state),
        plant_at(plant),
        Constraints(
            numbers(constraints.torque), records(constraints.sums, CONSTRAINTS)[0], records(constraints.states, STATE),
        ),
        Nominal(
            nominal.model, nominal.data, numbers(nominal.qpos), numbers(nominal.qvel), numbers(nominal.bias),
            numbers(nominal.passive),
        ),
        Sensor(records(sensor.settings, SENSOR)[0], table(sensor.history)),
        Drive(
            records(drive.settings, DRIVE)[0], numbers(drive.wanted), numbers(drive.level), table(drive.coils),
            numbers(drive.strength), numbers(drive.believed), table(drive.K),
        ),
        settings,
        desired,
        records(inputs.seen, MOTION)[first:last],
        records(inputs.ahead, MOTION)[first:last],
        records(inputs.samples, SAMPLE)[first:last],
        table(inputs.disturbance)[first * settings.substeps : last * settings.substeps],
        records(parts.signal, SIGNAL)[0],
        records(parts.command, COMMAND)[0],
        log,
        table(run.states)[:count],
        currents,
    )  # fmt: skip
    done = progress.logged
    metric_settings, totals = records(run.metric_settings, METRIC_SETTINGS)[0], records(run.totals, TOTALS)[0]
    time = numbers(inputs.time)[first : first + done]
    accumulate(metric_settings, totals, time, desired[:done], log[:done], currents[:done])
    settings.first += done
    return progress


def plant_at(plant: Any) -> Plant:
    """Return the plant of a RUN record. Compiled."""
    return Plant(
        plant.model, plant.data, numbers(plant.qpos), numbers(plant.qvel), numbers(plant.ctrl), numbers(plant.applied),
        counters(plant.warnings),
    )  # fmt: skip
