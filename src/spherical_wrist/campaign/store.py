"""Episodes as Parquet files, one for each batch, and queries over them.

A row is an episode: ``id``, ``sample``, ``law`` (its label), ``seed``, the varied parameters by their dotted names,
``outcome`` (completed, diverged, failed or invalid), ``ended_at_s``, ``reason``, and the metrics by name. A failed
episode is one whose law raised or wrote no torque; an invalid one could not be simulated at all.
"""

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import duckdb
import pyarrow as pa
from pyarrow import parquet

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.distribution import Kind
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.errors import one_line
from spherical_wrist.metrics import Metrics

METRICS = tuple(field.name for field in fields(Metrics))
_TYPES: dict[Kind, pa.DataType] = {
    "number": pa.float64(),
    "integer": pa.int64(),
    "boolean": pa.bool_(),
    "text": pa.string(),
    "table": pa.string(),
}
_DIGEST, _VERSIONS = b"campaign", b"versions"


class Batch(NamedTuple):
    """Episodes that are run and stored together.

    Attributes:
        number: position among the batches.
        first: id of the first episode.
        last: id after the last one.
    """

    number: int
    first: int
    last: int

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.first:012d}-{self.last:012d}.parquet"


class Column(NamedTuple):
    """A varied parameter in the table.

    Attributes:
        name: dotted name of the parameter and of its column.
        kind: of its values; tables and lists are JSON.
    """

    name: str
    kind: Kind


def columns(campaign: Campaign) -> list[Column]:
    """The varied parameters, but for the seed, which has a column of its own."""
    return [Column(name, found.kind) for name, found in campaign.distributions.items() if name != "seed"]


def schema(campaign: Campaign, digest: str) -> pa.Schema:
    """Names and types of the table; its metadata says which campaign it belongs to."""
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
            *(pa.field(name, pa.float64()) for name in METRICS),
        ],
        metadata={_DIGEST: digest.encode()},
    )


def encoded(campaign: Campaign, digest: str, versions: Mapping[str, str], rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Rows as the bytes of a Parquet file with checksums of its pages; the same rows give the same bytes.

    The versions of what computed them go into the file's metadata.
    """
    told = {column.name for column in columns(campaign) if column.kind == "table"}
    plain = [{name: json.dumps(v) if name in told else v for name, v in row.items()} for row in rows]
    names = schema(campaign, digest)
    names = names.with_metadata({**(names.metadata or {}), _VERSIONS: json.dumps(dict(versions)).encode()})
    table = pa.Table.from_pylist(plain, schema=names)
    sink = io.BytesIO()
    parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return sink.getvalue()


class EpisodeFiles:
    """The batches of a campaign in a folder.

    Args:
        folder: where the files are.
        campaign: what they belong to.
        digest: of the campaign, which every file carries.
        size: episodes in a batch.
    """

    def __init__(self, folder: Path, campaign: Campaign, digest: str, size: int) -> None:
        self.folder, self._campaign, self._size = folder, campaign, size
        self._schema = schema(campaign, digest)
        self.count = -(-campaign.size // size)

    def batch(self, number: int) -> Batch:
        """A batch by its number."""
        return Batch(number, number * self._size, min((number + 1) * self._size, self._campaign.size))

    def path(self, batch: Batch) -> Path:
        """The file of a batch."""
        return self.folder / batch.file

    def survey(self) -> "Survey":
        """Reads every file to its end and says which batches are there, and which files are not to be trusted."""
        there, odd = set(), []
        for path in sorted(self.folder.iterdir()) if self.folder.is_dir() else ():
            if path.name.startswith("."):
                continue
            batch = self._batch_of(path)
            fault = "no file of this campaign" if batch is None else self._fault(path, batch)
            if batch is None or fault:
                odd.append(f"{path.name}: {fault}")
            else:
                there.add(batch.number)
        return Survey(there, odd)

    def _batch_of(self, path: Path) -> Batch | None:
        first = path.name[:12]
        batch = self.batch(int(first) // self._size) if first.isascii() and first.isdigit() else None
        return batch if batch and batch.file == path.name and batch.first < batch.last else None

    def _fault(self, path: Path, batch: Batch) -> str:
        """What is wrong with a file; empty where it is as it was written."""
        try:
            with parquet.ParquetFile(path, page_checksum_verification=True) as file:
                if not file.schema_arrow.equals(self._schema, check_metadata=False):
                    return "its columns are not those of this campaign"
                if (file.schema_arrow.metadata or {}).get(_DIGEST) != (self._schema.metadata or {})[_DIGEST]:
                    return "it belongs to another campaign"
                ids = file.read().column("id").to_pylist()
        except (pa.ArrowException, OSError, ValueError) as error:
            return f"damaged ({one_line(error, limit=80)})"
        return "" if ids == list(range(batch.first, batch.last)) else "its rows are not those its name says"

    def table(self, there: set[int]) -> "Episodes":
        """Those of the batches ``there`` as one table."""
        return Episodes([self.path(self.batch(number)) for number in sorted(there)], self._schema)


class Survey(NamedTuple):
    """What is in a folder of episodes.

    Attributes:
        there: numbers of the batches whose files are whole.
        odd: names of other files, each with what is wrong with it.
    """

    there: set[int]
    odd: list[str]


class Episodes:
    """Stored episodes as a table that DuckDB queries, one file after the other, whatever their number."""

    def __init__(self, files: Sequence[Path], table: pa.Schema) -> None:
        self._schema = table
        self._base = duckdb.connect(config={"autoinstall_known_extensions": "false"})
        if files:
            listed = ", ".join("'" + str(file).replace("'", "''") + "'" for file in files)
            self._base.execute(f"CREATE VIEW episodes AS SELECT * FROM read_parquet([{listed}])")
        else:
            self._base.register("episodes", table.empty_table())

    def rows(self, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
        """The rows that a query gives, as dictionaries. The table is called ``episodes``.

        Args:
            sql: the query; ``?`` stands for a value, and names with dots are quoted: ``"disturbance.level"``.
            values: one for each ``?``.

        Raises:
            CampaignError: DuckDB refuses the query, or a file has gone.
        """
        return list(self._asked(sql, values).to_arrow_table().to_pylist())

    def arrays(self, sql: str, values: Sequence[Any] = ()) -> dict[str, Any]:
        """The columns that a query gives, as NumPy arrays; a missing number is not-a-number. See :meth:`rows`."""
        table = self._asked(sql, values).to_arrow_table()
        return {name: table.column(name).to_numpy() for name in table.column_names}

    def one(self, id_: int) -> dict[str, Any] | None:
        """The row of one episode, if it is there."""
        found = self.rows("SELECT * FROM episodes WHERE id = ?", [id_])
        return found[0] if found else None

    def in_order(self, size: int = 10_000) -> Iterator[dict[str, Any]]:
        """Every row, by id, ``size`` of them in memory at a time."""
        asked = self._asked("SELECT * FROM episodes ORDER BY id", ())
        for batch in asked.to_arrow_reader(size):
            yield from batch.to_pylist()

    def _asked(self, sql: str, values: Sequence[Any]) -> Any:
        try:
            return self._base.sql(sql, params=list(values))
        except duckdb.Error as error:
            raise CampaignError(f"the episodes cannot be queried: {one_line(error)}") from None
