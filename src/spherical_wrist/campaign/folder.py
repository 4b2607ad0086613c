"""Folder of a campaign, used by one command at a time.

``campaign.toml`` is the campaign file as given. ``campaign.json`` is the campaign with every default spelt out, every
path as seen from the folder (absolute in older versions), its digest, and the versions of packages and platform.
``episodes/`` has one Parquet file for each finished batch, and is the only record of which batches are done.
"""

import hashlib
import json
import shlex
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

from pydantic import ConfigDict, Field

from spherical_wrist.campaign.description import MOST_EPISODES, Campaign
from spherical_wrist.campaign.digest import digest_of, digests_of, version_differences, versions_here
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.portable import with_marks, without_marks
from spherical_wrist.campaign.store import EpisodeFiles, Episodes, python_warning
from spherical_wrist.consent import code_in, without_code
from spherical_wrist.errors import ParameterError, RecordingError, one_line
from spherical_wrist.files import read_whole, write_whole
from spherical_wrist.folder_lock import LOCK, folder_lock
from spherical_wrist.parameters import Parameters

GIVEN, RESOLVED, EPISODES = "campaign.toml", "campaign.json", "episodes"
FORMAT = 1

FEWEST_BATCHES = 32
"""Fewest batches of a campaign, if it has so many samples: work to share out."""

BATCH_TIME, STEP_TIME, EPISODE_TIME = 1.0, 4e-6, 1e-3
"""Seconds of work in a batch, and estimated seconds for a control period and for an episode."""


class Folder(NamedTuple):
    """Folder of a campaign.

    Attributes:
        path: the folder.
        campaign: the campaign.
        digest: of the campaign, and of the law and model files that it names.
        batch_size: episodes in a file.
        versions: of the packages and the platform that the results come from.
        withheld: Python files that the campaign names, and that were not loaded.
        sealed: True if all of its files have checksums.
    """

    path: Path
    campaign: Campaign
    digest: str
    batch_size: int
    versions: Mapping[str, str]
    withheld: tuple[str, ...] = ()
    sealed: bool = True

    @classmethod
    def create(cls, path: Path, file: Path | bytes, campaign: Campaign) -> Self:
        """Create a folder for a campaign; the caller holds its lock.

        Args:
            path: the folder.
            file: the campaign file, or its content.
            campaign: what the file describes.

        Raises:
            CampaignError: the folder has other content, or cannot be written.
        """
        check_empty(path)
        campaign, given = campaign.resolved(), file if isinstance(file, bytes) else read_whole(file)
        made = cls(path, campaign, digest_of(campaign), batch_size(campaign), versions_here())
        description = {
            "format": FORMAT,
            "digest": made.digest,
            "file": hashlib.sha256(given).hexdigest(),
            "batch_size": made.batch_size,
            "sealed": made.sealed,
            "versions": dict(made.versions),
            "campaign": with_marks(json.loads(campaign.to_json()), path),
        }
        try:
            (path / EPISODES).mkdir(exist_ok=True)
            write_whole(path / GIVEN, given, "campaign")
            write_whole(path / RESOLVED, json.dumps(description, indent=2, ensure_ascii=False).encode(), "campaign")
        except (OSError, RecordingError) as error:
            raise CampaignError(f"{error}") from None
        return made

    @classmethod
    def open(cls, path: Path | str, *, trust: bool = False) -> Self:
        """Open the folder of a campaign.

        Args:
            path: the folder.
            trust: load the Python files that the campaign names. To look at its results needs none of them.

        Raises:
            CampaignError: there is no campaign, or its description is damaged.
            WristError: it names files that are not there.
        """
        found = _read(Path(path))
        withheld = () if trust else tuple(code_in(found.campaign))
        with without_code() if withheld else nullcontext():
            campaign = Campaign(**found.campaign)
        return cls(Path(path), campaign, found.digest, found.batch_size, found.versions, withheld, found.sealed)

    def command(self, *options: str) -> str:
        """Return a command line on this folder, with the consent that its code needs."""
        consent = ["--trust"] if code_in(self.campaign.model_dump(mode="json")) else []
        return shlex.join(["wrist", "sweep", str(self.path), *options, *consent])

    def check_output(self, file: Path) -> None:
        """Refuse to write onto a file of the campaign.

        Raises:
            CampaignError: the path is that of one.
        """
        target, own = file.resolve(), self.path.resolve()
        if target in (own / GIVEN, own / RESOLVED, own / LOCK) or target.is_relative_to(own / EPISODES):
            raise CampaignError(f"{str(file)!r} is a file of the campaign: give another path")

    def check_consent(self) -> None:
        """Refuse to simulate with Python files that were not loaded.

        Raises:
            CampaignError: there are some.
        """
        if self.withheld:
            more = f" and {len(self.withheld) - 1} more" if len(self.withheld) > 1 else ""
            raise CampaignError(
                f"{str(self.path)!r} names Python code that would run here, {self.withheld[0]!r}{more}: "
                "read it, and allow it with --trust"
            )

    @property
    def files(self) -> EpisodeFiles:
        """Files of the finished batches."""
        return EpisodeFiles(self.path / EPISODES, self.campaign, self.digest, self.batch_size, sealed=self.sealed)

    def episodes(self, warn: Callable[[str], None] = python_warning) -> Episodes:
        """Open the stored episodes as a table.

        Args:
            warn: called with a line about each file that is not trusted and left out, and about those of an older
                version.
        """
        files = self.files
        found = files.scan()
        for text in found.doubts():
            warn(text)
        return files.table(found.complete)

    def check_unchanged(self, *, versions: bool = True) -> None:
        """Refuse to continue a campaign that has changed.

        Args:
            versions: if True, refuse other versions of packages and platform too.

        Raises:
            CampaignError: ``campaign.toml``, a file of a law, a model or a motion has changed, or versions have.
        """
        file = self.path / GIVEN
        if not file.is_file() or hashlib.sha256(file.read_bytes()).hexdigest() != _read(self.path).file:
            raise CampaignError(f"{str(file)!r} has changed since the campaign began: restore it, or begin another")
        if self.digest not in digests_of(self.campaign):
            raise CampaignError(
                "a file of a law, model or motion has changed since the campaign began: restore it, or begin another"
            )
        other = version_differences(self.versions) if versions else ""
        if other:
            raise CampaignError(
                f"{other}: other versions than the campaign began with may differ in their last digits; "
                "install those, or go on with --anyway"
            )

    def remove_partial_files(self) -> None:
        """Remove half-written files of a killed command; the caller holds the lock."""
        for path in (*self.path.glob(".*.part"), *(self.path / EPISODES).glob(".*.part")):
            with suppress(OSError):
                path.unlink()


