"""``wrist sweep``: begins, resumes, summarises a campaign, or replays one of its episodes."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from spherical_wrist.campaign.cluster import Cluster, Tls
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, check_empty, held, is_campaign
from spherical_wrist.campaign.replay import replay
from spherical_wrist.campaign.summary import QUANTILES, summary
from spherical_wrist.campaign.sweep import rehearsed, resume, sweep
from spherical_wrist.cli.output import print_json, printer, run_table
from spherical_wrist.cli.signals import Stopped, stopping
from spherical_wrist.cli.sweep_progress import listening, warn
from spherical_wrist.errors import ParameterError
from spherical_wrist.files import check_writable
from spherical_wrist.simulation.outcome import Status


class SweepOptions(NamedTuple):
    """The options of ``wrist sweep``; see its help."""

    output: Path | None
    resume: bool
    replay: int | None
    workers: int | None
    threads: int | None
    scheduler: str | None
    tls: tuple[Path | None, Path | None, Path | None]
    anyway: bool
    json: bool

    def cluster(self) -> Cluster:
        """Where to run.

        Raises:
            ParameterError: options contradict each other.
        """
        if self.scheduler is not None and (self.workers is not None or self.threads is not None):
            raise ParameterError("--workers and --threads are of this machine: a scheduler's workers have their own")
        ca, cert, key = self.tls
        if ca is None and cert is None and key is None:
            return Cluster(self.scheduler, self.workers, self.threads)
        if ca is None or cert is None or key is None or self.scheduler is None:
            raise ParameterError("TLS needs all of --tls-ca, --tls-cert and --tls-key, and a --scheduler tls://...")
        return Cluster(self.scheduler, self.workers, self.threads, Tls(ca, cert, key))


def run_sweep(given: Path, options: SweepOptions) -> int:
    """Does what the options ask for; returns the exit code.

    Args:
        given: campaign file, or folder of a campaign.
        options: what to do.

    Raises:
        WristError: wrong input, or a fault that stopped the campaign.
    """
    if options.replay is not None:
        return _replay(given, options.replay, options.output or Path(f"episode-{options.replay}.rrd"), options.json)
    if given.is_dir() and not (options.resume and is_campaign(given)):
        _report(Folder.open(given), options.json)
        return 0
    cluster, path = options.cluster(), given if given.is_dir() else options.output or given.with_suffix("")
    campaign = None if given.is_dir() or is_campaign(path) else _new(given, path)
    with held(path):
        if campaign is not None:
            folder = Folder.create(path, given, campaign)
        elif options.resume:
            folder = resume(path, anyway=options.anyway, file=None if given.is_dir() else given)
        else:
            raise CampaignError(f"{str(path)!r} holds a campaign: --resume goes on with it, -o gives another folder")
        try:
            with stopping(), listening(options.json) as listener:
                sweep(folder, cluster, listener)
        except Stopped as stop:
            print(f"stopped; go on with: wrist sweep {path} --resume", file=sys.stderr)
            return 128 + stop.number
    _report(folder, options.json)
    return 0


def _new(file: Path, path: Path) -> Campaign:
    check_empty(path)
    return rehearsed(file)


def _replay(path: Path, id_: int, output: Path, as_json: bool) -> int:
    from spherical_wrist.experiment.recordings import record  # half a second of imports

    folder = Folder.open(path)
    check_writable(output)
    again = replay(folder, id_)
    record(again.run, output)
    if as_json:
        outcome = again.run.outcome
        print_json(
            {
                "episode": id_,
                "outcome": str(outcome.status),
                "ended_at_s": outcome.time,
                "reason": outcome.reason,
                "recording": str(output),
                "stored": again.stored is not None,
                "differences": list(again.differences),
                "experiment": dict(again.run.description),
                "metrics": asdict(again.run.metrics),
            }
        )
    else:
        run_table(again.run, output)
        if again.stored is None:
            print(f"episode {id_} is not stored yet: there is nothing to compare with")
    again.check()
    return 0 if again.run.outcome.status is Status.COMPLETED else 1


def _report(folder: Folder, as_json: bool) -> None:
    """Prints what is stored."""
    episodes = folder.episodes(warn)
    laws = summary(episodes)
    stored, size = sum(law["episodes"] for law in laws), folder.campaign.size
    if as_json:
        print_json(
            {"folder": str(folder.path), "episodes": size, "stored": stored, "digest": folder.digest, "laws": laws}
        )
        return
    console = printer()
    console.print(Text.assemble((str(folder.path), "bold"), f"  {stored:,} of {size:,} episodes"), soft_wrap=True)
    console.print(_table(laws))
    if stored < size:
        console.print(f"go on with: wrist sweep {folder.path} --resume", soft_wrap=True)


def _table(laws: list[dict[str, Any]]) -> Table:
    title = Text("median and 95 % of RMS error [rad] and largest tip error [mm], of episodes that completed")
    table = Table(title=title, title_justify="left", title_style="dim", header_style="bold", box=SIMPLE_HEAD)
    table.padding, table.collapse_padding = (0, 1), True
    table.add_column("law", overflow="fold", min_width=12)
    for column in ("episodes", "others", "RMS", "95 %", "tip", "95 %"):
        table.add_column(column, justify="right", no_wrap=True)
    middle, most = map(str, QUANTILES[:2])
    for law in laws:
        error, tip = law["rms_error_rad"], law["max_tip_error_mm"]
        figures = (error.get(middle), error.get(most), tip.get(middle), tip.get(most))
        bad = law["episodes"] - law["completed"]
        table.add_row(law["law"], f"{law['episodes']:,}", f"{bad:,}", *map(_short, figures))
    return table


def _short(value: float | None) -> str:
    return "—" if value is None else f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 else f"{value:.2e}"
