"""Digests of all that decides a result besides its parameters: versions, code, and the files that a campaign names."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from spherical_wrist.campaign.carried_files import all_experiments
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.portable import without_folders
from spherical_wrist.parameters import paths_of
from spherical_wrist.simulation.run import versions
from spherical_wrist.wrist import model_files

SHOWING = {
    *(
        "__main__",
        "api",
        "assertions",
        "cli",
        "comparison",
        "design",
        "environment",
        "film",
        "guides",
        "inspection",
        "memory",
    ),
    *("missing_package", "paper", "picture_axes", "recording", "report", "result_table", "stability", "tuning"),
}
"""Rooms of the package that campaigns do not run: they show and compare results. A test compares with imports."""


@lru_cache(maxsize=1)
def versions_here() -> Mapping[str, str]:
    """Return the versions of packages and platform, and a digest of the code of this package that computes results."""
    digest = hashlib.sha256()
    folder = Path(__file__).parents[1]
    for file in sorted(folder.rglob("*.py")):
        name = file.relative_to(folder)
        if name.parts[0].removesuffix(".py") not in SHOWING:
            digest.update(str(name).encode() + file.read_bytes())
    return {**versions(), "code": digest.hexdigest()[:12]}


def version_differences(expected: Mapping[str, str]) -> str:
    """Return the versions that differ from the expected ones, as a phrase; empty if none does."""
    here = versions_here()
    other = (name for name, version in expected.items() if here.get(name) != version)
    return ", ".join(f"{name} {here.get(name)} instead of {expected[name]}" for name in other)


def digest_of(campaign: Campaign) -> str:
    """Compute the digest of a resolved campaign, and of the laws, models and motions in the files that it names.

    It does not depend on the folder that they are in.

    Raises:
        WristError: one of the files is missing or not valid.
    """
    return digests_of(campaign)[0]


def digests_of(campaign: Campaign) -> tuple[str, str]:
    """Compute :func:`digest_of`, and the same as older versions did, with absolute paths.

    Raises:
        WristError: one of the files is missing or not valid.
    """
    contents = b"".join(_contents(campaign))
    plain = campaign.model_dump(mode="json")
    texts = (json.dumps(without_folders(plain, 1), ensure_ascii=False), campaign.to_json())
    moved, older = (hashlib.sha256(text.encode() + contents).hexdigest() for text in texts)
    return moved, older


def _contents(campaign: Campaign) -> Iterator[bytes]:
    """Yield the contents of all files that a campaign names."""
    for experiment in all_experiments(campaign):
        if experiment.model is not None:
            yield from model_files(experiment.model).values()
        yield experiment.law.source()
        for part in (experiment.reference, experiment.disturbance, experiment.sensing, experiment.actuation):
            yield part.source()
            for file in paths_of(part).values():
                yield file.read_bytes() if file.is_file() else b""
