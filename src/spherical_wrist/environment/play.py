"""Many episodes, each played on by some control periods in one call; compiled.

Everything of an episode is found through its ROW: the addresses of what the loop works on, and what the reward depends
on. The loop, the gauge of the metrics and the sensors are those of every other run.
"""

from typing import Any

import numpy as np

from spherical_wrist.actuation.drive import DRIVE, Drive
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION, Nominal
from spherical_wrist.environment.observation import observe
from spherical_wrist.environment.reward import judge
from spherical_wrist.sensing.measure import SENSOR, Sensor
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.simulation.addresses import ARRAY, counters, law_at, numbers, records, table
from spherical_wrist.simulation.gauge import TOTALS, WINDOW, gauge
from spherical_wrist.simulation.loop import LOG, RUNNING, SETTINGS, Plant, close_loop
from spherical_wrist.simulation.parts import Inputs

PLANT, NOMINAL, MOTORS = Plant._fields[2:], Nominal._fields[2:], Drive._fields[1:]
"""The arrays of each, after model and data, and after the settings."""

ARRAYS = (
    *("parameters", "state", "settings", "signal", "command", "sensor", "scratch", "history", "drive"),
    *("log", "states", "currents", "window", "totals"),
    *PLANT,
    *(f"nominal_{name}" for name in NOMINAL),
    *MOTORS,
    *Inputs._fields,
)
ROW = np.dtype(
    [
        *((name, ARRAY) for name in ARRAYS),
        *((name, "i8") for name in ("law", "model", "data", "nominal_model", "nominal_data")),
        *((name, "i8") for name in ("frame", "periods", "offset", "left")),
        *((name, "f8", 3) for name in ("gravity", "lever", "weights", "scales", "asked")),
        *((name, "f8") for name in ("held", "most_tip_error", "most_error")),
    ],
    align=True,
)
"""An episode: where its arrays lie, and what the rest of it is.

``frame``: control periods of a frame; ``periods``: to be played now, at most, −1 for an episode that waits; ``offset``:
row of the present instant among the inputs; ``left``: control periods to the end; ``asked``: the last torque asked for,
once ``held``.
"""

RESULT = np.dtype(
    [
        ("reward", "f8"),
        ("status", "i8"),
        ("beyond", "?"),
        ("terminated", "?"),
        ("truncated", "?"),
        ("dry", "?"),
        ("tip_error_mm", "f8"),
        ("error", "f8", 3),
        ("rate_error", "f8", 3),
        ("torque", "f8", 3),
    ],
    align=True,
)
"""What came of it: why the loop stopped, or PLAYING where the law raised; whether the episode is over, and whether its
inputs end before the next frame does; the truth at the present instant, and the torque of the last period."""

PLAYING = -1


def play(rows: Any, results: Any, observations: Any) -> int:
    """Plays every episode on by its ``periods``, none at its beginning.

    Args:
        rows: ROW (n,).
        results: RESULT (n,), written.
        observations: (n, 18 and the numbers of an action), of which the first 18 are written.

    Returns:
        How many of them are over or need more inputs.
    """
    news = 0
    for i in range(len(rows)):
        result = results[i]
        result.terminated = result.truncated = result.dry = False
        if rows[i].periods >= 0:
            play_one(rows[i], result, observations[i])
        if result.terminated or result.truncated or result.dry:
            news += 1
    return news


def play_one(row: Any, result: Any, observation: Any) -> None:
    """See :func:`play`."""
    n, k = min(row.periods, row.left), row.offset
    plant = Plant(
        row.model, row.data, numbers(row.qpos), numbers(row.qvel), numbers(row.ctrl), numbers(row.applied),
        counters(row.warnings),
    )  # fmt: skip
    settings, signal = records(row.settings, SETTINGS)[0], records(row.signal, SIGNAL)[0]
    logged, result.status = 0, PLAYING
    if n > 0:
        time, desired = numbers(row.time)[k : k + n], records(row.desired, MOTION)[k : k + n]
        log, currents = records(row.log, LOG)[:n], table(row.currents)[:n]
        progress = close_loop(
            law_at(row.law),
            numbers(row.parameters),
            numbers(row.state),
            plant,
            Nominal(
                row.nominal_model, row.nominal_data, numbers(row.nominal_qpos), numbers(row.nominal_qvel),
                numbers(row.nominal_passive),
            ),
            Sensor(records(row.sensor, SENSOR)[0], table(row.history)),
            Drive(
                records(row.drive, DRIVE)[0], numbers(row.wanted), numbers(row.level), table(row.coils),
                numbers(row.strength), numbers(row.believed), table(row.K),
            ),
            settings,
            desired,
            records(row.seen, MOTION)[k : k + n],
            records(row.ahead, MOTION)[k : k + n],
            records(row.samples, SAMPLE)[k : k + n],
            table(row.disturbance)[k * settings.substeps : (k + n) * settings.substeps],
            signal,
            records(row.command, COMMAND)[0],
            log,
            table(row.states)[:n],
            currents,
        )  # fmt: skip
        logged, result.status = progress.logged, progress.status
        window, totals = records(row.window, WINDOW)[0], records(row.totals, TOTALS)[0]
        gauge(window, totals, time[:logged], desired[:logged], log[:logged], currents[:logged])
        settings.first += logged
        row.offset += logged
        row.left -= logged
    else:
        result.status = RUNNING
    judge(row, plant, logged, settings.period, result)
    result.terminated = logged > 0 and (result.status != RUNNING or result.beyond)
    result.truncated = result.status == RUNNING and row.left == 0
    result.dry = row.left > 0 and row.offset + min(row.frame, row.left) >= row.desired.rows
    observe(row, plant, settings, signal, observation)
