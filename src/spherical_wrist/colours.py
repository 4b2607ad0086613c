"""Colours that mean the same in every view: viewer, pictures and pages."""

AXES = ("#d55e00", "#009e73", "#0072b2")
"""Of x, y and z: three of the colours that Okabe and Ito chose for every kind of colour vision."""

PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of curves that are not x, y and z, from the same source."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Convert a colour such as ``#d55e00`` to red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
