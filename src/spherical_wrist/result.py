"""Base of the results that a person looks at: runs, comparisons, frontiers, margins and campaigns.

A result is data, and belongs to a low room. Pictures, tables and files are made of it by a class of the room ``api``,
its view, which is imported by its name when something is asked for.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from os import PathLike

    import pandas
    import xarray
    from matplotlib.figure import Figure


class Result:
    """Result that can be shown, drawn, converted to tables of other libraries, and saved.

    Attributes:
        view: module and class of its view, as ``module:Class``.
    """

    view: ClassVar[str]

    def __repr__(self) -> str:
        """Return the kind of the result and its main figures, in one line."""
        return f"<{type(self).__name__} {self.headline()}>"

    def headline(self) -> str:
        """Return the main figures in one line."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        """Return the HTML for a notebook: headline, figures, and a small picture."""
        html: str = self._view().html()
        return html

    def plot(self, width: float | str | None = None) -> Figure:
        """Draw the result; no display is needed. In a notebook, the figure is shown as a picture.

        Args:
            width: width of the figure [in], or a text: ``"one-column"``, ``"two-column"``, or a length such as
                ``"88mm"``. None for the usual one: two columns, and that of a page across for a run.

        Returns:
            A figure of Matplotlib, for ``figure.savefig``.

        Raises:
            ParameterError: the width is not valid.
        """
        figure: Figure = self._view(width).shown_figure()
        return figure

    def to_pandas(self) -> pandas.DataFrame:
        """Convert the result to a data frame; ``attrs["units"]`` has the units of its columns.

        Raises:
            ParameterError: pandas is not installed.
        """
        frame: pandas.DataFrame = self._view().to_pandas()
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Convert the result to a data set with named dimensions; each variable has its unit and meaning.

        Raises:
            ParameterError: xarray is not installed.
        """
        dataset: xarray.Dataset = self._view().to_xarray()
        return dataset

    def save(self, path: str | PathLike[str], width: float | str | None = None) -> Path:
        """Write the result to a file, in the format that the end of its name stands for; completely or not at all.

        Args:
            path: file to write. One that is there already is replaced.
            width: of a picture, as for :meth:`plot`.

        Returns:
            The path.

        Raises:
            ParameterError: the name of the file has another end than those that are valid; the message has these. Or
                the width is not valid.
            RecordingError: the file cannot be written.
        """
        written: Path = self._view(width).save(Path(path))
        return written

    def _view(self, width: float | str | None = None) -> Any:
        module, _, name = self.view.partition(":")
        return getattr(import_module(module), name)(self, width)


def counted(count: int, word: str) -> str:
    """Return a count with its noun: "1 law", "2 laws"."""
    return f"{count:,} {word}{'s' * (count != 1)}"
