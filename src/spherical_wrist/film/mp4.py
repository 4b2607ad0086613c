"""MP4: H.264, as every browser and player takes it."""

from fractions import Fraction
from pathlib import Path
from typing import Any, Self

from spherical_wrist.errors import ParameterError
from spherical_wrist.film.errors import FilmError
from spherical_wrist.film.opengl import Picture

USUAL_FPS = 30.0

QUALITY = {"crf": "18", "preset": "medium"}
"""x264's own scale, on which 18 is hardly to be told from the original."""

THREADS = 4
"""A fixed number, for what x264 writes depends on it: so the same pictures give the same file on every machine."""

BT709, LIMITED = 1, 1
"""ITU-T H.273's numbers for the colours of high definition, and FFmpeg's for the range of video."""


def frame_rate(fps: float | None) -> Fraction:
    """The rate of a film that is to have so many frames a second: the same, as a fraction."""
    return Fraction(USUAL_FPS if fps is None else fps).limit_denominator(1001)


def check(size: tuple[int, int]) -> None:
    """Makes sure that such a film can be made here.

    Raises:
        ParameterError: H.264 does not take pictures of that size.
        FilmError: PyAV is not there.
    """
    wide, high = size
    if wide % 2 or high % 2:
        even = f"{wide + wide % 2}x{high + high % 2}"
        raise ParameterError(f"size {wide}x{high}: width and height must be even for MP4 (H.264); try {even}")
    _av()


class Mp4:
    """Writes a film, picture by picture. A context manager; the file is complete once it is left.

    Args:
        path: file to write.
        size: width and height of the pictures [px], even.
        rate: frames per second.
    """

    def __init__(self, path: Path, size: tuple[int, int], rate: Fraction) -> None:
        av = _av()
        # the index comes first, so that a film plays while it is loaded; nothing in the file says when it was made
        options = {"movflags": "+faststart", "fflags": "+bitexact"}
        self._container = av.open(str(path), "w", format="mp4", options=options)
        self._stream = self._container.add_stream("libx264", rate=rate, options=QUALITY)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.thread_count = THREADS
        context.color_primaries = context.color_trc = context.colorspace = BT709
        context.color_range = LIMITED
        self._frame = av.VideoFrame.from_ndarray

    def __enter__(self) -> Self:
        """The film itself."""
        return self

    def add(self, picture: Picture) -> None:
        """Adds a picture."""
        frame = self._frame(picture, format="rgb24").reformat(format="yuv420p", dst_colorspace=BT709)
        self._container.mux(self._stream.encode(frame))

    def __exit__(self, failed: type[BaseException] | None, *_: object) -> None:
        """Ends the film."""
        try:
            if failed is None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()


def _av() -> Any:
    try:
        import av
    except ImportError:
        raise FilmError(
            "MP4 needs PyAV, which is not installed: pip install 'spherical-wrist[video]', or write a .gif"
        ) from None
    return av
