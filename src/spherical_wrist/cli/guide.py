"""``wrist guide``: the guides, in the terminal."""

import os

from rich.console import Console
from rich.markdown import Markdown
from rich.table import Table

from spherical_wrist.guides import NAMES, read_guide

WIDTH = 110
"""Columns beyond which prose is hard to read."""


def list_guides() -> None:
    """Prints the names of all guides and what each is about."""
    console = Console(highlight=False)
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name in NAMES:
        table.add_row(f"[bold green]{name}", read_guide(name).title)
    console.print(table)
    console.print("\nread one with: wrist guide NAME", style="dim")


def show_guide(name: str, raw: bool) -> None:
    """Prints a guide, with a pager where it goes to a terminal.

    Args:
        name: of the guide.
        raw: print the Markdown as it is.

    Raises:
        UnknownNameError: there is no guide of that name.
    """
    guide = read_guide(name)
    if raw:
        print(guide.text, end="")
        return
    console = Console(highlight=False)
    console.width = min(console.width, WIDTH)
    page = Markdown(guide.text, code_theme="ansi_dark")
    if not console.is_terminal:
        console.print(page)
        return
    os.environ.setdefault("LESS", "FRX")  # colours, and no pager for what fits the screen; as git does
    pager = os.environ.get("MANPAGER") or os.environ.get("PAGER") or "less"
    with console.pager(styles="less" in pager):
        console.print(page)
