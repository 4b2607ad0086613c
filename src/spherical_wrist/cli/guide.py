"""``wrist guide``: guides in the terminal."""

import os
from typing import Annotated

from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.guides import NAMES, read_guide

WIDTH = 110
"""Largest width of the text [columns]; longer lines of prose are hard to read."""


def command(
    name: Annotated[
        str | None, Argument(metavar="NAME", help="guide to read [list them]", autocompletion=completion.guides)
    ] = None,
    raw: Annotated[bool, Option("--raw", help="print the Markdown as it is")] = False,
) -> None:
    """Without NAME: a list of the guides. Every example in them can be copied and run as it stands."""
    if name is None:
        _list()
    else:
        _show(name, raw)


def _list() -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name in NAMES:
        table.add_row(f"[bold green]{name}", read_guide(name).title)
    console.print(table)
    console.print("\nread one with: wrist guide NAME", style="dim")


def _show(name: str, raw: bool) -> None:
    """Print a guide, with a pager if the output is a terminal."""
    guide = read_guide(name)
    if raw:
        print(guide.text, end="")
        return
    from rich.console import Console
    from rich.markdown import Markdown

    console = Console(highlight=False)
    console.width = min(console.width, WIDTH)
    page = Markdown(guide.text, code_theme="ansi_dark")
    if not console.is_terminal:
        console.print(page)
        return
    os.environ.setdefault("LESS", "FRX")  # colours, and no pager for text that fits the screen; as git does
    pager = os.environ.get("MANPAGER") or os.environ.get("PAGER") or "less"
    with console.pager(styles="less" in pager):
        console.print(page)
