"""Storage of episodes in Parquet files, one for each batch, and queries over them.

A row is an episode: ``id``, ``sample``, ``law`` (its label), ``seed``, the varied parameters by their dotted names,
``outcome`` (completed, diverged, failed or invalid), ``ended_at_s``, ``reason``, ``warnings`` (one a line, without
those that follow from the metrics; older versions kept none), and the metrics by name. An episode is
failed if its law raised or wrote a torque that is not finite (its metrics, if it has any, are of the time before), and
invalid if its experiment could not be simulated. A metric that is newer than a file is null in the table; a column of a
metric that this version does not know stays in it.

Each file has a checksum of itself, so that an edited one is found; see :mod:`spherical_wrist.seal`.
"""

import io
import json
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import duckdb
import pyarrow as pa
from pyarrow import parquet

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.distribution import Kind
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.errors import one_line
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.seal import PLACEHOLDER, Seal, seal_of, sealed

_TYPES: dict[Kind, pa.DataType] = {
    "number": pa.float64(),
    "integer": pa.int64(),
    "boolean": pa.bool_(),
    "text": pa.string(),
    "table": pa.string(),
}
_WARNINGS = pa.field("warnings", pa.string())
_DIGEST, _VERSIONS, _SEAL = b"campaign", b"versions", b"seal"


class Batch(NamedTuple):
    """Batch of episodes, which are run and stored together.

    Attributes:
        number: index of the batch.
        first: id of the first episode.
        last: id of the last episode, plus 1.
    """

    number: int
    first: int
    last: int

    @property
    def file(self) -> str:
        """Name of the file."""
        return f"{self.first:012d}-{self.last:012d}.parquet"


class Column(NamedTuple):
    """Column of a varied parameter.

    Attributes:
        name: dotted name of the parameter and of its column.
        kind: kind of the values; tables and lists are stored as JSON.
    """

    name: str
    kind: Kind


def columns(campaign: Campaign) -> list[Column]:
    """Return the columns of the varied parameters, without the seed, which always has a column."""
    return [Column(name, distribution.kind) for name, distribution in campaign.distributions.items() if name != "seed"]


def schema(campaign: Campaign, digest: str) -> pa.Schema:
    """Return names and types of the columns. The metadata has the digest of the campaign."""
    metrics = [pa.field(name, pa.float64()) for name in METRICS]
    return pa.schema([*fixed_schema(campaign), _WARNINGS, *metrics], metadata={_DIGEST: digest.encode()})


def fixed_schema(campaign: Campaign) -> pa.Schema:
    """Return names and types of all columns except the warnings, which older files have not, and the metrics."""
    return pa.schema(
        [
            pa.field("id", pa.int64(), nullable=False),
            pa.field("sample", pa.int64(), nullable=False),
            pa.field("law", pa.string(), nullable=False),
            pa.field("seed", pa.int64(), nullable=False),
            *(pa.field(column.name, _TYPES[column.kind]) for column in columns(campaign)),
            pa.field("outcome", pa.string(), nullable=False),
            pa.field("ended_at_s", pa.float64(), nullable=False),
            pa.field("reason", pa.string(), nullable=False),
        ]
    )


def encode_rows(
    campaign: Campaign, digest: str, versions: Mapping[str, str], rows: Sequence[Mapping[str, Any]]
) -> bytes:
    """Encode rows as a sealed Parquet file. The same rows give the same bytes.

    The metadata of the file has the versions that computed the rows.
    """
    as_json = {column.name for column in columns(campaign) if column.kind == "table"}
    plain = [{name: json.dumps(v) if name in as_json else v for name, v in row.items()} for row in rows]
    names = schema(campaign, digest)
    about = {_VERSIONS: json.dumps(dict(versions)).encode(), _SEAL: PLACEHOLDER.encode()}
    names = names.with_metadata({**(names.metadata or {}), **about})
    table = pa.Table.from_pylist(plain, schema=names)
    sink = io.BytesIO()
    parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return sealed(sink.getvalue())


def python_warning(text: str) -> None:
    """Issue a warning of Python's, which is what a reader of episodes does that is given no other place for it."""
    warnings.warn(text, stacklevel=3)


