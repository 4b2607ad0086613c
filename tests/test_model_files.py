"""Files of a model: every way in which MuJoCo finds them, on the disk of their maker and after they were moved."""

import shutil
import zipfile
import zlib
from pathlib import Path

import mujoco
import numpy as np
import pytest

from opened_files import opened_files
from rigs import mjcf
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.errors import ModelError
from spherical_wrist.inspection.replay import replay
from spherical_wrist.wrist import Wrist, check_confined, model_files, portable

SHAPE = "v 0 0 0\nv {x} 0 0\nv 0 .01 0\nv 0 0 -.05\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def png(*levels):
    """A picture of two by two grey levels."""

    def part(name, content):
        return len(content).to_bytes(4, "big") + name + content + zlib.crc32(name + content).to_bytes(4, "big")

    rows = bytes([0, *levels[:2], 0, *levels[2:]])
    header = b"\0\0\0\2\0\0\0\2\x08\0\0\0\0"
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", header) + part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b"")


def skin():
    """A skin of one triangle that one body moves, in MuJoCo's binary format."""
    sizes = np.array([3, 0, 1, 1], np.int32).tobytes()
    corners = np.eye(3, dtype=np.float32).tobytes() + np.array([0, 1, 2], np.int32).tobytes()
    bone = b"rotor".ljust(40, b"\0") + np.array([0, 0, 0, 1, 0, 0, 0], np.float32).tobytes()
    return sizes + corners + bone + np.int32(3).tobytes() + np.arange(3, dtype=np.int32).tobytes() + b"\0\0\x80?" * 3


CONTENTS = {
    "a.obj": SHAPE.format(x=0.01).encode(),
    "b.obj": SHAPE.format(x=0.02).encode(),
    "p.png": png(1, 2, 3, 4),
    "q.png": png(5, 6, 7, 9),
    "s.skn": skin(),
}
"""Assets by name."""
MESH = '<mesh name="m" file="{}"/>'
FACES = " ".join(f'file{side}="{{0}}"' for side in ("right", "left", "up", "down", "front", "back"))
CUBE, PICTURE = f'<texture name="c" type="cube" {FACES}/>', '<texture name="p" type="2d" file="{}"/>'
GROUND = '<hfield name="h" file="{}" size="1 1 1 1"/>'
CHILD = '<body name="child"><geom type="mesh" mesh="m" mass="0.01"/></body>'
CLOTH = '<worldbody><flexcomp name="f" type="mesh" dim="2" rigid="true" file="{}"/></worldbody>'


def including(file, compiler=""):
    """A model in the folder models that includes a file."""
    return mjcf(compiler=compiler, more=f'<include file="{file}"/>')


def part(content, tag="asset"):
    """A file to be included."""
    return f"<mujoco><{tag}>{content}</{tag}></mujoco>" if tag else f"<mujoco>{content}</mujoco>"


def assets(content, compiler="", more=""):
    """A model with assets."""
    return mjcf(compiler=compiler, more=f"<asset>{content}</asset>{more}")


def attaching(compiler="", child_compiler="", name="a.obj"):
    """A model in the folder models that attaches one in the folder child."""
    child = f"<compiler {child_compiler}/><asset>{MESH.format(name)}</asset><worldbody>{CHILD}</worldbody>"
    own = '<worldbody><attach model="child" body="child" prefix="c_"/></worldbody>'
    text = assets('<model name="child" file="../child/c.xml"/>', compiler, own)
    return {"models/m.xml": text, "child/c.xml": part(child, "")}


