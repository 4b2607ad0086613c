"""The command that runs campaigns, and its options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli.app import Option, app

PEM = "FILE.pem"


@app.command()
def sweep(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN.toml|DIR", help="campaign file, or a campaign's folder")
    ],
    output: Annotated[
        Path | None,
        Option("--output", "-o", metavar="DIR", help="folder of the campaign [the file's name]; of --replay, FILE.rrd"),
    ] = None,
    resume: Annotated[bool, Option("--resume", help="go on with what is left of the campaign in DIR")] = False,
    replay: Annotated[
        int | None, Option(metavar="ID", help="run one episode of DIR again, alone, and record it")
    ] = None,
    workers: Annotated[
        int | None, Option(metavar="N", min=0, help="worker processes; 0: the threads of this one [as cores ask for]")
    ] = None,
    threads: Annotated[
        int | None, Option(metavar="N", min=1, help="threads of each worker [one a core, up to 4]")
    ] = None,
    scheduler: Annotated[
        str | None, Option(metavar="ADDRESS", help="Dask scheduler, tcp://host:port or tls://, or its scheduler file")
    ] = None,
    tls_ca: Annotated[Path | None, Option(metavar=PEM, help="of tls://: certificate of the authority")] = None,
    tls_cert: Annotated[Path | None, Option(metavar=PEM, help="of tls://: certificate of this end")] = None,
    tls_key: Annotated[Path | None, Option(metavar=PEM, help="of tls://: key of that certificate")] = None,
    anyway: Annotated[bool, Option("--anyway", help="resume with other versions of packages")] = False,
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> int:
    """Run a campaign: one experiment under many conditions, laws × samples, from a campaign file.

    The folder DIR gets a copy of the file and the episodes as Parquet, with their parameters, seeds, metrics and
    outcomes. However it is stopped, --resume goes on where it was; the table in the end is the same, bit for bit.
    Without options, DIR is summarised. How a campaign file is written: see scripts/campaign.toml.

    Exit code: 0 all episodes are stored (some may have diverged), 2 wrong input or stopped by a fault, 130 or 143
    stopped by a signal. Of --replay: as of wrist run.
    """
    from spherical_wrist.cli.sweep import SweepOptions, run_sweep

    tls = (tls_ca, tls_cert, tls_key)
    return run_sweep(campaign, SweepOptions(output, resume, replay, workers, threads, scheduler, tls, anyway, json))
