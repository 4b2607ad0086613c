"""Descriptions of campaigns that can be moved: files are named as seen from the campaign's folder."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from typing import Any

MARK = "{folder}/"
"""Beginning of a path that starts at the campaign's folder, with slashes, and may climb."""

SHOWN = 2
"""Last parts of a path that are shown in tables: the file, and the folder that tells it from others of its name."""


def with_marks(description: Any, folder: Path) -> Any:
    """Return plain data with every absolute path as one from a folder."""

    def marked(text: str) -> str:
        try:
            return MARK + Path(os.path.relpath(text, folder.resolve())).as_posix()
        except ValueError:  # on another drive
            return text

    return _with_paths(description, marked)


def without_marks(description: Any, folder: Path) -> Any:
    """Return plain data as it was before :func:`with_marks`, for a folder that may have moved."""

    def absolute(text: str) -> str:
        return os.path.normpath(folder.resolve() / text.removeprefix(MARK))

    return _changed(description, lambda text: absolute(text) if text.startswith(MARK) else text)


def without_folders(description: Any, parts: int = SHOWN) -> Any:
    """Return plain data with absolute paths cut to their last parts."""
    return _with_paths(description, lambda text: "/".join(PurePath(text).parts[-parts:]))


def _with_paths(description: Any, change: Callable[[str], str]) -> Any:
    return _changed(description, lambda text: change(text) if PurePath(text).is_absolute() else text)


def _changed(value: Any, change: Callable[[str], str]) -> Any:
    """Return plain data with all texts in it changed, except for keys."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, Mapping):
        return {key: _changed(each, change) for key, each in value.items()}
    return [_changed(each, change) for each in value] if isinstance(value, list | tuple) else value