class EpisodeFiles:
    """Parquet files of a campaign, one for each batch.

    Args:
        folder: folder of the files.
        campaign: campaign.
        digest: digest of the campaign, which every file contains.
        size: number of episodes in a batch.
        sealed: True if every file must be sealed; older versions sealed none.
    """

    def __init__(self, folder: Path, campaign: Campaign, digest: str, size: int, *, sealed: bool = True) -> None:
        self.folder, self._campaign, self._size, self._sealed = folder, campaign, size, sealed
        self._schema, self._fixed = schema(campaign, digest), fixed_schema(campaign)
        self.count = -(-campaign.size // size)

    def batch(self, number: int) -> Batch:
        """Return a batch by its number."""
        return Batch(number, number * self._size, min((number + 1) * self._size, self._campaign.size))

    def path(self, batch: Batch) -> Path:
        """Return the path of the file of a batch."""
        return self.folder / batch.file

    def scan(self) -> "ScanResult":
        """Read and check every file. Return the complete batches, and the faults of other files."""
        complete, unsealed, faults = set(), 0, []
        for path in sorted(self.folder.iterdir()) if self.folder.is_dir() else ():
            if path.name.startswith("."):
                continue
            batch = self._batch_of(path)
            found = FileCheck("not a file of this campaign") if batch is None else self.check(batch)
            if batch is None or found.fault:
                faults.append(f"{path.name}: {found.fault}")
            else:
                complete.add(batch.number)
                unsealed += not found.sealed
        return ScanResult(complete, faults, unsealed)

    def _batch_of(self, path: Path) -> Batch | None:
        first = path.name[:12]
        batch = self.batch(int(first) // self._size) if first.isascii() and first.isdigit() else None
        return batch if batch and batch.file == path.name and batch.first < batch.last else None

    def check(self, batch: Batch) -> "FileCheck":
        """Read and check the file of a batch."""
        path = self.path(batch)
        if not path.is_file():  # a pipe would never end
            return FileCheck("not a file" if path.exists() else "missing")
        try:
            content = path.read_bytes()
            seal = seal_of(content)
            if seal is Seal.BROKEN or (seal is Seal.MISSING and self._sealed):
                return FileCheck(f"damaged, or changed since it was written (its checksum is {seal})")
            with parquet.ParquetFile(pa.BufferReader(content), page_checksum_verification=True) as file:
                if not self._has_columns(file.schema_arrow):
                    return FileCheck("its columns are not those of this campaign")
                if (file.schema_arrow.metadata or {}).get(_DIGEST) != (self._schema.metadata or {})[_DIGEST]:
                    return FileCheck("it belongs to another campaign")
                table = file.read()
        except (pa.ArrowException, OSError, ValueError) as error:
            return FileCheck(f"damaged ({one_line(error, limit=80)})")
        if table.column("id").to_pylist() != list(range(batch.first, batch.last)):
            return FileCheck("its rows do not match its name")
        return FileCheck("", seal is Seal.INTACT, table)

    def _has_columns(self, schema: pa.Schema) -> bool:
        """Return True if a file has the fixed columns, followed by the warnings and any metrics."""
        metrics = list(schema)[len(self._fixed) :]
        metrics = metrics[1:] if metrics and metrics[0].equals(_WARNINGS) else metrics
        fixed = pa.schema(list(schema)[: len(self._fixed)])
        return bool(fixed.equals(self._fixed)) and all(each.type == pa.float64() for each in metrics)

    def row(self, id_: int, warn: Callable[[str], None] = python_warning) -> dict[str, Any] | None:
        """Return the row of an episode with the columns of its file; None if there is no valid file.

        Args:
            id_: id of the episode.
            warn: called with a line about the file if it is not trusted, or if it has no checksum.
        """
        batch = self.batch(id_ // self._size)
        found = self.check(batch)
        if found.table is None:
            if self.path(batch).exists():
                warn(f"not trusted: {batch.file}: {found.fault}")
            return None
        if not found.sealed:
            warn(UNSEALED.format("1 file"))
        row: dict[str, Any] = found.table.slice(id_ - batch.first, 1).to_pylist()[0]
        return row

    def table(self, complete: set[int]) -> "Episodes":
        """Return the episodes of some batches as one table."""
        return Episodes([self.path(self.batch(number)) for number in sorted(complete)], self._schema)


MOST_NAMED = 5
"""Most files that are named in warnings."""

UNSEALED = "{} from an older version without checksums: changes are not found"
"""Warning about files that are not sealed."""


class FileCheck(NamedTuple):
    """Result of a check of one file.

    Attributes:
        fault: its fault; empty for a valid file.
        sealed: True if it has a checksum, which is right.
        table: its rows, if it is valid.
    """

    fault: str
    sealed: bool = False
    table: pa.Table | None = None


class ScanResult(NamedTuple):
    """Result of a scan of a campaign's files.

    Attributes:
        complete: numbers of the batches whose files are valid.
        faults: names of the other files, each with its fault.
        unsealed: number of valid files without a checksum.
    """

    complete: set[int]
    faults: list[str]
    unsealed: int

    def doubts(self) -> list[str]:
        """Return a line about each of the first files that are not trusted, and one about those without a checksum."""
        old = [UNSEALED.format(f"{self.unsealed} file{'s' * (self.unsealed > 1)}")] if self.unsealed else []
        named, more = self.faults[:MOST_NAMED], len(self.faults) - MOST_NAMED
        rest = [f"not trusted: {more} more files"] if more > 0 else []
        return [*(f"not trusted: {fault}" for fault in named), *rest, *old]


class Episodes:
    """Table of stored episodes, queried by DuckDB file by file, so that memory does not grow with their number."""

    def __init__(self, files: Sequence[Path], table: pa.Schema) -> None:
        self._schema = table
        self._database = duckdb.connect(config={"autoinstall_known_extensions": "false"})
        if files:
            create_episodes_view(self._database, files)
        else:
            self._database.register("episodes", table.empty_table())

    def rows(self, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
        """Return the rows of a query as dictionaries. The name of the table is ``episodes``.

        Args:
            sql: query; ``?`` stands for a value, and names with dots are quoted: ``"disturbance.level"``.
            values: values of the ``?``.

        Raises:
            CampaignError: DuckDB refuses the query, or a file is missing.
        """
        return list(self._query(sql, values).to_arrow_table().to_pylist())

    def arrays(self, sql: str, values: Sequence[Any] = ()) -> dict[str, Any]:
        """Return the columns of a query as NumPy arrays, with NaN for missing numbers. See :meth:`rows`."""
        table = self._query(sql, values).to_arrow_table()
        return {name: table.column(name).to_numpy() for name in table.column_names}

    def in_order(self, size: int = 10_000) -> Iterator[dict[str, Any]]:
        """Yield all rows ordered by id, with ``size`` of them in memory at a time."""
        result = self._query("SELECT * FROM episodes ORDER BY id", ())
        for batch in result.to_arrow_reader(size):
            yield from batch.to_pylist()

    def _query(self, sql: str, values: Sequence[Any]) -> Any:
        try:
            return self._database.sql(sql, params=list(values))
        except duckdb.Error as error:
            raise CampaignError(f"the episodes cannot be queried: {one_line(error)}") from None


def create_episodes_view(database: duckdb.DuckDBPyConnection, files: Sequence[Path]) -> None:
    """Create the view ``episodes`` over files of one or more versions, whose metrics may differ.

    Args:
        database: connection.
        files: files, at least one.
    """
    listed = ", ".join("'" + str(file).replace("'", "''") + "'" for file in files)
    database.execute("SET parquet_metadata_cache = true")  # a union by name reads the metadata of every file
    database.execute(f"CREATE VIEW stored AS SELECT * FROM read_parquet([{listed}], union_by_name = true)")
    present = {row[0] for row in database.execute("DESCRIBE stored").fetchall()}
    types = {_WARNINGS.name: "VARCHAR", **dict.fromkeys(METRICS, "DOUBLE")}
    missing = "".join(f', NULL::{type_} AS "{name}"' for name, type_ in types.items() if name not in present)
    database.execute(f"CREATE VIEW episodes AS SELECT *{missing} FROM stored")
