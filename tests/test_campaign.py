"""Sweeps: what is stored, that it is the same however it is run, resumed or replayed, and what stops it."""

import errno
import gc
import json
import os
import resource
import shlex
import shutil
import signal
import stat
import subprocess
import sys
import time
import tomllib
import tracemalloc
from contextlib import suppress
from itertools import product
from pathlib import Path

import numpy as np
import psutil
import pyarrow as pa
import pytest
from pyarrow import parquet

import spherical_wrist.files
from rigs import one_line
from sampling import THOROUGH, some
from spherical_wrist import load_recording, simulate
from spherical_wrist.campaign import batch as batches
from spherical_wrist.campaign.batch import run_episodes
from spherical_wrist.campaign.cluster import Cluster
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.digest import digests_of
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, batch_size, campaign_lock
from spherical_wrist.campaign.replay import replay
from spherical_wrist.campaign.store import encode_rows
from spherical_wrist.campaign.summary import summary
from spherical_wrist.campaign.sweep import Listener, read_campaign, resume, sweep
from spherical_wrist.errors import RecordingError
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.wrist import default_model

TEXT = """
laws = ["pd", "fuzzy_sliding_computed_torque", { name = "computed_torque", Kp = 1000 }]
samples = 12
batch = 7
seed = 5
hardware = "realistic"
[experiment]
duration = 0.1
disturbance = { name = "noise", level = 0.2 }
[vary]
mass_scale = { uniform = [0.5, 1.5] }
payload = [0.0, 0.01]
"com_shift.*" = { normal = [0.0, 0.0005] }
"reference.frequency" = { linear = [0.2, 0.6, 5] }
"disturbance.name" = ["noise", "sinusoid"]
friction = [0.0, 0.001]
"""
HERE = Cluster(workers=0, threads=2)


def swept(folder, text=TEXT, cluster=HERE):
    """A campaign run to its end in a new folder."""
    file = folder.with_suffix(".toml")
    file.write_text(text)
    with campaign_lock(folder):
        made = Folder.create(folder, file, read_campaign(file))
        assert sweep(made, cluster, Listener()) == made.campaign.size
    return made


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted((folder.path / "episodes").iterdir())}


