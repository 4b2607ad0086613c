"""A batch of episodes, from their ids to the bytes of their file: what a worker does."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import islice
from typing import Any

from spherical_wrist.campaign.cluster import closing
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digest_of, version_differences
from spherical_wrist.campaign.episode import Episode
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.store import METRICS, Batch, encoded
from spherical_wrist.errors import LawError, WristError, one_line
from spherical_wrist.experiment.bulk import Ended, measured_each
from spherical_wrist.simulation.workbench import SEATS, Workbench

FAILED, INVALID = "failed", "invalid"

ARRAYS = 64
"""Sampled motions that a thread keeps, 40 MB at most: laws and samples share them, for episodes of up to a minute."""


def run_batch(text: str, digest: str, batch: Batch, expected: Mapping[str, str]) -> bytes:
    """Runs the episodes of a batch, one after the other, and returns their rows as a Parquet file.

    Args:
        text: the campaign as JSON.
        digest: its digest, for the file.
        batch: which episodes.
        expected: versions of packages and platform that the results must come from.

    Raises:
        StoppedError: the worker is being closed.
        CampaignError: this process has other versions, or an episode raised what it should not.
    """
    other = version_differences(expected)
    if other:
        raise CampaignError(f"a worker has {other}: give all workers the versions of this command")
    try:
        undertaking = _prepared(text, digest)
    except WristError as error:
        raise CampaignError(f"a worker cannot take up the campaign: {error}") from None
    campaign = undertaking.campaign
    episodes, rows = campaign.episodes(batch.first, batch.last), list[dict[str, Any]]()
    with undertaking.bench() as bench:
        while together := list(islice(episodes, SEATS)):
            rows += run_episodes(together, bench, closing)
    return encoded(campaign, digest, expected, rows)


def run_episodes(
    episodes: Sequence[Episode], bench: Workbench, stop: Callable[[], bool] = lambda: False
) -> list[dict[str, Any]]:
    """Simulates up to ``SEATS`` episodes on a bench of this thread; their rows of the table.

    Raises:
        StoppedError: asked to stop.
        CampaignError: something went wrong that is neither the law's fault nor the experiment's.
    """
    results = measured_each([episode.experiment for episode in episodes], bench, stop)
    return [_row(episode, result) for episode, result in zip(episodes, results, strict=True)]


def _row(episode: Episode, result: Ended | Exception) -> dict[str, Any]:
    row: dict[str, Any] = {"id": episode.id, "sample": episode.sample, "law": episode.law, "seed": episode.seed}
    row |= {name: value for name, value in episode.values.items() if name != "seed"}
    if isinstance(result, Ended):
        outcome = result.outcome
        return row | _ended(str(outcome.status), outcome.time, outcome.reason) | vars(result.metrics)
    if isinstance(result, WristError):
        return row | _ended(FAILED if isinstance(result, LawError) else INVALID, 0.0, str(result))
    told = f"{type(result).__name__}: {one_line(result)}"
    raise CampaignError(f"episode {episode.id} raised {told} (--replay {episode.id} runs it alone)") from result


def _ended(outcome: str, time: float, reason: str) -> dict[str, Any]:
    return {"outcome": outcome, "ended_at_s": time, "reason": reason, **dict.fromkeys(METRICS)}


class Undertaking:
    """A campaign as this process runs it, with benches that its threads take and give back."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self._idle: list[Workbench] = []

    @contextmanager
    def bench(self) -> Iterator[Workbench]:
        """A bench for one thread."""
        try:
            bench = self._idle.pop()
        except IndexError:
            bench = Workbench(arrays=ARRAYS)
        try:
            yield bench
        finally:
            self._idle.append(bench)


_preparing = threading.Lock()
"""Two threads that load one law's file at the same time would get two laws."""


def _prepared(text: str, digest: str) -> Undertaking:
    with _preparing:
        return _prepare(text, digest)


@lru_cache(maxsize=1)
def _prepare(text: str, digest: str) -> Undertaking:
    campaign = Campaign.from_json(text)
    if digest_of(campaign) != digest:
        raise CampaignError("the files of a law, a model or a motion are not those of the command")
    return Undertaking(campaign)
