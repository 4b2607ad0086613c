"""Descriptions of campaigns that can be moved: files are named as seen from the campaign's folder."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from typing import Any

MARK = "{folder}/"
"""Beginning of a path that starts at the campaign's folder, with slashes, and may climb."""

SHOWN = 2
"""Last parts of a path that are shown in tables: the file, and the folder that tells it from others of its name."""


def without_marks(description: Any, folder: Path) -> Any:
    """Return plain data with absolute paths for those that start at a folder, which may have moved."""

    def absolute(text: str) -> str:
        return os.path.normpath(folder.resolve() / text.removeprefix(MARK))

    return with_texts(description, lambda text: absolute(text) if text.startswith(MARK) else text)


def without_folders(description: Any, parts: int = SHOWN) -> Any:
    """Return plain data with absolute paths cut to their last parts."""

    def cut(text: str) -> str:
        path = PurePath(text)
        return "/".join(path.parts[-parts:]) if path.is_absolute() else text

    return with_texts(description, cut)


def with_texts(value: Any, change: Callable[[str], str]) -> Any:
    """Return plain data with all texts in it changed, except for keys."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, Mapping):
        return {key: with_texts(each, change) for key, each in value.items()}
    return [with_texts(each, change) for each in value] if isinstance(value, list | tuple) else value
