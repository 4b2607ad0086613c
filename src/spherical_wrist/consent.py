"""Consent to run Python: the one gate before every load of a user's file.

Recordings and campaign folders come from other people, and their descriptions name Python files as laws, motions and
other parts. To look at results needs none of that code: a description is read ``without_code``, and a placeholder then
stands for every part that is a Python file. What simulates asks for consent first.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

MARK, SUFFIX = ".py:", ".py"
"""Text in the name of a part that is a Python file, as in ``path/to/file.py:Name``, and at its end without a name."""

_withheld: ContextVar[bool] = ContextVar("withheld", default=False)


@contextmanager
def without_code() -> Iterator[None]:
    """Load no Python file in this context; placeholders stand for the members that are named so."""
    token = _withheld.set(True)
    try:
        yield
    finally:
        _withheld.reset(token)


def code_is_withheld() -> bool:
    """Return True within :func:`without_code`."""
    return _withheld.get()


def is_code(name: Any) -> bool:
    """Return True for the name of a part that is a Python file."""
    return isinstance(name, str) and (MARK in name or name.endswith(SUFFIX))


def code_in(description: Any) -> list[str]:
    """Return the names of Python files anywhere in plain data, each once."""
    if isinstance(description, Mapping):
        inner = [*description.keys(), *description.values()]
    elif isinstance(description, list | tuple):
        inner = list(description)
    else:
        return [description] if is_code(description) else []
    return list(dict.fromkeys(name for each in inner for name in code_in(each)))
