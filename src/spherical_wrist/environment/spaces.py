"""The spaces of observations and actions, and what else Gymnasium hands in."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode

from spherical_wrist.environment.observation import BOUNDS
from spherical_wrist.environment.task import Task
from spherical_wrist.errors import ParameterError, UnknownNameError


def action_space(task: Task) -> Box:
    """Numbers within ±1, float32 as learners write them; float64 is taken as it is."""
    return Box(-1.0, 1.0, (len(task.actions.names),), np.float32)


def observation_space(task: Task) -> Box:
    """Numbers within their bounds, float64."""
    high = np.concatenate([BOUNDS, np.ones(len(task.actions.names))])
    return Box(-high, high, dtype=np.float64)


def render_mode_of(given: str | None, valid: Sequence[str]) -> str | None:
    """The way to draw, or none.

    Raises:
        UnknownNameError: there is no such way.
    """
    if given is not None and given not in valid:
        raise UnknownNameError("render_mode", given, valid)
    return given


def autoreset_mode_of(given: str | AutoresetMode) -> AutoresetMode:
    """When the next episode begins.

    Raises:
        UnknownNameError: there is no such mode.
    """
    try:
        return AutoresetMode(given)
    except ValueError:
        raise UnknownNameError("autoreset_mode", given, (mode.value for mode in AutoresetMode)) from None


def seeds_of(seed: Any, count: int) -> list[int | None]:
    """One seed for each wrist: of a number, it and those after it.

    Raises:
        ParameterError: there are not as many as wrists.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + i for i in range(count)]
    seeds = list(seed)
    if len(seeds) != count:
        raise ParameterError(f"seed: a number, or one for each of {count} wrists is needed; {len(seeds)} are given")
    return seeds


def mask_of(options: Mapping[str, Any] | None, count: int) -> npt.NDArray[np.bool_]:
    """Which wrists are reset: those of ``reset_mask``, or all.

    Raises:
        ParameterError: the mask is no array of booleans for each wrist, or none of them is true.
    """
    mask = (options or {}).get("reset_mask")
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    found = np.asarray(mask)
    if found.shape != (count,) or found.dtype != np.bool_ or not found.any():
        raise ParameterError(f"reset_mask: {count} booleans are needed, one for each wrist, and one that is true")
    return found
