"""Guides for those who use the package: Markdown beside this file, read with ``wrist guide NAME``."""

from pathlib import Path
from typing import NamedTuple

from spherical_wrist.errors import UnknownNameError

NAMES = ("conventions", "law", "reference", "disturbance", "hardware", "wrist", "recordings")
"""All guides, in the order in which to read them."""


class Guide(NamedTuple):
    """A guide.

    Attributes:
        name: what it is asked for by.
        title: its heading, in plain text.
        text: all of it, as Markdown.
    """

    name: str
    title: str
    text: str


def read_guide(name: str) -> Guide:
    """The guide of a name.

    Raises:
        UnknownNameError: there is none; the message has those that there are.
    """
    if name not in NAMES:
        raise UnknownNameError("guide", name, NAMES, "; `wrist guide` lists them")
    text = (Path(__file__).parent / f"{name}.md").read_text(encoding="utf-8")
    return Guide(name, text.partition("\n")[0].removeprefix("# "), text)
