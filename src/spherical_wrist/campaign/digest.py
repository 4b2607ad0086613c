"""What decides the bits of a result besides its parameters: versions, code, and the files that a campaign names."""

import hashlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.episode import changed
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.run import versions
from spherical_wrist.parameters import Parameters
from spherical_wrist.wrist import dependencies

SHOWING = {"cli", "comparison", "inspection", "lyapunov", "paper", "recording", "report", "tuning"}
"""Rooms of the package that show and compare results, and make none."""


@lru_cache(maxsize=1)
def versions_here() -> Mapping[str, str]:
    """Versions of packages and platform of this process, and a digest of the code of this package that computes."""
    told = hashlib.sha256()
    folder = Path(__file__).parents[1]
    for file in sorted(folder.rglob("*.py")):
        name = file.relative_to(folder)
        if name.parts[0].removesuffix(".py") not in SHOWING:
            told.update(str(name).encode() + file.read_bytes())
    return {**versions(), "code": told.hexdigest()[:12]}


def version_differences(expected: Mapping[str, str]) -> str:
    """Which versions of this process differ from those expected, as a phrase; empty where none does."""
    here = versions_here()
    other = (name for name, version in expected.items() if here.get(name) != version)
    return ", ".join(f"{name} {here.get(name)} instead of {expected[name]}" for name in other)


def digest_of(campaign: Campaign) -> str:
    """Digest of a resolved campaign, and of the laws, models and motions in the files that it names.

    Raises:
        WristError: one of them is not there, or not what it should be.
    """
    told = hashlib.sha256(campaign.to_json().encode())
    for experiment in _all_that_name_files(campaign):
        if experiment.model is not None:
            for text in _model(experiment.model):
                told.update(text)
        told.update(experiment.law.source())
        for part in (experiment.reference, experiment.disturbance, experiment.sensing, experiment.actuation):
            told.update(part.source())
            for file in paths_of(part).values():
                told.update(file.read_bytes() if file.is_file() else b"")
    return told.hexdigest()


def paths_of(part: Parameters) -> dict[str, Path]:
    """The parameters that are files, by name."""
    values = ((name, getattr(part, name)) for name in type(part).model_fields)
    return {name: value for name, value in values if isinstance(value, Path)}


def _all_that_name_files(campaign: Campaign) -> Iterator[Experiment]:
    """The experiment under every law, and with every single value that may be a file."""
    yield from campaign.bases.values()
    first = next(iter(campaign.bases.values()))
    for name, distribution in campaign.distributions.items():
        if distribution.kind in ("text", "table"):
            for option in distribution.options or ():
                yield changed(first, {name: option})


@lru_cache(maxsize=8)
def _model(file: Path) -> tuple[bytes, ...]:
    """An MJCF file with what it includes, and the files that it takes shapes and pictures from."""
    return tuple(each.read_bytes() for each in dependencies(file))
