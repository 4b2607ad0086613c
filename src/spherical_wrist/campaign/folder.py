"""Folder of a campaign, used by one command at a time.

``campaign.toml`` is the campaign file as given, without the absolute folders in it. ``campaign.json`` is the campaign
with every default spelt out, its digest, the versions of packages and platform, and a checksum of each file in
``files/``: copies of the laws, models and motions that the campaign names, on which it runs (older versions kept none,
and named the files by their paths). ``episodes/`` has one Parquet file for each finished batch, and is the only record
of which batches are done.
"""

import json
import shlex
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Annotated, Any, NamedTuple, Self

from pydantic import ConfigDict, Field

from spherical_wrist.campaign.carried_files import FILES, CarriedFiles, check_intact, files_outside
from spherical_wrist.campaign.description import MOST_EPISODES, Campaign
from spherical_wrist.campaign.digest import digest_of, digests_of, version_differences, versions_here
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.portable import without_marks
from spherical_wrist.campaign.store import EpisodeFiles, Episodes, python_warning
from spherical_wrist.consent import code_in, without_code
from spherical_wrist.errors import ParameterError, RecordingError, one_line
from spherical_wrist.experiment.embedded_files import text_without_folders
from spherical_wrist.files import read_whole, write_whole
from spherical_wrist.folder_lock import LOCK, folder_lock
from spherical_wrist.parameters import Parameters

GIVEN, RESOLVED, EPISODES = "campaign.toml", "campaign.json", "episodes"
FORMAT = 1

