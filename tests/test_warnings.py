"""Warnings of runs: the table of checks, the sources, and the places where they are shown."""

import html
import io
import json
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

import spherical_wrist as sw
from rigs import RigidBody, bits, mjcf
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.measure.warnings import CHECKS, summarized, warnings_of
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording.metrics_text import metrics_text
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.recording.writer import write_recording
from spherical_wrist.seal import PLACEHOLDER, sealed


@pytest.mark.parametrize("name", CHECKS)
def test_a_check_speaks_beyond_its_limit_only(name):
    check = CHECKS[name]
    metric = METRICS[check.metric]
    quiet = dict.fromkeys(METRICS)
    assert not warnings_of(quiet)
    assert not warnings_of(quiet | {check.metric: check.limit})
    [said] = warnings_of(quiet | {check.metric: check.limit + 0.25})
    assert f"{metric.shown_value(check.limit + 0.25):.3g} {metric.shown_unit}".strip() in said
    assert said.startswith(check.event)
    assert said.endswith(check.advice)
    assert "\n" not in said
    assert not said.endswith(".")


@pytest.mark.parametrize("name", CHECKS)
def test_several_runs_are_counted_with_the_worst(name):
    check = CHECKS[name]
    runs = {str(k): dict.fromkeys(METRICS) | {check.metric: check.limit + 0.1 * (k - 3)} for k in range(6)}
    [said] = summarized(runs)
    assert f"{check.event} in 2 of 6 runs, most in 5 " in said
    assert not summarized({"0": runs["0"]})


def test_warnings_of_models_and_motions_are_counted_by_kind():
    """The figures of a sentence differ from run to run; what it says is the same."""
    quiet, loud = dict.fromkeys(METRICS), dict.fromkeys(METRICS) | {"max_error_rad": 1.0}
    runs = {"a on x": quiet, "b on x": loud, "c on y": quiet}
    said = {
        "a on x": ("leaves by 0.3 rad for 7 %", "held"),
        "b on x": ("held", *warnings_of(loud)),
        "c on y": ("held",),
    }
    assert summarized(runs, said) == (
        "in 1 of 3 runs, such as a on x: leaves by 0.3 rad for 7 %",
        "held",
        *summarized(runs),
    )
    said["c on y"] = ("leaves by 1e-05 rad for 88.5 %",)
    assert summarized(runs, said)[:2] == (
        "in 2 of 3 runs, such as a on x: leaves by 0.3 rad for 7 %",
        "in 2 of 3 runs, such as a on x: held",
    )


CAMPAIGN = """
laws = ["pd", "computed_torque"]
design = "grid"
[experiment]
duration = 0.4
disturbance = {{ amplitude = {torque} }}
[vary]
mass_scale = [0.9, 1.1]
"""


def test_a_campaign_sums_up_the_warnings_of_its_episodes(wrist):
    """On the error stream, in JSON and on the page: as many, and as large, as the table of episodes has it."""
    Path("doubtful.toml").write_text(CAMPAIGN.format(torque=0.25))
    code, out, err = wrist("sweep", "doubtful.toml", "--workers", "0", "--json")
    told = json.loads(out)
    assert (code, told["stored"]) == (0, 4)
    rows = sw.load_campaign("doubtful").episodes.rows("SELECT * FROM episodes WHERE outcome = 'completed'")
    for name, check in CHECKS.items():
        found = [row for row in rows if row[check.metric] > check.limit]
        assert found, name
        worst = max(found, key=lambda row: (row[check.metric], -row["id"]))
        [said] = [text for text in told["warnings"] if text.startswith(check.event)]
        assert f"in {len(found)} of {len(rows)} episodes, most in episode {worst['id']} " in said
    lines = "".join(f"wrist: warning: {warning}\n" for warning in told["warnings"])
    assert err.endswith(lines)
    assert wrist("sweep", "doubtful")[2] == lines
    code, out, err = wrist("report", "doubtful", "--json", "-o", "page.html")
    assert (code, json.loads(out)["warnings"], err) == (0, told["warnings"], lines)
    page = html.unescape(Path("page.html").read_text(encoding="utf-8"))
    assert [text for text in told["warnings"] if f"Warning: {text}." not in page] == []


