"""Files that a campaign names, carried in its folder: laws with the modules beside them, models with assets, motions.

A campaign runs on these copies. Its folder can therefore be sent, and goes on where the files that it began with are
not. Each file that the campaign names has a folder of its own in ``files/``, with all that it needs.
"""

from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any, NamedTuple

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.episode import changed
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.portable import MARK, with_texts
from spherical_wrist.consent import MARK as CODE
from spherical_wrist.consent import is_code, without_code
from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.experiment.description import PARTS, Experiment
from spherical_wrist.experiment.embedded_files import file_groups
from spherical_wrist.files import read_whole
from spherical_wrist.package_files import shortest_name
from spherical_wrist.parameters import paths_of
from spherical_wrist.wrist import check_confined

FILES = "files"
"""Folder of the copies, within that of the campaign."""


class CarriedFiles(NamedTuple):
    """Copies of the files that a campaign names.

    Attributes:
        description: the campaign as plain data; files are named by :data:`~spherical_wrist.campaign.portable.MARK` and
            their place.
        contents: contents by place, a path from the folder of the campaign.
    """

    description: Mapping[str, Any]
    contents: Mapping[str, bytes]

    @classmethod
    def of(cls, campaign: Campaign) -> "CarriedFiles":
        """Collect the files of a resolved campaign as they are now; Python files as they were loaded.

        Raises:
            WristError: one of them cannot be read, or is not valid.
        """
        places: dict[str, str] = {}
        contents: dict[str, bytes] = {}
        texts: dict[str, str] = {}
        for experiment in all_experiments(campaign):
            for _, group in file_groups(experiment, {}):
                if group.given is None or group.given in texts:
                    continue
                file, name = _file_and_class(group.given)
                if file not in places:
                    first = next(iter(group.files))
                    folder = _free(Path(first).stem, contents)
                    places[file] = f"{folder}/{first}"
                    contents |= {f"{folder}/{path}": content for path, content in group.files.items()}
                texts[group.given] = MARK + places[file] + name
        description = with_texts(campaign.model_dump(mode="json"), lambda text: texts.get(text, text))
        return cls(description, contents)

    @property
    def checksums(self) -> dict[str, str]:
        """SHA-256 of each file, by place."""
        return {place: sha256(content).hexdigest() for place, content in self.contents.items()}


def all_experiments(campaign: Campaign) -> Iterator[Experiment]:
    """Yield the experiment under every law, and with every single value that may be a file."""
    yield from campaign.bases.values()
    first = next(iter(campaign.bases.values()))
    for name, distribution in campaign.distributions.items():
        if distribution.kind in ("text", "table"):
            for option in distribution.options or ():
                yield changed(first, {name: option})


def files_outside(campaign: Campaign, folder: Path, places: Mapping[str, str]) -> list[str]:
    """Return the files that a campaign names and neither its folder nor this package carries.

    Args:
        campaign: the campaign, whose Python files need not be loaded.
        folder: folder of the campaign.
        places: what the folder carries, by path from it.
    """
    carried = {str(folder.resolve() / place) for place in places}
    named = dict.fromkeys(str(each.file) for each in _named(campaign))
    return [file for file in named if file not in carried and shortest_name(file) == file]


def check_intact(campaign: Campaign, folder: Path, checksums: Mapping[str, str]) -> None:
    """Check that a folder carries what it did when the campaign began, and that its models open nothing else.

    Compiled Python, which loading the files leaves there, is removed: nobody can read what it would run.

    Args:
        campaign: the campaign, whose Python files need not be loaded.
        folder: folder of the campaign.
        checksums: SHA-256 of each file that the folder carries, by path from it.

    Raises:
        CampaignError: a file has changed, is missing, or was added; or a model names files outside of its folder.
    """
    root = folder.resolve() / FILES
    if root.is_symlink():
        raise CampaignError(f"{str(folder / FILES)!r} leads elsewhere: a folder with the campaign's files is needed")
    for cache in root.rglob("__pycache__"):
        rmtree(cache, ignore_errors=True)
    present = (path for path in root.rglob("*") if path.is_symlink() or not path.is_dir())
    if added := sorted({path.relative_to(root.parent).as_posix() for path in present} - checksums.keys()):
        raise CampaignError(f"{str(folder / added[0])!r} is no file of the campaign: remove it")
    for place, checksum in checksums.items():
        try:
            inside = (root.parent / place).resolve() == root.parent / place and _is_in(FILES, place)
            same = inside and sha256(read_whole(root.parent / place)).hexdigest() == checksum
        except (OSError, ValueError) as error:
            raise CampaignError(f"{str(folder / place)!r} cannot be read: {one_line(error, 100)}") from None
        if not same:
            raise CampaignError(
                f"{str(folder / place)!r} has changed since the campaign began: restore it, or begin another"
            )
    for purpose, file in _named(campaign):
        if not file.is_relative_to(root):
            continue
        own = "/".join((FILES, *file.relative_to(root).parts[:1]))
        if purpose == "model":
            _check_model(file, folder.resolve() / own)
        elif purpose == "code" and (
            odd := [place for place in checksums if _is_in(own, place) and place[-3:] != ".py"]
        ):
            raise CampaignError(f"{str(folder / odd[0])!r} is no Python file, and may be run like one: remove it")


def _check_model(file: Path, folder: Path) -> None:
    try:
        check_confined(file, folder)
    except ModelError as error:
        raise CampaignError(f"model {str(file)!r}: {error}") from None


def _is_in(folder: str, place: str) -> bool:
    return place.startswith(f"{folder}/")


class _NamedFile(NamedTuple):
    """File that a campaign names, and what it is for: ``model``, ``code`` or ``data``."""

    purpose: str
    file: Path


def _named(campaign: Campaign) -> list[_NamedFile]:
    """Return the files that a campaign names, each once; no Python file is loaded for it."""
    found: list[_NamedFile] = []
    with without_code():
        for experiment in all_experiments(campaign):
            if experiment.model is not None:
                found.append(_NamedFile("model", experiment.model))
            for part in (getattr(experiment, name) for name in PARTS):
                if is_code(type(part).address):
                    found.append(_NamedFile("code", Path(_file_and_class(type(part).address)[0])))
                found += [_NamedFile("data", file) for file in paths_of(part).values()]
    return list(dict.fromkeys(found))


def _file_and_class(given: str) -> tuple[str, str]:
    """Return file and ``:Name`` of the name of a part that is a Python file; of any other text itself."""
    file, mark, name = given.rpartition(CODE)
    return (f"{file}.py", f":{name}") if mark else (given, "")


def _free(name: str, contents: Mapping[str, bytes]) -> str:
    """Return a folder that no place has, called like a file, or numbered."""
    taken = {place.split("/")[1].lower() for place in contents}
    number, free = 1, name
    while free.lower() in taken:
        number += 1
        free = f"{name}-{number}"
    return f"{FILES}/{free}"