def is_campaign(path: Path) -> bool:
    """Return True if a folder holds a campaign."""
    return (path / RESOLVED).is_file()


def check_empty(path: Path) -> None:
    """Refuse a path for a new campaign that is in use.

    Raises:
        CampaignError: it is a file, or a folder with other content than a killed command may have left there.
    """
    if path.exists() and not path.is_dir():
        raise CampaignError(f"{str(path)!r} is a file: give a folder for the campaign with -o")
    strange = [each.name for each in path.iterdir() if not _left_behind(each)] if path.is_dir() else []
    if strange:
        raise CampaignError(f"{str(path)!r} is not empty ({strange[0]}): give another folder, or one to be made")


def campaign_lock(path: Path) -> AbstractContextManager[None]:
    """Hold the folder of a campaign for this command alone; see :func:`spherical_wrist.folder_lock.folder_lock`."""
    return folder_lock(path, CampaignError, "running the campaign")


def batch_size(campaign: Campaign) -> int:
    """Compute the number of episodes in a batch: about a second of work, whole samples if possible."""
    if campaign.batch is not None:
        return campaign.batch
    first = next(iter(campaign.bases.values()))
    wanted = BATCH_TIME / (EPISODE_TIME + STEP_TIME * first.duration / first.control_period)
    laws = len(campaign.bases)
    return max(round(min(wanted, campaign.size / FEWEST_BATCHES) / laws), 1) * laws


class _Description(Parameters):
    """Contents of ``campaign.json``."""

    model_config = ConfigDict(extra="ignore", strict=True)

    format: int
    digest: str
    file: str
    batch_size: Annotated[int, Field(gt=0, le=MOST_EPISODES)]
    versions: dict[str, str]
    campaign: dict[str, Any]
    sealed: bool = False


def _read(path: Path) -> _Description:
    file = path / RESOLVED
    try:
        found = json.loads(read_whole(file))
        if not isinstance(found, dict) or found.get("format") != FORMAT:
            raise CampaignError(f"{str(file)!r} is not of format {FORMAT}: was it made by another version?")
        return _Description(**{**found, "campaign": without_marks(found.get("campaign"), path)})
    except FileNotFoundError:
        raise CampaignError(f"{str(path)!r} holds no campaign: there is no {RESOLVED} in it") from None
    except RecursionError:
        raise CampaignError(f"{str(file)!r} cannot be read: its values are nested too deeply") from None
    except OSError as error:
        raise CampaignError(f"{str(file)!r} cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        raise CampaignError(f"{str(file)!r} cannot be read: {one_line(error).partition(';')[0]}") from None
    except ParameterError as error:
        raise CampaignError(f"{str(file)!r} is damaged: {error}") from None


def _left_behind(path: Path) -> bool:
    """Return True for content left by a command that was killed while it created the campaign."""
    if path.name == EPISODES and path.is_dir():
        return not any(path.iterdir())
    return path.name in (LOCK, GIVEN) or (path.name.startswith(".") and path.name.endswith(".part"))
