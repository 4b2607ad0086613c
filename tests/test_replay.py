"""Recordings as evidence: they carry what they were made from, and come out the same to the last bit."""

import io
import json
import shutil
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from rigs import mjcf, mounted, one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment.embedded_files import EmbeddedFiles
from spherical_wrist.inspection.replay import replay
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.wrist import default_model

LAW = """
from spherical_wrist.control import Law
from my_gains import STIFFNESS

class Spring(Law):
    damping: float = 0.016

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = STIFFNESS * signal.error[i] + parameters.damping * signal.rate_error[i] + signal.N[i]
"""
TOOL = "v 0 0 0\nv .01 0 0\nv 0 .01 0\nv 0 0 -.05\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def own_everything(folder):
    """An experiment of which nothing is the package's: law with a helper, motion from a file, a model with parts."""
    (folder / "my_law.py").write_text(LAW)
    (folder / "my_gains.py").write_text("STIFFNESS = 0.2\n")
    time = np.linspace(0.0, 2.0, 41)
    rows = np.column_stack([time, np.cos(0.1 * np.sin(time)), *np.outer([0.6, 0.0, 0.8], np.sin(0.1 * np.sin(time)))])
    np.savetxt(folder / "motion.csv", rows, delimiter=",", header="t,w,x,y,z", comments="")
    (folder / "models" / "shapes").mkdir(parents=True)
    (folder / "models" / "shapes" / "tool.obj").write_text(TOOL)
    (folder / "models" / "shapes" / "mesh.xml").write_text(
        '<mujoco><asset><mesh name="tool" file="tool.obj"/></asset></mujoco>'
    )
    body = '<body><geom type="mesh" mesh="tool" mass="0.05"/><site name="tip" pos="0 0 -0.05"/></body>'
    text = mounted(mjcf(body, compiler='meshdir="shapes"', more='<include file="shapes/mesh.xml"/>'))
    (folder / "models" / "mine.xml").write_text(text)
    return Experiment(
        law={"name": str(folder / "my_law.py") + ":Spring", "damping": 0.02},
        reference={"name": "recorded", "file": folder / "motion.csv"},
        model=folder / "models" / "mine.xml",
        duration=1.0,
        payload=0.005,
    )


VARIANTS = {
    "default": {},
    "realistic": {"sensing": "realistic", "actuation": "realistic", "friction": 1e-3, "seed": 3},
    "random motion and push": {"reference": "beating_heart", "disturbance": "noise", "seed": 5},
    "diverges": {"disturbance": {"name": "constant", "amplitude": 50.0}},
    "adaptive, substeps": {"law": "adaptive_fuzzy_sliding_computed_torque", "physics_period": 0.0005},
}


@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("variant", VARIANTS.values(), ids=VARIANTS)
def test_a_recording_replays_to_the_last_bit(tmp_path, variant, every):
    record(simulate(Experiment(duration=3.0, **variant), record_every=every), tmp_path / "run.rrd")
    found = replay(tmp_path / "run.rrd")
    assert found.identical
    assert not found.circumstances
    assert found.series.rows[0] == found.series.rows[1] == len(found.recorded) > 0


