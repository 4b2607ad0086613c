"""Style of every picture: fonts, sizes, widths, and the looks of laws. Matplotlib is not imported here."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from spherical_wrist.colours import GREY, INK, OWN, PAPER, RIVALS
from spherical_wrist.errors import ParameterError

WIDTHS = {"one-column": 3.5, "two-column": 7.16}
"""Widths of a picture in a journal of two columns (IEEE) by name [in]."""
INCHES = {"in": 1.0, "mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "pt": 1.0 / 72.27}
NARROWEST, WIDEST = 2.5, 20.0
"""Limits of the width of a picture [in]."""
FOR_ONE_COLUMN = 5.0
"""Width [in] below which panels stand below each other."""

TEXT, SMALL, LARGE = 8.0, 7.0, 9.0
"""Sizes of text, of labels at ticks and in legends, and of a title above all panels [pt]."""
STYLE: Any = {
    "font.family": ["DejaVu Sans"],  # comes with Matplotlib, so that pictures are the same on every machine
    "font.size": TEXT,
    "axes.titlesize": TEXT,
    "axes.labelsize": TEXT,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "figure.titlesize": LARGE,
    "figure.titleweight": "bold",
    "axes.axisbelow": True,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "axes.grid": True,
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "ytick.alignment": "center",
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "spherical-wrist",
    "pdf.fonttype": 42,  # TrueType, which publishers ask for
    "pgf.rcfonts": False,  # the fonts of the document
    "text.hinting": "no_hinting",  # or texts have other widths at other resolutions
    "agg.path.chunksize": 20000,
}
"""Settings of Matplotlib (rcParams) for all pictures."""


class LawLook(NamedTuple):
    """Look of a law.

    Attributes:
        colour: colour of its line and marker.
        dash: line style.
        weight: width of its line [pt].
        order: drawing order; larger ones are in front.
        accented: True for one's own laws.
        named: True if its name is written in its colour.
    """

    colour: str
    dash: Any
    weight: float
    order: int
    accented: bool = False
    named: bool = False

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of Matplotlib for a line."""
        return {"color": self.colour, "linestyle": self.dash, "linewidth": self.weight, "zorder": self.order}


def law_looks(statuses: Mapping[str, str], *, lines: bool = False, many: bool = False) -> dict[str, LawLook]:
    """Return the looks of laws by label: one's own in the accent, the paper's in another colour, the others in grey.

    Args:
        statuses: status of each law (:data:`~spherical_wrist.control.contract.LawStatus`), keyed by label.
        lines: True if lines have to be told apart: then a few other laws have colours too.
        many: True if many others have to be told apart too: by colours and dashes.
    """
    own = own_laws(statuses)
    others = [label for label, status in statuses.items() if label not in own and status != "paper"]
    colours = RIVALS if many or (lines and len(others) <= len(RIVALS)) else (GREY,)
    dashes = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (5, 1.5, 1, 1.5)))
    seen = dict.fromkeys(("own", "paper", "other"), 0)
    looks = {}
    for label, status in statuses.items():
        kind = "own" if label in own else "paper" if status == "paper" else "other"
        place, seen[kind] = seen[kind], seen[kind] + 1
        if kind == "other":
            pale = len(colours) == 1
            dash = dashes[place // len(colours) % len(dashes)] if many else "-"
            looks[label] = LawLook(colours[place % len(colours)], dash, 0.7 if pale else 1.0, 2)
        else:
            dash = dashes[place % len(dashes)]
            own_look = LawLook(OWN, dash, 1.6, 5, accented=True, named=True)
            looks[label] = own_look if kind == "own" else LawLook(PAPER, dash, 1.3, 4, named=True)
    return looks


def own_laws(statuses: Mapping[str, str]) -> frozenset[str]:
    """Return the labels of one's own laws: the user's; where there are none, this project's."""
    own = "user" if "user" in statuses.values() else "ours"
    return frozenset(label for label, status in statuses.items() if status == own)


def width_inches(given: str | float) -> float:
    """Read the width of a picture: ``one-column``, ``two-column``, or a length such as ``88mm`` or ``3.5in``.

    Args:
        given: the text; or the width itself [in].

    Raises:
        ParameterError: it is none of these, or too small or large for a picture.
    """
    if isinstance(given, str):
        if given in WIDTHS:
            return WIDTHS[given]
        found = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*(in|mm|cm|pt)", given.strip(), re.ASCII)
        if found is None:
            raise ParameterError(
                f"width {given!r}: {', '.join(WIDTHS)}, or a length in {', '.join(INCHES)} is needed, such as 88mm"
            )
        width = float(found[1]) * INCHES[found[2]]
    else:
        width = float(given)
    if not NARROWEST <= width <= WIDEST:
        raise ParameterError(f"width {given!r}: a picture is {NARROWEST:g}in to {WIDEST:g}in wide")
    return width