def rows(folder):
    return list(folder.episodes().in_order())


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The campaign, run without interruption."""
    return swept(tmp_path_factory.mktemp("campaigns") / "whole")


@pytest.fixture
def copy(whole, tmp_path):
    """A copy of it to damage."""
    shutil.copytree(whole.path, tmp_path / "copy")
    return Folder.open(tmp_path / "copy")


def test_every_episode_is_stored_with_all_that_made_it(whole):
    stored = rows(whole)
    assert [row["id"] for row in stored] == list(range(36))
    for episode, row in zip(whole.campaign.episodes(0, 36), stored, strict=True):
        run = simulate(episode.experiment(), keep_series=False)
        assert (row["sample"], row["law"], row["seed"]) == (episode.sample, episode.law, run.experiment.seed)
        assert {name: row[name] for name in episode.values} == dict(episode.values)
        assert row["mass_scale"] == run.experiment.mass_scale
        assert row["com_shift.y"] == run.experiment.com_shift[1]
        assert (row["outcome"], row["ended_at_s"], row["reason"]) == (run.outcome.status, run.outcome.time, "")
        assert {name: row[name] for name in METRICS} == dict(run.metrics)
    assert len({row["rms_error_rad"] for row in stored}) == 36


def test_the_order_in_which_episodes_share_a_cache_does_not_matter(whole):
    order = np.random.default_rng(1).permutation(36)
    episodes = list(whole.campaign.episodes(0, 36))
    cache = RunCache()
    again = {int(k): run_episodes([episodes[k]], cache)[0] for k in order}
    stored = rows(whole)
    assert all(again[k] == stored[k] for k in range(36))


@pytest.mark.parametrize(("size", "cluster"), [(36, Cluster(workers=0, threads=1)), (1, HERE)])
def test_the_table_does_not_depend_on_how_it_is_made(whole, tmp_path, size, cluster):
    other = swept(tmp_path / "other", TEXT.replace("batch = 7", f"batch = {size}"), cluster)
    assert len(contents(other)) == -(-36 // size)
    assert rows(other) == rows(whole)


def test_a_second_run_gives_the_same_files_byte_for_byte(whole, tmp_path):
    assert contents(swept(tmp_path / "again")) == contents(whole)


def test_resuming_runs_what_is_missing_and_nothing_else(whole, copy):
    before = contents(copy)
    gone = list(before)[1::2]
    for name in gone:
        (copy.path / "episodes" / name).unlink()
    (copy.path / "episodes" / ".1234.part").write_bytes(b"half")
    kept = {name: (copy.path / "episodes" / name).stat().st_mtime_ns for name in before if name not in gone}
    seen = []
    with campaign_lock(copy.path):
        folder = resume(copy.path)
        ran = sweep(folder, HERE, Listener(progress=lambda done, size: seen.append((done, size))))
    assert ran == sum(min(7, 36 - int(name[:12])) for name in gone)
    assert seen[0] == (36 - ran, 36)
    assert seen[-1] == (36, 36)
    assert contents(folder) == contents(whole)
    assert {name: (copy.path / "episodes" / name).stat().st_mtime_ns for name in kept} == kept
    with campaign_lock(copy.path):
        assert sweep(resume(copy.path), HERE, Listener()) == 0


def truncated(data):
    return data[: len(data) // 2]


def flipped(data):
    middle = len(data) // 3
    return data[:middle] + bytes([data[middle] ^ 4]) + data[middle + 1 :]


@pytest.mark.parametrize("harm", [truncated, flipped, lambda data: b""])
def test_a_damaged_file_is_reported_and_not_trusted(whole, copy, harm):
    path = sorted((copy.path / "episodes").iterdir())[2]
    path.write_bytes(harm(path.read_bytes()))
    said = []
    with pytest.warns(UserWarning, match="not trusted"):
        assert len(rows(copy)) == 36 - 7
    with campaign_lock(copy.path):
        assert sweep(resume(copy.path), HERE, Listener(warn=said.append)) == 7
    assert len(said) == 1
    assert path.name in said[0]
    assert contents(copy) == contents(whole)


def edited(file, **metadata):
    """Rewrite a batch as somebody with pyarrow would who wants another figure in it."""
    table = parquet.read_table(file)
    place = table.column_names.index("rms_error_rad")
    better = pa.array([1e-9] * len(table))
    table = table.set_column(place, "rms_error_rad", better)
    about = {key: value for key, value in table.schema.metadata.items() if key != b"seal" or not metadata}
    parquet.write_table(table.replace_schema_metadata(about), file)


@pytest.mark.parametrize("without", [{}, {"seal": None}], ids=["seal kept", "seal left out"])
def test_an_edited_batch_is_found_by_every_command_that_reads_it(whole, copy, wrist, without):
    file = copy.path / "episodes" / copy.files.batch(1).file
    edited(file, **without)
    line = f"not trusted: {file.name}: damaged, or changed since it was written"
    for command in ((), ("--replay", "8", "-o", "a.rrd"), ("--resume", "--workers", "0")):
        code, _, err = wrist("sweep", copy.path, *command)
        assert code == 0
        assert err.count("\n") == 1
        assert line.removeprefix("not trusted: ") in err
        if command != ("--resume", "--workers", "0"):
            assert wrist("report", copy.path, "--json")[2] == wrist("sweep", copy.path)[2]
    assert contents(copy) == contents(whole)
    assert wrist("sweep", copy.path)[2] == ""


def test_files_of_older_versions_without_a_checksum_are_read_and_named_once(whole, copy, wrist):
    described = json.loads((copy.path / "campaign.json").read_text())
    del described["sealed"]
    (copy.path / "campaign.json").write_text(json.dumps(described))
    for number in range(copy.files.count):
        file = copy.files.path(copy.files.batch(number))
        table = parquet.read_table(file)
        about = {key: value for key, value in table.schema.metadata.items() if key != b"seal"}
        parquet.write_table(table.replace_schema_metadata(about), file)
    for command in (("sweep", copy.path), ("report", copy.path), ("sweep", copy.path, "--resume", "--workers", "0")):
        code, _, err = wrist(*command)
        assert code == 0
        assert err == "wrist: warning: 6 files from an older version without checksums: changes are not found\n"
    with pytest.warns(UserWarning, match="6 files from an older version"):
        assert rows(Folder.open(copy.path)) == rows(whole)


def test_files_of_another_campaign_are_not_trusted(whole, copy, tmp_path):
    folder = copy.path / "episodes"
    first, second, third, *_ = sorted(folder.iterdir())
    shutil.copy(first, second)  # whole, but other episodes than its name says
    other = swept(tmp_path / "other", TEXT.replace("seed = 5", "seed = 6"))
    shutil.copy(other.path / "episodes" / third.name, third)
    shutil.copy(first, folder / "000000000001-000000000008.parquet")
    (folder / "notes.txt").write_text("mine")
    said = []
    with campaign_lock(copy.path):
        assert sweep(resume(copy.path), HERE, Listener(warn=said.append)) == 14
    assert len(said) == 4
    with pytest.warns(UserWarning, match="not a file of this campaign"):
        assert rows(copy) == rows(whole)
    assert (folder / "notes.txt").read_text() == "mine"


def test_replaying_an_episode_gives_it_bit_for_bit(whole, wrist):
    code, out, err = wrist("sweep", whole.path, "--replay", "17", "-o", "run.rrd", "--json")
    assert (code, err) == (0, "")
    told, stored = json.loads(out), rows(whole)[17]
    assert told["metrics"] == {name: stored[name] for name in METRICS}
    assert (told["stored"], told["differences"]) == (True, [])
    (episode,) = whole.campaign.episodes(17, 18)
    direct, recorded = simulate(episode.experiment()), load_recording("run.rrd")
    assert recorded.metrics == direct.metrics
    assert recorded.experiment == episode.experiment()
    for name, array in direct.channels.items():
        assert recorded.channels[name].tobytes() == array.tobytes(), name


def test_a_replay_that_differs_says_in_what(whole, wrist, copy):
    path = sorted((copy.path / "episodes").iterdir())[0]
    replay(copy, 3).check()
    false = rows(copy)[:7]
    false[3]["rms_error_rad"] *= 1.0 + 1e-15
    false[4]["reaching_time_s"] = None
    path.write_bytes(encode_rows(copy.campaign, copy.digest, copy.versions, false))
    assert replay(copy, 3).differences == ("rms_error_rad",)
    assert replay(copy, 4).differences == ("reaching_time_s",)
    assert replay(copy, 5).differences == ()
    code, _, err = wrist("sweep", copy.path, "--replay", "3")
    assert (code, "differs from the stored episode in rms_error_rad" in err) == (2, True)
    path.unlink()
    assert replay(copy, 3).stored is None
    code, _, err = wrist("sweep", copy.path, "--replay", "36")
    assert (code, "0 to 35" in err) == (2, True)


def test_outcomes_are_kept_apart(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from spherical_wrist.control import Law\n\n\nclass Pushy(Law):\n    torque: float = 0.0\n\n    @staticmethod\n"
        "    def step(signal, parameters, state, command):\n        for i in range(3):\n"
        "            command.torque[i] = parameters.torque / (0.02 - signal.time)\n"
    )
    text = f"""
    laws = ["pd", "{tmp_path}/mine.py:Pushy"]
    design = "grid"
    [experiment]
    duration = 0.05
    reference = "step"
    disturbance = {{ level = 0.0, name = "constant" }}
    [vary]
    "initial_rate_error.x" = [0.0, -2000.0]
    """
    folder = swept(tmp_path / "campaign", text)
    found = {(row["initial_rate_error.x"], row["law"][-5:]): row for row in rows(folder)}
    assert found[0.0, "pd"]["outcome"] == "completed"
    diverged = found[-2000.0, "pd"]
    assert diverged["outcome"] == "diverged"
    assert diverged["ended_at_s"] < 0.05
    assert "rad/s" in diverged["reason"]
    failed = found[0.0, "Pushy"]
    assert failed["outcome"] == "failed"
    assert failed["rms_error_rad"] is None
    assert "Pushy" in failed["reason"] or "pushy" in failed["reason"]
    told = {law["law"]: law for law in summary(folder.episodes())}
    outcomes = ("episodes", "completed", "diverged", "failed", "invalid")
    assert [told["pd"][name] for name in outcomes] == [2, 1, 1, 0, 0]
    assert sum(told["mine.py:Pushy"][name] for name in outcomes[1:]) == 2


def test_an_episode_that_turns_out_not_to_be_valid_is_stored_with_its_reason(tmp_path):
    text = """
    laws = ["pd"]
    samples = 40
    design = "random"
    [experiment]
    duration = 0.01
    [vary]
    "disturbance.level" = { uniform = [0.0, 0.2] }
    "reference.amplitude" = { choice = [0.0, 0.5] }
    "reference.frequency" = { choice = [0.0, 0.5] }
    "initial_error.x" = [0.0, 0.1]
    model = ["MODEL", "MODEL"]
    """
    spherical = Path(__file__).parents[1] / "models" / "wrist.xml"
    weightless = spherical.read_text().replace('gravity="0 0 -9.81"', 'gravity="0 0 0"')
    (tmp_path / "wrist.xml").write_text(weightless)
    folder = swept(tmp_path / "campaign", text.replace("MODEL", str(tmp_path / "wrist.xml")))
    for row in rows(folder):
        still = row["reference.amplitude"] == 0.0 or row["reference.frequency"] == 0.0
        assert row["outcome"] == ("invalid" if still else "completed")
        assert ("is zero" in row["reason"]) == still
        assert (row["rms_error_rad"] is None) == still


def test_summaries_are_numpys_quantiles(whole, wrist):
    stored = rows(whole)
    for law in summary(whole.episodes()):
        errors = [row["rms_error_rad"] for row in stored if row["law"] == law["law"]]
        assert law["episodes"] == law["completed"] == 12
        for share, value in law["rms_error_rad"].items():
            assert value == pytest.approx(np.quantile(errors, float(share)), rel=1e-12)
    code, out, _ = wrist("sweep", whole.path, "--json")
    told = json.loads(out)
    assert (code, told["stored"], told["episodes"]) == (0, 36, 36)
    assert told["laws"] == summary(whole.episodes())


def test_summaries_leave_out_what_did_not_complete(whole, copy):
    path = sorted((copy.path / "episodes").iterdir())[0]
    false = rows(copy)[:7]
    false[0] |= {"outcome": "diverged", "rms_error_rad": 1e6, "max_tip_error_mm": 1e6}  # of pd
    path.write_bytes(encode_rows(copy.campaign, copy.digest, copy.versions, false))
    law = summary(copy.episodes())[0]
    errors = [row["rms_error_rad"] for row in rows(whole)[3::3]]
    assert (law["law"], law["episodes"], law["completed"], law["diverged"]) == ("pd", 12, 11, 1)
    assert law["rms_error_rad"]["0.5"] == pytest.approx(np.median(errors), rel=1e-12)
    assert law["rms_error_rad"]["1.0"] == max(errors)


def test_stored_episodes_answer_questions(whole):
    found = whole.episodes().arrays('SELECT id, "com_shift.x" AS x, reaching_time_s, law FROM episodes ORDER BY id')
    stored = rows(whole)
    assert found["x"].tolist() == [row["com_shift.x"] for row in stored]
    assert np.isnan(found["reaching_time_s"][[row["reaching_time_s"] is None for row in stored]]).all()
    assert found["law"].tolist() == [row["law"] for row in stored]
    some = whole.episodes().rows("SELECT id FROM episodes WHERE mass_scale > ? ORDER BY id", [1.0])
    assert [row["id"] for row in some] == [row["id"] for row in stored if row["mass_scale"] > 1.0]
    with pytest.raises(CampaignError) as error:
        whole.episodes().rows("SELECT nothing FROM episodes")
    assert "nothing" in one_line(error.value)


def test_one_command_at_a_time(copy, wrist):
    with campaign_lock(copy.path):
        code, _, err = wrist("sweep", copy.path, "--resume")
        assert (code, err.count("\n"), "another command" in err) == (2, 1, True)
    assert wrist("sweep", copy.path, "--resume")[0] == 0


def test_the_lock_goes_with_the_process_that_holds_it(copy):
    code = f"import fcntl, os, time\nf = open({str(copy.path / '.lock')!r}, 'w')\nfcntl.flock(f, fcntl.LOCK_EX)\n"
    code += "print('held', flush=True)\ntime.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        with pytest.raises(CampaignError, match="another command"), campaign_lock(copy.path):
            pass
        other.send_signal(signal.SIGKILL)
        other.wait()
        with campaign_lock(copy.path):
            pass


def test_a_changed_campaign_is_not_resumed(copy, wrist, tmp_path):
    file = copy.path / "campaign.toml"
    other = tmp_path / "other.toml"
    other.write_text(TEXT.replace("seed = 5", "seed = 6"))
    code, _, err = wrist("sweep", other, "-o", copy.path, "--resume")
    assert (code, "another campaign" in err) == (2, True)
    other.write_text("# the same, said in another way\n" + TEXT.replace("duration = 0.1", "duration = 1e-1"))
    assert wrist("sweep", other, "-o", copy.path, "--resume")[0] == 0
    file.write_text(TEXT.replace("samples = 12", "samples = 13"))
    code, _, err = wrist("sweep", copy.path, "--resume")
    assert (code, "has changed" in err) == (2, True)
    file.write_text(TEXT)
    assert wrist("sweep", copy.path, "--resume")[0] == 0


LAW = (
    "from spherical_wrist.control import Law\n\n\nclass Mine(Law):\n    @staticmethod\n"
    "    def step(signal, parameters, state, command):\n        for i in range(3):\n"
    "            command.torque[i] = 0.1 * signal.error[i]\n        if signal.time > 0.009:\n"
    "            command.torque[0] = float('nan')\n"
)
MOVED = """
laws = ["{here}/mine.py:Mine", "pd"]
design = "grid"
batch = 1
[experiment]
duration = 0.02
disturbance = {{ name = "constant", amplitude = 0.001 }}
[vary]
model = ["{here}/a/wrist.xml", "{here}/b/wrist.xml"]
reference = [{{ name = "recorded", file = "{here}/motion.csv" }}]
"""
PART = '<mujoco><asset><mesh name="none" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset></mujoco>'


def test_a_campaign_is_sent_with_the_files_that_it_names(tmp_path, wrist, monkeypatch):
    """Its folder names none of the machine, and resumes, replays and reports where nothing else of it is."""
    here, there = tmp_path / "sender", tmp_path / "receiver"
    for name in "ab":
        (here / name).mkdir(parents=True)
        text = default_model().read_text().replace("<worldbody>", f'<include file="{name}.xml"/><worldbody>', 1)
        (here / name / "wrist.xml").write_text(text)
        (here / name / f"{name}.xml").write_text(PART)
    (here / "helper.py").write_text("gain = 0.1\n")
    (here / "mine.py").write_text(f"import helper\n{LAW}".replace("0.1 *", "helper.gain *"))
    (here / "motion.csv").write_text("t,w,x,y,z\n" + "".join(f"{0.1 * k:g},1,0,0,0\n" for k in range(20)))
    folder = swept(here / "c", MOVED.format(here=here))
    before = rows(folder)
    assert {row["model"] for row in before} == {"wrist/wrist.xml", "wrist-2/wrist.xml"}
    assert {row["law"] for row in before} == {"mine.py:Mine", "pd"}
    tables = [str(parquet.read_table(file).to_pylist()) for file in sorted((folder.path / "episodes").iterdir())]
    texts = [*tables, *((folder.path / name).read_text() for name in ("campaign.json", "campaign.toml"))]
    assert [text for text in texts if "sender" in text or str(tmp_path) in text] == []
    there.mkdir()
    shutil.copytree(folder.path, there / "c")
    shutil.rmtree(here)
    monkeypatch.chdir(there)
    moved = Folder.open("c")
    assert rows(moved) == before
    (moved.path / "episodes" / moved.files.batch(1).file).unlink()
    assert "--trust" in wrist("sweep", "c", "--resume")[2]
    code, _, err = wrist("sweep", "c", "--resume", "--trust", "--workers", "0", "--threads", "1")
    assert code == 0, err
    assert rows(moved) == before
    assert wrist("sweep", "c", "--replay", "0", "-o", "0.rrd", "--trust")[0] == 1  # failed, as it had
    assert wrist("sweep", "c", "--replay", "1", "-o", "1.rrd", "--trust")[0] == 0
    code, out, _ = wrist("report", "c", "--json")
    assert (code, "sender" in out) == (0, False)


def older(folder, text):
    """The folder of a campaign as an older version made it: it names files by their paths, and carries none."""
    described = json.loads((folder.path / "campaign.json").read_text())
    campaign = Campaign(**tomllib.loads(text)).resolved()
    described |= {"campaign": json.loads(campaign.to_json()), "digest": digests_of(campaign)[1]}
    del described["files"]
    (folder.path / "campaign.json").write_text(json.dumps(described))
    shutil.rmtree(folder.path / "files")
    for file in (folder.path / "episodes").iterdir():
        file.unlink()  # their digest is that of this version


def test_a_folder_of_an_older_version_with_absolute_paths_goes_on(tmp_path, wrist):
    (tmp_path / "mine.py").write_text(LAW)
    text = f'laws = ["{tmp_path}/mine.py:Mine"]\nsamples = 2\n[experiment]\nduration = 0.02\n'
    folder = swept(tmp_path / "c", text)
    older(folder, text)
    assert wrist("sweep", folder.path, "--resume", "--trust", "--workers", "0", "--threads", "1")[0] == 0
    assert wrist("sweep", folder.path)[0] == 0


def test_a_folder_of_an_older_version_reads_files_of_this_machine_only_with_consent(tmp_path, wrist):
    shutil.copy(default_model(), tmp_path / "mine.xml")
    text = f'samples = 1\n[experiment]\nduration = 0.02\nmodel = "{tmp_path}/mine.xml"\n'
    folder = swept(tmp_path / "c", text)
    older(folder, text)
    for options in (["--resume"], ["--replay", "0", "-o", tmp_path / "0.rrd"]):
        assert "files outside of it" in wrist("sweep", folder.path, *options)[2]
        assert wrist("sweep", folder.path, *options, "--trust")[0] == 0


CHANGES = {
    "an edited law": (lambda law: law.write_text(law.read_text().replace("0.1", "0.2")), "has changed since"),
    "a lost law": (lambda law: law.unlink(), "cannot be read"),
    "a library beside it": (lambda law: (law.parent / "numpy.so").write_bytes(b""), "no file of the campaign"),
    "a link beside it": (lambda law: (law.parent / "numpy").symlink_to("/tmp"), "no file of the campaign"),
}


def test_a_campaign_whose_copies_changed_does_not_go_on(tmp_path, wrist):
    law = tmp_path / "mine.py"
    law.write_text(LAW)
    file = tmp_path / "c.toml"
    folder = swept(tmp_path / "c", f'laws = ["{law}:Mine"]\nsamples = 2\n[experiment]\nduration = 0.01\n')
    resume = shlex.split(folder.command("--resume"))[1:]
    assert "--trust" in resume
    law.write_text(LAW.replace("0.1", "0.3"))
    assert wrist(*resume)[0] == 0  # with the copy
    code, _, err = wrist("sweep", file, "-o", folder.path, "--resume")
    assert (code, err.count("\n"), "has changed since the campaign began, 'mine.py'" in err) == (2, 1, True)
    law.write_text(LAW)
    assert wrist("sweep", file, "-o", folder.path, "--resume")[0] == 0
    for number, (change, said) in enumerate(CHANGES.values()):
        copy = tmp_path / f"copy-{number}"
        shutil.copytree(folder.path, copy)
        change(copy / "files" / "mine" / "mine.py")
        for options in (["--resume"], ["--replay", "0", "-o", tmp_path / "0.rrd"]):
            code, _, err = wrist("sweep", copy, "--trust", *options)
            assert (code, err.count("\n"), said in err) == (2, 1, True), err
        assert wrist("sweep", copy)[0] == 0  # which needs none of them


def test_other_versions_are_refused_but_for_anyway(copy, wrist, monkeypatch):
    other = {**copy.versions, "mujoco": "9.9"}
    monkeypatch.setattr("spherical_wrist.campaign.digest.versions_here", lambda: other)
    sorted((copy.path / "episodes").iterdir())[0].unlink()
    code, _, err = wrist("sweep", copy.path, "--resume")
    assert (code, "mujoco 9.9 instead of" in err, "--anyway" in err) == (2, True, True)
    monkeypatch.setattr("spherical_wrist.campaign.sweep.versions_here", lambda: other)
    assert wrist("sweep", copy.path, "--resume", "--anyway")[0] == 0


def test_a_worker_with_other_versions_computes_nothing(whole):
    with pytest.raises(CampaignError, match=r"a worker has numpy .* instead of 1\.0"):
        batches.run_batch(whole.campaign.to_json(), whole.digest, whole.files.batch(0), {"numpy": "1.0"})


def test_a_full_disk_is_said_and_the_campaign_resumes(whole, copy, wrist, monkeypatch):
    for path in list((copy.path / "episodes").iterdir())[1:]:
        path.unlink()
    write, count = os.write, [0]

    def full(descriptor, data):
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):  # what wakes a thread is no disk
            return write(descriptor, data)
        count[0] += 1
        if count[0] > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(descriptor, data)

    with monkeypatch.context() as patch:
        patch.setattr(spherical_wrist.files.os, "write", full)
        code, _, err = wrist("sweep", copy.path, "--resume")
    assert (code, err.count("\n")) == (2, 1)
    assert "No space left on device" in err
    assert f"wrist sweep {copy.path} --resume" in err
    assert len(contents(copy)) == 3
    assert not list((copy.path / "episodes").glob(".*"))
    assert wrist("sweep", copy.path, "--resume")[0] == 0
    assert contents(copy) == contents(whole)


def test_a_file_that_may_not_grow_is_no_torn_file(tmp_path):
    """The same, with a limit of the kernel's: the file ends in the middle."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(RecordingError, match="File too large"):
            spherical_wrist.files.write_whole(tmp_path / "x.parquet", bytes(5000), "episodes")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_holds_something_else_is_left_alone(wrist, tmp_path):
    (tmp_path / "c.toml").write_text(TEXT)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years")
    code, _, err = wrist("sweep", "c.toml", "-o", "mine")
    assert (code, "thesis.txt" in err) == (2, True)
    (tmp_path / "f").write_text("")
    assert wrist("sweep", "c.toml", "-o", "f")[0] == 2
    assert wrist("sweep", "mine")[0] == 2
    assert wrist("sweep", "mine", "--resume")[0] == 2
    assert wrist("sweep", "none.toml")[0] == 2
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_a_campaign_that_is_there_is_not_begun_again(whole, wrist, tmp_path):
    (tmp_path / "c.toml").write_text(TEXT)
    code, _, err = wrist("sweep", "c.toml", "-o", whole.path)
    assert (code, "--resume" in err) == (2, True)


