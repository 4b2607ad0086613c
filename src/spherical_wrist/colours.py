"""Colours that mean the same in every view: viewer, pictures and pages."""

from collections.abc import Sequence

BLACK, ORANGE, SKY, GREEN = "#000000", "#e69f00", "#56b4e9", "#009e73"
YELLOW, BLUE, VERMILION, PURPLE = "#f0e442", "#0072b2", "#d55e00", "#cc79a7"
"""The eight colours that Okabe and Ito chose for every kind of colour vision."""

AXES = (VERMILION, GREEN, BLUE)
"""Of x, y and z."""
PALETTE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
"""Of curves that are not x, y and z."""
SIZES = (BLACK, ORANGE, SKY, PURPLE, YELLOW)
"""Of curves that must not be taken for x, y or z, such as the lengths of vectors."""
OWN, PAPER = VERMILION, BLUE
"""Of one's own law, and of the source paper's."""
RIVALS = (BLACK, GREEN, PURPLE, SKY, ORANGE)
"""Of the lines of other laws, if there are no more of them."""
ACTUAL, DESIRED = "#ff8c1e", "#28c882"
"""Of the tool tip's path and of the desired attitude in scenes: films, and the viewer."""
INK, GREY, PALE = "#222222", "#7f7f7f", "#bfbfbf"
"""Of text, of what is in the background, and of what is behind that."""


def of_components(names: Sequence[str]) -> list[str]:
    """Return the colours of curves by their names: those of the axes for "x" or "x 0", or those of the palette.

    Empty if there are more than the palette has.
    """
    axes = dict(zip("wxyz", (GREY, *AXES), strict=True))
    firsts = [name.partition(" ")[0] for name in names]
    if all(first in axes for first in firsts):
        return [axes[first] for first in firsts]
    return list(PALETTE[: len(names)]) if len(names) <= len(PALETTE) else []


def rgb(colour: str) -> tuple[int, int, int]:
    """Convert a colour such as ``#d55e00`` to red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
