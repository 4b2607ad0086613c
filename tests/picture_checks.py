"""Checks of pictures that several tests share."""

from itertools import combinations

from matplotlib.backends.backend_agg import FigureCanvasAgg


def overlaps(made):
    """Return the texts of a picture that reach into a panel that is not theirs, into each other, or beyond the edge."""
    made.draw_without_rendering()
    renderer = FigureCanvasAgg(made).get_renderer()
    panels = [panel.get_window_extent(renderer) for panel in made.axes]
    names, words = [], []
    for panel in made.axes:
        names += [text for text in panel.get_yticklabels() if text.get_text()]
        words += [panel.title, panel.xaxis.label, *panel.get_xticklabels()]
    words += [text for legend in made.legends for text in legend.get_texts()]
    boxes = {text: text.get_window_extent(renderer) for text in (*names, *words) if text.get_text()}
    whole = made.get_window_extent(renderer)
    found = [
        (text.get_text(), "a panel")
        for text, box in boxes.items()
        for panel in panels
        if box.shrunk(0.98, 0.9).overlaps(panel)
    ]
    found += [
        (a.get_text(), b.get_text())
        for (a, first), (b, second) in combinations(boxes.items(), 2)
        if first.shrunk(0.98, 0.9).overlaps(second.shrunk(0.98, 0.9))
    ]
    found += [
        (text.get_text(), "the edge")
        for text, box in boxes.items()
        if box.x0 < whole.x0 or box.x1 > whole.x1 or box.y0 < whole.y0 or box.y1 > whole.y1
    ]
    return found
