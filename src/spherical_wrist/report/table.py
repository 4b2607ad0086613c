"""The episodes of a campaign as a table on disk that questions are put to. The only file of this room with DuckDB.

Of the episodes in the folder, ``measured`` has those that count, a row each: ``id``, ``sample``, ``law``, the varied
parameters by their dotted names, ``outcome``, ``ended_at_s``, ``reason`` and the three ``FIGURES``. An episode whose
run did not complete counts as worse than any that did: its figures are infinite. Episodes that could not be simulated
at all are no fault of the law and left out, and so are those that completed but have nothing in the steady window.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import duckdb

from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.campaign.store import Column, columns, create_episodes_view, python_warning
from spherical_wrist.errors import one_line

FIGURES = {"error": "rms_error_rad", "tip": "max_tip_error_mm", "chattering": "chattering_Nm_per_s"}
"""Columns of figures, and the metrics that they are."""
MEMORY = "256MB"
"""Memory that a query may take; beyond, it goes to the disk."""
UNMEASURED = f"outcome = 'completed' AND ({' OR '.join(f'{metric} IS NULL' for metric in FIGURES.values())})"


class Table(NamedTuple):
    """The table.

    Attributes:
        base: connection to it.
        parameters: the varied parameters.
        laws: labels of the laws that have episodes, in the order of the campaign.
        odd: files in the folder that are not to be trusted, and why.
    """

    base: duckdb.DuckDBPyConnection
    parameters: tuple[Column, ...]
    laws: tuple[str, ...]
    odd: tuple[str, ...]

    def rows(self, sql: str, *values: Any) -> list[tuple[Any, ...]]:
        """The rows that a query gives; ``?`` in it stand for the values.

        Raises:
            CampaignError: the query fails, for instance because the disk is full.
        """
        with explained():
            return self.base.execute(sql, values).fetchall()

    def named(self, sql: str, *values: Any) -> list[dict[str, Any]]:
        """The same as dictionaries."""
        with explained():
            asked = self.base.execute(sql, values)
            names = [column[0] for column in asked.description or ()]
            return [dict(zip(names, row, strict=True)) for row in asked.fetchall()]


@contextmanager
def table_of(folder: Folder, warn: Callable[[str], None] = python_warning) -> Iterator[Table]:
    """The table of a campaign, in a folder of its own for temporary files, which goes when the context is left.

    Args:
        folder: the campaign's folder.
        warn: called with a line about each file that is not trusted or not sealed.

    Raises:
        CampaignError: nothing is stored yet, or the table cannot be made.
    """
    files = folder.files
    scan = files.scan()
    for text in scan.doubts():
        warn(text)
    paths = [files.path(files.batch(number)) for number in sorted(scan.complete)]
    if not paths:
        raise CampaignError(f"{str(folder.path)!r} has no episodes yet: {folder.command('--resume')} runs them")
    parameters = tuple(columns(folder.campaign))
    with TemporaryDirectory(prefix="wrist-report-") as room, explained():
        base = duckdb.connect(
            str(Path(room) / "table.duckdb"),
            config={"autoinstall_known_extensions": "false", "memory_limit": MEMORY, "temp_directory": room},
        )
        try:
            create_episodes_view(base, paths)
            base.execute(_measured(parameters))
            found = {law for (law,) in base.execute("SELECT DISTINCT law FROM episodes").fetchall()}
            laws = tuple(law for law in folder.campaign.bases if law in found)
            if not laws:
                raise CampaignError(f"{str(folder.path)!r}: its episodes are of other laws than its campaign names")
            yield Table(base, parameters, laws, tuple(scan.faults))
        finally:
            base.close()


def quoted(name: str) -> str:
    """A column's name in a query."""
    return '"' + name.replace('"', '""') + '"'


@contextmanager
def explained() -> Iterator[None]:
    """Errors of DuckDB in one line.

    Raises:
        CampaignError: instead of them.
    """
    try:
        yield
    except (duckdb.Error, OSError) as error:
        raise CampaignError(f"the episodes cannot be read: {one_line(error)}") from None


def _measured(parameters: Sequence[Column]) -> str:
    varied = "".join(f", {quoted(column.name)}" for column in parameters)
    figures = ", ".join(
        f"CASE outcome WHEN 'completed' THEN {metric} ELSE 'inf'::DOUBLE END AS {name}"
        for name, metric in FIGURES.items()
    )
    return (
        f"CREATE TABLE measured AS SELECT id, sample, law{varied}, outcome, ended_at_s, reason, {figures} "
        f"FROM episodes WHERE outcome <> 'invalid' AND NOT ({UNMEASURED}) ORDER BY id"
    )
