"""Pictures: one style, formats that other programs open, widths, and text that nothing covers."""

import io
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from rigs import one_line
from spherical_wrist.colours import AXES, GREY, OWN, PALETTE, PAPER, RIVALS
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
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


def test_every_format_is_what_its_ending_says_and_the_same_whenever_it_is_made():
    for ending in PICTURES:
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
