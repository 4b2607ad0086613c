"""Selection of laws: by name, with parameters, from a user's own Python file, or from an experiment file.

A law may have a name of its own, as in ``"mine=my.py:Law"``; the label of any other is the text that was given.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from spherical_wrist.control import ComputedTorque, Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import law_address, read_settings
from spherical_wrist.experiment.description import Experiment, read_toml, toml

Laws = dict[str, Law]
"""Laws by label."""

_NAME = re.compile(r"[^\s=/\\:]+")
_NAMED = re.compile(rf"\s*({_NAME.pattern})\s*=\s*(\S.*)", re.DOTALL)
"""Text of a law with a name of its own; a path or a parameter has a slash or a blank before its first ``=``."""
_SETTINGS = re.compile(r"\s+(?=\w+\s*=)")
"""Blanks before a parameter; paths and lists may contain blanks too."""

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
        label, law = named_law(text)
        if label in laws:
            raise ParameterError(f"--law {label!r} is given twice")
        laws[label] = law
    if not laws:
        laws = registered()
        own = Experiment(law=tables["law"]).law if "law" in tables else BASELINE
        if own not in laws.values():
            laws[law_text(own) or f"{own.name} of the experiment"] = own
    settings = {name.removeprefix("law."): value for name, value in changes.items() if name.startswith("law.")}
    if "law" in changes or "name" in settings:
        raise ParameterError("--set law: give the laws to compare with --law, which may be repeated")
    for name in changes:  # before an experiment refuses it that does not know these laws
        if name not in Experiment.model_fields and any(name in type(law).model_fields for law in laws.values()):
            raise ParameterError(f"unknown parameter {name!r}: did you mean 'law.{name}'?")
    return {label: _changed(law, settings) for label, law in laws.items()} if settings else laws


def named_law(text: str) -> tuple[str, Law]:
    """Read a law with its label: ``"mine=LAW"`` is called ``mine``, and any other text is its own label.

    Raises:
        WristError: the law is unknown, a parameter is not valid, or the name is that of another law.
    """
    name, given = _name_and_law(text)
    law = law_from_text(given)
    if name and Law.members.get(name, type(law)) is not type(law):
        raise ParameterError(f"--law {text!r}: {name} is the name of another law; give yours one of its own")
    return name or text, law


def law_text(law: Law, name: str = "") -> str | None:
    """Return the text that :func:`law_from_text` reads as a law; None if the command line cannot name it.

    Args:
        law: the law.
        name: name to write in place of its address.
    """
    try:
        name = name or law_address(type(law))
    except ParameterError:
        return None
    try:
        usual = dict(type(law)())
    except ParameterError:  # a law with a parameter that must be given
        usual = {}
    differing = {parameter for parameter, value in law if parameter not in usual or value != usual[parameter]}
    plain = law.model_dump(mode="json", include=differing)
    return " ".join([name, *(f"{each}={_short(value)}" for each, value in plain.items() if each != "name")])


def law_option(label: str, law: Law) -> str | None:
    """Return the value of ``--law`` that makes a law again with its label; None if the command line cannot name it."""
    text = law_text(law)
    named = _NAME.fullmatch(label) and label not in Law.members and not label.endswith(".toml")
    return f"{label}={text}" if named and text else text and label


def named_laws(laws: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a note on each law with a name of its own: the value of ``--law`` that makes it again.

    Args:
        laws: laws of a JSON object, with ``law`` (label) and ``option``.
    """
    return [law["option"] for law in laws if law["option"] not in (None, law["law"])]


def _name_and_law(text: str) -> tuple[str, str]:
    found = _NAMED.fullmatch(text)
    return (found[1], found[2]) if found else ("", text)


def _short(value: Any) -> str:
    """Write a value as ``--set`` reads it; three equal numbers as one."""
    equal = isinstance(value, list) and len(value) == 3 and value[0] == value[1] == value[2]
    return value if isinstance(value, str) else toml(value[0] if equal else value)


def law_from_text(text: str) -> Law:
    """Read a law: ``"NAME"``, ``"NAME PARAMETER=VALUE …"``, ``"path/to/file.py:Name …"`` or ``"experiment.toml"``.

    Only the table ``law`` of an experiment file is used. A name of its own, ``"mine=…"``, is skipped.

    Raises:
        WristError: the law is unknown, or a parameter is not valid.
    """
    if text.strip().startswith("=") or re.fullmatch(r"[^\s/:]*=", text.strip()):
        raise ParameterError(f"--law {text!r}: NAME=LAW is needed, such as mine=path/to/file.py:Law")
    name, *settings = _SETTINGS.split(_name_and_law(text)[1].strip())
    if name.endswith(".toml"):
        tables = read_toml(Path(name))
        if "law" not in tables:
            raise ParameterError(f"--law {name!r}: the file says nothing about the law")
        return _changed(Experiment(law=tables["law"]).law, read_settings(settings))
    law: Law = Law.resolve({"name": name, **read_settings(settings)}, default=name)
    return law


def law_value(text: str) -> Any:
    """Return a law as the value of an experiment's ``law``: a name, or a table if the text has more than that.

    Raises:
        WristError: as :func:`law_from_text`, but for an unknown name.
    """
    given = _name_and_law(text)[1].strip()
    name, *settings = _SETTINGS.split(given)
    if not settings and not name.endswith(".toml"):
        return name
    law = law_from_text(given)
    return {**law.model_dump(mode="json"), "name": law_address(type(law))}


def _changed(law: Law, settings: Mapping[str, Any]) -> Law:
    try:
        return law.replaced(**settings)
    except ParameterError as error:
        raise ParameterError(f"law {law.name}: {error}") from None
