"""Pictures: one style, formats that other programs open, widths, and text that nothing covers."""

import csv
import io
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from picture_checks import overlaps
from rigs import one_line
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.colours import AXES, GREY, OWN, PALETTE, PAPER, RIVALS
from spherical_wrist.comparison.law_rows import columns_that_fit, law_rows, panel_widths, row_panels, rows_height
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.inspection.runs_picture import in_bins, runs_picture
from spherical_wrist.picture_axes import log_ticks, logarithmic, text_width, wrapped
from spherical_wrist.picture_file import PICTURES, check_ending, picture_bytes, picture_content
from spherical_wrist.picture_style import STYLE, WIDTHS, law_looks, width_inches
from spherical_wrist.plain_text import latex, latex_mathematics, literal
from spherical_wrist.result_table import Column, ResultTable, as_csv, as_latex, as_markdown, table_content

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
        assert "width" in one_line(error.value)


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


@pytest.mark.parametrize("width", WIDTHS.values())
def test_no_text_of_rows_of_laws_covers_data_or_other_text(width):
    statuses = {name: law.status for name, law in Law.members.items()} | {LONG: "user", "$a_b$ {x}": "rival"}
    rows = law_rows(statuses, width)
    titles = ["unknown_delay [ms]", "disturbance [%]", "worst tip error [µm]"]
    shares = [1.0] * columns_that_fit(rows, width, 0.6, 3)
    with mpl.rc_context(STYLE):
        made = Figure(figsize=(width, 0.1 + rows_height(rows, titles, width, shares)))
        for panel in row_panels(made, rows, titles, 0.1, shares):
            logarithmic(panel.xaxis, 2.3e-5, 4.1e3, panel_widths(rows, width, shares)[0])
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


# --- tables

TABLE = ResultTable(
    "100 % of #1",
    [Column("law", text=True), Column("tip_error", "µm"), Column("×")],
    [["my_law & co", 1.234e-5, None], ["b|c", 2.0, -3.5]],
    frozenset({(0, 1)}),
    ["a note"],
    frozenset({1}),
)


def test_a_table_as_latex():
    assert as_latex(TABLE).splitlines() == [
        "% 100 % of #1",
        "% a note",
        r"% In the preamble: \usepackage{booktabs}",
        r"\begin{tabular}{lrr}",
        r"\toprule",
        r"law & tip\_error & $\times$ \\",
        r" & [$\mu$m] &  \\",
        r"\midrule",
        r"my\_law \& co & \textbf{$1.23\times10^{-5}$} & --- \\",
        r"\textbf{b\textbar{}c} & 2 & $-$3.5 \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]


def test_a_table_as_markdown_and_csv():
    assert as_markdown(TABLE).splitlines() == [
        "**100 % of #1**", "", r"| law | tip_error \[µm\] | × |", "| --- | ---: | ---: |",
        "| my_law & co | **1.23e-05** | — |", r"| **b\|c** | 2 | -3.5 |", "", "a note",
    ]  # fmt: skip
    rows = list(csv.reader(io.StringIO(as_csv(TABLE))))
    assert rows == [["law", "tip_error [µm]", "×"], ["my_law & co", "1.234e-05", ""], ["b|c", "2.0", "-3.5"]]
    with pytest.raises(ParameterError, match=r"must end in .tex, .md or .csv"):
        table_content(TABLE, Path("a.txt"))


# --- runs over time


@pytest.fixture(scope="module")
def runs():
    quick = {"duration": 0.6, "steady_from": 0.3}
    laws = {"pd": "pd", "mine": {"name": "pd", "P": 0.5}}
    return {label: simulate(Experiment(law=law, **quick)) for label, law in laws.items()}


@pytest.mark.parametrize("width", WIDTHS.values())
def test_the_picture_of_runs_over_time(runs, width):
    made = runs_picture(runs, {"pd": "baseline", "mine": "user"}, width, bound=0.1)
    with mpl.rc_context(STYLE):
        assert [pair for pair in overlaps(made) if "a panel" not in pair] == []
    tip, attitude, torque = made.axes
    curves = {line.get_color(): line for line in tip.lines if len(line.get_xdata()) > 2}
    assert set(curves) == {OWN, RIVALS[0]}
    pd = runs["pd"]
    error = 1e3 * np.linalg.norm(pd.tip - pd.desired_tip, axis=1)
    drawn = curves[RIVALS[0]].get_ydata()
    squares = np.sqrt(np.mean(np.square(drawn[len(drawn) // 2 :])))
    assert squares == pytest.approx(np.sqrt(np.mean(np.square(error[len(error) // 2 :]))), rel=0.02)
    assert 0.1 in [line.get_ydata()[0] for line in tip.lines if line.get_linestyle() == "--"]
    assert [text.get_text() for text in made.legends[0].get_texts()] == ["pd", "mine", "bound"]
    assert len(attitude.lines) == len(torque.lines) == 2
    zoomed = runs_picture(runs, {"pd": "baseline", "mine": "user"}, width, window=(0.5, 0.55))
    assert len(zoomed.axes[0].lines[0].get_xdata()) == 50  # every row


def test_bins_keep_the_extremes_and_the_rms():
    time, values = np.arange(1000) * 1e-3, np.random.default_rng(1).normal(size=1000)
    edges = np.linspace(-5e-4, 0.9995, 11)
    middle, low, rms, high = in_bins(time, values, edges)
    assert middle == pytest.approx(np.arange(10) * 0.1 + 0.0495)
    pieces = values.reshape(10, 100)
    assert (low == pieces.min(axis=1)).all()
    assert (high == pieces.max(axis=1)).all()
    assert rms == pytest.approx(np.sqrt(np.mean(np.square(pieces), axis=1)))


def test_wrist_plot_draws_recordings_and_laws_in_one_figure(runs, wrist):
    record(runs["pd"], "a.rrd")
    Path("my.py").write_text(
        'from spherical_wrist.control import PD\n\nclass Mine(PD):\n    """A law."""\n', encoding="utf-8"
    )
    given = ["plot", "old=a.rrd", "a.rrd", "--law", "mine=my.py:Mine P=0.4", "--duration", "0.6"]
    code, out, err = wrist(*given, "-o", "e.pdf", "-o", "e.pgf", "--width", "one-column", "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert [run["label"] for run in told["runs"]] == ["old", "pd", "mine"]
    assert told["runs"][0]["metrics"] == dict(runs["pd"].metrics)
    assert Path("e.pdf").read_bytes().startswith(b"%PDF")
    assert "mine" in Path("e.pgf").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "a.pdf"], "there is nothing to draw"),
        (["--law", "pd", "-o", "a.jpg"], "must end in"),
        (["--law", "pd", "-o", "a.pdf", "--width", "2m"], "one-column, two-column"),
        (["--law", "pd", "-o", "a.pdf", "--from", "2", "--to", "1"], "before the end"),
        (["--law", "pd", "-o", "a.pdf", "--case", "frictoin"], "did you mean 'friction'"),
        (["none.rrd", "-o", "a.pdf"], "none.rrd"),
        (["e.toml", "-o", "a.pdf"], "laws with --law"),
        (["--law", "pd"], "wrist plot --law pd -o errors.pdf"),
    ],
)
def test_a_wrong_plot_is_one_line(wrist, arguments, said):
    code, out, err = wrist("plot", *arguments)
    assert (code, out) == (2, "")
    assert said in err
    assert not list(Path().iterdir())
