"""Many runs of the loop in one call; compiled.

A call from Python takes its arguments apart one by one, and waits for Python's lock at its end: with a RUN for each of
many runs, both happen once for all of them. The loop and the gauge of the metrics are those of every other run.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation.drive import DRIVE, Drive
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION, Array, Nominal
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.simulation.addresses import (
    ARRAY,
    counters,
    laid,
    law_at,
    loop_at,
    numbers,
    records,
    table,
    where,
)
from spherical_wrist.simulation.compiler import address, compiled_loop
from spherical_wrist.simulation.gauge import TOTALS, WINDOW, gauge
from spherical_wrist.simulation.loop import LOG, SETTINGS, Plant, Progress
from spherical_wrist.simulation.parts import Inputs, Parts


def _fields(kind: Any, **others: npt.DTypeLike) -> npt.DTypeLike:
    """A record with the fields of a named tuple: ARRAY, but for ``others``."""
    return np.dtype([(name, others.get(name, ARRAY)) for name in kind._fields], align=True)


RUN = np.dtype(
    [
        ("loop", "i8"),
        (
            "parts",
            _fields(
                Parts,
                law="i8",
                plant=_fields(Plant, model="i8", data="i8"),
                nominal=_fields(Nominal, model="i8", data="i8"),
                sensor=_fields(Sensor),
                drive=_fields(Drive),
            ),
        ),
        ("inputs", _fields(Inputs)),
        ("log", ARRAY),
        ("states", ARRAY),
        ("currents", ARRAY),
        ("window", ARRAY),
        ("totals", ARRAY),
        ("logged", "i8"),
        ("status", "i8"),
    ],
    align=True,
)
"""A run: the address of the loop, and where all that it works on lies; then how far :func:`play` came with it, and why
it stopped, or PLAYING where the law raised and in runs after that one."""

PLAYING = -1


def lay(
    run: Any,
    parts: Parts,
    log: npt.NDArray[Any],
    states: Array,
    currents: Array,
    window: npt.NDArray[Any],
    totals: npt.NDArray[Any],
) -> None:
    """Writes into a RUN where all but its inputs lies; whoever plays it keeps that alive.

    Args:
        run: the RUN, written.
        parts: of the run, its law compiled.
        log: LOG (n,), room for n control periods.
        states: room for the law's state, (n, size).
        currents: room for coil currents, (n, coils).
        window: WINDOW (1,), what is measured.
        totals: TOTALS (1,), where to.
    """
    run["loop"] = address(compiled_loop())
    run["parts"] = laid(parts._replace(law=address(parts.law)))
    run["log"], run["states"], run["currents"] = where(log), where(states), where(currents)
    run["window"], run["totals"] = where(window), where(totals)


def play(runs: Any) -> None:
    """Plays every run through all of its inputs, as far as it goes.

    Args:
        runs: RUN (n,).
    """
    for i in range(len(runs)):
        runs[i].status = PLAYING
    for i in range(len(runs)):
        run = runs[i]
        progress = advance(run, 0, run.inputs.desired.rows)
        run.logged, run.status = progress.logged, progress.status


def advance(run: Any, first: int, count: int) -> Progress:
    """Plays a run on by ``count`` control periods, the first of them in row ``first`` of its inputs, and measures them.

    Args:
        run: RUN, or a record with the same fields.
        first: row of the present instant.
        count: control periods to play, for which its log has room.
    """
    parts, inputs, last = run.parts, run.inputs, first + count
    plant, nominal, sensor, drive = parts.plant, parts.nominal, parts.sensor, parts.drive
    settings = records(parts.settings, SETTINGS)[0]
    desired, log = records(inputs.desired, MOTION)[first:last], records(run.log, LOG)[:count]
    currents = table(run.currents)[:count]
    progress: Progress = loop_at(run.loop)(
        law_at(parts.law),
        numbers(parts.parameters),
        numbers(parts.state),
        plant_at(plant),
        Nominal(
            nominal.model, nominal.data, numbers(nominal.qpos), numbers(nominal.qvel), numbers(nominal.passive),
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
    window, totals = records(run.window, WINDOW)[0], records(run.totals, TOTALS)[0]
    gauge(window, totals, numbers(inputs.time)[first : first + done], desired[:done], log[:done], currents[:done])
    settings.first += done
    return progress


def plant_at(plant: Any) -> Plant:
    """The plant of a run."""
    return Plant(
        plant.model, plant.data, numbers(plant.qpos), numbers(plant.qvel), numbers(plant.ctrl), numbers(plant.applied),
        counters(plant.warnings),
    )  # fmt: skip
