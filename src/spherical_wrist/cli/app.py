"""The command ``wrist``: a table of its commands, each in the module of its name, imported when it is used."""

from importlib import import_module
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from spherical_wrist.cli.verbosity import Quiet, Verbose, set_verbosity

GROUPS = {
    "Simulate, and look at it": {
        "run": "Simulate a closed loop, say how well it tracked, and record it.",
        "view": "Show a recording in the Rerun viewer, or take a picture of it.",
        "inspect": "Show what a recording holds, and check it; draw and export it.",
        "plot": "Draw errors of several laws or recordings over time.",
        "diff": "Show how two runs differ, and where their series part.",
        "replay": "Simulate a recording again, and compare bit for bit.",
        "render": "Film a recorded run with MuJoCo; no screen is needed.",
    },
    "Judge and tune laws": {
        "compare": "Compare laws on a suite of cases, and rank them.",
        "frontier": "Find how far from the nominal wrist each law stays precise.",
        "margins": "Compute stability margins, and the worst tip error.",
        "ablate": "Show what each part of a law is worth: its figures without it.",
        "tune": "Tune the gains of a law: small errors, little chattering.",
        "design": "Find the gains of laws by one criterion, or check those they have.",
        "paper": "Test the claims of the source paper, and draw its figures.",
    },
    "Run campaigns": {
        "sweep": "Run an experiment under many conditions, from a campaign file.",
        "report": "Report on a campaign: one HTML page that needs nothing else.",
    },
    "Look things up": {
        "list": "List laws, references, metrics, ..., or describe one of them.",
        "guide": "Read a guide: your own law, motion, hardware or wrist.",
    },
}
"""Summaries of the commands, in groups and in working order. The rest of a command's help is its docstring."""

COMMANDS = {name: summary for commands in GROUPS.values() for name, summary in commands.items()}
"""Summaries of all commands."""

FIRST_STEPS = (
    ("wrist run", "the default experiment, recorded to wrist.rrd"),
    ("wrist view wrist.rrd", "look at it"),
    ("wrist guide law", "a law of your own"),
    ("wrist COMMAND --help", "all options of a command"),
)

SETTINGS: dict[str, Any] = {
    "rich_markup_mode": None,
    "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


class Commands(TyperGroup):
    """Group of commands that are known by name and summary until one is used."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {name: TyperCommand(name, short_help=summary) for name, summary in COMMANDS.items()}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that the arguments name, and import it."""
        if args[0] not in self.commands and not args[0].startswith("-"):
            from spherical_wrist.cli.near_misses import unknown_command

            raise unknown_command(args[0], args[1:], self.commands)
        name, known, rest = super().resolve_command(ctx, args)
        return name, None if known is None else _imported(known.name or ""), rest

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Show the help where there are no arguments."""
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            raise typer.Exit
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands in their groups, with whole summaries, and first steps."""
        widest = max(map(len, self.commands))
        for group, commands in GROUPS.items():
            with formatter.section(group):
                formatter.write_dl([(name.ljust(widest), summary) for name, summary in commands.items()])
        with formatter.section("First steps"):
            formatter.write_dl(FIRST_STEPS)


class Command(TyperCommand):
    """Command whose help takes meanings and defaults of an experiment's parameters from their declarations.

    Every default is printed once, in brackets at the end.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options, with the help texts of an experiment's parameters filled in."""
        from spherical_wrist.experiment.options import OPTIONS

        own = {option.name: option for option in OPTIONS}
        for option in self.params:
            if option.name in own and getattr(option, "help", "") is None:
                option.help = own[option.name].help()  # type: ignore[attr-defined]
            _show_default(option)
        super().format_options(ctx, formatter)


def _show_default(option: Any) -> None:
    """Put a default in brackets at the end of the help, unless that says it already."""
    if getattr(option, "show_default", False):
        option.show_default = False
        value, text = option.default, option.help or ""
        if not (value is None or isinstance(value, bool) or callable(value) or text.endswith("]")):
            shown = f"{value:g}" if isinstance(value, float) else str(getattr(value, "value", value))
            option.help = f"{text} [{shown}]".lstrip()


def _imported(name: str) -> Any:
    from spherical_wrist.cli.options import with_options

    command = import_module(f"spherical_wrist.cli.{name}").command
    single = typer.Typer(add_completion=False, **SETTINGS)
    text, _, _ = cleandoc(command.__doc__ or "").partition("\n\nRaises:")
    single.command(name, cls=Command, help=f"{COMMANDS[name]}\n\n{text}")(with_options(command))
    return typer.main.get_command(single)


app = typer.Typer(name="wrist", cls=Commands, **SETTINGS)


def _print_version(wanted: bool) -> None:
    if wanted:
        from spherical_wrist.versions import package_version

        typer.echo(f"spherical-wrist {package_version('spherical-wrist')}")
        raise typer.Exit


@app.callback()
def wrist(
    version: Annotated[
        bool, typer.Option("--version", help="print the version", callback=_print_version, is_eager=True)
    ] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Closed-loop simulation of a surgical wrist on a ball joint, in MuJoCo, recorded with Rerun."""
    set_verbosity(quiet=quiet, verbose=verbose)
