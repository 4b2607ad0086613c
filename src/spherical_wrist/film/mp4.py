"""MP4: H.264, as every browser and player takes it."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from spherical_wrist.errors import ParameterError
from spherical_wrist.film.errors import FilmError
from spherical_wrist.film.opengl import Picture
from spherical_wrist.missing_package import installing

USUAL_FPS = 30.0

QUALITY = {"crf": "18", "preset": "medium"}
"""x264's own scale: 18 can hardly be told from the original."""

THREADS = 4
"""A fixed number, because the output of x264 depends on it: the same pictures give the same file on every machine."""

BT709, LIMITED = 1, 1
"""Numbers of ITU-T H.273 for the colours of high definition, and of FFmpeg for the range of video."""


def frame_rate(fps: float | None) -> Fraction:
    """Return the requested frame rate as a fraction."""
    return Fraction(USUAL_FPS if fps is None else fps).limit_denominator(1001)


def check(size: tuple[int, int]) -> None:
    """Check that such a film can be made here.

    Raises:
        ParameterError: H.264 does not take pictures of that size.
        FilmError: PyAV is not installed.
    """
    wide, high = size
    if wide % 2 or high % 2:
        even = f"{wide + wide % 2}x{high + high % 2}"
        raise ParameterError(f"size {wide}x{high}: width and height must be even for MP4 (H.264); try {even}")
    _av()


def write(path: Path, size: tuple[int, int], rate: Fraction, count: int, picture: Callable[[int], Picture]) -> None:
    """Write a film picture by picture, so that long films take no more memory than short ones.

    Args:
        path: file to write.
        size: width and height of the pictures [px], even.
        rate: frames per second.
        count: number of frames.
        picture: renders a frame by its number.
    """
    av = _av()
    # the index comes first, so that a film plays while it is loaded; nothing in the file says when it was made
    options = {"movflags": "+faststart", "fflags": "+bitexact"}
    with av.open(str(path), "w", format="mp4", options=options) as container:
        stream = container.add_stream("libx264", rate=rate, options=QUALITY)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.thread_count = THREADS
        context.color_primaries = context.color_trc = context.colorspace = BT709
        context.color_range = LIMITED
        for number in range(count):
            frame = av.VideoFrame.from_ndarray(picture(number), format="rgb24")
            container.mux(stream.encode(frame.reformat(format="yuv420p", dst_colorspace=BT709)))
        container.mux(stream.encode(None))


def _av() -> Any:
    try:
        import av
    except ImportError:
        raise FilmError(f"MP4 needs PyAV, which is not installed: {installing('video')}, or write a .gif") from None
    return av