def test_a_bad_campaign_leaves_nothing_behind(wrist, tmp_path):
    (tmp_path / "c.toml").write_text(TEXT.replace("mass_scale", "mass_scal"))
    code, out, err = wrist("sweep", "c.toml", "-o", "c")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "did you mean 'mass_scale'" in err
    assert not (tmp_path / "c").exists()
    (tmp_path / "c.toml").write_text("laws = [")
    assert "not valid TOML" in wrist("sweep", "c.toml")[2]


@pytest.mark.parametrize(
    "options",
    [
        ["--scheduler", "tcp://127.0.0.1:1", "--workers", "2"],
        ["--tls-ca", "ca.pem"],
        ["--tls-ca", "a", "--tls-cert", "b", "--tls-key", "c", "--scheduler", "tcp://127.0.0.1:1"],
        ["--tls-ca", "a", "--tls-cert", "b", "--tls-key", "c", "--scheduler", "tls://127.0.0.1:1"],
        ["--scheduler", "none.json"],
        ["--workers", "-1"],
    ],
)
def test_wrong_options_get_one_line(wrist, copy, options):
    sorted((copy.path / "episodes").iterdir())[0].unlink()
    code, out, err = wrist("sweep", copy.path, "--resume", *options)
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_batches_are_whole_samples_of_about_half_a_second():
    def size(**changes):
        given = {"laws": ["pd", "computed_torque", "sliding_mode"], "samples": 100_000, "experiment": {"duration": 2.0}}
        return batch_size(Campaign(**{**given, **changes}))

    assert size() % 3 == 0
    assert size(experiment={"duration": 20.0}) < size() < size(experiment={"duration": 0.2})
    assert size(experiment={"duration": 1000.0}) == 3
    assert size(batch=5) == 5
    assert size(samples=64) <= 6


