"""Sketches in place of the pictures of commands, for tests about what becomes of their files; others draw them."""

import io
from functools import cache

import numpy as np
from matplotlib.figure import Figure

_save = Figure.savefig


@cache
def sketch(kind):
    """A picture of noise, as bytes: quicker to draw than those of the commands, and as long."""
    drawing = Figure()
    drawing.add_subplot().plot(np.random.default_rng(0).normal(size=(500, 3)))
    content = io.BytesIO()
    _save(drawing, content, format=kind)
    return content.getvalue()


def sketched(drawing, target, **options):
    """In place of ``Figure.savefig`` into memory, whose bytes the command then writes."""
    target.write(sketch(options["format"])) if isinstance(target, io.BytesIO) else _save(drawing, target, **options)
