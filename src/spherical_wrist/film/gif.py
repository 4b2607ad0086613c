"""GIF: plays everywhere, without sound and in 255 colours, again and again."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from struct import pack
from typing import Self

import numpy as np
import numpy.typing as npt
from PIL import Image
from PIL.GifImagePlugin import getdata

from spherical_wrist.errors import ParameterError
from spherical_wrist.film.opengl import Picture

USUAL_FPS = 20.0

SHORTEST = 2
"""Least time of a frame [1/100 s]: what browsers take for a mistake below it, and show for 1/10 s instead."""

COLOURS, UNCHANGED = 255, 255
"""Colours of a film, and the index that stands for what is as in the frame before."""


def frame_rate(fps: float | None) -> Fraction:
    """The nearest rate that a GIF can have to so many frames a second: frames last a multiple of 1/100 s.

    Raises:
        ParameterError: browsers would not play it that fast.
    """
    hundredths = round(100.0 / (USUAL_FPS if fps is None else fps))
    if hundredths < SHORTEST:
        raise ParameterError(f"fps = {fps:g}: a GIF has at most {100 // SHORTEST} frames a second; write a .mp4")
    return Fraction(100, hundredths)


def check(size: tuple[int, int]) -> None:
    """Every size will do."""


class Gif:
    """Writes a film, picture by picture. A context manager; the file is complete once it is left.

    Of every picture but the first, only what changed is written.

    Args:
        path: file to write.
        rate: frames per second, one of :func:`frame_rate`.
        samples: pictures of the film, from which its colours are chosen.
    """

    def __init__(self, path: Path, rate: Fraction, samples: Sequence[Picture]) -> None:
        self._palette = palette(samples)
        self._colours = bytes(self._palette.getpalette() or ()).ljust(3 * 256, b"\0")
        self._before: npt.NDArray[np.uint8] | None = None
        self._milliseconds = int(1000 / rate)
        self._file = path.open("wb")

    def __enter__(self) -> Self:
        """The film itself."""
        return self

    def add(self, picture: Picture) -> None:
        """Adds a picture; the first one says how large all are."""
        now = np.asarray(Image.fromarray(picture).quantize(palette=self._palette, dither=Image.Dither.NONE))
        if self._before is None:
            self._begin(now)
            left, top, part = 0, 0, now
        else:
            changed = now != self._before
            left, top, box = _bounds(changed)
            part = np.where(changed[box], now[box], np.uint8(UNCHANGED))
        image = Image.fromarray(part)
        image.putpalette(self._colours)
        options = {"duration": self._milliseconds, "transparency": UNCHANGED, "disposal": 1, "interlace": 0}
        self._file.write(b"".join(getdata(image, (left, top), **options)))
        self._before = now

    def __exit__(self, failed: type[BaseException] | None, *_: object) -> None:
        """Ends the film."""
        with self._file:
            if failed is None:
                self._file.write(b";")

    def _begin(self, first: npt.NDArray[np.uint8]) -> None:
        """Size, colours, and that it plays for ever: what Pillow writes only once it has every picture in memory."""
        high, wide = first.shape
        self._file.write(b"GIF89a" + pack("<HHBBB", wide, high, 0b1111_0111, 0, 0))
        self._file.write(self._colours)
        self._file.write(b"!\xff\x0bNETSCAPE2.0" + pack("<BBHB", 3, 1, 0, 0))


def palette(samples: Sequence[Picture]) -> Image.Image:
    """A palette image for all pictures of a film.

    Half of the colours are chosen for the many pixels of the background, the other half for what is small and must be
    told from it, such as the trails: by colours that occur at all, however often.
    """
    pixels = np.concatenate([picture.reshape(-1, 3) for picture in samples])
    kinds = np.unique(pixels >> 2, axis=0) << 2
    chosen = [
        Image.fromarray(colours[None]).quantize(count, Image.Quantize.MEDIANCUT).getpalette() or []
        for colours, count in ((pixels, (COLOURS + 1) // 2), (kinds, COLOURS // 2))
    ]
    image = Image.new("P", (1, 1))
    image.putpalette([*chosen[0], *chosen[1]])
    return image


def _bounds(changed: npt.NDArray[np.bool_]) -> tuple[int, int, tuple[slice, slice]]:
    """The smallest box with all changes, at least a pixel: its left, its top, and its rows and columns."""
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    if not rows.size:
        return 0, 0, (slice(0, 1), slice(0, 1))
    return int(columns[0]), int(rows[0]), (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
