"""``wrist sweep``: begin, resume or summarise a campaign, or replay one of its episodes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Group
from rich.text import Text
from typer import Argument, Option

from spherical_wrist.cli.options import CONDITIONS, Changes, Hardware, Json, Settings, with_parameters
from spherical_wrist.cli.streams import say, warned
from spherical_wrist.cli.tables import Entry, fitted, heading_lines, print_json, printer, short
from spherical_wrist.errors import ParameterError
from spherical_wrist.plain_text import visible

if TYPE_CHECKING:
    from spherical_wrist.campaign.cluster import Cluster
    from spherical_wrist.campaign.description import Campaign
    from spherical_wrist.campaign.folder import Folder
    from spherical_wrist.campaign.sweep import Listener

PEM = "FILE.pem"


@with_parameters(*CONDITIONS)
def command(
    *,
    campaign: Annotated[Path, Argument(metavar="CAMPAIGN.toml|DIR", help="campaign file, or a campaign's folder")],
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Annotated[
        Path | None,
        Option("--output", "-o", metavar="DIR", help="folder of the campaign [the file's name]; of --replay, FILE.rrd"),
    ] = None,
    resume: Annotated[bool, Option("--resume", help="continue the campaign in DIR")] = False,
    replay: Annotated[int | None, Option(metavar="ID", help="simulate one episode of DIR again, and record it")] = None,
    workers: Annotated[
        int | None,
        Option(metavar="N", min=0, help="worker processes; 0: only threads of this process [by the number of cores]"),
    ] = None,
    threads: Annotated[
        int | None, Option(metavar="N", min=1, help="threads of each worker [one per core, up to 4]")
    ] = None,
    scheduler: Annotated[
        str | None, Option(metavar="ADDRESS", help="Dask scheduler, tcp://host:port or tls://, or its scheduler file")
    ] = None,
    tls_ca: Annotated[Path | None, Option(metavar=PEM, help="of tls://: certificate of the authority")] = None,
    tls_cert: Annotated[Path | None, Option(metavar=PEM, help="of tls://: certificate of this computer")] = None,
    tls_key: Annotated[Path | None, Option(metavar=PEM, help="of tls://: key of that certificate")] = None,
    anyway: Annotated[bool, Option("--anyway", help="resume with other versions of packages")] = False,
    trust: Annotated[
        bool, Option("--trust", help="of --resume and --replay: run Python code that the folder names, such as a law")
    ] = False,
    json: Json = False,
) -> int:
    """The folder DIR gets a copy of the file, and the episodes as Parquet: parameters, seeds, metrics and outcomes.

    A campaign that was stopped in any way continues with --resume; the final table is the same, bit for bit.
    Without options, DIR is summarised. Python code that DIR names, such as a law, is run only with --trust.
    Options such as --model and --set change the experiment of the file.
    For an example of a campaign file, see scripts/campaign.toml.

    Exit code: 0 all episodes are stored (some may have been lost), 2 wrong input or stopped by a fault, 130 or 143
    stopped by a signal. Of --replay: as of wrist run.

    Raises:
        ParameterError: options contradict each other, or a value is not valid.
        CampaignError: the folder holds a campaign already.
    """
    from spherical_wrist.campaign.errors import CampaignError
    from spherical_wrist.campaign.folder import Folder, campaign_lock, is_campaign
    from spherical_wrist.campaign.sweep import resume as resumed
    from spherical_wrist.campaign.sweep import sweep
    from spherical_wrist.cli.signals import Stopped, farewell, stopping

    changed = _changes(hardware, changes, set_)
    if changed and (campaign.is_dir() or replay is not None):
        raise ParameterError(
            f"{min(changed)}: the campaign in {str(campaign)!r} has its experiment; options change that of a file"
        )
    if replay is not None:
        return _replay(Folder.open(campaign, trust=trust), replay, output or Path(f"episode-{replay}.rrd"), json)
    if campaign.is_dir() and not (resume and is_campaign(campaign)):
        _report(Folder.open(campaign), json)
        return 0
    cluster = _cluster(scheduler, workers, threads, (tls_ca, tls_cert, tls_key))
    path = campaign if campaign.is_dir() else output or campaign.with_suffix("")
    new = None if campaign.is_dir() or is_campaign(path) else _new(campaign, path, changed)
    with campaign_lock(path):
        if new is not None:
            folder = Folder.create(path, _copy(campaign, changed), new)
        elif resume:
            folder = resumed(
                path, anyway=anyway, file=None if campaign.is_dir() else campaign, trust=trust, changes=changed
            )
        else:
            raise CampaignError(f"{str(path)!r} holds a campaign: --resume goes on with it, -o gives another folder")
        try:
            farewell(stopped := visible(f"stopped; go on with: {folder.command('--resume')}"))
            with stopping(), _listener(json) as listener:
                sweep(folder, cluster, listener)
        except Stopped as stop:
            print(stopped, file=sys.stderr)
            return 128 + stop.number
    _report(folder, json, lambda text: None)  # the sweep has said what is not trusted
    return 0


def _cluster(
    scheduler: str | None, workers: int | None, threads: int | None, tls: tuple[Path | None, Path | None, Path | None]
) -> Cluster:
    """Return the processes to run on, if the options do not contradict each other."""
    from spherical_wrist.campaign.cluster import Cluster, Tls

    if scheduler is not None and (workers is not None or threads is not None):
        raise ParameterError("--workers and --threads are of this machine: a scheduler's workers have their own")
    ca, cert, key = tls
    if ca is None and cert is None and key is None:
        return Cluster(scheduler, workers, threads)
    if ca is None or cert is None or key is None or scheduler is None:
        raise ParameterError("TLS needs all of --tls-ca, --tls-cert and --tls-key, and a --scheduler tls://...")
    return Cluster(scheduler, workers, threads, Tls(ca, cert, key))


@contextmanager
def _listener(quiet: bool) -> Iterator[Listener]:
    """Show progress and warnings; only warnings if it is to be quiet."""
    from spherical_wrist.campaign.sweep import Listener
    from spherical_wrist.cli.progress import counting_episodes

    if quiet:
        yield Listener(warn=warned)
        return
    with counting_episodes() as progress:
        yield Listener(progress, warned)


def _changes(hardware: str | None, changes: Changes, settings: list[str] | None) -> dict[str, Any]:
    """Return the values by which the options change the experiment of a campaign file."""
    from spherical_wrist.experiment.command import read_settings

    preset = {} if hardware is None else {"hardware": hardware}
    return {**preset, **changes, **read_settings(settings or [])}


def _copy(file: Path, changed: dict[str, Any]) -> bytes:
    """Return the content of a campaign file, below the values that options changed."""
    from pydantic_core import to_jsonable_python

    from spherical_wrist.experiment.description import toml
    from spherical_wrist.files import read_whole

    lines = [f"# changed by an option: {name} = {toml(to_jsonable_python(value))}\n" for name, value in changed.items()]
    return "".join(lines).encode() + read_whole(file)


def _new(file: Path, path: Path, changed: dict[str, Any]) -> Campaign:
    from spherical_wrist.campaign.folder import check_empty
    from spherical_wrist.campaign.sweep import read_campaign

    check_empty(path)
    return read_campaign(file, changed)


def _replay(folder: Folder, id_: int, output: Path, as_json: bool) -> int:
    from spherical_wrist.campaign.replay import replay
    from spherical_wrist.cli.output import run_table, warn
    from spherical_wrist.files import check_writable
    from spherical_wrist.loop.outcome import Status
    from spherical_wrist.recording.runs import record

    folder.check_consent()
    folder.check_output(output)
    check_writable(output)
    again = replay(folder, id_, warned)
    record(again.run, output)
    if as_json:
        outcome = again.run.outcome
        print_json(
            {
                "episode": id_,
                "outcome": str(outcome.status),
                "ended_at_s": outcome.time,
                "reason": outcome.reason,
                **again.run.verdict.to_dict(),
                "warnings": list(again.run.warnings),
                "recording": str(output),
                "stored": again.stored is not None,
                "differences": list(again.differences),
                "experiment": dict(again.run.description),
                "metrics": dict(again.run.metrics),
            }
        )
        warn(again.run.warnings)
    else:
        run_table(again.run, output)
        if again.stored is None:
            say(f"episode {id_} is not stored: there is nothing to compare with")
    again.check()
    return 0 if again.run.outcome.status is Status.COMPLETED else 1


def _report(folder: Folder, as_json: bool, warn: Callable[[str], None] = warned) -> None:
    """Print a summary of the episodes that are stored."""
    from spherical_wrist.campaign.summary import summary
    from spherical_wrist.cli.output import warn as warn_all
    from spherical_wrist.measure.warnings import summarized_table

    episodes = folder.episodes(warn)
    laws, warnings = summary(episodes), summarized_table(episodes.rows)
    warn_all(warnings)
    stored, size = sum(law["episodes"] for law in laws), folder.campaign.size
    if as_json:
        print_json(
            {
                "folder": str(folder.path),
                "episodes": size,
                "stored": stored,
                "digest": folder.digest,
                "laws": laws,
                "warnings": list(warnings),
            }
        )
        return
    console = printer()
    console.print(Text.assemble((str(folder.path), "bold"), f"  {stored:,} of {size:,} episodes"), soft_wrap=True)
    console.print(_table(laws, console.width))
    if stored < size:
        console.print(f"go on with: {folder.command('--resume')}", soft_wrap=True)


def _table(laws: list[dict[str, Any]], width: int) -> Group:
    from spherical_wrist.campaign.summary import FIGURES, QUANTILES
    from spherical_wrist.measure.metrics import METRICS

    names = " and ".join(METRICS[name].label_and_unit for name in FIGURES)
    quantiles = [column for name in FIGURES for column in (heading_lines(METRICS[name].label), "95 %")]
    middle, most = map(str, QUANTILES[:2])
    rows: list[list[Entry]] = []
    for law in laws:
        figures = (law[name].get(quantile) for name in FIGURES for quantile in (middle, most))
        lost = law["episodes"] - law["completed"]
        rows.append([law["law"], f"{lost:,}/{law['episodes']:,}", *map(short, figures)])
    title = f"median and 95 % of {names}, of episodes that completed"
    return fitted(title, ["law", "lost", *quantiles], rows, width)
