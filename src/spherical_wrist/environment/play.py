"""Many episodes, each played on by some control periods in one call; compiled.

What the loop works on is found through the run that each ROW begins with, and measured as in every other run.
"""

from typing import Any

import numpy as np

from spherical_wrist.environment.observation import observe
from spherical_wrist.environment.reward import judge
from spherical_wrist.simulation.addresses import ARRAY, records
from spherical_wrist.simulation.bulk import PLAYING, RUN, advance, plant_at
from spherical_wrist.simulation.loop import RUNNING, SETTINGS

ROW = np.dtype(
    [
        ("run", RUN),
        ("scratch", ARRAY),
        *((name, "i8") for name in ("frame", "periods", "offset", "left")),
        *((name, "f8", 3) for name in ("gravity", "lever", "weights", "scales", "asked")),
        *((name, "f8") for name in ("held", "most_tip_error", "most_error")),
    ],
    align=True,
)
"""An episode: its run, room for a copy of its sensors, and what the rest of it is.

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
    n, logged = min(row.periods, row.left), 0
    settings = records(row.run.parts.settings, SETTINGS)[0]
    result.status = RUNNING
    if n > 0:
        result.status = PLAYING
        progress = advance(row.run, row.offset, n)
        logged, result.status = progress.logged, progress.status
        row.offset += logged
        row.left -= logged
    plant = plant_at(row.run.parts.plant)
    judge(row, plant, logged, settings.period, result)
    result.terminated = logged > 0 and (result.status != RUNNING or result.beyond)
    result.truncated = result.status == RUNNING and row.left == 0
    result.dry = row.left > 0 and row.offset + min(row.frame, row.left) >= row.run.inputs.desired.rows
    observe(row, plant, settings, observation)
