"""Replay of a single episode of a campaign."""

from collections.abc import Callable
from math import isnan
from typing import Any, NamedTuple

from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.campaign.store import python_warning
from spherical_wrist.experiment.embedded_files import text_without_folders
from spherical_wrist.measure.warnings import other_warnings
from spherical_wrist.simulation.run import Run
from spherical_wrist.simulation.simulate import simulate


class Replay(NamedTuple):
    """Replayed episode.

    Attributes:
        run: run of the episode, with its series.
        stored: row of the episode in the campaign's table; None if it is not stored yet.
        differences: names of the columns whose stored value differs from that of the run in any bit.
    """

    run: Run
    stored: dict[str, Any] | None
    differences: tuple[str, ...]

    def check(self) -> None:
        """Check that the replay equals the stored episode.

        Raises:
            CampaignError: values differ; the message names them.
        """
        if self.differences:
            raise CampaignError(
                f"the replay differs from the stored episode in {', '.join(self.differences)}: "
                "was it run with other versions, or on another kind of machine?"
            )


def replay(folder: Folder, id_: int, warn: Callable[[str], None] = python_warning) -> Replay:
    """Run an episode by its id.

    Args:
        folder: folder of the campaign.
        id_: id of the episode.
        warn: called with a line about the stored episode if its file is not trusted or not sealed.

    Raises:
        CampaignError: the campaign has no episode of this id, or names Python code that is not trusted.
        WristError: the experiment of the episode is not valid, or its law raises.
    """
    folder.check_consent()
    size = folder.campaign.size
    if not 0 <= id_ < size:
        raise CampaignError(f"episode {id_}: the campaign's episodes are 0 to {size - 1}")
    (episode,) = folder.campaign.episodes(id_, id_ + 1)
    stored = folder.files.row(id_, warn)
    run = simulate(episode.experiment())
    replayed = {"law": episode.law, "seed": episode.seed, "outcome": str(run.outcome.status), **run.metrics}
    replayed |= {"ended_at_s": run.outcome.time, "reason": text_without_folders(run.outcome.reason)}
    replayed["warnings"] = text_without_folders(other_warnings(run.warnings, run.metrics))
    known = stored or {}
    differences = tuple(name for name, value in replayed.items() if name in known and not _same(known[name], value))
    return Replay(run, stored, differences)


def _same(one: Any, other: Any) -> bool:
    """Return True if two values are equal, or both NaN."""
    both = isinstance(one, float) and isinstance(other, float)
    return bool(one == other or (both and isnan(one) and isnan(other)))
