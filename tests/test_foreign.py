"""Recordings and campaign folders of other people: what consent allows, and what their models may name.

All commands over all attacks are in test_forge.py.
"""

import pytest

from forge import CODE, EVIL, Forge, Place
from rigs import mjcf, one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.campaign.folder import Folder
from spherical_wrist.consent import without_code
from spherical_wrist.errors import RecordingError, WristError
from spherical_wrist.experiment.description import PARTS
from spherical_wrist.inspection.replay import replay
from spherical_wrist.wrist import check_confined


@pytest.fixture
def ran(tmp_path):
    """The file that hostile code writes."""
    return tmp_path / "ran"


@pytest.fixture
def evil(tmp_path, ran):
    """A hostile law in a folder of its own."""
    folder = tmp_path / "evil"
    folder.mkdir()
    (folder / "evil.py").write_text(EVIL.format(ran=str(ran)))
    return folder / "evil.py"


@pytest.fixture(scope="module")
def honest():
    return simulate(Experiment(duration=0.05, law="pd"))


@pytest.fixture(scope="module")
def forge(honest):
    return Forge.of(honest)


def test_with_consent_the_code_in_the_recording_runs(wrist, forge, tmp_path):
    place = Place.at(tmp_path)
    ran, path = place.ran, forge.write(tmp_path / "foreign.rrd", *CODE["carried"](place))
    with pytest.raises(WristError):
        assert load_recording(path).experiment
    assert not ran.exists()
    assert wrist("replay", path, "--trust")[0] == 1  # another law than that of the run
    assert ran.exists()
    assert load_recording(path, trust=True).experiment.law.name == "evil"


def test_an_included_file_opens_nothing_outside_either(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "main.xml").write_text(mjcf(more='<include file="parts/a.xml"/>'))
    (tmp_path / "in" / "parts").mkdir()
    inner = tmp_path / "in" / "parts" / "a.xml"
    inner.write_text('<mujoco><asset><mesh name="m" file="../../secret.obj"/></asset></mujoco>')
    with pytest.raises(WristError, match=r"secret\.obj.*outside"):
        check_confined(tmp_path / "in" / "main.xml", tmp_path / "in")
    inner.write_text('<mujoco><asset><mesh name="m" file="m.obj"/></asset></mujoco>')
    check_confined(tmp_path / "in" / "main.xml", tmp_path / "in")


@pytest.mark.parametrize(
    "text",
    [
        r'<mujoco><asset><mesh name="m" file="..\secret.obj"/></asset></mujoco>',
        r'<mujoco><compiler meshdir="..\"/><asset><mesh name="m" file="secret.obj"/></asset></mujoco>',
        '<!DOCTYPE m [<!ENTITY e "a/b">]><mujoco><asset><mesh name="m" file="&e;/../../secret.obj"/></asset></mujoco>',
        '<!DOCTYPE m [<!-- > <mujoco><asset><mesh name="m" file="../secret.obj"/></asset></mujoco> --> ]><mujoco/>',
        '<!DOCTYPE m SYSTEM "><mujoco><asset><mesh name=%s file=%s/></asset></mujoco>"><mujoco/>',
        '<mujoco><INCLUDE file="b.xml"/></mujoco>',
        '<mujoco><asset><model name="m" file="b.xml"/></asset></mujoco>',
        '<mujoco><asset><model name="m" file="a.xml"/><model name="n" file="b.xml"/></asset></mujoco>',
    ],
)
def test_names_that_mujoco_reads_otherwise_than_xml_or_the_system_are_confined_too(tmp_path, text):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.xml").write_text(text)
    (tmp_path / "in" / "b.xml").write_text('<mujoco><include file="../secret.xml"/></mujoco>')
    with pytest.raises(WristError) as error:
        check_confined(tmp_path / "in" / "a.xml", tmp_path / "in")
    assert any(word in one_line(error.value) for word in ("outside", "entities", "document type"))


# --- campaigns


CAMPAIGN = """
laws = ["{law}"]
samples = 4
batch = 2
[experiment]
duration = 0.05
[vary]
mass_scale = {{ uniform = [0.5, 1.5] }}
"law.stiffness" = {{ uniform = [0.1, 0.2] }}
"""


@pytest.fixture
def campaign(wrist, evil, ran, tmp_path):
    """A finished campaign with a law of its maker's, as it comes by mail: its law is code that would run here."""
    (tmp_path / "c.toml").write_text(CAMPAIGN.format(law=f"{evil}:Evil"))
    code, _, err = wrist("sweep", tmp_path / "c.toml", "-o", tmp_path / "c", "--workers", "0", "--threads", "1")
    assert code == 0, err
    ran.unlink()
    return (tmp_path / "c").rename(tmp_path / "mailed")  # a file in another place is loaded, and run, anew


def test_a_campaign_runs_its_code_only_with_consent(wrist, campaign, ran):
    for command in (["sweep", campaign], ["report", campaign, "--json"]):
        code, _, err = wrist(*command)
        assert (code, err, ran.exists()) == (0, "", False)
    assert Folder.open(campaign).withheld
    for options in (["--replay", "1"], ["--resume"]):
        code, _, err = wrist("sweep", campaign, *options)
        assert (code, err.count("\n"), "--trust" in err, ran.exists()) == (2, 1, True, False)
    assert wrist("sweep", campaign, "--replay", "1", "--trust")[0] == 0
    assert ran.exists()


def test_a_campaign_file_is_consent_to_what_it_names(wrist, campaign, tmp_path):
    code, _, err = wrist("sweep", tmp_path / "c.toml", "-o", campaign, "--resume", "--workers", "0")
    assert (code, err) == (0, "")


# --- placeholders


@pytest.mark.parametrize("part", PARTS)
def test_a_placeholder_has_the_parameters_that_it_is_given(part, evil, ran):
    with without_code():
        experiment = Experiment(**{part: {"name": f"{evil}:Evil", "stiffness": 0.3}})
    member = getattr(experiment, part)
    assert experiment.model_dump(mode="json")[part] == {**member.model_dump(mode="json"), "name": f"{evil}:Evil"}
    assert member.stiffness == 0.3
    assert not ran.exists()
    assert type(member) not in PARTS[part].members.values()


@pytest.mark.parametrize("name", ["step", "__init__", "model_config", "a b", "members"])
def test_a_placeholder_cannot_have_any_name(evil, name):
    with without_code(), pytest.raises(WristError) as error:
        Experiment(law={"name": f"{evil}:Evil", name: 1.0})
    one_line(error.value)


def test_an_honest_recording_replays_bit_for_bit(tmp_path, honest):
    record(honest, tmp_path / "run.rrd")
    assert replay(tmp_path / "run.rrd").identical
    assert load_recording(tmp_path / "run.rrd").experiment.law == honest.experiment.law


def test_files_on_the_way_to_a_recording_are_told(forge, tmp_path):
    """A recording of an older version without files and with a model of its own cannot be drawn."""
    path = forge.write(tmp_path / "foreign.rrd", {"model": "/somewhere/model.xml"}, {"model": None})
    with pytest.raises(RecordingError, match="does not carry it"), load_recording(path).plant():
        pass