HIDDEN = ".files.part"
"""Folder in which the files are copied before they are in their place."""

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
        trusted: True if Python files that the campaign names may run, and, of older versions, others may be read that
            its folder does not carry.
        sealed: True if all of its batches have checksums.
        carried: checksums of the files that the folder carries, by path from it; None of older versions.
    """

    path: Path
    campaign: Campaign
    digest: str
    batch_size: int
    versions: Mapping[str, str]
    trusted: bool = False
    sealed: bool = True
    carried: Mapping[str, str] | None = None

    @classmethod
    def create(cls, path: Path, file: Path | bytes, campaign: Campaign) -> Self:
        """Create a folder for a campaign; the caller holds its lock.

        Args:
            path: the folder.
            file: the campaign file, or its content.
            campaign: what the file describes.

        Raises:
            CampaignError: the folder has other content, or cannot be written.
            WristError: a file that the campaign names cannot be read.
        """
        check_empty(path)
        given = text_without_folders((file if isinstance(file, bytes) else read_whole(file)).decode("utf-8-sig"))
        resolved = campaign.resolved()
        description, contents = CarriedFiles.of(resolved)
        hidden = path / HIDDEN
        try:
            (path / EPISODES).mkdir(exist_ok=True)
            rmtree(hidden, ignore_errors=True)
            for place, content in contents.items():
                (hidden / place).parent.mkdir(parents=True, exist_ok=True)
                write_whole(hidden / place, content, "campaign")
            if contents:
                (hidden / FILES).rename(path / FILES)
                hidden.rmdir()
                resolved = Campaign(**without_marks(description, path))
            checksums = {place: sha256(content).hexdigest() for place, content in contents.items()}
            made = cls(
                path, resolved, digest_of(resolved), batch_size(resolved), versions_here(), True, True, checksums
            )
            described = {
                "format": FORMAT,
                "digest": made.digest,
                "file": sha256(given.encode()).hexdigest(),
                "batch_size": made.batch_size,
                "sealed": made.sealed,
                "versions": dict(made.versions),
                "files": checksums,
                "campaign": description,
            }
            write_whole(path / GIVEN, given.encode(), "campaign")
            write_whole(path / RESOLVED, json.dumps(described, indent=2, ensure_ascii=False).encode(), "campaign")
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
            WristError: it is not valid, or names files that are not there.
        """
        path, found = Path(path), _read(Path(path))
        description = without_marks(found.campaign, path)
        if trust and found.files is not None:
            cls.open(path).check_carried()
        with nullcontext() if trust else without_code():
            campaign = Campaign(**description)
        return cls(
            path, campaign, found.digest, found.batch_size, found.versions, trust, found.sealed, found.files
        )  # fmt: skip

    @property
    def withheld(self) -> tuple[str, ...]:
        """Python files that the campaign names, and that were not loaded."""
        return () if self.trusted else tuple(self._doubtful()[0])

    def command(self, *options: str) -> str:
        """Return a command line on this folder, with the consent that its code needs."""
        consent = ["--trust"] if any(self._doubtful()) else []
        return shlex.join(["wrist", "sweep", str(self.path), *options, *consent])

    def check_output(self, file: Path) -> None:
        """Refuse to write onto a file of the campaign.

        Raises:
            CampaignError: the path is that of one.
        """
        target, own = file.resolve(), self.path.resolve()
        folders = (own / EPISODES, own / FILES)
        if target in (own / GIVEN, own / RESOLVED, own / LOCK) or any(map(target.is_relative_to, folders)):
            raise CampaignError(f"{str(file)!r} is a file of the campaign: give another path")

    def check_consent(self) -> None:
        """Refuse to simulate with Python that is not trusted, or with files that the folder does not carry.

        Raises:
            CampaignError: it names some, or files in it have changed.
        """
        self.check_carried()
        if self.trusted:
            return
        for named, kind in zip(
            self._doubtful(), ("Python code that would run here", "files outside of it"), strict=True
        ):
            if named:
                more = f" and {len(named) - 1} more" if len(named) > 1 else ""
                raise CampaignError(
                    f"{str(self.path)!r} names {kind}, {named[0]!r}{more}: read it, and allow it with --trust"
                )

    def _doubtful(self) -> tuple[list[str], list[str]]:
        """Return what needs consent: Python files, and, of older versions, files that the folder does not carry."""
        code = code_in(self.campaign.model_dump(mode="json"))
        return code, [] if code or self.carried is not None else files_outside(self.campaign, self.path, {})

    def check_carried(self) -> None:
        """Check the files that the folder carries, and that the campaign names no others.

        Raises:
            CampaignError: a file has changed, or is not one of the folder's.
        """
        if self.carried is None:
            return
        if outside := files_outside(self.campaign, self.path, self.carried):
            raise CampaignError(f"{str(self.path)!r} names {one_line(outside[0], 120)!r}, and does not carry it")
        check_intact(self.campaign, self.path, self.carried)

    def check_same(self, campaign: Campaign) -> None:
        """Check that a campaign is that of this folder, and that the files that it names are still the same.

        Raises:
            CampaignError: it is another, or a file has changed since this one began.
        """
        resolved = campaign.resolved()
        if self.carried is None:
            same, changed = resolved.to_json() == self.campaign.to_json(), []
        else:
            wanted = CarriedFiles.of(resolved)
            same = json.dumps(wanted.description) == json.dumps(_read(self.path).campaign)
            now = wanted.checksums
            changed = sorted(each for each in now.keys() | self.carried if now.get(each) != self.carried.get(each))
        if not same:
            raise CampaignError(f"{str(self.path)!r} holds another campaign than this one: give another folder")
        if changed:
            raise CampaignError(
                f"a file of a law, model or motion has changed since the campaign began, {Path(changed[0]).name!r}: "
                f"restore it, go on with the copies in the folder, {self.command('--resume')}, or begin another"
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
        if not file.is_file() or sha256(file.read_bytes()).hexdigest() != _read(self.path).file:
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
                rmtree(path) if path.is_dir() else path.unlink()


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
    files: dict[str, str] | None = None


def _read(path: Path) -> _Description:
    file = path / RESOLVED
    try:
        found = json.loads(read_whole(file))
        if not isinstance(found, dict) or found.get("format") != FORMAT:
            raise CampaignError(f"{str(file)!r} is not of format {FORMAT}: was it made by another version?")
        return _Description(**found)
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
