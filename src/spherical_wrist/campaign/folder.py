"""A campaign's folder: what is run in it, with which versions, by one command at a time.

``campaign.toml`` is the file as it was given, ``campaign.json`` what it means, with every default and path spelt out,
its digest and the versions of what computes, and ``episodes/`` has one Parquet file for each finished batch. Which
batches are done is read from there and nowhere else, so that there is nothing that could disagree with it.
"""

import fcntl
import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digest_of, version_differences, versions_here
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.store import EpisodeFiles, Episodes
from spherical_wrist.errors import RecordingError
from spherical_wrist.files import write_whole

GIVEN, MEANT, EPISODES, LOCK = "campaign.toml", "campaign.json", "episodes", ".lock"
FORMAT = 1

FEWEST_BATCHES = 32
"""Batches that a campaign has at least, where it has so many samples, so that there is something to share out."""

BATCH_TIME, STEP_TIME, EPISODE_TIME = 1.0, 4e-6, 1e-3
"""Seconds of work in a batch, and estimates of what a control period and an episode cost."""


class Folder(NamedTuple):
    """A campaign's folder.

    Attributes:
        path: where it is.
        campaign: what is run.
        digest: of the campaign, and of the law and model files that it names.
        batch_size: episodes in a file.
        versions: of the packages and the platform that the results come from.
    """

    path: Path
    campaign: Campaign
    digest: str
    batch_size: int
    versions: Mapping[str, str]

    @classmethod
    def create(cls, path: Path, file: Path, campaign: Campaign) -> Self:
        """Makes a folder for a campaign; the caller holds its lock.

        Raises:
            CampaignError: there is something else in it, or it cannot be written.
        """
        check_empty(path)
        campaign = campaign.resolved()
        made = cls(path, campaign, digest_of(campaign), batch_size(campaign), versions_here())
        told = {
            "format": FORMAT,
            "digest": made.digest,
            "file": hashlib.sha256(file.read_bytes()).hexdigest(),
            "batch_size": made.batch_size,
            "versions": dict(made.versions),
            "campaign": json.loads(campaign.to_json()),
        }
        try:
            (path / EPISODES).mkdir(exist_ok=True)
            write_whole(path / GIVEN, file.read_bytes(), "campaign")
            write_whole(path / MEANT, json.dumps(told, indent=2, ensure_ascii=False).encode(), "campaign")
        except (OSError, RecordingError) as error:
            raise CampaignError(f"{error}") from None
        return made

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """The campaign in a folder.

        Raises:
            CampaignError: there is none, or what says so is damaged.
            WristError: it names files that are not there.
        """
        told = _told(Path(path))
        try:
            campaign = Campaign(**told["campaign"])
            return cls(Path(path), campaign, told["digest"], told["batch_size"], told["versions"])
        except (KeyError, TypeError) as error:
            raise CampaignError(f"{str(Path(path) / MEANT)!r} is damaged: {error!r}") from None

    @property
    def files(self) -> EpisodeFiles:
        """Its finished batches."""
        return EpisodeFiles(self.path / EPISODES, self.campaign, self.digest, self.batch_size)

    def episodes(self, warn: Callable[[str], None] = lambda text: None) -> Episodes:
        """The episodes that are stored, as a table.

        Args:
            warn: called with a line about each file that is not to be trusted, which is left out.
        """
        files = self.files
        there, odd = files.survey()
        for text in odd:
            warn(f"not trusted: {text}")
        return files.table(there)

    def check_unchanged(self, *, versions: bool = True) -> None:
        """Refuses to go on with a campaign that is no longer what it was.

        Args:
            versions: also refuse other versions of packages and platform.

        Raises:
            CampaignError: ``campaign.toml``, a file of a law, a model or a motion has changed, or versions have.
        """
        file = self.path / GIVEN
        if not file.is_file() or hashlib.sha256(file.read_bytes()).hexdigest() != _told(self.path)["file"]:
            raise CampaignError(f"{str(file)!r} has changed since the campaign began: restore it, or begin another")
        if digest_of(self.campaign) != self.digest:
            raise CampaignError(
                "a file of a law, model or motion has changed since the campaign began: restore it, or begin another"
            )
        other = version_differences(self.versions) if versions else ""
        if other:
            raise CampaignError(
                f"{other}: other versions than the campaign began with may differ in their last digits; "
                "install those, or go on with --anyway"
            )

    def tidy(self) -> None:
        """Removes what a killed command left half written; the caller holds the lock."""
        for path in (*self.path.glob(".*.part"), *(self.path / EPISODES).glob(".*.part")):
            with suppress(OSError):
                path.unlink()


def is_campaign(path: Path) -> bool:
    """Whether a folder holds a campaign."""
    return (path / MEANT).is_file()


def check_empty(path: Path) -> None:
    """Refuses a place for a new campaign where there is something else.

    Raises:
        CampaignError: it is a file, or a folder with other things in it than a killed command may have left there.
    """
    if path.exists() and not path.is_dir():
        raise CampaignError(f"{str(path)!r} is a file: give a folder for the campaign with -o")
    strange = [each.name for each in path.iterdir() if not _left_behind(each)] if path.is_dir() else []
    if strange:
        raise CampaignError(f"{str(path)!r} is not empty ({strange[0]}): give another folder, or one to be made")


@contextmanager
def held(path: Path) -> Iterator[None]:
    """The folder, made if need be, for this command alone. The lock is the kernel's and ends with its holder.

    Raises:
        CampaignError: another command holds it, or it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise CampaignError(f"{str(path)!r} cannot be used: {error.strerror or error}") from None
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise CampaignError(f"another command is running the campaign in {str(path)!r}: wait for it") from None
        yield
    finally:
        os.close(descriptor)


def batch_size(campaign: Campaign) -> int:
    """Episodes in a batch: a second's work, whole samples where that is possible."""
    if campaign.batch is not None:
        return campaign.batch
    first = next(iter(campaign.bases.values()))
    wanted = BATCH_TIME / (EPISODE_TIME + STEP_TIME * first.duration / first.control_period)
    laws = len(campaign.bases)
    return max(round(min(wanted, campaign.size / FEWEST_BATCHES) / laws), 1) * laws


def _told(path: Path) -> dict[str, Any]:
    file = path / MEANT
    try:
        told = json.loads(file.read_bytes())
    except FileNotFoundError:
        raise CampaignError(f"{str(path)!r} holds no campaign: there is no {MEANT} in it") from None
    except (OSError, ValueError) as error:
        raise CampaignError(f"{str(file)!r} cannot be read: {error}") from None
    if not isinstance(told, dict) or told.get("format") != FORMAT:
        raise CampaignError(f"{str(file)!r} is not of format {FORMAT}: was it made by another version?")
    return told


def _left_behind(path: Path) -> bool:
    """Whether a command that was killed before the campaign was there leaves such a thing."""
    if path.name == EPISODES and path.is_dir():
        return not any(path.iterdir())
    return path.name in (LOCK, GIVEN) or (path.name.startswith(".") and path.name.endswith(".part"))
