"""Check that a study in a folder is the requested one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from spherical_wrist.errors import ParameterError

MISSING = object()


def check_same(before: Mapping[str, Any], now: Mapping[str, Any], folder: Path) -> None:
    """Refuse to continue a study with other settings.

    Args:
        before: settings of the study in the folder, as plain data.
        now: requested settings.
        folder: the folder, for the message.

    Raises:
        ParameterError: they differ; the message names the first difference.
    """
    for name, value in now.items():
        if before.get(name) != value:
            raise ParameterError(
                f"{str(folder)!r} holds another study: {_difference(name, before.get(name), value)}; "
                "repeat the command that began it, or give another folder with -o"
            )


def _difference(name: str, before: Any, now: Any) -> str:
    """Return the first difference of two values, in words; of tables, by the dotted name of the entry."""
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in {**before, **now}:
            inner = before.get(key, MISSING), now.get(key, MISSING)
            if inner[0] != inner[1]:
                return _difference(f"{name}: {key}", *inner)
    return f"{name} was {_short(before)}, and is {_short(now)} here"


def _short(value: Any) -> str:
    if value is MISSING:
        return "not there"
    text = f"{value[0]:g}:{value[1]:g}" if _is_range(value) else str(value)
    return text if len(text) <= 60 else text[:59] + "…"


def _is_range(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(isinstance(each, float) for each in value)
