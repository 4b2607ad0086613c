"""Values of options that the shell offers: names, settings with their defaults, and files."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from typer import Context

from spherical_wrist.experiment.options import OPTIONS
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.guides import NAMES, read_guide

LONGEST = 60
"""Characters of a default up to which it is offered with the name of its parameter."""

Offer = list[tuple[str, str]]


def members(part: str) -> Callable[[str], Offer]:
    """Return a completion of the names that a part of an experiment may have; of nothing for other parameters."""

    def complete(incomplete: str) -> Offer:
        from spherical_wrist.experiment.description import PARTS

        found = PARTS[part].members if part in PARTS else {}
        return _offer(((name, (member.__doc__ or "").partition("\n")[0]) for name, member in found.items()), incomplete)

    return complete


laws = members("law")


def hardware(incomplete: str) -> Offer:
    """Complete the name of a kind of sensors and motors."""
    return _offer(((name, "") for name in HARDWARE), incomplete)


def settings(context: Context, incomplete: str) -> Offer:
    """Complete a setting of the experiment that is typed so far, with its default."""
    from spherical_wrist.experiment.description import PARTS, Experiment

    given = {option.part: context.params.get(option.name) for option in OPTIONS if option.type is str}
    given |= HARDWARE.get(context.params.get("hardware") or "", {})
    found = [_setting(name, field.default) for name, field in Experiment.model_fields.items() if name not in PARTS]
    for part, family in PARTS.items():
        name = given.get(part)
        name = name[-1] if isinstance(name, list) and name else name  # of several laws, the last
        member = family.members.get(str(name)) or family.members[Experiment.model_fields[part].default]
        found += [_setting(f"{part}.{parameter}", field.default) for parameter, field in member.model_fields.items()]
    return _offer(((each, "") for each in found), incomplete)


def axes(incomplete: str) -> Offer:
    """Complete the name of an axis of a frontier."""
    from spherical_wrist.experiment.axes import AXES

    return _offer(((name, axis.meaning) for name, axis in AXES.items()), incomplete)


def bounds(incomplete: str) -> Offer:
    """Complete the name of a metric that is bounded."""
    from spherical_wrist.measure.metrics import METRICS

    return _offer(((f"{name}=", metric.meaning) for name, metric in METRICS.items()), incomplete)


def guides(incomplete: str) -> Offer:
    """Complete the name of a guide."""
    return _offer(((name, read_guide(name).title) for name in NAMES), incomplete)


def kinds(incomplete: str) -> Offer:
    """Complete a kind of entries of wrist list."""
    from spherical_wrist.cli.list import kinds as known

    return _offer(((name, kind.meaning) for name, kind in known().items()), incomplete)


def listed(context: Context, incomplete: str) -> Offer:
    """Complete the name of an entry of the kind that is given before it."""
    from spherical_wrist.cli.list import kinds as known

    word = context.params.get("kind") or ""
    found = next((each.entries() for each in known().values() if word in (each.name, *each.others)), {})
    return _offer(((name, entry["summary"]) for name, entry in found.items()), incomplete)


def recordings(incomplete: str) -> list[str]:
    """Complete the path of a recording; a single folder is left to the shell, which completes it better."""
    typed = Path(incomplete + "*")
    try:
        found = sorted(typed.parent.glob(typed.name))
    except (OSError, ValueError, NotImplementedError):
        return []
    shown = [path for path in found if not path.name.startswith(".") or typed.name.startswith(".")]
    files = [str(path) for path in shown if path.suffix == ".rrd" and path.is_file()]
    return [*files, *(f"{path}/" for path in shown if path.is_dir())] if files else []


def _setting(name: str, default: Any) -> str:
    from pydantic_core import PydanticUndefined, to_jsonable_python

    from spherical_wrist.experiment.description import toml

    value = None if default is PydanticUndefined else to_jsonable_python(default)
    text = "" if value is None else value if isinstance(value, str) else toml(value)
    return f"{name}={text if len(text) <= LONGEST else ''}"


def _offer(names: Iterable[tuple[str, str]], incomplete: str) -> Offer:
    return [(name, about) for name, about in names if name.startswith(incomplete)]