WAYS = {
    "a folder beside, named after the include": (
        {
            "models/m.xml": including("../robot/r.xml").replace(
                "</mujoco>", '<compiler meshdir="../robot/g"/></mujoco>'
            ),
            "robot/r.xml": part(f'<compiler meshdir="g"/><asset>{MESH.format("a.obj")}</asset>', ""),
        },
        ["robot/g/a.obj"],
    ),
    "a folder above, from a file above": (
        {"a/b/m.xml": including("../../r.xml", 'meshdir="../g"'), "r.xml": part(MESH.format("a.obj"))},
        ["a/g/a.obj"],
    ),
    "beside the included file": (
        {"models/m.xml": including("sub/r.xml"), "models/sub/r.xml": part(MESH.format("a.obj"))},
        ["models/sub/a.obj"],
    ),
    "beside the model rather than the included file": (
        {"models/m.xml": including("sub/r.xml"), "models/sub/r.xml": part(MESH.format("a.obj"))},
        ["models/a.obj", "models/sub/a.obj=b.obj"],
    ),
    "an include by way of the model's folder": (
        {
            "models/m.xml": including("sub/r.xml"),
            "models/sub/r.xml": part('<include file="sub/t.xml"/>', ""),
            "models/sub/t.xml": part(MESH.format("a.obj")),
        },
        ["models/sub/a.obj"],
    ),
    "an include by way of the including file's folder": (
        {
            "models/m.xml": including("sub/r.xml"),
            "models/sub/r.xml": part('<include file="sub/t.xml"/>', ""),
            "models/sub/sub/t.xml": part(MESH.format("a.obj")),
        },
        ["models/sub/sub/a.obj"],
    ),
    "a folder of assets in place of one of meshes": (
        {
            "models/m.xml": including("../parts/r.xml", 'meshdir="../g"'),
            "parts/r.xml": part(f'<compiler assetdir="../h"/><asset>{MESH.format("a.obj")}</asset>', ""),
        },
        ["g/a.obj=b.obj", "h/a.obj"],
    ),
    "comments that are no XML": (
        {
            "models/m.xml": including("r.xml").replace("<default>", "<!-- --- the palm --- --><default>"),
            "models/r.xml": part(f"<!---- shapes ----><!-- Gel\udce4nder -->{MESH.format('a.obj')}"),
        },
        ["models/a.obj"],
    ),
    "a document type with an entity that nobody uses": (
        {"models/m.xml": '<!DOCTYPE mujoco SYSTEM "m.dtd" [<!ENTITY e "]>">]>' + assets(MESH.format("a.obj"))},
        ["models/a.obj"],
    ),
    "a stripped path": (
        {"models/m.xml": assets(MESH.format("/exported/from/a.obj"), 'meshdir="g" strippath="true"')},
        ["models/g/a.obj"],
    ),
    "a stripped path of another system": (
        {"models/m.xml": assets(MESH.format(r"C:\from\a.obj"), 'meshdir="g" strippath="true"')},
        ["models/g/a.obj"],
    ),
    "stripped paths of equal file names": (
        {
            "models/m.xml": assets(
                MESH.format("/x/a.obj") + MESH.format("y/a.obj").replace('"m"', '"n"'), 'strippath="true"'
            )
        },
        ["models/a.obj", "models/y/a.obj=b.obj"],
    ),
    "equal file names in folders": (
        {"models/m.xml": assets(MESH.format("{there}/x/a.obj") + MESH.format("../y/x/a.obj").replace('"m"', '"n"'))},
        ["x/a.obj", "y/x/a.obj=b.obj"],
    ),
    "backslashes": ({"models/m.xml": assets(MESH.format(r"..\g\a.obj"))}, ["g/a.obj"]),
    "a number for a letter": ({"models/m.xml": assets(MESH.format("{there}/g/&#97;.obj"))}, ["g/a.obj"]),
    "a name from the file": (
        {"models/m.xml": assets(MESH.format("{there}/g/a.obj").replace('name="m"', ""))},
        ["g/a.obj"],
    ),
    "another file in a comment": (
        {"models/m.xml": assets(f"<!-- {MESH.format('/gone.obj')} -->{MESH.format('{there}/g/a.obj')}")},
        ["g/a.obj"],
    ),
    "a folder of textures": (
        {"models/m.xml": assets(PICTURE.format("p.png") + CUBE.format("q.png"), 'meshdir="g" texturedir="../t"')},
        ["t/p.png", "t/q.png"],
    ),
    "textures of a stripped path": (
        {"models/m.xml": assets(PICTURE.format("/x/p.png") + CUBE.format("/q.png"), 'texturedir="t" strippath="true"')},
        ["models/t/p.png", "models/t/q.png"],
    ),
    "textures beside the included file": (
        {"models/m.xml": including("../t/r.xml"), "t/r.xml": part(PICTURE.format("p.png") + CUBE.format("q.png"))},
        ["t/p.png", "t/q.png"],
    ),
    "a height field in the folder of meshes": (
        {"models/m.xml": assets(GROUND.format("p.png"), 'assetdir="t" meshdir="{there}/g"')},
        ["g/p.png", "models/t/p.png=q.png"],
    ),
    "a height field beside the included file": (
        {"models/m.xml": including("{there}/t/r.xml"), "t/r.xml": part(GROUND.format("p.png"))},
        ["t/p.png"],
    ),
    "a skin": (
        {"models/m.xml": assets('<skin name="s" file="/x/s.skn"/>', 'meshdir="g" strippath="true"')},
        ["models/g/s.skn"],
    ),
    "a skin beside the included file": (
        {"models/m.xml": including("{there}/t/r.xml"), "t/r.xml": part('<skin name="s" file="s.skn"/>', "deformable")},
        ["t/s.skn"],
    ),
    "a cloth of a stripped path": (
        {"models/m.xml": mjcf(compiler='meshdir="g" strippath="true"', more=CLOTH.format("/x/a.obj"))},
        ["models/g/a.obj"],
    ),
    "a cloth beside the included file": (
        {"models/m.xml": including("{there}/t/r.xml"), "t/r.xml": part(CLOTH.format("a.obj"), "")},
        ["t/a.obj"],
    ),
    "folders named twice": (
        {
            "models/m.xml": assets(MESH.format("a.obj"), 'meshdir="/gone"', '<compiler assetdir="{there}/g"/>'),
        },
        ["g/a.obj"],
    ),
    "an attached model": (attaching('meshdir="gone"', 'meshdir="../g"'), ["g/a.obj"]),
    "an attached model with a stripped path": (
        attaching('strippath="true"', 'meshdir="g"', "/x/a.obj"),
        ["child/g/a.obj"],
    ),
    "an attached model in an absolute folder": (
        attaching("", 'meshdir="{there}/g"'),
        ["g/a.obj"],
    ),
}
"""Ways to find assets: texts by path, the model first, and assets by path, with the content of another after "="."""


