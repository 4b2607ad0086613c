"""Matplotlib figures as the bytes of a file: without a screen, and the same bytes whenever they are made."""

import io
from typing import Any


def picture_bytes(drawing: Any, kind: str, style: Any, *, dpi: int = 200, transparent: bool = False) -> bytes:
    """Return a figure as a file.

    Args:
        drawing: a ``matplotlib.figure.Figure``. A layout engine that it has is applied once and then removed.
        kind: kind of file, such as ``"png"`` or ``"svg"``.
        style: settings of Matplotlib (rcParams) to draw with.
        dpi: dots per inch of kinds made of dots.
        transparent: draw no ground.
    """
    import matplotlib as mpl

    content = io.BytesIO()
    with mpl.rc_context(style):
        engine = drawing.get_layout_engine()
        if engine is not None:  # savefig would draw everything once more, only for the layout
            engine.execute(drawing)
            drawing.set_layout_engine("none")
        undated = {"Date": None} if kind == "svg" else None
        drawing.savefig(content, format=kind, dpi=dpi, transparent=transparent, metadata=undated)
    return content.getvalue()
