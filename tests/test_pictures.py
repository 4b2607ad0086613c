"""Pictures: one style, formats that other programs open, widths, and text that nothing covers."""

import io
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from itertools import combinations, pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from rigs import one_line
from spherical_wrist.colours import AXES, GREY, OWN, PALETTE, PAPER, RIVALS
from spherical_wrist.comparison.law_rows import columns_that_fit, law_rows, panel_width, row_panels, rows_height
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.picture_axes import log_ticks, logarithmic, text_width, wrapped
from spherical_wrist.picture_file import PICTURES, check_ending, picture_bytes, picture_content
from spherical_wrist.picture_style import STYLE, WIDTHS, law_looks, width_inches
from spherical_wrist.plain_text import latex, latex_mathematics, literal

NAME = r"my_law K=50% {a} #1 & $x$ ~ \ ^ τ²"


def drawing():
    with mpl.rc_context(STYLE):
        made = Figure(figsize=(3.5, 2.0), layout="constrained")
        panel = made.subplots()
        panel.semilogy([1, 2], [1e-3, -1.0], label=literal(NAME))
        panel.set(xlabel="time [µs]", ylabel=r"$\tau_x$ [N·m]", title=literal(NAME))
    return made


# --- formats


def test_pictures_are_the_same_whenever_they_are_made():
    for ending in (".svg", ".pdf", ".pgf"):
        content = picture_content(drawing(), Path("a" + ending.upper()))
        assert content == picture_content(drawing(), Path("b" + ending))
    assert imread(io.BytesIO(picture_bytes(drawing(), "png"))).shape[:2] == (600, 1050)  # 300 dots an inch


def test_text_of_an_svg_is_text():
    root = ET.fromstring(picture_bytes(drawing(), "svg"))
    texts = {"".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")}
    assert NAME in texts
    assert "time [µs]" in texts


def test_fonts_of_a_pdf_are_embedded_as_truetype():
    content = picture_bytes(drawing(), "pdf")
    assert content.startswith(b"%PDF-1.")
    assert content.rstrip().endswith(b"%%EOF")
    assert b"/FontFile2" in content  # a TrueType program is in the file
    assert set(re.findall(rb"/Subtype /(Type\w+|CIDFont\w+)", content)) == {b"Type0", b"CIDFontType2"}


def test_a_pgf_picture_is_balanced_and_escaped():
    code = picture_bytes(drawing(), "pgf").decode()
    assert code.count(r"\begin{pgfscope}") == code.count(r"\end{pgfscope}") > 10
    assert (
        r"my\_law K=50\% \{a\} \#1 \& \$x\$ \textasciitilde{} \textbackslash{} \textasciicircum{} $\tau$$^{2}$" in code
    )
    assert r"$\tau_x$ [N$\cdot$m]" in code
    assert "/home" not in code
    assert not re.search(r"[^\x00-\x7f]", code)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
def test_latex_takes_a_pgf_picture(tmp_path):
    (tmp_path / "a.pgf").write_bytes(picture_bytes(drawing(), "pgf"))
    (tmp_path / "a.tex").write_text(
        "\\documentclass{article}\\usepackage{pgf}\\begin{document}\\input{a.pgf}\\end{document}"
    )
    subprocess.run(["pdflatex", "-halt-on-error", "a.tex"], cwd=tmp_path, check=True, capture_output=True)


def test_an_image_cannot_be_pgf():
    with mpl.rc_context(STYLE):
        made = Figure()
        made.subplots().imshow([[0.0, 1.0]])
    with pytest.raises(ParameterError) as error:
        picture_bytes(made, "pgf")
    assert "choose PDF" in one_line(error.value)
    with pytest.raises(ParameterError, match=r"must end in .png, .svg, .pdf or .pgf"):
        check_ending(Path("a.jpg"), "picture", PICTURES)


def test_latex_of_text():
    assert latex("a_b-c--d 1e-3") == r"a\_b-c-{}-d 1e-3"
    assert latex("tip [µm] × 2, 10⁻³") == r"tip [$\mu$m] $\times$ 2, 10$^{-3}$"
    assert latex("\x1b[0m é") == "?[0m é"
    assert latex_mathematics(r"$τ_x$ 50 % \$") == r"${\tau}_x$ 50 \% \$"


# --- widths and colours


def test_widths():
    assert width_inches("one-column") == WIDTHS["one-column"] == 3.5
    assert width_inches("88mm") == pytest.approx(3.46457, rel=1e-5)
    assert width_inches("12.7 cm") == pytest.approx(5.0)
    assert width_inches("252pt") == pytest.approx(3.487, rel=1e-3)
    for wrong in ("", "88", "mm", "-3in", "1in", "3m", "1e1in", "nan in"):
        with pytest.raises(ParameterError) as error:
            width_inches(wrong)
        assert "--width" in one_line(error.value)


def test_ones_own_laws_have_the_accent_and_the_papers_its_colour():
    statuses = {name: law.status for name, law in Law.members.items()}
    looks = law_looks(statuses)
    assert {name for name, look in looks.items() if look.accented} == {n for n, s in statuses.items() if s == "ours"}
    assert {name for name, look in looks.items() if look.colour == PAPER} == {
        name for name, status in statuses.items() if status == "paper"
    }
    assert {look.colour for look in looks.values()} == {OWN, PAPER, GREY}
    mine = law_looks({"mine": "user", "theirs": "rival", "ours": "ours"}, lines=True)
    assert [look.colour for look in mine.values()] == [OWN, *RIVALS[:2]]
    assert mine["mine"].accented
    two = law_looks({"a": "user", "b": "user"})
    assert two["a"].dash != two["b"].dash


@pytest.mark.parametrize("colours", [AXES, PALETTE, (OWN, *RIVALS), (OWN, PAPER)])
def test_colours_are_told_apart_without_red_or_green(colours):
    """Viénot, Brettel and Mollon (1999): the colours as people without one kind of cones see them, in linear RGB."""
    missing = {
        "red": np.array([[0.1124, 0.8876, 0.0], [0.1124, 0.8876, 0.0], [0.004, -0.004, 1.0]]),
        "green": np.array([[0.2929, 0.7071, 0.0], [0.2929, 0.7071, 0.0], [-0.0223, 0.0223, 1.0]]),
    }
    linear = np.array([to_rgb(colour) for colour in colours]) ** 2.2
    for matrix in missing.values():
        seen = np.clip(linear @ matrix.T, 0.0, 1.0) ** (1.0 / 2.2)
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=2)[np.triu_indices(len(colours), 1)]
        assert apart.min() > 0.12