def written(folder, way):
    """Write the files of a way below a folder, and return the model and the assets that it needs."""
    texts, kept = WAYS[way]
    for path, text in texts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(text.replace("{there}", str(folder)).encode(errors="surrogateescape"))
    for each in kept:
        path, _, other = each.partition("=")
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(CONTENTS[other or (folder / path).name])
    return folder / next(iter(texts))


def content_of(file):
    """All that comes from assets, with the names of the parts, as MuJoCo compiles them."""
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.nmesh + model.ntex + model.nhfield + model.nskin + model.nflex > 0
    fields = ("names", "mesh_vert", "tex_data", "hfield_data", "skin_vert", "flex_vert", "body_mass", "body_inertia")
    return {field: np.asarray(getattr(model, field)).tobytes() for field in fields}


@pytest.mark.parametrize("way", WAYS)
def test_a_moved_model_is_the_same_to_the_last_bit(tmp_path, way):
    there, here = tmp_path / "there", tmp_path / "here"
    model = written(there, way)
    before = content_of(model)
    files = portable(model)
    own = {path.name for path in model.parent.rglob("*") if path.is_dir()}
    shutil.rmtree(there)
    for path, content in files.items():
        (here / path).parent.mkdir(parents=True, exist_ok=True)
        (here / path).write_bytes(content)
        assert str(there).encode() not in content
    moved = here / next(iter(files))
    check_confined(moved, here)
    folders = {folder for path in files for folder in Path(path).parts[:-1]}
    assert moved.parent == here
    assert {folder for folder in folders - own if not folder.startswith("assets")} == set()  # none of its maker's
    assert content_of(moved) == before
    assert portable(moved) == files  # so that a replay can be recorded


@pytest.mark.parametrize("way", WAYS)
def test_the_files_of_a_model_are_those_that_mujoco_reads(tmp_path, way):
    """As MuJoCo tells itself; of a model that was moved, it does not even look for files elsewhere."""
    there, here = tmp_path / "there", tmp_path / "here"
    model = written(there, way)
    assert {file.resolve() for file in model_files(model)} == {file.resolve() for file in opened_files(model)[1]}
    for path, content in portable(model).items():
        (here / path).parent.mkdir(parents=True, exist_ok=True)
        (here / path).write_bytes(content)
    asked, read = opened_files(here / next(iter(portable(model))))
    assert len(read) == len(portable(model))
    assert all(file.is_relative_to(here) for file in asked)


