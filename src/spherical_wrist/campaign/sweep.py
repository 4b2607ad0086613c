"""Run the batches of a campaign that are not stored yet, and store them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.campaign.batch import run_batch
from spherical_wrist.campaign.cluster import Cluster, connected, run_all
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import versions_here
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.campaign.validation import validate
from spherical_wrist.errors import RecordingError
from spherical_wrist.files import write_whole


class Listener(NamedTuple):
    """Callbacks of a sweep.

    Attributes:
        progress: called with the number of episodes stored so far and of all.
        warn: called with a line about a file that is not trusted.
    """

    progress: Callable[[int, int], None] = lambda done, size: None
    warn: Callable[[str], None] = lambda text: None


def read_campaign(file: Path, changes: Mapping[str, Any] | None = None) -> Campaign:
    """Read a campaign file, and check it as far as possible before the first episode.

    Args:
        file: campaign file.
        changes: see :meth:`~spherical_wrist.campaign.description.Campaign.from_toml`.

    Raises:
        WristError: the campaign is not valid.
    """
    campaign = Campaign.from_toml(file, changes)
    validate(campaign)
    return campaign


def resume(
    path: Path,
    *,
    anyway: bool = False,
    file: Path | None = None,
    trust: bool = False,
    changes: Mapping[str, Any] | None = None,
) -> Folder:
    """Open the folder of a campaign to continue it; the caller holds its lock.

    Args:
        path: the folder.
        anyway: if True, accept other versions of packages.
        file: the campaign file, to check that it is the same campaign. What it names is then trusted.
        trust: load the Python files that the folder names.
        changes: of that file; see :meth:`~spherical_wrist.campaign.description.Campaign.from_toml`.

    Raises:
        CampaignError: there is no campaign, it has changed, or it names Python code that is not trusted.
    """
    folder = Folder.open(path, trust=trust)
    if file is not None:
        folder.check_same(Campaign.from_toml(file, changes))
        folder = Folder.open(path, trust=True)
    folder.check_consent()
    folder.check_unchanged(versions=not anyway)
    folder.remove_partial_files()
    return folder


def sweep(folder: Folder, cluster: Cluster, listener: Listener) -> int:
    """Run every batch that is not stored yet, and return the number of episodes run. The caller holds the lock.

    Raises:
        CampaignError: the scheduler or the disk failed; stored episodes stay, and the campaign can be resumed.
        WristError: raised by an episode.
    """
    files = folder.files
    found = files.scan()
    for text in found.doubts():
        listener.warn(text.replace("not trusted:", "not trusted, and run again where it belongs to the campaign:", 1))
    left = [number for number in range(files.count) if number not in found.complete]
    done = folder.campaign.size - sum(_length(files.batch(number)) for number in left)
    ran = 0
    listener.progress(done, folder.campaign.size)
    if not left:
        return ran
    text, versions = folder.campaign.to_json(), dict(versions_here())

    def arguments(batch: Any) -> tuple[Any, ...]:
        return text, folder.digest, batch, versions

    try:
        with connected(cluster) as client:
            for batch, content in run_all(client, run_batch, map(files.batch, left), arguments):
                write_whole(files.path(batch), content, "episodes")
                ran += _length(batch)
                listener.progress(done + ran, folder.campaign.size)
    except (CampaignError, RecordingError) as error:
        raise CampaignError(f"{error}; nothing stored is lost, go on with: {folder.command('--resume')}") from None
    return ran


def _length(batch: Any) -> int:
    return int(batch.last - batch.first)
