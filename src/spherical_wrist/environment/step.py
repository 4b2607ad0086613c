"""Steps of many episodes in one compiled call.

The arrays of the loop are found through the run record in each EPISODE_RECORD. Metrics are computed as in every run.
"""

from typing import Any

import numpy as np

from spherical_wrist.environment.observation import observe
from spherical_wrist.environment.reward import evaluate_reward
from spherical_wrist.loop.addresses import ARRAY, records
from spherical_wrist.loop.loop import RUNNING, SETTINGS
from spherical_wrist.loop.rollout import RUN, UNFINISHED, advance, plant_at

EPISODE_RECORD = np.dtype(
    [
        ("run", RUN),
        ("sensor_copy", ARRAY),
        *((name, "i8") for name in ("frame_skip", "periods", "offset", "remaining")),
        *((name, "f8", 3) for name in ("gravity", "lever", "weights", "scales", "last_command")),
        *((name, "f8") for name in ("has_last_command", "max_tip_error", "max_error")),
    ],
    align=True,
)
"""Episode record, the argument of the compiled step.

``run``: run record; ``sensor_copy``: memory for a copy of the sensors; ``frame_skip``: control periods per step;
``periods``: control periods of this call, −1 to skip the episode; ``offset``: row of the present instant in the inputs;
``remaining``: control periods to the end of the episode; ``gravity``: its direction; ``lever``: from the centre of the
joint to the tip; ``weights`` and ``scales``: of the reward; ``last_command``: last commanded torque, valid if
``has_last_command`` is 1; ``max_tip_error`` and ``max_error``: limits that terminate the episode.
"""

INFO = (("error", "f8", 3), ("rate_error", "f8", 3), ("tip_error_mm", "f8"), ("torque", "f8", 3))
"""Fields of a result that the info of a step has: true errors at the present instant, torque of the last period."""

STEP_RESULT = np.dtype(
    [
        ("reward", "f8"),
        ("status", "i8"),
        ("out_of_bounds", "?"),
        ("terminated", "?"),
        ("truncated", "?"),
        ("needs_inputs", "?"),
        *INFO,
    ],
    align=True,
)
"""Result of a step.

``status``: status of the loop, UNFINISHED if the law raised; ``out_of_bounds``: an error is beyond its limit;
``terminated`` and ``truncated``: as in Gymnasium; ``needs_inputs``: the sampled inputs end before the next step does.
"""


def step_episodes(episodes: Any, results: Any, observations: Any) -> int:
    """Run every episode for its ``periods``. With 0 periods only its result and observation are written.

    Args:
        episodes: EPISODE_RECORD (n,).
        results: STEP_RESULT (n,), written.
        observations: observations (n, 18 + size of an action); the first 18 columns are written.

    Returns:
        Number of episodes that have ended or need more inputs.
    """
    count = 0
    for i in range(len(episodes)):
        result = results[i]
        result.terminated = result.truncated = result.needs_inputs = False
        if episodes[i].periods >= 0:
            step_episode(episodes[i], result, observations[i])
        if result.terminated or result.truncated or result.needs_inputs:
            count += 1
    return count


def step_episode(record: Any, result: Any, observation: Any) -> None:
    """Run one episode; see :func:`step_episodes`."""
    n, logged = min(record.periods, record.remaining), 0
    settings = records(record.run.parts.settings, SETTINGS)[0]
    result.status = RUNNING
    if n > 0:
        result.status = UNFINISHED
        progress = advance(record.run, record.offset, n)
        logged, result.status = progress.logged, progress.status
        record.offset += logged
        record.remaining -= logged
    plant = plant_at(record.run.parts.plant)
    evaluate_reward(record, plant, logged, settings.period, result)
    result.terminated = n > 0 and (result.status != RUNNING or result.out_of_bounds)
    result.truncated = result.status == RUNNING and record.remaining == 0
    needed = record.offset + min(record.frame_skip, record.remaining)
    result.needs_inputs = record.remaining > 0 and needed >= record.run.inputs.desired.rows
    observe(record, plant, settings, observation)