def test_nothing_but_the_recording_is_needed(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    record(simulate(own_everything(folder)), tmp_path / "run.rrd")
    shutil.rmtree(folder)
    found = replay(tmp_path / "run.rrd", trust=True)
    assert found.identical
    assert set(found.recorded.embedded_files.files) == {
        "law/my_law.py",
        "law/my_gains.py",
        "reference.file/motion.csv",
        "model/mine.xml",
        "model/shapes/mesh.xml",
        "model/shapes/tool.obj",
    }
    with found.recorded.plant() as plant:
        assert plant.spec.copy().compile().nmesh == 1
    record(load_recording(tmp_path / "run.rrd"), tmp_path / "copy.rrd")  # its files are gone, and it can still be drawn
    assert replay(tmp_path / "copy.rrd", trust=True).identical


def test_what_was_simulated_is_kept_and_not_what_is_there_later(tmp_path):
    run = simulate(own_everything(tmp_path))
    (tmp_path / "my_gains.py").write_text("STIFFNESS = 0.9\n")
    (tmp_path / "motion.csv").write_text("t,w,x,y,z\n0,1,0,0,0\n1,1,0,0,0\n2,1,0,0,0\n")
    (tmp_path / "models" / "mine.xml").unlink()
    record(run, tmp_path / "run.rrd")
    assert replay(tmp_path / "run.rrd", trust=True).identical


def test_code_in_a_recording_does_not_run_unasked(tmp_path, wrist):
    experiment = own_everything(tmp_path)
    record(simulate(experiment), tmp_path / "run.rrd")
    with pytest.raises(RecordingError, match="--trust") as error:
        replay(tmp_path / "run.rrd")
    assert "as its law" in one_line(error.value)
    code, out, _ = wrist("replay", tmp_path / "run.rrd", "--extract", tmp_path / "inside")
    assert code == 0
    assert (tmp_path / "inside" / "law" / "my_law.py").read_text() == LAW
    assert str(tmp_path / "inside" / "model" / "shapes" / "tool.obj") in out.splitlines()
    assert wrist("replay", tmp_path / "run.rrd", "--trust")[0] == 0


def test_another_number_is_found_out_with_its_place(tmp_path, wrist):
    run = simulate(Experiment(duration=3.0))
    torque = run.torque.copy()
    torque[123, 1] = np.nextafter(torque[123, 1], 1.0)
    metrics = Metrics({**run.metrics.available, "peak_torque_Nm": 1.0})
    record(replace(run.replaced(torque=torque), metrics=metrics), tmp_path / "run.rrd")
    found = replay(tmp_path / "run.rrd")
    assert not found.identical
    assert (found.series.first.time, found.series.first.row_a) == (0.123, 123)
    assert [array.name for array in found.series.arrays if not array.same] == ["torque"]
    assert found.metrics == ("peak_torque_Nm",)
    code, out, _ = wrist("replay", tmp_path / "run.rrd")
    assert code == 1
    assert "differs first at t = 0.123 s, row 123" in out
    assert "another cause is likely" in " ".join(out.split())
    code, out, _ = wrist("replay", tmp_path / "run.rrd", "--json")
    told = json.loads(out)
    assert (code, told["identical"], told["first_difference"]) == (1, False, {"time_s": 0.123, "row": 123})
    assert told["arrays"]["torque"]["largest"] == np.abs(torque - run.torque).max()


def test_other_versions_are_named_as_a_cause(tmp_path, wrist):
    run = simulate(Experiment(duration=3.0))
    versions = {**run.versions, "numpy": "1.0", "processor": "abacus"}
    record(replace(run.replaced(error=run.error + 1e-12), versions=versions), tmp_path / "run.rrd")
    code, out, _ = wrist("replay", tmp_path / "run.rrd")
    assert code == 1
    assert "numpy 1.0 then" in out
    assert "processor abacus then" in out


def test_an_interrupted_run_is_replayed_as_far_as_it_went(tmp_path):
    simulated = []
    run = simulate(
        Experiment(duration=60.0), progress=lambda done, total: simulated.append(done), stop=lambda: len(simulated) >= 2
    )
    assert run.outcome.status == "interrupted"
    record(run, tmp_path / "run.rrd")
    found = replay(tmp_path / "run.rrd")
    assert found.identical
    assert len(found.again) == len(run) == 16384


def test_a_difference_between_files_is_a_difference_between_experiments(tmp_path, wrist):
    experiment = own_everything(tmp_path)
    record(simulate(experiment), tmp_path / "a.rrd")
    (tmp_path / "my_gains.py").write_text("STIFFNESS = 0.2  # the same\n")
    (tmp_path / "my_law.py").write_text(LAW + "\n")  # loaded anew, and with it the helper
    record(simulate(own_law_again(experiment, tmp_path)), tmp_path / "b.rrd")
    code, out, _ = wrist("diff", tmp_path / "a.rrd", tmp_path / "b.rrd", "--json")
    told = json.loads(out)
    assert (code, told["series"]["same"], list(told["experiment"])) == (1, True, ["file of law"])
    assert wrist("diff", tmp_path / "a.rrd", tmp_path / "a.rrd")[0] == 0


def own_law_again(experiment, folder):
    return experiment.replaced(law={"name": str(folder / "my_law.py") + ":Spring", "damping": 0.02})


NAMING = {
    "mesh": ('<mesh name="tool" file="{shapes}/tool.obj"/>', ""),
    "folder of meshes": ('<mesh name="tool" file="tool.obj"/>', 'meshdir="{shapes}"'),
    "folder of assets": ('<mesh name="tool" file="tool.obj"/>', 'assetdir="{shapes}/"'),
    "mesh beside a folder of meshes": ('<mesh name="tool" file="{shapes}/tool.obj"/>', 'meshdir="elsewhere"'),
    "folder above": ('<mesh name="tool" file="shapes/tool.obj"/>', 'meshdir="{folder}"'),
    "link": ('<mesh name="tool" file="tool.obj"/>', 'meshdir="link"'),
    "quotes and signs": ("<mesh name='tool' file='{shapes}/a &amp; b&apos;.obj'/>", ""),
    "climbing": ('<mesh name="tool" file="../shapes/tool.obj"/>', ""),
}
"""Ways to name a mesh in a folder that is not the model's, by an asset and a compiler."""


@pytest.mark.parametrize("included", [False, True], ids=["in the model", "in an included file"])
@pytest.mark.parametrize("kind", NAMING)
def test_a_recording_has_all_that_its_model_names_wherever_that_was(tmp_path, kind, included):
    """Once what it was made from is gone, it is simulated again from itself."""
    folder, models = tmp_path / "there", tmp_path / "there" / "models"
    (folder / "shapes").mkdir(parents=True)
    models.mkdir()
    for name in ("tool.obj", "a & b'.obj"):
        (folder / "shapes" / name).write_text(TOOL)
    (models / "link").symlink_to(folder / "shapes")
    asset, compiler = (text.format(shapes=folder / "shapes", folder=folder) for text in NAMING[kind])
    more = f"<asset>{asset}</asset>"
    if included:
        (folder / "shapes" / "mesh.xml").write_text(f"<mujoco>{more}</mujoco>")
        more = f'<include file="{folder}/shapes/mesh.xml"/>'
    body = '<body><geom type="mesh" mesh="tool" mass="0.05"/><site name="tip" pos="0 0 -0.05"/></body>'
    (models / "mine.xml").write_text(mjcf(body, compiler=compiler, more=more))
    run = simulate(Experiment(model=models / "mine.xml", duration=0.1))
    record(run, tmp_path / "run.rrd")
    shutil.rmtree(folder)
    assert replay(tmp_path / "run.rrd").identical
    with load_recording(tmp_path / "run.rrd").plant() as plant:
        assert plant.model.nmesh == 1
    texts = [content for content in run.embedded_files.files.values() if content.lstrip()[:1] == b"<"]
    assert texts
    assert not any(str(tmp_path).encode() in content for content in texts)


def test_a_model_whose_names_can_be_moved_is_kept_as_it_is(tmp_path):
    experiment = own_everything(tmp_path)
    kept = EmbeddedFiles.of(experiment).files
    assert kept["model/mine.xml"] == (tmp_path / "models" / "mine.xml").read_bytes()


def test_the_packages_own_model_is_kept_too_and_taken_where_the_package_has_another(tmp_path, monkeypatch):
    embedded_files = EmbeddedFiles.of(Experiment())
    assert embedded_files.places == {"model": "model/wrist.xml"}
    assert embedded_files.files["model/wrist.xml"] == default_model().read_bytes()
    embedded_files.unpack(tmp_path)
    plain = Experiment().model_dump(mode="json")
    assert Experiment(**embedded_files.described(plain, tmp_path)).model is None
    (tmp_path / "newer.xml").write_bytes(default_model().read_bytes() + b"<!-- newer -->")
    monkeypatch.setattr("spherical_wrist.experiment.embedded_files.default_model", lambda: tmp_path / "newer.xml")
    assert Experiment(**embedded_files.described(plain, tmp_path)).model == tmp_path / "model" / "wrist.xml"


def test_archives_are_reproducible_and_distrusted():
    embedded_files = EmbeddedFiles.of(Experiment())
    assert embedded_files.archive() == EmbeddedFiles.of(Experiment()).archive()
    assert EmbeddedFiles.from_archive(embedded_files.places, embedded_files.archive()) == embedded_files
    with pytest.raises(ValueError, match="damaged"):
        EmbeddedFiles.from_archive(embedded_files.places, embedded_files.archive()[:-30])
    for path in ("../out.xml", "/etc/out.xml"):
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w") as archive:
            archive.writestr(path, b"")
        with pytest.raises(ValueError, match="leads nowhere"):
            EmbeddedFiles.from_archive({"model": path}, content.getvalue())
    with pytest.raises(ValueError, match="lacks"):
        EmbeddedFiles.from_archive({"model": "model/other.xml"}, embedded_files.archive())


def test_a_recording_without_files_says_so(tmp_path):
    record(replace(simulate(Experiment(duration=0.1)), embedded_files=EmbeddedFiles()), tmp_path / "run.rrd")
    with pytest.raises(RecordingError, match="kept no files"):
        replay(tmp_path / "run.rrd")


def test_the_checksums_in_the_properties_are_those_of_the_files(tmp_path):
    from hashlib import sha256

    from spherical_wrist.recording.reader import read_recording

    record(simulate(Experiment(duration=0.1)), tmp_path / "run.rrd")
    told = read_recording(tmp_path / "run.rrd").properties["files"]["model"]
    assert told == {"path": "model/wrist.xml", "sha256": sha256(default_model().read_bytes()).hexdigest()}


def test_the_plant_of_a_recording_is_that_of_the_experiment(tmp_path):
    experiment = Experiment(duration=0.1, mass_scale=1.3, payload=0.02, com_shift=(1e-3, 0.0, 0.0), friction=1e-3)
    record(simulate(experiment), tmp_path / "run.rrd")
    theirs = plant_of(experiment).model
    with load_recording(tmp_path / "run.rrd").plant() as plant:
        for name in ("body_mass", "body_inertia", "body_ipos", "dof_frictionloss", "geom_size"):
            np.testing.assert_array_equal(getattr(plant.model, name), getattr(theirs, name))


def test_the_recording_still_has_a_sensible_size(tmp_path):
    run = simulate(Experiment())
    record(run, tmp_path / "run.rrd")
    assert len(run.embedded_files.archive()) < 4000
    assert (tmp_path / "run.rrd").stat().st_size < 5e6
