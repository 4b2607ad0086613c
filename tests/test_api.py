"""Python as people use it: `import spherical_wrist as sw`, one calling style, and results in tables and pictures."""

import ast
import base64
import io
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from pyarrow import csv, parquet

import spherical_wrist as sw
from rigs import bits, one_line
from sampling import some
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.comparison.cases import DEFAULT
from spherical_wrist.comparison.compare import compare as compare_laws
from spherical_wrist.control import PD
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.values import Conditions, ExperimentValues
from spherical_wrist.inspection.columns import columns
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.missing_package import installing
from spherical_wrist.picture_file import PICTURES
from spherical_wrist.reference import Lissajous

SOURCE = Path(sw.__file__)
SHORT = {"duration": 0.2}
TOML = 'law = { name = "pd", P = 0.2 }\nhardware = "realistic"\nduration = 0.2\nsensing.delay = 0.002\n'


class Stiff(sw.Law):
    """A law of this file."""

    stiffness: float = 0.3

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.stiffness * signal.error[i] + 0.02 * signal.rate_error[i] + signal.N[i]


@pytest.fixture(scope="module")
def run():
    return sw.simulate("pd", **SHORT)


@pytest.fixture(scope="module")
def comparison():
    return sw.compare(["pd", Stiff], cases=["constant-heavy", "realistic"], seeds=2, **SHORT)


@pytest.fixture(scope="module")
def frontier():
    return sw.frontier(["pd", "slotine_li"], axes=["heavier", "delay"], tolerance=0.5, **SHORT)


@pytest.fixture(scope="module")
def margins():
    return sw.margins(["slotine_li", "pd"], ranges=False)


@pytest.fixture(scope="module")
def campaign():
    vary = {"mass_scale": {"uniform": [0.5, 1.5]}, "payload": [0.0, 0.01]}
    return sw.sweep(["pd", PD(P=0.3)], vary=vary, samples=4, seed=3, **SHORT)


@pytest.fixture(params=some(["run", "comparison", "frontier", "margins", "campaign"], 2))
def result(request):
    return request.getfixturevalue(request.param)


# --- the package ------------------------------------------------------------------------------------------------------


