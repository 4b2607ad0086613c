"""GIF: plays everywhere, without sound and in 255 colours, again and again."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import chain, product
from pathlib import Path

import numpy as np
from PIL import Image

from spherical_wrist.errors import ParameterError
from spherical_wrist.film.opengl import Picture

USUAL_FPS = 20.0

SHORTEST = 2
"""Shortest time of a frame [1/100 s]: browsers take less for a mistake, and show the frame for 1/10 s instead."""

COLOURS, UNCHANGED = 255, 255
"""Number of colours of a film, and index in the palette that stands for a pixel that is as in the frame before."""

SAMPLES = 8
"""Number of pictures that the colours are chosen from."""


def frame_rate(fps: float | None) -> Fraction:
    """Return the nearest frame rate that a GIF can have: frames last a multiple of 1/100 s.

    Raises:
        ParameterError: browsers would not play it that fast.
    """
    hundredths = round(100.0 / (USUAL_FPS if fps is None else fps))
    if hundredths < SHORTEST:
        raise ParameterError(f"fps = {fps:g}: a GIF has at most {100 // SHORTEST} frames a second; write a .mp4")
    return Fraction(100, hundredths)


def check(size: tuple[int, int]) -> None:
    """Accept every size."""


def write(path: Path, size: tuple[int, int], rate: Fraction, count: int, picture: Callable[[int], Picture]) -> None:
    """Write a film. Of every frame but the first, only the changes are written; an equal one prolongs the last.

    Pillow keeps a byte for each pixel of each frame in memory until the last one is there.

    Args:
        path: file to write.
        size: of the pictures, which say it themselves.
        rate: frames per second, one of :func:`frame_rate`.
        count: number of frames.
        picture: renders a frame by its number.
    """
    chosen = np.linspace(0, count - 1, min(SAMPLES, count)).round().astype(int)
    kept = {int(number): picture(int(number)) for number in chosen}  # rendering takes the time
    colours = palette([kept[int(number)] for number in chosen])
    reference = _indexed(colours)
    table = _completed(colours)

    def frame(number: int) -> Image.Image:
        pixels = kept.pop(number) if number in kept else picture(number)
        indexed = Image.fromarray(pixels).quantize(palette=reference, dither=Image.Dither.NONE)
        indexed.putpalette(table)
        return indexed

    options = {"duration": int(1000 / rate), "loop": 0, "transparency": UNCHANGED, "optimize": True, "disposal": 1}
    rest = (frame(number) for number in range(1, count))
    frame(0).save(path, "gif", save_all=True, append_images=rest, palette=table, interlace=0, **options)


def palette(samples: Sequence[Picture]) -> list[tuple[int, ...]]:
    """Choose the colours of a film from some of its pictures: red, green and blue, all different.

    Half of the colours are chosen for the many pixels of the background, the other half for what is small and must be
    told from it, such as the trails: by colours that occur at all, however often.
    """
    pixels = np.concatenate([picture.reshape(-1, 3) for picture in samples])
    kinds = np.unique(pixels >> 2, axis=0) << 2
    halves = ((pixels, (COLOURS + 1) // 2), (kinds, COLOURS // 2))
    flat = (Image.fromarray(each[None]).quantize(n, Image.Quantize.MEDIANCUT).getpalette() or [] for each, n in halves)
    values = list(chain.from_iterable(flat))
    return list(dict.fromkeys(zip(values[::3], values[1::3], values[2::3], strict=True)))


def _indexed(colours: Sequence[tuple[int, ...]]) -> Image.Image:
    image = Image.new("P", (1, 1))
    image.putpalette(list(chain.from_iterable(colours)))
    return image


def _completed(colours: Sequence[tuple[int, ...]]) -> bytes:
    """Return the palette with 256 different colours: Pillow finds the indices of frames by their colours."""
    known = set(colours)
    unused = (each for each in product(range(256), repeat=3) if each not in known)
    spare = [next(unused) for _ in range(COLOURS + 1 - len(colours))]
    return bytes(chain.from_iterable([*colours, *spare]))
