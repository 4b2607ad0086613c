"""The command that shows guides, and its options."""

from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app


@app.command()
def guide(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="guide to read [list them]", autocompletion=completion.guides)
    ] = None,
    raw: Annotated[bool, Option("--raw", help="print the Markdown as it is")] = False,
) -> None:
    """Read a guide: conventions, and how to bring a law, a motion, a disturbance, hardware or a wrist of your own.

    Without NAME: what guides there are. Every example in them can be copied and run as it stands.
    """
    from spherical_wrist.cli.guide import list_guides, show_guide

    if name is None:
        list_guides()
    else:
        show_guide(name, raw)
