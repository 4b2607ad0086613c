"""Base of the views of results: notebook, picture, tables and files."""

import base64
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
import pyarrow as pa
from matplotlib.figure import Figure
from pyarrow import csv, parquet

from spherical_wrist.files import write_whole
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.missing_package import missing
from spherical_wrist.picture_file import PICTURES, check_ending, picture_bytes, picture_content
from spherical_wrist.picture_style import WIDTHS, width_inches
from spherical_wrist.report.html import template_environment
from spherical_wrist.report.parts import written
from spherical_wrist.result import Result
from spherical_wrist.result_table import TABLES, Cell, ResultTable, table_content

Shown = TypeVar("Shown", bound=Result)
Row = Mapping[str, Any]
Content = bytes | Iterable[bytes]

DOTS = 90
"""Dots per inch of the pictures in a notebook."""

EXTRA = "notebook"
"""Extra of the package that brings the libraries of data frames and data sets."""


class View(ABC, Generic[Shown]):
    """View of a result.

    Args:
        result: the result.
        width: width of its pictures, as for :meth:`.Result.plot`.

    Attributes:
        keys: names of the columns that tell the rows apart; the dimensions of a data set.

    Raises:
        ParameterError: the width is not valid.
    """

    keys: ClassVar[tuple[str, ...]] = ()
    usual_width: ClassVar[float] = WIDTHS["two-column"]

    def __init__(self, result: Shown, width: float | str | None = None) -> None:
        self.result = result
        self.width = self.usual_width if width is None else width_inches(width)

    @abstractmethod
    def summary(self) -> ResultTable:
        """Return the table of a notebook and of a paper."""

    @abstractmethod
    def figure(self) -> Figure:
        """Draw the picture."""

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """Return the result as rows of plain values by column."""

    def notes(self) -> list[str]:
        """Return lines for a notebook, such as warnings."""
        return []

    def small_figure(self) -> Figure:
        """Draw the picture of a notebook's summary."""
        return self.figure()

    def units(self) -> dict[str, str]:
        """Return the unit of each column that has one."""
        return {name: metric.unit for name, metric in METRICS.items() if metric.unit}

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return functions that give the content of a file, by the end of its name."""
        pictures = dict.fromkeys(PICTURES, lambda path: picture_content(self.figure(), path))
        tables = dict.fromkeys(TABLES, lambda path: table_content(self.summary(), path))
        return {**pictures, **tables, ".csv": lambda path: self._as_csv(), ".parquet": lambda path: self._as_parquet()}

    # --- the same for all results -------------------------------------------------------------------------------------

    def html(self) -> str:
        """Return the HTML of a notebook; everything in it is escaped."""
        table = self.summary()
        html: str = _template().render(
            headline=self.result.headline(),
            notes=self.notes(),
            columns=table.columns,
            rows=[
                [(_entry(cell), (row, place) in table.best) for place, cell in enumerate(cells)]
                for row, cells in enumerate(table.rows)
            ],
            picture=base64.b64encode(_png(self.small_figure())).decode(),
        )
        return html

    def shown_figure(self) -> Figure:
        """Draw the picture, which a notebook shows although it belongs to no display of pyplot."""
        figure = self.figure()
        vars(figure)["_repr_png_"] = partial(_png, figure)  # which IPython asks an object for
        return figure

    def to_pandas(self) -> Any:
        """Return the rows as a data frame.

        Raises:
            ParameterError: pandas is not installed.
        """
        frame = library("pandas").DataFrame(self.rows())
        frame.attrs["units"] = {name: unit for name, unit in self.units().items() if name in frame.columns}
        return frame

    def to_xarray(self) -> Any:
        """Return the rows as a data set whose dimensions are the keys.

        Raises:
            ParameterError: xarray is not installed.
        """
        xarray, rows, units = library("xarray"), self.rows(), self.units()
        labels = {key: list(dict.fromkeys(row[key] for row in rows)) for key in self.keys}
        places = [tuple(labels[key].index(row[key]) for key in self.keys) for row in rows]
        shape = tuple(len(values) for values in labels.values())
        variables = {}
        for name in rows[0] if rows else ():
            if name not in self.keys:
                values = _gridded([row[name] for row in rows], places, shape)
                variables[name] = (self.keys, values, {"units": units[name]} if name in units else {})
        return xarray.Dataset(variables, coords=labels)

    def save(self, path: Path) -> Path:
        """Write a file of the kind that the end of its name stands for.

        Raises:
            ParameterError: the end is not that of a kind.
            RecordingError: the file cannot be written.
        """
        files = self.files()
        check_ending(path, "file", tuple(files))
        write_whole(path, files[path.suffix.lower()](path), "file")
        return path

    def _table(self) -> pa.Table:
        plain = [{name: _plain(value) for name, value in row.items()} for row in self.rows()]
        return pa.Table.from_pylist(plain)

    def _as_csv(self) -> bytes:
        sink = pa.BufferOutputStream()
        csv.write_csv(self._table(), sink)
        return bytes(sink.getvalue())

    def _as_parquet(self) -> bytes:
        sink = pa.BufferOutputStream()
        parquet.write_table(self._table(), sink)
        return bytes(sink.getvalue())


def as_json(value: Any) -> bytes:
    """Return the content of a JSON file."""
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def library(name: str) -> Any:
    """Import a library that only conversions need.

    Raises:
        ParameterError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError:
        raise missing(f"{name} is not installed", EXTRA) from None


def _png(figure: Figure) -> bytes:
    return picture_bytes(figure, "png", dpi=DOTS)


def _plain(value: Any) -> Any:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, list | tuple | dict) else value


def _entry(cell: Cell) -> Any:
    """Return a number in three digits, a dash for None, and text as it is."""
    if cell is None:
        return "—"
    return cell if isinstance(cell, str) else written(cell, short=True)


def _gridded(values: Sequence[Any], places: Sequence[tuple[int, ...]], shape: tuple[int, ...]) -> Any:
    """Return values as an array over the dimensions, with not-a-number or None where there is none."""
    array = np.full(shape, None, dtype=object)
    for place, value in zip(places, values, strict=True):
        array[place] = value
    kinds = {type(value) for value in array.ravel()}
    if kinds == {int}:
        return array.astype(np.int64)
    return array.astype(np.float64) if kinds <= {int, float, type(None)} else array


@cache
def _template() -> Any:
    return template_environment("spherical_wrist.api").get_template("result.html")
