"""Selection of laws: by name, with parameters, from a user's own Python file, or from an experiment file."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from spherical_wrist.control import ComputedTorque, Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import Experiment, read_toml

Laws = dict[str, Law]
"""Laws by label."""

BASELINE = ComputedTorque()
"""Law without a switching function. Chattering is reported relative to that of this law."""


def registered() -> Laws:
    """Return every law of the package with its default parameters."""
    return {name: Law.resolve(name, default=name) for name in Law.members}


def laws_from_texts(texts: Iterable[str], tables: Mapping[str, Any], changes: Mapping[str, Any]) -> Laws:
    """Return the laws of a comparison.

    Args:
        texts: laws as on the command line; see :func:`law_from_text`. Without any, all laws of the package, and the law
            of the experiment if it is another one.
        tables: experiment as plain tables.
        changes: values by dotted name. Those of the law, such as ``law.K``, apply to every law.

    Raises:
        WristError: a law is unknown, or a parameter is not valid.
    """
    laws: Laws = {}
    for text in texts:
        if text in laws:
            raise ParameterError(f"--law {text!r} is given twice")
        laws[text] = law_from_text(text)
    if not laws:
        laws = registered()
        own = Experiment(law=tables["law"]).law if "law" in tables else BASELINE
        if own not in laws.values():
            laws[f"{own.name} of the experiment"] = own
    settings = {name.removeprefix("law."): value for name, value in changes.items() if name.startswith("law.")}
    if "law" in changes or "name" in settings:
        raise ParameterError("--set law: give the laws to compare with --law, which may be repeated")
    return {label: _changed(law, settings) for label, law in laws.items()} if settings else laws


def law_from_text(text: str) -> Law:
    """Read a law: ``"NAME"``, ``"NAME PARAMETER=VALUE …"``, ``"path/to/file.py:Name …"`` or ``"experiment.toml"``.

    Only the table ``law`` of an experiment file is used.

    Raises:
        WristError: the law is unknown, or a parameter is not valid.
    """
    # split only at spaces before a parameter: paths and lists may contain spaces
    name, *settings = re.split(r"\s+(?=\w+\s*=)", text.strip())
    if name.endswith(".toml"):
        tables = read_toml(Path(name))
        if "law" not in tables:
            raise ParameterError(f"--law {name!r}: the file says nothing about the law")
        return _changed(Experiment(law=tables["law"]).law, read_settings(settings))
    law: Law = Law.resolve({"name": name, **read_settings(settings)}, default=name)
    return law


def _changed(law: Law, settings: Mapping[str, Any]) -> Law:
    try:
        return law.replaced(**settings)
    except ParameterError as error:
        raise ParameterError(f"law {law.name}: {error}") from None
