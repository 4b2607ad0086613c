"""What the shell offers for the values of options, quickly: nothing heavy is imported."""

from collections.abc import Iterable
from pathlib import Path

from typer import Context

from spherical_wrist.cli.scan import Family, experiment_defaults, parts
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.guides import NAMES, read_guide

_STANDARD = {
    "law": "fuzzy_sliding_computed_torque",
    "reference": "lissajous",
    "disturbance": "constant",
    "sensing": "ideal",
    "actuation": "ideal",
}
"""Members that an experiment has where nothing else is said; a test checks them."""

_OPTIONS = {"law": "law", "reference": "reference", "disturbance": "disturbance_shape"}
"""Of the parts that have an option of their own, its name in the code."""

Offer = list[tuple[str, str]]


def laws(incomplete: str) -> Offer:
    """Control laws."""
    return _members("law", incomplete)


def references(incomplete: str) -> Offer:
    """Desired motions."""
    return _members("reference", incomplete)


def disturbances(incomplete: str) -> Offer:
    """Shapes of a disturbance."""
    return _members("disturbance", incomplete)


def hardware(incomplete: str) -> Offer:
    """Kinds of sensors and motors."""
    return _offer(((name, "") for name in HARDWARE), incomplete)


def settings(context: Context, incomplete: str) -> Offer:
    """Parameters of the experiment as far as it is typed, with their defaults, ready to be changed."""
    given = context.params
    found = [f"{name}={default}" for name, default in experiment_defaults().items() if name not in parts()]
    for part in parts():
        family = Family(part)
        name = given.get(_OPTIONS.get(part, ""))
        if part in ("sensing", "actuation"):
            name = HARDWARE.get(given.get("hardware") or "", {}).get(part)
        name = name[-1] if isinstance(name, list) and name else name  # of several laws, the last
        member = name if isinstance(name, str) and name in family.members else _STANDARD[part]
        found += [f"{part}.{parameter}={default}" for parameter, default in family.defaults(member).items()]
    return _offer(((each, "") for each in found), incomplete)


def guides(incomplete: str) -> Offer:
    """Guides, with what each is about."""
    return _offer(((name, read_guide(name).title) for name in NAMES), incomplete)


def recordings(incomplete: str) -> list[str]:
    """Recordings, and folders where there is a choice; where there is only one folder the shell knows better."""
    typed = Path(incomplete + "*")
    try:
        found = sorted(typed.parent.glob(typed.name))
    except (OSError, ValueError, NotImplementedError):
        return []
    shown = [path for path in found if not path.name.startswith(".") or typed.name.startswith(".")]
    files = [str(path) for path in shown if path.suffix == ".rrd" and path.is_file()]
    return [*files, *(f"{path}/" for path in shown if path.is_dir())] if files else []


def _members(part: str, incomplete: str) -> Offer:
    family = Family(part)
    return _offer(((name, family.about(name)) for name in family.members), incomplete)


def _offer(names: Iterable[tuple[str, str]], incomplete: str) -> Offer:
    return [(name, about) for name, about in names if name.startswith(incomplete)]
