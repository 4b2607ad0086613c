"""Matplotlib figures as the bytes of a file: without a screen, and the same bytes whenever they are made."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from spherical_wrist.errors import ParameterError
from spherical_wrist.picture_style import STYLE
from spherical_wrist.plain_text import latex, latex_mathematics

PICTURES = (".png", ".svg", ".pdf", ".pgf")
"""Endings of the names of pictures, which say their format."""
IN_FOLDER = ("png", "svg", "pdf")
"""Formats of the pictures in a folder of results."""
FOR_PRINT, ON_SCREEN = 300, 200
"""Dots per inch of pictures made of dots, of those that fit a page and of wider ones."""
WIDEST_PRINTED = 8.0
"""Width of a picture that fits a page [in]."""
_UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
_PGF_HEADER = r"""% A picture by spherical-wrist and Matplotlib; its text is set in the font of the document.
% In the preamble: \usepackage{pgf}     In the text: \input{FILE.pgf}
"""


def check_ending(path: Path, kind: str, endings: Sequence[str]) -> None:
    """Check that the name of a file says its format.

    Args:
        path: the file.
        kind: kind of file in the message, such as ``picture``.
        endings: endings that are valid, in small letters.

    Raises:
        ParameterError: the name has another ending, or none.
    """
    if path.suffix.lower() not in endings:
        raise ParameterError(f"{kind} {str(path)!r}: its name must end in {', '.join(endings[:-1])} or {endings[-1]}")


def picture_content(drawing: Any, path: Path) -> bytes:
    """Return a figure as the content of a file, in the format that its name says.

    Raises:
        ParameterError: the name has another ending.
    """
    check_ending(path, "picture", PICTURES)
    return picture_bytes(drawing, path.suffix.lower().removeprefix("."))


def folder_pictures(drawing: Any, name: str) -> dict[str, bytes]:
    """Return a figure in the formats of a folder of results, keyed by file name."""
    return {f"{name}.{kind}": picture_bytes(drawing, kind) for kind in IN_FOLDER}


def picture_bytes(
    drawing: Any, kind: str, style: Any = STYLE, *, dpi: int | None = None, transparent: bool = False
) -> bytes:
    """Return a figure as a file.

    Args:
        drawing: a ``matplotlib.figure.Figure``. A layout engine that it has is applied once and then removed.
        kind: kind of file: ``"png"``, ``"svg"``, ``"pdf"`` or ``"pgf"``.
        style: settings of Matplotlib (rcParams) to draw with.
        dpi: dots per inch of kinds made of dots; None for as many as its width asks for.
        transparent: draw no ground.

    Raises:
        ParameterError: a picture with an image is to be PGF, which has none.
    """
    import matplotlib as mpl

    content = io.BytesIO()
    with mpl.rc_context(style):
        engine = drawing.get_layout_engine()
        if engine is not None:  # savefig would draw everything once more, only for the layout
            engine.execute(drawing)
            drawing.set_layout_engine("none")
            for panel in drawing.axes:  # the solver's rounding differs from run to run, and SVG has names made of it
                panel.set_position([round(place, 6) for place in panel.get_position().bounds])
        if kind == "pgf":
            return _pgf(drawing).encode()
        if dpi is None:
            dpi = FOR_PRINT if drawing.get_figwidth() <= WIDEST_PRINTED else ON_SCREEN
        drawing.savefig(content, format=kind, dpi=dpi, transparent=transparent, metadata=_UNDATED.get(kind))
    return content.getvalue()


def _pgf(drawing: Any) -> str:
    r"""Return a figure as PGF code for ``\input``.

    Matplotlib's own writer asks an installed LaTeX how large each text is. Here the sizes are those of Matplotlib's
    font, which is wider than the usual ones of documents: no LaTeX is needed, and the file is the same everywhere.
    """
    from matplotlib.backends.backend_pgf import RendererPgf
    from matplotlib.textpath import text_to_path

    class Renderer(RendererPgf):
        """Renderer whose text is escaped for LaTeX, and measured without it."""

        def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
            scale = self.dpi / 72.0
            width, height, descent = text_to_path.get_text_width_height_descent(s, prop, ismath)
            return scale * width, scale * height, scale * descent

        def draw_text(self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float,
                      ismath: Any = False, mtext: Any = None) -> None:  # fmt: skip
            text = latex_mathematics(s) if ismath else latex(s)
            super().draw_text(gc, x, y, text, prop, angle, ismath, mtext)  # type: ignore[no-untyped-call]

    code = io.StringIO()
    width, height = drawing.get_size_inches()
    corner = rf"\pgfqpoint{{{width:f}in}}{{{height:f}in}}"
    code.write(
        f"{_PGF_HEADER}\\begingroup%\n\\makeatletter%\n\\providecommand{{\\mathdefault}}[1]{{#1}}%\n"
        f"\\begin{{pgfpicture}}%\n\\pgfpathrectangle{{\\pgfpointorigin}}{{{corner}}}%\n"
        "\\pgfusepath{use as bounding box, clip}%\n"
    )
    try:
        drawing.draw(Renderer(drawing, code))  # type: ignore[no-untyped-call]
    except (ValueError, NotImplementedError) as error:
        raise ParameterError(f"this picture cannot be PGF ({error}): choose PDF, which LaTeX includes too") from None
    code.write("\\end{pgfpicture}%\n\\makeatother%\n\\endgroup%\n")
    return code.getvalue()
