"""The ``wrist run`` command that makes an experiment, and reading of its settings."""

import re
import shlex
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError, one_line, refuse_huge_integers
from spherical_wrist.experiment.description import Experiment, parsed_toml, toml
from spherical_wrist.experiment.options import FLAGS
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.package_files import shortest_name
from spherical_wrist.parameters import Member, Parameters
from spherical_wrist.reference import Reference

BARE = re.compile(r"(?!(?:true|false|inf|nan)$)[A-Za-z_/][\w./-]*", re.ASCII)
"""Strings that ``--set`` takes without quotes."""


def command_of(experiment: Experiment, law: str | None = None) -> str:
    """Return the shortest ``wrist run`` command that makes an experiment, for a POSIX shell.

    The command contains only what differs from the defaults. In any folder it makes an equal experiment; a law from a
    file is loaded from that file again.

    Args:
        experiment: the experiment.
        law: value of ``--law``; None for :func:`law_address` of its law.

    Raises:
        ParameterError: a part of the experiment has no name on the command line, such as a law that is defined inside
            a function, or a value cannot be written there.
    """
    return min((shlex.join(_words(experiment, hardware, law)) for hardware in (None, *HARDWARE)), key=len)


def law_address(law: type[Law]) -> str:
    """Return the value of ``--law`` for a law: its name, or ``path/to/file.py:Name`` for a user's own.

    Raises:
        ParameterError: the law is not at the top level of a Python file.
    """
    if Law.members.get(law.name) is law:
        return law.name
    if ".py:" in law.address:
        return law.address
    file = getattr(sys.modules.get(law.__module__), "__file__", None) or ""
    if not file.endswith(".py") or "." in law.__qualname__:
        raise ParameterError(
            f"law {law.name!r} ({law.__qualname__}) cannot be named on the command line: define it at the top level of "
            "a Python file, for wrist run --law path/to/file.py:Name"
        )
    return f"{Path(file).resolve()}:{law.__name__}"


def read_settings(texts: Iterable[str]) -> dict[str, Any]:
    """Read ``name=value`` texts of ``--set`` as values keyed by dotted name; a value is TOML, or a bare word.

    Raises:
        ParameterError: a text is not of this form.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise ParameterError(f"--set {text!r}: NAME=VALUE is needed, such as law.K=0.02")
        try:
            found[name] = parsed_toml(f"value = {value}")["value"]
            refuse_huge_integers(found[name], f"--set {name}")
        except tomllib.TOMLDecodeError:
            found[name] = value
        except RecursionError:
            raise ParameterError(f"--set {name}: the value is nested too deeply") from None
        except ValueError as error:
            raise ParameterError(f"--set {name}: {one_line(error)}") from None
    return found


def _words(experiment: Experiment, hardware: str | None, law: str | None) -> Iterator[str]:
    yield from ("wrist", "run")
    usual = Experiment()
    if hardware is not None:
        usual = Experiment(**HARDWARE[hardware])
        yield from ("--hardware", hardware)
    for field in Experiment.model_fields:
        value, before = getattr(experiment, field), getattr(usual, field)
        if isinstance(value, Member):
            yield from _member(field, value, before, law if field == "law" else None)
        elif value != before:
            yield from _setting(field, _shortest(experiment, field))


def _member(field: str, value: Member, usual: Member, address: str | None) -> Iterator[str]:
    """Yield the words for a part: its name if it differs, then the parameters that differ from that member's own."""
    standard: dict[str, Any] = dict(usual)
    if type(value) is not type(usual):
        required = {name: getattr(value, name) for name, info in type(value).model_fields.items() if info.is_required()}
        standard = {name: kept for name, kept in type(value)(**required) if name not in required}
        address = address or _address(value)
        subject = value.subject if isinstance(value, Reference) else ""
        if subject and getattr(value, subject) is not None:
            standard[subject] = getattr(value, subject)
            address = f"{address}:{shortest_name(str(standard[subject]))}"
        yield from _setting(field, address)
    for name, chosen in value:
        if name not in standard or chosen != standard[name]:
            yield from _setting(f"{field}.{name}", _shortest(value, name))


def _address(member: Member) -> str:
    if isinstance(member, Law):
        return law_address(type(member))
    if ".py:" in member.address:
        return member.address
    if type(member).members.get(member.name) is not type(member):
        raise ParameterError(f"{member.kind} {member.name!r} is not one that the command line knows (see wrist list)")
    return member.name


def _shortest(owner: Parameters, name: str) -> Any:
    """Return a parameter as plain data, with three equal numbers as one if the parameter accepts that."""
    value = owner.model_dump(mode="json")[name]
    if isinstance(getattr(owner, name), Path):
        return shortest_name(value)
    if isinstance(value, list) and len(value) == 3 and value[0] == value[1] == value[2]:
        try:
            if owner.replaced(**{name: value[0]}) == owner:
                return value[0]
        except ParameterError:
            pass
    return value


def _setting(name: str, value: Any) -> Iterator[str]:
    if value is None:
        raise ParameterError(f"{name} = None cannot be written on the command line: leave it at its default")
    if name in FLAGS and isinstance(value, list) and all(isinstance(each, str) for each in value):
        yield from (FLAGS[name], ",".join(value))
    elif name in FLAGS:
        yield from (FLAGS[name], value if isinstance(value, str) else toml(value))
    else:
        bare = isinstance(value, str) and BARE.fullmatch(value)
        yield from ("--set", f"{name}={value if bare else toml(value)}")