HELD = """
laws = ["pd"]
design = "grid"
batch = 2
[experiment]
duration = 0.3
[vary]
model = ["free.xml", "dry.xml"]
"reference.amplitude" = { linear = [0.1, 0.3, 2] }
"""


def test_a_campaign_sums_up_the_warnings_of_models_and_motions(wrist):
    """They stand in the table of episodes as they do in single runs; older files, which have none, are read beside."""
    Path("free.xml").write_text(mjcf())
    Path("dry.xml").write_text(mjcf(joint='frictionloss="1e-4" limited="true" range="0 0.25"'))
    Path("held.toml").write_text(HELD)
    code, out, err = wrist("sweep", "held.toml", "--workers", "0", "--json")
    told = json.loads(out)["warnings"]
    assert (code, err) == (0, "".join(f"wrist: warning: {warning}\n" for warning in told))
    folder = sw.load_campaign("held").folder
    runs = {f"episode {each.id}": simulate(each.experiment()) for each in folder.campaign.episodes(0, 4)}
    metrics, said = ({name: getattr(run, what) for name, run in runs.items()} for what in ("metrics", "warnings"))
    assert [row["warnings"].split("\n") for row in folder.episodes().in_order()] == [
        [text for text in said[name] if text not in warnings_of(metrics[name])] or [""] for name in runs
    ]
    assert sorted(told) == sorted(text.replace(" runs,", " episodes,") for text in summarized(metrics, said))
    assert [text for text in told if "frictionloss" in text and "in 2 of 4 episodes, such as" in text]
    assert [text for text in told if "leaves the range" in text and "in 1 of 4 episodes, such as" in text]
    assert wrist("sweep", "held", "--replay", "3", "-o", "3.rrd")[0] == 0
    batch = min((folder.path / "episodes").iterdir())
    older = parquet.read_table(batch).drop_columns("warnings")
    sink = io.BytesIO()
    parquet.write_table(older.replace_schema_metadata({**older.schema.metadata, b"seal": PLACEHOLDER.encode()}), sink)
    batch.write_bytes(sealed(sink.getvalue()))
    assert json.loads(wrist("report", "held", "--json")[1])["warnings"] == told


def test_a_frontier_warns_of_the_run_where_it_begins(wrist):
    options = ("--law", "pd", "--axis", "heavier", "--axis", "com", "--duration", "0.4", "--json", "--tolerance", "0.9")
    code, out, err = wrist("frontier", *options, "--set", "disturbance.amplitude=0.25")
    [saturated, large] = json.loads(out)["warnings"]
    assert code == 0
    assert "in 1 of 1 runs, most in the nominal wrist with pd, where axis heavier begins" in saturated
    assert err == f"wrist: warning: {saturated}\nwrist: warning: {large}\n"
    assert wrist("frontier", *options)[2] == ""


def test_tuning_warns_of_the_default_gains_and_those_of_the_front(wrist):
    options = ("--trials", "2", "--duration", "0.4", "--case", "constant-heavy", "--json")
    code, out, err = wrist("tune", "pd", *options, "--set", "disturbance.amplitude=0.25")
    warnings = json.loads(out)["warnings"]
    assert (code, len(warnings)) == (0, 2)
    assert all(" on constant-heavy " in text for text in warnings)
    assert err == "".join(f"wrist: warning: {warning}\n" for warning in warnings)


def test_compare_sums_up_the_warnings_of_models_and_motions(wrist, tmp_path):
    (tmp_path / "w.xml").write_text(mjcf(joint='frictionloss="1e-4"'))
    cases = ("--case", "constant-heavy", "--case", "double-mass")
    code, _, err = wrist("compare", "--law", "pd", *cases, "--duration", "0.4", "--set", "model=w.xml")
    assert code == 0
    assert [line for line in err.splitlines() if "frictionloss" in line] == [
        f"wrist: warning: {text}" for text in Experiment(model=tmp_path / "w.xml").nominal().warnings
    ]