def test_the_three_lists_of_names_are_one():
    """Type checkers need imports and a literal list; what runs is a table."""
    tree = ast.parse(SOURCE.read_text())
    (typed,) = (node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    imported = {
        alias.name: node.module.removeprefix("spherical_wrist.")
        for node in typed.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert imported == sw._HOMES
    assert sorted(sw.__all__) == sorted([*imported, "__version__"]) == sorted(dir(sw))
    for name in sw.__all__:
        assert getattr(sw, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = sw.simulat


def test_the_functions_stay_functions_when_the_rooms_are_imported(margins):
    """A room of the same name would take the place of a function in the package."""
    for name in ("simulate", "compare", "margins", "sweep", "frontier", "record", "load_recording"):
        assert callable(getattr(sw, name)), name
        assert not (SOURCE.parent / name).exists(), name
        assert not (SOURCE.parent / f"{name}.py").exists(), name


def test_importing_is_quick_and_the_module_is_the_command():
    code = (
        "import sys, spherical_wrist\n"
        "assert {name for name in sys.modules if name.startswith('spherical_wrist')} == {'spherical_wrist'}\n"
        "assert not {'numpy', 'pydantic', 'mujoco', 'matplotlib', 'pandas'} & set(sys.modules)\n"
        "import runpy; sys.argv = ['wrist', '--version']; runpy.run_module('spherical_wrist', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"spherical-wrist {sw.__version__}\n"


def test_typed_values_are_the_parameters_of_an_experiment():
    assert ExperimentValues.__optional_keys__ == {*sw.Experiment.model_fields, "hardware"}
    assert Conditions.__optional_keys__ == ExperimentValues.__optional_keys__ - {"law"}


# --- the same words everywhere ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "law", ["pd", PD, PD(), {"name": "pd"}, "pd P=0.16,0.16,0.06".replace("0.16,0.16,0.06", "[0.16, 0.16, 0.06]")]
)
def test_a_law_is_given_in_any_way(law, run):
    again = sw.simulate(law, **SHORT)
    assert bits(again) == bits(run)
    assert bits(sw.simulate(experiment={"law": law if not isinstance(law, str) else "pd", **SHORT})) == bits(run)


def test_a_file_a_class_of_this_file_and_a_label(tmp_path):
    text = "from spherical_wrist.control import Law\nclass Own(Law):\n    gain: float = 0.3\n    @staticmethod\n"
    text += "    def step(signal, parameters, state, command):\n        for i in range(3):\n"
    text += "            command.torque[i] = parameters.gain * signal.error[i]\n"
    (tmp_path / "own.py").write_text(text)
    given = [f"{tmp_path}/own.py:Own", Stiff, Stiff(stiffness=0.4), {"name": "pd", "P": 0.2}]
    found = sw.compare(given, cases="constant-heavy", duration=0.05)
    assert list(found.laws) == [given[0], "stiff", "stiff stiffness=0.4", "pd P=0.2"]
    labelled = sw.compare({"mine": Stiff, "theirs": "pd"}, cases="constant-heavy", duration=0.05)
    assert list(labelled.laws) == ["mine", "theirs"]
    assert labelled.laws["mine"] == Stiff()


def test_experiments_are_given_in_any_way(tmp_path):
    (tmp_path / "late.toml").write_text(TOML)
    values = {"law": {"name": "pd", "P": 0.2}, "hardware": "realistic", **SHORT, "sensing": {"delay": 0.002}}
    experiment = sw.Experiment(**values)
    assert (experiment.sensing.name, experiment.sensing.delay, experiment.friction) == ("realistic", 0.002, 1e-3)
    runs = [
        sw.simulate(experiment),
        sw.simulate(experiment=experiment),
        sw.simulate(experiment=values),
        sw.simulate(experiment=tmp_path / "late.toml"),
        sw.simulate(PD(P=0.2), hardware="realistic", sensing={"delay": 0.002}, **SHORT),
        sw.simulate("pd P=0.2", hardware="realistic", **SHORT, **{"sensing.delay": 0.002}),
        sw.simulate(experiment.replaced(duration=4.0), duration=0.2),
    ]
    assert all(bits(run) == bits(runs[0]) for run in runs)


def test_instances_are_changed_by_dotted_names_like_tables():
    experiment = sw.Experiment(law=PD(P=0.2), disturbance={"name": "noise", "level": 0.1}, reference=Lissajous, **SHORT)
    assert sw.simulate(experiment, **{"law.D": 0.01}).experiment.law == PD(P=0.2, D=0.01)
    changed = sw.simulate(experiment, **{"disturbance.name": "constant"}).experiment.disturbance
    assert (changed.name, changed.level) == ("constant", 0.1)
    with pytest.raises(WristError, match="law pd: unknown parameter 'Q'"):
        sw.simulate(experiment, **{"law.Q": 1.0})


def test_a_comparison_is_that_of_the_command(comparison):
    laws = {"pd": PD(), "stiff": Stiff()}
    expected = compare_laws(
        laws, [each for each in DEFAULT if each.name in ("constant-heavy", "realistic")], {}, SHORT, seeds=2
    )
    for key, cell in expected.cells.items():
        assert dict(comparison.cells[key].metrics) == dict(cell.metrics)


def test_cases_are_given_in_any_way(tmp_path):
    (tmp_path / "cases.toml").write_text('[[case]]\nname = "late"\nsensing.delay = 0.002\n')
    for cases in (tmp_path / "cases.toml", str(tmp_path / "cases.toml"), {"late": {"sensing": {"delay": 0.002}}}):
        (cell,) = sw.compare("pd", cases=cases, duration=0.05).cells.values()
        assert (cell.case, cell.experiment.sensing.delay) == ("late", 0.002)


def test_progress_is_optional(capsys):
    seen = []
    sw.compare("pd", cases="constant-heavy", duration=0.05, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (2, 2)
    assert capsys.readouterr().err == ""
    sw.simulate("pd", progress=True, **SHORT)
    assert capsys.readouterr().err.endswith("simulating: 200 of 200\n")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: sw.simulate("pdd"), "did you mean 'pd'"),
        (lambda: sw.simulate(3), "law = 3: a name, a table of a name and parameters, an instance or a class"),
        (lambda: sw.simulate("wrist.toml"), "give experiment='wrist.toml'"),
        (lambda: sw.simulate(sw.Experiment(), experiment={}), "two experiments"),
        (lambda: sw.simulate("pd", mass_scal=1.0), "did you mean 'mass_scale'"),
        (lambda: sw.simulate("pd", hardware="reel"), "unknown hardware 'reel'"),
        (lambda: sw.simulate(experiment=3), "experiment = 3"),
        (lambda: sw.compare(["pd", PD()]), "law 'pd' is given twice"),
        (lambda: sw.compare(law="pd"), "laws are the first argument"),
        (lambda: sw.compare([]), "no law is given"),
        (lambda: sw.compare("pd", cases=[]), "no case is given"),
        (lambda: sw.compare("pd", cases="constant-heavi"), "did you mean 'constant-heavy'"),
        (lambda: sw.frontier("pd", axes="heavyer"), "did you mean 'heavier'"),
        (lambda: sw.sweep("pd", vary={"mass_scal": [1.0]}, samples=2), "did you mean 'mass_scale'"),
        (lambda: sw.load_campaign("nowhere"), "holds no campaign"),
    ],
)
def test_what_is_wrong_is_one_line(call, said):
    with pytest.raises(WristError) as error:
        call()
    assert said in one_line(error.value)


# --- campaigns --------------------------------------------------------------------------------------------------------


def test_a_campaign_from_python_is_that_of_its_file(campaign):
    described = Campaign.from_toml(campaign.path / "campaign.toml")
    assert described.resolved().to_json() == campaign.campaign.to_json()
    assert list(campaign.campaign.bases) == ["pd", "pd P=0.3"]
    assert campaign.run(3).metrics.rms_error_rad == campaign.to_pandas()["rms_error_rad"][3]
    assert sw.load_campaign(campaign.path).summary() == campaign.summary()


def test_a_campaign_goes_on_where_it_is_asked_to(tmp_path):
    options = {"vary": {"mass_scale": [1.0, 1.2]}, "design": "grid", "folder": tmp_path / "c", "duration": 0.05}
    assert repr(sw.sweep("pd", **options)).startswith("<CampaignResults 2 of 2 episodes, 1 law, in ")
    with pytest.raises(WristError, match="resume=True goes on"):
        sw.sweep("pd", **options)
    assert len(sw.sweep("pd", resume=True, **options).to_pandas()) == 2
    with pytest.raises(WristError, match="holds another campaign"):
        sw.sweep("pd P=0.3", resume=True, **options)


# --- results ----------------------------------------------------------------------------------------------------------


def test_a_result_is_one_line(result):
    text = repr(result)
    assert text.startswith(f"<{type(result).__name__} ")
    assert "\n" not in text
    assert len(text) < 200


def picture(content):
    """Read a picture, and check that there is something on it."""
    image = Image.open(io.BytesIO(content))
    assert min(image.size) > 50
    assert np.ptp(np.asarray(image.convert("L"))) > 100, "it is empty"
    return image


def test_a_result_is_shown_in_a_notebook(result):
    html = result._repr_html_()
    assert result.headline() in html
    assert "<table" in html
    (png,) = re.findall(r"data:image/png;base64,([^\"]*)", html)
    picture(base64.b64decode(png))
    assert len(html) < 200_000


def test_a_result_is_drawn_without_a_display(frontier):
    figure = frontier.plot()
    assert isinstance(figure, Figure)
    picture(figure._repr_png_())  # as a notebook asks for it
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_a_result_is_drawn_in_the_width_that_a_paper_wants(result):
    for width, inches in (("one-column", 3.5), (7.16, 7.16)):
        if isinstance(result, sw.Run) and inches < 6.0:
            with pytest.raises(ParameterError, match="wrist plot"):
                result.plot(width)
        else:
            assert result.plot(width).get_figwidth() == inches


def test_a_picture_is_saved_in_a_width(frontier, tmp_path):
    saved = Image.open(io.BytesIO(frontier.save(tmp_path / "frontier.png", "one-column").read_bytes()))
    assert saved.width == 3.5 * 300
    with pytest.raises(ParameterError, match="width 'wide'"):
        frontier.save(tmp_path / "frontier.png", "wide")


def test_files_are_written_by_their_suffix(result, tmp_path):
    valid = set(result._view().files())
    assert {".csv", ".parquet", ".json", *PICTURES} <= valid
    for suffix in valid - {*PICTURES, ".rrd", ".html"}:
        path = tmp_path / f"result{suffix}"
        assert result.save(path) == path
        assert path.stat().st_size > 100, suffix
    frame = result.to_pandas()
    assert parquet.read_table(tmp_path / "result.parquet").num_rows == len(frame)
    assert csv.read_csv(tmp_path / "result.csv").num_rows == len(frame)
    json.loads((tmp_path / "result.json").read_text())
    with pytest.raises(ParameterError, match=r"its name must end in .*\.csv") as error:
        result.save(tmp_path / "result.doc")
    assert one_line(error.value)


def test_pictures_and_pages_are_saved_too(frontier, campaign, tmp_path):
    picture(frontier.save(tmp_path / "frontier.PNG").read_bytes())
    assert campaign.headline().split(",")[0].split()[0] in campaign.save(tmp_path / "report.html").read_text()


def test_a_run_is_saved_bit_for_bit(run, tmp_path):
    assert bits(sw.load_recording(run.save(tmp_path / "run.rrd"))) == bits(run)


def test_a_run_in_tables(run):
    frame, data = run.to_pandas(), run.to_xarray()
    for column in columns(run):
        values = frame.index if column.name == "time_s" else frame[column.name]
        assert np.array_equal(values, column.values)
    assert frame.attrs["units"]["error_x_rad"] == "rad"
    assert np.array_equal(data.error.sel(axis="y"), run.error[:, 1])
    assert np.array_equal(data.attitude.sel(component="w"), run.attitude[:, 0])
    assert (data.error.units, data.sizes["time"]) == ("rad", len(run))
    assert data.attrs["rms_tip_error_mm"] == run.metrics.rms_tip_error_mm


def test_a_run_of_coils_and_a_state_has_dimensions_for_them():
    data = sw.simulate("slotine_li", hardware="realistic", duration=0.02).to_xarray()
    assert data.current.dims == ("time", "current_component")
    assert data.law_state.dims == ("time", "law_state_component")


def test_a_comparison_in_tables(comparison):
    frame, data = comparison.to_pandas(), comparison.to_xarray()
    for (law, case, seed), cell in comparison.cells.items():
        (row,) = (frame.law == law).mul(frame.case == case).mul(frame.seed == seed).to_numpy().nonzero()[0]
        for name in METRICS:
            expected = np.nan if cell.metrics[name] is None else cell.metrics[name]
            assert np.array_equal(float(data[name].sel(law=law, case=case, seed=seed)), expected, equal_nan=True)
            assert np.array_equal(np.float64(frame[name][row]), expected, equal_nan=True)
    assert data.rms_error_rad.units == frame.attrs["units"]["rms_error_rad"] == "rad"


def test_frontier_margins_and_campaign_in_tables(frontier, margins, campaign):
    for edge in frontier.edges:
        found = float(frontier.to_xarray().misses.sel(law=edge.law, axis=edge.axis.name))
        assert found == edge.misses
    data = margins.to_xarray()
    for law in margins.laws:
        assert np.array_equal(data.sensitivity.sel(law=law.law), law.linear.sensitivity)
    assert set(margins.to_pandas().law) == {"pd", "slotine_li"}
    episodes = campaign.to_xarray()
    assert dict(episodes.sizes) == {"law": 2, "sample": 4}
    assert episodes.seed.dtype == np.int64
    assert episodes.seed.isel(law=0).equals(episodes.seed.isel(law=1).assign_coords(law="pd")), "seeds are paired"


def test_names_are_escaped():
    html = sw.compare({"<b>&": "pd"}, cases={"<script>": {}}, duration=0.05)._repr_html_()
    assert "&lt;b&gt;&amp;" in html
    assert "<b>&" not in html


def test_a_missing_library_is_one_line(run, monkeypatch):
    for name, call in (("pandas", run.to_pandas), ("xarray", run.to_xarray)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ParameterError) as error:
            call()
        assert one_line(error.value) == f"{name} is not installed: {installing('notebook')}"


def test_a_missing_package_is_installed_where_this_interpreter_runs(monkeypatch, tmp_path):
    """With its own pip, not the shell's; and by uv where there is none. The shell reads the command as it stands."""
    monkeypatch.chdir(tmp_path)
    inside, wanted = tmp_path / "my env" / "bin", "spherical-wrist[tune]"
    monkeypatch.setattr("sys.executable", str(inside / "python"))
    monkeypatch.setattr("shutil.which", lambda name: str(tmp_path / "other" / name))
    assert shlex.split(installing("tune")) == ["my env/bin/python", "-m", "pip", "install", wanted]
    monkeypatch.setattr("shutil.which", lambda name: str(inside / name))
    assert shlex.split(installing("tune")) == ["pip", "install", wanted]
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setattr("spherical_wrist.missing_package.find_spec", lambda name: None)
    assert shlex.split(installing("tune")) == ["uv", "pip", "install", "--python", "my env/bin/python", wanted]


def test_a_run_without_figures_or_series_is_shown():
    short = sw.simulate("pd", duration=0.001, keep_series=False, steady_from=5.0)
    assert "no sample is in the steady window" in repr(short)
    assert "<table" in short._repr_html_()