def test_memory_does_not_grow_with_the_campaign(tmp_path):
    """Results are written and forgotten: of forty batches of 7 kB each, 280 kB, none is left in all.

    What Dask notes about a task is more than a third of that.
    """
    file, folder = tmp_path / "c.toml", tmp_path / "c"
    file.write_text('laws = ["pd"]\nsamples = 60\nbatch = 1\n[experiment]\nduration = 0.002\n')
    used = {}

    def progress(done, size):
        if done in (20, size):
            gc.collect()
            used[done] = tracemalloc.get_traced_memory()[0]

    with campaign_lock(folder):
        made = Folder.create(folder, file, read_campaign(file))
        tracemalloc.start()
        sweep(made, HERE, Listener(progress))
        tracemalloc.stop()
    assert used[60] - used[20] < 350_000


@pytest.mark.parametrize("number", some([signal.SIGINT, signal.SIGTERM], 2))
def test_a_signal_leaves_a_folder_that_resumes(whole, tmp_path, number):
    file = tmp_path / "c.toml"
    file.write_text(TEXT.replace("samples = 12", "samples = 20000"))
    command = [sys.executable, "-c", "from spherical_wrist.cli import main; main()", "sweep", str(file), "-o"]
    with subprocess.Popen([*command, str(tmp_path / "c")], stderr=subprocess.PIPE, text=True) as process:
        folder = tmp_path / "c" / "episodes"
        while not (folder.is_dir() and len(list(folder.glob("*.parquet"))) > 3):
            time.sleep(0.02)
            assert process.poll() is None
        process.send_signal(number)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number
    assert f"wrist sweep {tmp_path / 'c'} --resume" in err
    there, odd, _ = Folder.open(tmp_path / "c").files.scan()
    assert len(there) > 3
    assert not odd
    with campaign_lock(tmp_path / "c"):
        pass