def test_limits_of_warnings_are_listed_in_the_units_that_people_see(wrist, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    _, out, _ = wrist("list", "warnings")
    text = " ".join(out.split())
    assert "saturated saturated > 1 %: the torque saturated" in text
    assert "large_error attitude error, largest > 0.5 rad" in text


def test_runs_that_are_right_are_silent(wrist):
    for arguments in ([], ["--hardware", "realistic"], ["--reference", "beating_heart"]):
        code, _, err = wrist("run", "--no-recording", "--duration", "3", *arguments)
        assert (code, err) == (0, "")


MUTTERING = '''
from spherical_wrist.reference import Lissajous

class Muttering(Lissajous):
    """A motion that says something about itself."""

    def warnings(self, duration):
        yield f"this motion is doubtful for {duration:g} s"
'''


def test_model_and_motion_and_run_contribute(tmp_path):
    (tmp_path / "m.py").write_text(MUTTERING)
    (tmp_path / "w.xml").write_text(mjcf(joint='frictionloss="1e-4"'))
    experiment = Experiment(
        duration=1.0, law="pd", model=tmp_path / "w.xml", reference=f"{tmp_path / 'm.py'}:Muttering",
        disturbance={"name": "constant", "amplitude": 5.0},
    )  # fmt: skip
    model, motion, *run = simulate(experiment).warnings
    assert "frictionloss" in model
    assert motion == "this motion is doubtful for 1 s"
    assert run


def spun(nominal, share):
    """A motion about the tool of a wrist upright, that needs this share of its motor's torque at 4 Hz.

    The torque of θ = A sin(ω t) is I θ̈ + d θ̇, of the amplitude A ω hypot(I ω, d).
    """
    body, omega = RigidBody.of(nominal), 8.0 * np.pi
    needed = omega * np.hypot(body.inertia[2, 2] * omega, body.damping)
    return {"name": "sinusoid", "amplitude": (0, 0, share * nominal.upper[2] / needed), "frequency": 4, "phase": 0}


def test_a_reference_beyond_the_motors_says_by_how_much_and_when(nominal):
    upright = {"law": "computed_torque", "disturbance": 0, "mass_scale": 1, "duration": 1.0}
    assert not simulate(Experiment(reference=spun(nominal, 0.99), **upright)).warnings
    said = simulate(Experiment(reference=spun(nominal, 1.25), **upright)).warnings[0]
    assert said.startswith("the reference alone needs more torque than the motors give: up to 1.25 × what they give")
    body, omega, time = RigidBody.of(nominal), 8.0 * np.pi, np.arange(1000) * 1e-3
    phase = np.arctan2(body.damping, -body.inertia[2, 2] * omega)
    share = 1.25 * np.abs(np.sin(omega * time + phase))
    beyond = share > 1.0
    assert f"({share.max() * nominal.upper[2]:.3g} N·m at " in said
    assert f"from {time[beyond.argmax()]:.4g} s on for {100.0 * beyond.mean():.3g} % of the time" in said


def test_a_run_whose_law_asks_too_much_does_not_blame_the_reference(nominal):
    stiff = {"name": "computed_torque", "Kp": 4e4, "Kv": 400}
    found = simulate(Experiment(law=stiff, duration=0.3, initial_error=(0.0, 0.0, 3.0), steady_from=0.0))
    assert found.metrics.saturated_fraction > 0.0
    assert not [said for said in found.warnings if "reference alone" in said]


@pytest.mark.parametrize(
    ("timestep", "period", "step"),
    [(None, 0.001, 0.001), (0.001, 0.0015, 0.00075), (0.003, 0.01, 0.0025), (0.001, 0.002, None), (0.002, 0.01, None)],
)
def test_physics_steps_that_fit_the_control_period_are_taken_and_said(wrist, tmp_path, timestep, period, step):
    """As if they had been given, bit for bit, and again from the recording; without a timestep MuJoCo has 2 ms."""
    text = mjcf().replace('timestep="0.001"', "" if timestep is None else f'timestep="{timestep}"')
    (tmp_path / "w.xml").write_text(text)
    experiment = Experiment(model=tmp_path / "w.xml", law="pd", control_period=period, duration=60 * period)
    run = simulate(experiment)
    said = [text for text in run.warnings if "physics steps" in text]
    if step is None:
        assert not said
    else:
        given = simulate(experiment.replaced(physics_period=step))
        assert bits(run) == bits(given)
        assert not [text for text in given.warnings if "physics steps" in text]
        [sentence] = said
        for value in (step, timestep or 0.002, period):
            assert f" {value:g} s" in sentence
    record(run, tmp_path / "a.rrd")
    (tmp_path / "w.xml").unlink()
    code, out, err = wrist("replay", "a.rrd", "--json")
    assert (code, json.loads(out)["identical"]) == (0, True)
    assert err == "".join(f"wrist: warning: {warning}\n" for warning in run.warnings)


@pytest.mark.parametrize(
    "command", [["run"], ["compare", "--law", "pd", "--case", "constant-heavy"]], ids=lambda c: c[0]
)
def test_the_default_timestep_of_mujoco_is_no_fault(wrist, tmp_path, command):
    (tmp_path / "w.xml").write_text(mjcf().replace('timestep="0.001"', ""))
    given = (*command, "--duration", "0.02", "--set", f"model={tmp_path / 'w.xml'}")
    code, _, err = wrist(*given)
    assert code == 0
    assert command[0] != "run" or "the physics steps are 0.001 s" in err
    code, _, err = wrist(*given, "--set", "physics_period=0.002")
    assert (code, err.count("\n")) == (2, 1)
    assert "control_period = 0.001 s is no multiple of physics_period = 0.002 s: use 0.002" in err


@pytest.fixture
def doubtful(wrist):
    options = ("--duration", "3", "--law", "pd", "--disturbance", "2", "--json")
    code, out, err = wrist("run", *options)
    return code, json.loads(out), err


def test_warnings_are_on_the_error_stream_in_json_and_in_the_recording(wrist, doubtful):
    code, told, err = doubtful
    assert code == 0
    assert told["warnings"]
    lines = "".join(f"wrist: warning: {warning}\n" for warning in told["warnings"])
    assert err == lines
    run = load_recording("wrist.rrd")
    assert list(run.warnings) == told["warnings"]
    for command in (["inspect"], ["replay"]):
        code, _, err = wrist(*command, "wrist.rrd")
        assert (code, err) == (0, lines)
        assert json.loads(wrist(*command, "wrist.rrd", "--json")[1])["warnings"] == told["warnings"]
    for warning in told["warnings"]:
        assert f"**warning:** {warning[:20]}" in metrics_text(properties_of(run), len(run), 1)


def test_warnings_of_others_are_text(wrist, tmp_path):
    run = simulate(Experiment(duration=0.05, law="pd"))
    object.__setattr__(run, "warnings", ("\x1b[2J[red]x[/red] <b> $y$ **z**\n# head",))
    record(run, tmp_path / "foreign.rrd")
    _, _, err = wrist("inspect", tmp_path / "foreign.rrd", "--plot", "a.png")
    assert err == "wrist: warning: ␛[2J[red]x[/red] <b> $y$ **z** # head\n"
    text = metrics_text(properties_of(run), len(run), 1)
    assert r"\[red\]x\[/red\] \<b\> $y$ \*\*z\*\* # head" in text
    assert Path("a.png").stat().st_size


@pytest.mark.parametrize("value", ["text", 3, [3], {"a": "b"}])
def test_warnings_of_another_kind_are_refused(wrist, tmp_path, value):
    run = simulate(Experiment(duration=0.05, law="pd"))
    properties = properties_of(run)
    properties["outcome"]["warnings"] = value
    write_recording(tmp_path / "foreign.rrd", run, plant_of(run.experiment), properties)
    code, _, err = wrist("inspect", tmp_path / "foreign.rrd")
    assert code == 2
    assert err.count("\n") == 1
    assert "warnings" in err


def test_recordings_of_older_versions_have_the_warnings_of_their_metrics():
    said = {}
    for path in (Path(__file__).parent / "recordings" / "format1").glob("*.rrd"):
        run = load_recording(path)
        said[path.stem] = run.warnings
        assert run.warnings == warnings_of(run.metrics)
    assert len(said.pop("diverged")) == len(CHECKS)
    assert not any(said.values())


def test_the_list_has_every_check(wrist):
    told = json.loads(wrist("list", "--json")[1])["warnings"]
    assert set(told) == set(CHECKS)
    out = wrist("list", "warnings")[1]
    assert all(METRICS[check.metric].label in out for check in CHECKS.values())
