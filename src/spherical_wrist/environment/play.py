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
from spherical_wrist.simulation.loop import LOG, SETTINGS, Plant, close_loop

ARRAYS = (
    *("parameters", "state", "qpos", "qvel", "ctrl", "applied", "warnings"),
    *("nominal_qpos", "nominal_qvel", "nominal_passive", "sensor", "scratch", "history"),
    *("drive", "wanted", "level", "coils", "strength", "believed", "map", "settings", "signal", "command"),
    *("time", "desired", "seen", "ahead", "samples", "disturbance", "log", "states", "currents", "window", "totals"),
)
ROW = np.dtype(
    [
        *((name, ARRAY) for name in ARRAYS),
        *((name, "i8") for name in ("law", "model", "data", "nominal_model", "nominal_data")),
        *((name, "i8") for name in ("periods", "offset", "left")),
        *((name, "f8", 3) for name in ("gravity", "lever", "weights", "scales", "asked")),
        *((name, "f8") for name in ("held", "most_tip_error", "most_error")),
    ],
    align=True,
)
"""An episode. ``periods``: to be played now, −1 for an episode that waits; ``offset``: row of the present instant among
the inputs; ``left``: control periods to the end; ``asked``: the last torque asked for, once ``held``."""

RESULT = np.dtype(
    [
        ("reward", "f8"),
        ("status", "i8"),
        ("logged", "i8"),
        ("beyond", "f8"),
        ("tip_error_mm", "f8"),
        ("error", "f8", 3),
        ("rate_error", "f8", 3),
        ("torque", "f8", 3),
    ],
    align=True,
)
"""What came of it; a status of PLAYING says that the law raised."""

PLAYING = -1


def play(rows: Any, results: Any, observations: Any) -> None:
    """Plays every episode on by its ``periods``, none at its beginning.

    Args:
        rows: ROW (n,).
        results: RESULT (n,), written.
        observations: (n, 18 and the numbers of an action), of which the first 18 are written.
    """
    for i in range(len(rows)):
        if rows[i].periods >= 0:
            play_one(rows[i], results[i], observations[i])


def play_one(row: Any, result: Any, observation: Any) -> None:
    """See :func:`play`."""
    n, k = row.periods, row.offset
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
                numbers(row.strength), numbers(row.believed), table(row.map),
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
        result.status = 0
    result.logged = logged
    judge(row, plant, logged, settings.period, result)
    observe(row, plant, settings, signal, observation)
