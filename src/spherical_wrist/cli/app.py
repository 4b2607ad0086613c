"""The command ``wrist``: a table of its commands, each in the module of its name, imported when it is used."""

from importlib import import_module
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

COMMANDS = {
    "run": "Simulate a closed loop, print how well it tracked, and record it.",
    "list": "List laws, references, disturbances, sensors, motors and parameters, with units and defaults.",
    "guide": "Read a guide: conventions, or how to bring a law, a motion, hardware or a wrist of your own.",
    "view": "Show a recording in the Rerun viewer: the wrist as it moves, and everything over time.",
    "inspect": "Show what was run, with which versions, and check the stored metrics against the recorded series.",
    "diff": "Show how two runs differ: experiments, versions, outcomes, metrics, and where their series part.",
    "replay": "Simulate a recording again from what is inside it, and compare bit for bit.",
    "render": "Film a recorded run, rendered by MuJoCo; no screen is needed.",
    "compare": "Compare laws on a suite of cases, and rank them.",
    "frontier": "Find how far from the nominal wrist each law keeps its errors within bounds.",
    "margins": "Compute stability margins, and the largest tip error by any bounded torque, from the linearised loop.",
    "ablate": "Show what each part of a law is worth: its figures without it.",
    "design": "Find the gains of laws by one criterion, constraints and an objective, or check the gains they have.",
    "tune": "Tune the gains of a law: small errors against little chattering, over a family of perturbed wrists.",
    "sweep": "Run a campaign: one experiment under many conditions, laws × samples, from a campaign file.",
    "report": "Report on a campaign: one HTML page that needs nothing else, no network and no script.",
    "paper": "Regenerate the evaluation of the source paper: table, figures, and a verdict on each claim.",
}
"""Summaries of the commands, in the order of the help. The rest of a command's help is its docstring."""

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
        name, known, rest = super().resolve_command(ctx, args)
        return name, None if known is None else _imported(known.name or ""), rest


class Command(TyperCommand):
    """Command whose help takes meanings and defaults of an experiment's parameters from their declarations."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options, with the help texts of an experiment's parameters filled in."""
        from spherical_wrist.experiment.options import OPTIONS

        own = {option.name: option for option in OPTIONS}
        for option in self.params:
            if option.name in own and getattr(option, "help", "") is None:
                option.help = own[option.name].help()  # type: ignore[attr-defined]
        super().format_options(ctx, formatter)


def _imported(name: str) -> Any:
    from spherical_wrist.cli.options import with_options

    command = import_module(f"spherical_wrist.cli.{name}").command
    single = typer.Typer(add_completion=False, **SETTINGS)
    text, _, _ = cleandoc(command.__doc__ or "").partition("\n\nRaises:")
    single.command(name, cls=Command, help=f"{COMMANDS[name]}\n\n{text}")(with_options(command))
    return typer.main.get_command(single)


app = typer.Typer(name="wrist", cls=Commands, no_args_is_help=True, **SETTINGS)


def _print_version(wanted: bool) -> None:
    if wanted:
        from spherical_wrist.versions import package_version

        typer.echo(f"spherical-wrist {package_version('spherical-wrist')}")
        raise typer.Exit


@app.callback()
def wrist(version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True)] = False) -> None:
    """Closed-loop simulation of a surgical wrist on a ball joint, in MuJoCo, recorded with Rerun."""
