"""Files of results: a folder of them, pictures and tables by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from spherical_wrist.cli.tables import json_bytes, printer, written_to
from spherical_wrist.picture_style import WIDTHS

if TYPE_CHECKING:
    from spherical_wrist.result_table import ResultTable


class ResultFiles(NamedTuple):
    """Files that a command is asked to write.

    Attributes:
        folder: folder of all results; None for none.
        plots: pictures.
        tables: tables.
        width: width of the pictures [in].
    """

    folder: Path | None = None
    plots: Sequence[Path] = ()
    tables: Sequence[Path] = ()
    width: float = WIDTHS["two-column"]

    @property
    def named(self) -> list[Path]:
        """Pictures and tables that were named."""
        return [*self.plots, *self.tables]

    def say(self, names: str = "") -> None:
        """Print a line on the folder, and one on each file that was named."""
        console = printer()
        if self.folder is not None:
            console.print(written_to(self.folder, names), soft_wrap=True)
        for file in self.named:
            console.print(written_to(file.parent, file.name), soft_wrap=True)


def result_files(
    folder: Path | None, plots: list[Path] | None, tables: list[Path] | None, width: str | None
) -> ResultFiles:
    """Return the files of a command, checked before it begins to work.

    Raises:
        WristError: a name or the width is not valid, or a file cannot be written.
    """
    from spherical_wrist.files import check_writable
    from spherical_wrist.picture_file import PICTURES, check_ending
    from spherical_wrist.picture_style import width_inches
    from spherical_wrist.result_table import TABLES

    for files, kind, endings in ((plots, "picture", PICTURES), (tables, "table", TABLES)):
        for file in files or []:
            check_ending(file, kind, endings)
            check_writable(file, kind)
    return ResultFiles(
        folder, plots or [], tables or [], WIDTHS["two-column"] if width is None else width_inches(width)
    )


def write_results(
    files: ResultFiles,
    name: str,
    table: dict[str, Any],
    draw: Callable[[float], Any],
    tabulate: Callable[[], ResultTable],
    more: Callable[[], Mapping[str, bytes]] = dict,
) -> None:
    """Write all files together, or none. The names of those in the folder are noted in the JSON object.

    Args:
        files: files to write.
        name: name of the files in the folder, without ending.
        table: JSON object of the results.
        draw: draws the picture at a width [in].
        tabulate: makes the table.
        more: makes further files of the folder, by name; they replace others of that name.
    """
    from spherical_wrist.files import write_together
    from spherical_wrist.picture_file import folder_pictures, picture_content
    from spherical_wrist.result_table import table_content

    contents: dict[Path, bytes] = {}
    drawing = draw(files.width) if files.folder is not None or files.plots else None
    if files.folder is not None:
        inside = dict(folder_pictures(drawing, name))
        for ending in (".tex", ".md"):
            inside[name + ending] = table_content(tabulate(), Path(name + ending))
        inside |= more()
        table["files"] = sorted([*inside, f"{name}.json"])
        inside[f"{name}.json"] = json_bytes(table)
        contents |= {files.folder / file: content for file, content in inside.items()}
    contents |= {file: picture_content(drawing, file) for file in files.plots}
    contents |= {file: table_content(tabulate(), file) for file in files.tables}
    if contents:
        write_together(contents)
