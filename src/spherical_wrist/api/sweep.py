"""``sw.sweep`` and ``sw.load_campaign``: laws × samples of one experiment, stored in a folder."""

import atexit
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, ClassVar, Unpack

from spherical_wrist.api.arguments import (
    ExperimentGiven,
    LawsGiven,
    ProgressGiven,
    changes_of,
    counter,
    law_table,
    laws_of,
    tables_of,
)
from spherical_wrist.campaign.cluster import Cluster
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.design import DesignName
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, campaign_lock, is_campaign
from spherical_wrist.campaign.replay import replay
from spherical_wrist.campaign.store import Episodes, python_warning
from spherical_wrist.campaign.summary import summary
from spherical_wrist.campaign.sweep import Listener
from spherical_wrist.campaign.sweep import resume as resumed
from spherical_wrist.campaign.sweep import sweep as run_campaign
from spherical_wrist.campaign.validation import validate
from spherical_wrist.experiment.description import Experiment, parsed_toml, toml, with_changes
from spherical_wrist.experiment.values import Conditions
from spherical_wrist.result import Result, counted
from spherical_wrist.simulation.run import Run


@dataclass(frozen=True, repr=False)
class CampaignResults(Result):
    """Stored episodes of a campaign.

    Attributes:
        folder: folder of the campaign.
    """

    view: ClassVar[str] = "spherical_wrist.api.campaign_view:CampaignView"

    folder: Folder

    @property
    def path(self) -> Path:
        """Path of the folder."""
        return self.folder.path

    @property
    def campaign(self) -> Campaign:
        """Description of the campaign."""
        return self.folder.campaign

    @property
    def episodes(self) -> Episodes:
        """Table of the stored episodes, for queries."""
        return self.folder.episodes()

    def headline(self) -> str:
        """Return the numbers of episodes and laws, and the folder."""
        laws = self.summary()
        stored, size = sum(law["episodes"] for law in laws), self.campaign.size
        return f"{stored:,} of {counted(size, 'episode')}, {counted(len(self.campaign.bases), 'law')}, in {self.path}"

    def summary(self) -> list[dict[str, Any]]:
        """Return a table for each law: episodes by outcome, and quantiles of the errors of completed episodes."""
        return summary(self.episodes)

    def run(self, id_: int) -> Run:
        """Simulate an episode again, and check it against the stored one.

        Args:
            id_: id of the episode.

        Raises:
            CampaignError: there is no such episode, it differs from the stored one, or the campaign names Python code
                that is not trusted.
        """
        again = replay(self.folder, id_)
        again.check()
        return again.run


def sweep(
    laws: LawsGiven | None = None,
    *,
    vary: Mapping[str, Any],
    samples: int | None = None,
    design: DesignName = "sobol",
    experiment: ExperimentGiven | None = None,
    folder: str | PathLike[str] | None = None,
    resume: bool = False,
    jobs: int | None = None,
    progress: ProgressGiven | None = None,
    **changes: Unpack[Conditions],
) -> CampaignResults:
    """Run every law on every sample of a design.

    Every law sees the same samples with the same seeds. The episodes are stored while they are run, so that a campaign
    that was stopped goes on with ``resume=True``.

    Args:
        laws: laws; by default that of the experiment alone.
        vary: distributions of the varied parameters by dotted name, as in a campaign file, such as
            ``{"mass_scale": {"uniform": [0.5, 1.5]}}``.
        samples: number of samples; of a grid, all its points.
        design: ``sobol``, ``grid``, ``latin_hypercube`` or ``random``.
        experiment: experiment whose parameters are varied; by default the default experiment.
        folder: folder of the campaign; by default a temporary one, which is removed when this process ends.
        resume: True to go on with the same campaign in a folder.
        jobs: number of threads; by default one for each core.
        progress: True for a line on the error stream, or a function of the stored episodes and of all.
        **changes: parameters of the experiment that replace its own; ``seed`` is that of everything random.

    Raises:
        CampaignError: the folder cannot be used, or holds another campaign.
        WristError: a law, a distribution or a parameter is not valid.
    """
    values = changes_of(changes)
    seed = values.pop("seed", 0)
    tables = with_changes(tables_of(experiment), values)
    own = {} if laws is None else {label: law_table(law) for label, law in laws_of(laws, tables).items()}
    base = Experiment(**{name: value for name, value in tables.items() if not (own and name == "law")})
    plain = {name: value for name, value in base.model_dump(mode="json").items() if name in tables}
    if own:
        plain.pop("law", None)
    elif "law" in plain:
        plain["law"] = law_table(base.law)
    described = {name: value for name, value in plain.items() if value is not None}
    given: dict[str, Any] = {"samples": samples, "design": design, "seed": seed, "experiment": described, "vary": vary}
    wanted = {"laws": own, **given} if own else given
    return _run(wanted, Path(folder) if folder is not None else _temporary(), resume, jobs, progress)


def load_campaign(folder: str | PathLike[str], *, trust: bool = False) -> CampaignResults:
    """Open the folder of a campaign, complete or not.

    Args:
        folder: the folder.
        trust: allow the Python files that the campaign names, such as a user's own law, to run where an episode is
            simulated again. To look at its results needs none of them.

    Raises:
        CampaignError: there is no campaign, or its description is damaged.
    """
    return CampaignResults(Folder.open(Path(folder), trust=trust))


def _run(
    wanted: Mapping[str, Any], path: Path, resume: bool, jobs: int | None, progress: ProgressGiven | None
) -> CampaignResults:
    text = "".join(f"{name} = {toml(value, exact=True)}\n" for name, value in wanted.items() if value is not None)
    campaign = Campaign(**parsed_toml(text))  # that of the file in its folder, by any way of writing
    there = is_campaign(path)
    if not there:
        validate(campaign)
    with campaign_lock(path):
        if not there:
            folder = Folder.create(path, text.encode(), campaign)
        elif not resume:
            raise CampaignError(f"{str(path)!r} holds a campaign: resume=True goes on with it, or give another folder")
        else:
            Folder.open(path).check_same(campaign)
            folder = resumed(path, trust=True)
        run_campaign(folder, Cluster(workers=0, threads=jobs), Listener(counter(progress, "episodes"), python_warning))
    return CampaignResults(folder)


def _temporary() -> Path:
    path = Path(mkdtemp(prefix="campaign-"))
    atexit.register(rmtree, path, ignore_errors=True)
    return path