@pytest.mark.parametrize("way", [
    "a folder beside, named after the include", "a stripped path", "an attached model", "comments that are no XML",
])  # fmt: skip
def test_a_run_is_replayed_without_the_files_of_its_model(tmp_path, way):
    model = written(tmp_path / "there", way)
    record(simulate(Experiment(model=model, duration=0.1)), tmp_path / "run.rrd")
    shutil.rmtree(tmp_path / "there")
    assert replay(tmp_path / "run.rrd").identical


def test_what_is_beside_a_linked_model_is_beside_the_link(tmp_path):
    elsewhere, models = tmp_path / "elsewhere", tmp_path / "models"
    elsewhere.mkdir()
    models.mkdir()
    (elsewhere / "m.xml").write_text(assets(MESH.format("a.obj")))
    (models / "linked.xml").symlink_to(elsewhere / "m.xml")
    (models / "a.obj").write_bytes(CONTENTS["a.obj"])
    assert mujoco.MjModel.from_xml_path(str(models / "linked.xml")).nmesh == 1
    assert [file.name for file in model_files(models / "linked.xml")] == ["linked.xml", "a.obj"]
    assert list(portable(models / "linked.xml")) == ["linked.xml", "assets/a.obj"]


def test_files_are_read_anew_when_one_has_changed(tmp_path):
    model = written(tmp_path, "a stripped path")
    assert len(model_files(model)) == 2
    (tmp_path / "models" / "g" / "a.obj").write_bytes(CONTENTS["b.obj"])
    assert CONTENTS["b.obj"] in model_files(model).values()


@pytest.mark.parametrize("file", ["m.xml", "sub/../m.xml", "n.xml"])
@pytest.mark.parametrize("kind", ["<asset><model name='q' file='{}'/></asset>", "<include file='{}'/>"])
def test_a_model_that_is_a_part_of_itself_is_one_line(wrist, tmp_path, kind, file):
    """MuJoCo would attach it until the stack is full."""
    (tmp_path / "m.xml").write_text(mjcf(more=kind.format(file)))
    (tmp_path / "n.xml").write_text(part(kind.format("m.xml"), ""))
    code, _, err = wrist("run", "--model", tmp_path / "m.xml", "--no-recording")
    assert (code, err.count("\n")) == (2, 1), err
    assert "itself" in err


def test_one_model_may_be_attached_by_two_others(tmp_path):
    child = part("<body name='child'><geom size='.01'/></body>", "worldbody")
    own = "<worldbody><attach model='child' body='child' prefix='{}_'/></worldbody>"
    named = '<asset><model name="child" file="c.xml"/></asset>'
    (tmp_path / "c.xml").write_text(child)
    (tmp_path / "i.xml").write_text(part(named + own.format("i"), ""))
    (tmp_path / "m.xml").write_text(mjcf(more=named + own.format("m")))
    (tmp_path / "both.xml").write_text(
        mjcf(more='<asset><model name="one" file="m.xml"/><model name="two" file="i.xml"/></asset>')
    )
    assert len(model_files(tmp_path / "both.xml")) == 4


@pytest.mark.parametrize("attached", [False, True])
def test_a_model_in_an_archive_is_to_be_unpacked(tmp_path, attached):
    """MuJoCo reads it, but nobody could tell what is in it without opening it."""
    with zipfile.ZipFile(tmp_path / "a.mjz", "w") as archive:
        archive.writestr("a.xml", mjcf())
    assert mujoco.MjSpec.from_file(str(tmp_path / "a.mjz")).compile().njnt == 1
    (tmp_path / "m.xml").write_text(mjcf(more='<asset><model name="a" file="a.mjz"/></asset>'))
    with pytest.raises(ModelError, match=r"a\.mjz' is an archive: unpack it"):
        Wrist.load(tmp_path / ("m.xml" if attached else "a.mjz"))


def test_a_model_that_mujoco_reads_and_is_no_xml_is_refused_when_it_is_recorded(wrist, tmp_path):
    """Its entity is letters to MuJoCo: a name like any other."""
    (tmp_path / "m.xml").write_text('<!DOCTYPE m [<!ENTITY e "x">]>' + mjcf().replace('name="rotor"', 'name="&e;"'))
    code, _, err = wrist("run", "--model", tmp_path / "m.xml", "--law", "pd", "--duration", "0.1")
    assert (code, err.count("\n")) == (2, 1), err
    assert "cannot be recorded, because it is no XML (undefined entity" in err
    assert wrist("run", "--model", tmp_path / "m.xml", "--law", "pd", "--duration", "0.1", "--no-recording")[0] == 0