def simulates(process):
    """Return True if a thread of a process or its children, other than the first of each, was at work for a while.

    It is the thread of a batch: the others only wait, once the first thread has done all imports.
    """
    first = psutil.Process(process.pid)
    with suppress(psutil.NoSuchProcess):  # a child that ended meanwhile
        for each in (first, *first.children(recursive=True)):
            if any(thread.user_time > 0.3 for thread in each.threads() if thread.id != each.pid):
                return True
    return False


@pytest.mark.parametrize(("workers", "level"), product(["0", "1"], [0.0, 0.1]) if THOROUGH else [("1", 0.0)])
def test_a_signal_ends_long_episodes_too(tmp_path, workers, level):
    file, folder = tmp_path / "c.toml", tmp_path / "c"
    file.write_text(f"samples = 2\n[experiment]\nduration = 100000\ndisturbance = {{ level = {level} }}\n")
    command = [sys.executable, "-c", "from spherical_wrist.cli import main; main()", "sweep", str(file), "-o"]
    with subprocess.Popen(
        [*command, str(folder), "--workers", workers, "--threads", "1"], stderr=subprocess.PIPE, text=True
    ) as process:
        while not simulates(process):
            time.sleep(0.05)
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 128 + signal.SIGINT
    assert err.endswith(f"stopped; go on with: wrist sweep {folder} --resume\n")
