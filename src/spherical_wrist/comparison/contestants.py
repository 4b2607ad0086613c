"""The laws that are compared: by name, with parameters, from a user's own Python file, or from an experiment file."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from spherical_wrist.control import ComputedTorque, Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import Experiment, read_toml

Laws = dict[str, Law]
"""Laws by the label that tells them apart in a table."""

YARDSTICK = ComputedTorque()
"""The law whose chattering the chattering of the others is compared with: it has nothing in it that switches."""


def registered() -> Laws:
    """Every law of the package with its default parameters."""
    return {name: Law.resolve(name, default=name) for name in Law.members}


def contestants(texts: Iterable[str], tables: Mapping[str, Any], changes: Mapping[str, Any]) -> Laws:
    """The laws that take part.

    Args:
        texts: laws as on the command line, see :func:`contestant`; none for every law of the package, and with them
            that of the experiment where it is none of these.
        tables: the experiment as plain tables.
        changes: values by dotted name; those of the law, such as ``law.K``, go into every law.

    Raises:
        WristError: a text names no law, or a parameter is not valid.
    """
    laws: Laws = {}
    for text in texts:
        if text in laws:
            raise ParameterError(f"--law {text!r} is given twice")
        laws[text] = contestant(text)
    if not laws:
        laws = registered()
        own = Experiment(law=tables["law"]).law if "law" in tables else YARDSTICK
        if own not in laws.values():
            laws[f"{own.name} of the experiment"] = own
    settings = {name.removeprefix("law."): value for name, value in changes.items() if name.startswith("law.")}
    if "law" in changes or "name" in settings:
        raise ParameterError("--set law: give the laws to compare with --law, which may be repeated")
    return {label: _changed(law, settings) for label, law in laws.items()} if settings else laws


def contestant(text: str) -> Law:
    """A law from ``"NAME"``, ``"NAME PARAMETER=VALUE …"``, ``"path/to/file.py:Name …"`` or ``"experiment.toml"``.

    Of an experiment file, the table ``law`` alone counts.

    Raises:
        WristError: there is no such law, or a parameter is not valid.
    """
    # only a space before a parameter parts the words: paths and lists may have some too
    name, *settings = re.split(r"\s+(?=\w+\s*=)", text.strip())
    if name.endswith(".toml"):
        tables = read_toml(Path(name))
        if "law" not in tables:
            raise ParameterError(f"--law {name!r}: the file says nothing about the law")
        return _changed(Experiment(law=tables["law"]).law, read_settings(settings))
    found: Law = Law.resolve({"name": name, **read_settings(settings)}, default=name)
    return found


def _changed(law: Law, settings: Mapping[str, Any]) -> Law:
    try:
        return law.replaced(**settings)
    except ParameterError as error:
        raise ParameterError(f"law {law.name}: {error}") from None
