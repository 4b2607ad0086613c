"""A batch of episodes, from their ids to the bytes of their file: what a worker does."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, TypeVar

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digest_of, version_differences
from spherical_wrist.campaign.episode import Episode
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.store import METRICS, Batch, encoded
from spherical_wrist.errors import LawError, WristError, one_line
from spherical_wrist.experiment.measured import Measured, Prepared, finished, prepared
from spherical_wrist.simulation.workbench import SEATS, Workbench

Step = TypeVar("Step")

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
    with undertaking.bench() as bench:
        rows: list[dict[str, Any]] = []
        for first in range(batch.first, batch.last, SEATS):
            rows += run_episodes(list(campaign.episodes(first, min(first + SEATS, batch.last))), bench)
    return encoded(campaign, digest, expected, rows)


def run_episodes(episodes: Sequence[Episode], bench: Workbench) -> list[dict[str, Any]]:
    """Simulates up to ``SEATS`` episodes on a bench of this thread; their rows of the table.

    All of them are prepared before the first is run, which costs less: running one evicts from the processor's
    caches what preparing the next needs.

    Raises:
        CampaignError: something went wrong that is neither the law's fault nor the experiment's.
    """
    begun = [_attempted(episode, _begin, episode, bench, seat) for seat, episode in enumerate(episodes)]
    rows = []
    for episode, ready in zip(episodes, begun, strict=True):
        ended = _attempted(episode, finished, ready) if isinstance(ready, Prepared) else ready
        if isinstance(ended, Measured):
            outcome = ended.outcome
            ended = {**_ended(str(outcome.status), outcome.time, outcome.reason), **vars(ended.metrics)}
        rows.append({**_named(episode), **ended})
    return rows


def _named(episode: Episode) -> dict[str, Any]:
    row: dict[str, Any] = {"id": episode.id, "sample": episode.sample, "law": episode.law, "seed": episode.seed}
    return row | {name: value for name, value in episode.values.items() if name != "seed"}


def _begin(episode: Episode, bench: Workbench, seat: int) -> Prepared:
    return prepared(episode.experiment(), bench, seat=seat)


def _attempted(episode: Episode, step: Callable[..., Step], *arguments: Any) -> Step | dict[str, Any]:
    """What a step of an episode returns, or how the episode ended where it raises.

    Raises:
        CampaignError: it raises what is neither the law's fault nor the experiment's.
    """
    try:
        return step(*arguments)
    except LawError as error:
        return _ended(FAILED, 0.0, str(error))
    except WristError as error:
        return _ended(INVALID, 0.0, str(error))
    except Exception as error:
        told = f"{type(error).__name__}: {one_line(error)}"
        raise CampaignError(f"episode {episode.id} raised {told} (--replay {episode.id} runs it alone)") from error


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
