"""One episode of a campaign, alone."""

from dataclasses import asdict
from math import isnan
from typing import Any, NamedTuple

from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.experiment.run import Run
from spherical_wrist.experiment.simulate import simulate


class Replay(NamedTuple):
    """An episode that was run again.

    Attributes:
        run: the same episode, with its series.
        stored: its row in the campaign's table; None where it is not there yet.
        differences: names of the columns whose stored value is not, bit for bit, what came out now.
    """

    run: Run
    stored: dict[str, Any] | None
    differences: tuple[str, ...]

    def check(self) -> None:
        """Raises where the replay is not the episode that is stored.

        Raises:
            CampaignError: values differ; the message names them.
        """
        if self.differences:
            raise CampaignError(
                f"the replay differs from the stored episode in {', '.join(self.differences)}: "
                "was it run with other versions, or on another kind of machine?"
            )


def replay(folder: Folder, id_: int) -> Replay:
    """Runs an episode by its id.

    Raises:
        CampaignError: the campaign has no such episode.
        WristError: the episode is invalid, or its law failed.
    """
    size = folder.campaign.size
    if not 0 <= id_ < size:
        raise CampaignError(f"episode {id_}: the campaign's episodes are 0 to {size - 1}")
    (episode,) = folder.campaign.episodes(id_, id_ + 1)
    stored = folder.episodes().one(id_)
    run = simulate(episode.experiment())
    now = {"law": episode.law, "seed": episode.seed, "outcome": str(run.outcome.status), **asdict(run.metrics)}
    now |= {"ended_at_s": run.outcome.time, "reason": run.outcome.reason}
    different = () if stored is None else tuple(name for name, value in now.items() if not _same(stored[name], value))
    return Replay(run, stored, different)


def _same(one: Any, other: Any) -> bool:
    """Equal, or both not-a-number."""
    both = isinstance(one, float) and isinstance(other, float)
    return bool(one == other or (both and isnan(one) and isnan(other)))
