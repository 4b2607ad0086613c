"""Work of a worker: run a batch of episodes, and return the bytes of its file."""

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import islice
from typing import Any, NamedTuple

from spherical_wrist.campaign.cluster import closing
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digests_of, version_differences
from spherical_wrist.campaign.episode import Episode
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.portable import without_folders
from spherical_wrist.campaign.store import Batch, encode_rows
from spherical_wrist.errors import LawError, WristError, one_line
from spherical_wrist.experiment.embedded_files import text_without_folders
from spherical_wrist.loop.outcome import Status, StoppedError
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.measure.warnings import other_warnings
from spherical_wrist.prepare.cache import SLOTS, CachePool, RunCache
from spherical_wrist.simulation.rollouts import RolloutResult, roll_out
from spherical_wrist.stages import one_of_many

FAILED, INVALID = "failed", "invalid"

ARRAYS = 64
"""Number of sampled motions that a thread keeps, at most 40 MB. Laws and samples share them.

This is enough for episodes of up to a minute.
"""


def run_batch(text: str, digest: str, batch: Batch, expected: Mapping[str, str]) -> bytes:
    """Run the episodes of a batch, and return their rows as a Parquet file.

    Args:
        text: campaign as JSON.
        digest: digest of the campaign, which is stored in the file.
        batch: batch of episodes.
        expected: versions of packages and platform that this process must have.

    Raises:
        StoppedError: the worker is being closed.
        CampaignError: this process has other versions, or an episode raised an unexpected error.
    """
    other = version_differences(expected)
    if other:
        raise CampaignError(f"a worker has {other}: give all workers the versions of this command")
    try:
        prepared = _prepared(text, digest)
    except WristError as error:
        raise CampaignError(f"a worker cannot take up the campaign: {error}") from None
    campaign = prepared.campaign
    episodes, rows = campaign.episodes(batch.first, batch.last), list[dict[str, Any]]()
    with prepared.caches.borrowed() as cache:
        while together := list(islice(episodes, SLOTS)):
            rows += run_episodes(together, cache, closing)
    return encode_rows(campaign, digest, expected, rows)


def run_episodes(
    episodes: Sequence[Episode], cache: RunCache, stop: Callable[[], bool] = lambda: False
) -> list[dict[str, Any]]:
    """Simulate at most ``SLOTS`` episodes, and return their rows of the table.

    Args:
        episodes: episodes.
        cache: cache of this thread.
        stop: polled a few times a second; returns True to stop.

    Raises:
        StoppedError: ``stop`` returned True.
        CampaignError: an episode raised an error that neither its law nor its experiment explains.
    """
    with one_of_many():
        results = roll_out([episode.experiment for episode in episodes], cache, stop=stop)
    if any(isinstance(each, RolloutResult) and each.outcome.status is Status.INTERRUPTED for each in results):
        raise StoppedError
    return [_row(episode, result) for episode, result in zip(episodes, results, strict=True)]


def _row(episode: Episode, result: RolloutResult | Exception) -> dict[str, Any]:
    row: dict[str, Any] = {"id": episode.id, "sample": episode.sample, "law": episode.law, "seed": episode.seed}
    row |= {name: without_folders(value) for name, value in episode.values.items() if name != "seed"}
    if isinstance(result, RolloutResult):
        outcome = result.outcome
        said = text_without_folders(other_warnings(result.warnings, result.metrics))
        return row | _ended(str(outcome.status), outcome.time, outcome.reason, said) | dict(result.metrics)
    if isinstance(result, WristError):
        return row | _ended(FAILED if isinstance(result, LawError) else INVALID, 0.0, str(result))
    error = f"{type(result).__name__}: {one_line(result)}"
    raise CampaignError(f"episode {episode.id} raised {error} (--replay {episode.id} runs it alone)") from result


def _ended(outcome: str, time: float, reason: str, warnings: str = "") -> dict[str, Any]:
    ended = {"outcome": outcome, "ended_at_s": time, "reason": text_without_folders(reason), "warnings": warnings}
    return ended | dict.fromkeys(METRICS)


class WorkerCampaign(NamedTuple):
    """Campaign in a worker process.

    Attributes:
        campaign: campaign.
        caches: caches for the threads of the process.
    """

    campaign: Campaign
    caches: CachePool


_preparing = threading.Lock()
"""Lock that keeps two threads from loading the file of a law twice, which would give two classes."""


def _prepared(text: str, digest: str) -> WorkerCampaign:
    with _preparing:
        return _prepare(text, digest)


@lru_cache(maxsize=1)
def _prepare(text: str, digest: str) -> WorkerCampaign:
    campaign = Campaign.from_json(text)
    if digest not in digests_of(campaign):
        raise CampaignError("the files of a law, a model or a motion are not those of the command")
    return WorkerCampaign(campaign, CachePool(ARRAYS))
