"""Captions of pictures: a title, a legend, the time and the tip error."""

from math import floor, log10
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw
from PIL.ImageFont import FreeTypeFont, truetype

from spherical_wrist.film.opengl import Picture

Colour = tuple[int, int, int]

BACK, TEXT, DIM = (24, 28, 35, 205), (255, 255, 255, 255), (178, 186, 198, 255)
EM, LEAST_EM = 1.0 / 38.0, 11.0
"""Size of the text in heights of the picture (of 16:9, if it is narrower), and its minimum in pixels."""

SMOOTH = 4
"""Factor of supersampling of corners and dots."""


class Style(NamedTuple):
    """Parts of a caption that stay the same.

    Attributes:
        title: upper line.
        subtitle: line below it.
        legend: names and colours.
        speed: of the film; shown unless it is 1.
        largest_error: largest tip error shown [m], which sets the decimals.
        time_decimals: decimals of the time.
    """

    title: str
    subtitle: str
    legend: tuple[tuple[str, Colour], ...]
    speed: float
    largest_error: float
    time_decimals: int = 2


class Caption:
    """Writes on pictures of one size, into the lower left corner.

    Args:
        size: width and height of the pictures [px].
        style: the parts that stay the same.
    """

    def __init__(self, size: tuple[int, int], style: Style) -> None:
        self._style = style
        em = max(LEAST_EM, EM * min(size[1], size[0] * 9 / 16))
        self._pad = pad = round(0.8 * em)
        fixed = [("speed", f"× {style.speed:g}")] if style.speed != 1.0 else []
        room = size[0] - 4 * pad
        bold, plain = _font("DejaVuSans-Bold", em, style.title, room), _font("DejaVuSans", 0.85 * em, "", room)
        self._figures = figures = _font("DejaVuSans", 0.95 * em)
        self._step = round(1.5 * em)
        legend = _legend(style.legend, plain, em)
        wanted = (bold.getlength(style.title), plain.getlength(style.subtitle), legend.width, 13 * em)
        width = min(round(max(wanted)), room) + 2 * pad
        self._rows = pad + 2 * self._step + round(0.3 * em)  # where the figures begin
        end = self._rows + (2 + len(fixed)) * self._step + round(0.3 * em)
        panel = _rounded((width, end + legend.height + pad), pad)
        draw = ImageDraw.Draw(panel)
        draw.text((pad, pad), style.title, font=bold, fill=TEXT)
        draw.text((pad, pad + self._step), style.subtitle, font=plain, fill=DIM)
        for row, name in enumerate(("time", "tip error", *(name for name, _ in fixed))):
            draw.text((pad, self._rows + row * self._step), name, font=figures, fill=DIM)
        self._panel = panel
        for row, (_, value) in enumerate(fixed, 2):
            self._figure(draw, row, value)
        panel.alpha_composite(legend, (pad, end))
        self._place = (slice(size[1] - pad - panel.height, size[1] - pad), slice(pad, pad + width))

    def write(self, picture: Picture, time: float, error: float) -> None:
        """Write the caption into a picture, in place.

        Args:
            picture: of the caption's size.
            time: simulated [s].
            error: of the tool tip [m].
        """
        panel = self._panel.copy()
        draw = ImageDraw.Draw(panel)
        self._figure(draw, 0, f"{time:.{self._style.time_decimals}f} s")
        self._figure(draw, 1, in_mm(error, self._style.largest_error))
        place = picture[self._place]
        drawn = np.asarray(panel, dtype=np.uint16)[-place.shape[0] :, : place.shape[1]]
        opacity = drawn[..., 3:]
        place[:] = (drawn[..., :3] * opacity + place * (255 - opacity) + 127) // 255

    def _figure(self, draw: ImageDraw.ImageDraw, row: int, text: str) -> None:
        right = self._panel.width - self._pad
        draw.text((right, self._rows + row * self._step), text, font=self._figures, fill=TEXT, anchor="ra")


def in_mm(distance: float, largest: float) -> str:
    """Format a distance [m] in mm, with the decimals that give the largest one three digits: figures do not jump."""
    decimals = 2 - floor(log10(1e3 * largest)) if largest > 0.0 else 2
    return f"{1e3 * distance:.{min(max(decimals, 0), 9)}f} mm"


def _font(name: str, size: float, text: str = "", room: float = 0.0) -> FreeTypeFont:
    """Load a font that comes with Matplotlib, of a size [px] or smaller so that a text fits into the room [px]."""
    file = Path(mpl.get_data_path()) / "fonts" / "ttf" / f"{name}.ttf"
    font = truetype(file, size)
    length = font.getlength(text)
    return font if length <= room or not text else truetype(file, size * room / length)


def _rounded(size: tuple[int, int], radius: float) -> Image.Image:
    wide, high = size[0] * SMOOTH, size[1] * SMOOTH
    mask = Image.new("L", (wide, high))
    ImageDraw.Draw(mask).rounded_rectangle((0, 0, wide - 1, high - 1), 0.6 * radius * SMOOTH, fill=BACK[3])
    panel = Image.new("RGBA", size, BACK[:3])
    panel.putalpha(mask.resize(size, Image.Resampling.BOX))
    return panel


def _legend(entries: tuple[tuple[str, Colour], ...], font: FreeTypeFont, em: float) -> Image.Image:
    """Draw a dot and a name for every entry, in a row."""
    dot, gap = round(0.55 * em), round(0.45 * em)
    widths = [dot + gap + round(font.getlength(name)) + round(1.2 * em) for name, _ in entries]
    row = Image.new("RGBA", (max(1, sum(widths)), round(1.1 * em)))
    left = 0
    for (name, rgb), width in zip(entries, widths, strict=True):
        mask = Image.new("L", (dot * SMOOTH, dot * SMOOTH))
        ImageDraw.Draw(mask).ellipse((0, 0, dot * SMOOTH - 1, dot * SMOOTH - 1), fill=255)
        middle = row.height // 2
        row.paste(rgb, (left, middle - dot // 2), mask.resize((dot, dot), Image.Resampling.BOX))
        ImageDraw.Draw(row).text((left + dot + gap, middle), name, font=font, fill=DIM, anchor="lm")
        left += width
    return row