# --- rows of laws

LONG = "adaptive_fuzzy_sliding_computed_torque Kp=[400, 400, 400] Kv=[40, 40, 40] prediction=false"


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


@pytest.mark.parametrize("width", WIDTHS.values())
def test_no_text_of_rows_of_laws_covers_data_or_other_text(width):
    statuses = {name: law.status for name, law in Law.members.items()} | {LONG: "user", "$a_b$ {x}": "rival"}
    rows = law_rows(statuses, width)
    titles = ["unknown_delay [ms]", "disturbance [%]", "worst tip error [µm]"]
    columns = columns_that_fit(rows, width, 0.6, 3)
    with mpl.rc_context(STYLE):
        made = Figure(figsize=(width, 0.1 + rows_height(rows, titles, width, columns)))
        for panel in row_panels(made, rows, titles, 0.1, columns):
            logarithmic(panel.xaxis, 2.3e-5, 4.1e3, panel_width(rows, width, columns))
        assert overlaps(made) == []
    drawn = [text.get_text() for text in made.axes[0].get_yticklabels()]
    assert [text.replace("\n", "").replace(" ", "") for text in drawn] == [
        literal(label).replace(" ", "") for label in statuses
    ]
    assert (max(text.count("\n") for text in drawn) >= 2) == (width < 5.0)


@given(st.floats(1e-9, 1e6), st.floats(1.02, 1e12), st.floats(0.3, 6.0))
@settings(max_examples=60)
def test_numbers_at_a_logarithmic_axis_are_round_inside_and_apart(low, ratio, length):
    high = low * ratio
    ticks = log_ticks(low, high, length)
    assert ticks == sorted(ticks)
    assert all(low * 0.999999 <= tick <= high * 1.000001 for tick in ticks)
    assert all(len(f"{tick:.3e}".partition("e")[0].rstrip("0").replace(".", "")) <= 2 for tick in ticks)
    places = [length * np.log10(tick / low) / np.log10(ratio) for tick in ticks]
    assert all(b - a > 0.1 for a, b in pairwise(places))
    if ratio > 1e3 and length > 1.0:
        assert len(ticks) >= 2


def test_long_text_is_broken_and_nothing_is_lost():
    for room in (0.3, 0.8, 1.5):
        lines = wrapped(LONG, 7.0, room)
        assert "".join(lines).replace(" ", "") == LONG.replace(" ", "")
        assert all(text_width(line, 7.0) <= room for line in lines)
    assert wrapped("pd", 7.0, 1.0) == ["pd"]
