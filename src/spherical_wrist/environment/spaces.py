"""Spaces of observations and actions, and checks of the arguments that Gymnasium passes."""

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
    """Return the space of actions: numbers within ±1, float32 as is usual. Actions in float64 are not rounded."""
    return Box(-1.0, 1.0, (len(task.actions.names),), np.float32)


def observation_space(task: Task) -> Box:
    """Return the space of observations: float64 numbers within their bounds."""
    high = np.concatenate([BOUNDS, np.ones(len(task.actions.names))])
    return Box(-high, high, dtype=np.float64)


def render_mode_of(given: str | None, valid: Sequence[str]) -> str | None:
    """Return a valid render mode, or None.

    Raises:
        UnknownNameError: the render mode is unknown.
    """
    if given is not None and given not in valid:
        raise UnknownNameError("render_mode", given, valid)
    return given


def autoreset_mode_of(given: str | AutoresetMode) -> AutoresetMode:
    """Return the autoreset mode, which determines when the next episode begins.

    Raises:
        UnknownNameError: the mode is unknown.
    """
    try:
        return AutoresetMode(given)
    except ValueError:
        raise UnknownNameError("autoreset_mode", given, (mode.value for mode in AutoresetMode)) from None


def seeds_of(seed: Any, count: int) -> list[int | None]:
    """Return one seed for each environment. One number stands for itself and those that follow it.

    Raises:
        ParameterError: the number of seeds is not the number of environments.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + i for i in range(count)]
    seeds = list(seed)
    if len(seeds) != count:
        raise ParameterError(
            f"seed: a number, or one for each of {count} environments is needed; {len(seeds)} are given"
        )
    return seeds


def check_options(options: Mapping[str, Any] | None, *known: str) -> None:
    """Check the options of a reset: one that is not known would be ignored.

    Raises:
        ParameterError: there is another one than those that are known.
    """
    for name in options or {}:
        if name not in known:
            advice = f"the only one is {', '.join(map(repr, known))}" if known else "a reset has none; see make(...)"
            raise ParameterError(f"reset(options=...): unknown option {name!r}: {advice}")


def mask_of(options: Mapping[str, Any] | None, count: int) -> npt.NDArray[np.bool_]:
    """Return the mask of environments to reset: ``reset_mask``, or all.

    Raises:
        ParameterError: there is another option, the mask has not one boolean for each environment, or none is true.
    """
    check_options(options, "reset_mask")
    mask = (options or {}).get("reset_mask")
    if mask is None:
        return np.ones(count, dtype=np.bool_)
    found = np.asarray(mask)
    if found.shape != (count,) or found.dtype != np.bool_ or not found.any():
        raise ParameterError(f"reset_mask: {count} booleans are needed, one for each wrist, and one that is true")
    return found
