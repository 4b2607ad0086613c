"""Hostile recordings and campaign folders, made with the package's own writers, as someone would who knows them well.

Each table has attacks of one kind by name; :func:`recordings` and :func:`folders` return all of them. ``READING`` has
the commands that read a recording, ``CAMPAIGN`` those that read a folder. To add an attack, add an entry: every command
meets it.
"""

import ctypes
import io
import json
import os
import py_compile
import shutil
import struct
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from rigs import mjcf
from spherical_wrist import Experiment
from spherical_wrist.campaign.folder import EPISODES, RESOLVED
from spherical_wrist.experiment.embedded_files import EmbeddedFiles
from spherical_wrist.experiment.packed_files import LARGEST, MOST
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.recording.writer import write_recording
from spherical_wrist.simulation.run import Run

EVIL = """
from pathlib import Path
Path({ran!r}).write_text("ran")
from spherical_wrist.control import Law

class Evil(Law):
    stiffness: float = 0.2

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.stiffness * signal.error[i] + 0.02 * signal.rate_error[i]
"""
ODD = "[bold]b[/bold] :smile: \x1b[31mred\x1b]0;title\x07 \x9b2J \u202eback $a$ ![x](http://localhost/x.png) <b>"
"""Markup of Rich, codes of emoji, escape sequences, a turn of the direction of writing, mathematics, and Markdown."""


class Place(NamedTuple):
    """A receiver's machine: what an attack may aim at.

    Attributes:
        folder: folder that holds what was sent.
        evil: hostile Python on this disk; bytecode of it lies beside. Running it writes ``ran``.
        secret: private file on this disk: a motion, which a model may also name.
        ran: file that hostile code writes.
    """

    folder: Path
    evil: Path
    secret: Path
    ran: Path

    @classmethod
    def at(cls, folder: Path) -> "Place":
        """Make it: the private files are in a folder of their own."""
        private = folder / "private"
        private.mkdir()
        place = cls(folder, private / "evil.py", private / "secret.csv", folder / "ran")
        place.evil.write_text(EVIL.format(ran=str(place.ran)))
        unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
        py_compile.compile(str(place.evil), str(place.evil.with_suffix(".pyc")), invalidation_mode=unchecked)
        place.secret.write_text("t,w,x,y,z\n0,1,0,0,0\n1,1,0,0,0\n")
        shutil.copy(place.evil, folder)
        shutil.copy(place.secret, folder)
        return place


@contextmanager
def opened(*folders: Path) -> Iterator[Callable[[], set[str]]]:
    """Watch the files of folders through Linux, which sees what any library opens; yield a function of their names."""
    linux = ctypes.CDLL(None, use_errno=True)
    descriptor = linux.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
    is_open = 0x20
    for folder in folders:
        assert linux.inotify_add_watch(descriptor, os.fsencode(folder), is_open) >= 0

    def names() -> set[str]:
        found = set()
        while True:
            try:
                events = os.read(descriptor, 1 << 16)
            except BlockingIOError:
                return found
            while events:
                length = struct.unpack_from("iIII", events)[3]
                found.add(os.fsdecode(events[16 : 16 + length].rstrip(b"\0")))
                events = events[16 + length :]

    try:
        yield names
    finally:
        os.close(descriptor)


class Attack(NamedTuple):
    """Hostile recording or folder.

    Attributes:
        make: writes it at the path that it is given.
        refused: commands that must refuse it.
        said: text of their line.
        consent: True if ``--trust`` allows what it does.
    """

    make: Callable[[Path, Place], Any]
    refused: tuple[str, ...] = ()
    said: str = ""
    consent: bool = False


REPLAY, TRUSTED, RENDER = "replay FILE", "replay FILE --trust", "render FILE --frame a.png --size 320x240"
READING = (
    REPLAY, TRUSTED, "replay FILE --extract out", "replay FILE --json", "inspect FILE", "inspect FILE --json",
    "inspect FILE --plot a.png", "inspect FILE --export a.csv", "inspect FILE --export a.npz", "diff FILE FILE",
    "diff FILE FILE --json", "diff FILE FILE --plot a.png", "plot FILE -o a.png", RENDER, "FILE",
)  # fmt: skip
"""Commands that read a recording; its viewer is Rerun's, which the package only starts."""
RESUME, AGAIN = "sweep DIR --resume", "sweep DIR --replay 1 -o a.rrd"
CAMPAIGN = (
    "sweep DIR", "sweep DIR --json", "report DIR -o a.html", "report DIR --json", RESUME, AGAIN, f"{RESUME} --trust",
    f"{AGAIN} --trust", "DIR",
)  # fmt: skip
"""Commands that read the folder of a campaign."""
MADE = {"a.png", "a.csv", "a.npz", "a.html", "a.rrd", "out", "ran"}
"""Names that these commands may make; ``ran`` is looked for by itself."""


# --- recordings


class Forge(NamedTuple):
    """Writer of recordings of a run, with other properties and files than its own.

    Attributes:
        run: the run.
        plant: wrist that is drawn.
    """

    run: Run
    plant: Any

    @classmethod
    def of(cls, run: Run) -> "Forge":
        """Return the forge of a run of the default wrist."""
        return cls(run, plant_of(Experiment(duration=0.05)))

    def write(
        self,
        path: Path,
        experiment: Mapping[str, Any] | None = None,
        files: Mapping[str, tuple[str, bytes] | None] | None = None,
        *,
        more: Mapping[str, bytes] | None = None,
        archive: bytes | None = None,
        every: int = 1,
        **groups: Mapping[str, Any],
    ) -> Path:
        """Write a recording.

        Args:
            path: the file.
            experiment: changes of the experiment.
            files: path in the archive and content by parameter; None leaves out the one that the run carries.
            more: further files of the archive.
            archive: all of the archive in place of these.
            every: interval of the rows, as the recording says it.
            **groups: changes of other groups of properties.
        """
        carried = EmbeddedFiles(dict(self.run.embedded_files.places), dict(self.run.embedded_files.files))
        for name, file in (files or {}).items():
            if file is None:
                del carried.places[name]
            else:
                carried.places[name], carried.files[file[0]] = file
        carried.files.update(more or {})
        properties = properties_of(self.run)
        properties["experiment"] |= experiment or {}
        properties["files"] = {name: {"path": place, "sha256": ""} for name, place in carried.places.items()}
        for name, changes in groups.items():
            properties[name] = {**properties[name], **changes}
        content = carried.archive() if archive is None else archive
        write_recording(path, self.run, self.plant, properties, every, content)
        return path


LAW = {"law": {"name": "law.py:Evil"}}
CACHED = f"{{}}/__pycache__/{{}}.{sys.implementation.cache_tag}.pyc"
"""Place of the bytecode of a module in a folder, which Python runs in place of the module."""
CODE: dict[str, Callable[[Place], tuple[Any, ...]]] = {
    "carried": lambda at: (LAW, {"law": ("law/law.py", at.evil.read_bytes())}),
    "on this disk": lambda at: ({"law": {"name": f"{at.evil}:Evil"}}, {}),
    "beside the recording": lambda at: ({"law": {"name": "evil.py:Evil"}}, {}),
    "as bytecode": lambda at: (
        {"law": {"name": f"{at.evil}:Evil"}},
        {"law": ("law/a.py:/x.pyc", at.evil.with_suffix(".pyc").read_bytes())},
    ),
    "as bytecode beside honest Python": lambda at: (
        LAW,
        {"law": ("law/law.py", b"import evil\n")},
        {"law/evil.pyc": at.evil.with_suffix(".pyc").read_bytes()},
    ),
    "as cached bytecode of honest Python": lambda at: (
        LAW,
        {"law": ("law/law.py", b"honest = True\n")},
        {CACHED.format("law", "law"): at.evil.with_suffix(".pyc").read_bytes()},
    ),
    "as a library": lambda at: (LAW, {"law": ("law/law.py", b"import evil\n")}, {"law/evil.so": b"\x7fELF"}),
    "without a table": lambda at: ({"law": f"{at.evil}:Evil"}, {}),
    "without a name": lambda at: ({"law": {"name": str(at.evil)}}, {}),
    "as a motion": lambda at: (
        {"reference": {"name": f"{at.evil}:Evil"}},
        {"reference": ("reference/evil.py", at.evil.read_bytes())},
    ),
    "as a disturbance": lambda at: ({"disturbance": {"name": f"{at.evil}:Evil"}}, {}),
    "as sensors": lambda at: ({"sensing": {"name": f"{at.evil}:Evil"}}, {}),
    "as motors": lambda at: ({"actuation": {"name": "evil.py:Evil"}}, {}),
    "without a model": lambda at: ({"law": {"name": f"{at.evil}:Evil"}}, {"model": None}),
    "with a model on this disk": lambda at: (
        {"law": {"name": f"{at.evil}:Evil"}, "model": str(at.evil.with_name("evil.xml"))},
        {"model": None},
    ),
}
"""Changes of the experiment, files and further files that would run code, by how they name it."""

NAMED: dict[str, Callable[[Place], tuple[Any, ...]]] = {
    "a motion on this disk": lambda at: ({"reference": {"name": "recorded", "file": str(at.secret)}}, {}),
    "a motion in a short form": lambda at: ({"reference": {"name": f"recorded:{at.secret}"}}, {}),
    "a motion in a text": lambda at: ({"reference": f"recorded:{at.secret}"}, {}),
    "a motion beside": lambda at: ({"reference": {"name": "recorded", "file": at.secret.name}}, {}),
    "the whole of a motion": lambda at: (
        {"duration": "whole", "reference": {"name": "recorded", "file": str(at.secret)}},
        {},
    ),
    "the times of a motion": lambda at: ({"reference": {"name": "recorded", "times": str(at.secret)}}, {}),
    "a number that is a file": lambda at: ({}, {"law.P": ("law/p", b"1")}),
    "a part that there is not": lambda at: ({}, {"nothing": ("nothing/p", b"1")}),
    "a model on this disk": lambda at: ({"model": str(at.secret)}, {"model": None}),
}
"""Changes of the experiment and files that would open a file of this disk."""

OUTSIDE = {
    "include": '<include file="{file}"/>',
    "mesh": '<asset><mesh name="m" file="{file}"/></asset>',
    "texture": '<asset><texture name="t" type="2d" file="{file}"/></asset>',
    "cube": '<asset><texture name="t" type="cube" fileright="{file}"/></asset>',
    "height field": '<asset><hfield name="h" file="{file}" size="1 1 1 1"/></asset>',
    "skin": '<asset><skin name="s" file="{file}"/></asset>',
    "model": '<asset><model name="m" file="{file}"/></asset>',
    "folder of meshes": '<compiler meshdir="{folder}"/><asset><mesh name="m" file="{name}"/></asset>',
    "folder of assets": '<compiler assetdir="{folder}"/><asset><texture name="t" file="{name}"/></asset>',
    "flexible body": '<worldbody><flexcomp name="f" type="mesh" file="{file}"/></worldbody>',
}
"""Parts of a model that open a file, by kind."""
BOMBS = {
    "replicate": '<worldbody><replicate count="100000000"><geom size="1"/></replicate></worldbody>',
    "replicates in each other": '<worldbody><replicate count="30000"><replicate count="30000"><geom size="1"/>'
    "</replicate></replicate></worldbody>",
    "cloth": '<worldbody><flexcomp name="f" type="grid" dim="3" count="2000 2000 2000"/></worldbody>',
    "memory": '<size memory="900G"/>',
    "itself": '<include file="a.xml"/>',
}
"""Parts of a model that grow without end."""


def model(text: str) -> dict[str, tuple[str, bytes]]:
    return {"model": ("model/a.xml", text.encode())}


def outside(part: str, up: str, at: Place) -> str:
    """Return a model with a part that opens the private file, by its absolute path or by climbing."""
    file = f"{up}{str(at.secret)[1:]}"
    return mjcf(more=part.format(file=file, folder=file.rpartition("/")[0], name=at.secret.name))


def archive_of(files: list[tuple[str, bytes]], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return an archive with any paths."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as archive:
        for path, file in files:
            archive.writestr(path, file)
    return content.getvalue()


def claiming(size: int) -> bytes:
    """An archive of one file that is said to unpack to a size."""
    content = bytearray(archive_of([("model/a.xml", b"0" * 100)]))
    entry = content.index(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = struct.pack("<I", size)
    return bytes(content)


def encrypted() -> bytes:
    """An archive of one file that is said to be encrypted."""
    content = bytearray(archive_of([("model/a.xml", b"0" * 100)]))
    content[content.index(b"PK\x01\x02") + 8] |= 1
    return bytes(content)


ARCHIVES: dict[str, tuple[Callable[[], bytes], str]] = {
    "too large": (lambda: claiming(LARGEST + 1), "larger than 268 MB"),
    "too many": (lambda: archive_of([(f"model/{k}", b"") for k in range(MOST + 1)]), "more than 10000 files"),
    "packed by lzma": (
        lambda: archive_of([("model/a.xml", b"0")], zipfile.ZIP_LZMA),
        "packed 'model/a.xml' in another",
    ),
    "encrypted": (encrypted, "packed 'model/a.xml' in another"),
    "climbing": (lambda: archive_of([("model/../../a.xml", b"")]), "leads nowhere"),
    "absolute": (lambda: archive_of([("/etc/a.xml", b"")]), "leads nowhere"),
    "a folder": (lambda: archive_of([("model/", b"")]), "leads nowhere"),
    "no archive": (lambda: b"PK", "damaged"),
}
"""Archives that would fill memory or disk or lead out of their folder, and what is said of them."""
ENDLESS: dict[str, tuple[dict[str, Any], int]] = {
    "a long run": ({"duration": 1e12}, 1),
    "a long run with few rows": ({"duration": 1e9}, 10**8),
    "short control periods": ({"control_period": 1e-12}, 1),
    "short physics steps": ({"physics_period": 1e-12}, 1),
    "many physics steps": ({"duration": 1e6, "physics_period": 1e-5}, 10**5),
    "an entry of Python's": ({"self": 1}, 1),
    "an entry of Python's in a part": ({"law": {"name": "pd", "self": 1}}, 1),
}
"""Changes of the experiment that would never end or are none, with the interval of the rows."""
WORDS: dict[str, dict[str, Any]] = {
    "a law": {"experiment": {"law": {"name": ODD}}},
    "a Python file": {"experiment": {"law": {"name": f"{ODD}.py:{ODD}"}}},
    "a reason": {"outcome": {"reason": ODD}},
    "a verdict": {"outcome": {"verdict": ODD}},
    "warnings": {"outcome": {"warnings": [ODD, f"{ODD}\n{ODD}"]}},
    "a version": {"versions": {"numpy": ODD}},
    "a package": {"versions": {ODD: "1"}},
    "the name of a property": {"experiment": {ODD: 1}},
    "a joint": {"experiment": {"joint": ODD}},
}
"""Changes of properties that a terminal, a picture or a page may obey, by what they stand for."""


NO_XML = {"empty": "", "cut": "<mujoco", "bytes": "\0", "entity": "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>"}
"""Texts that are no model."""


def recordings(forge: Forge) -> dict[str, Attack]:
    """Return all attacks by recordings, by kind and name."""

    def of(experiment: Any = None, files: Any = None, more: Any = None, **rest: Any) -> Callable[[Path, Place], Path]:
        return lambda path, at: forge.write(path, experiment, files, more=more, **rest)

    def from_place(way: Callable[[Place], tuple[Any, ...]]) -> Callable[[Path, Place], Path]:
        return lambda path, at: of(*way(at))(path, at)

    def by_model(part: str, up: str) -> Callable[[Path, Place], Path]:
        return lambda path, at: forge.write(path, {}, model(outside(part, up, at)))

    found: dict[str, Attack] = {}
    for name, way in CODE.items():
        consented = name in ("carried", "as a motion")
        found[f"code {name}"] = Attack(from_place(way), (REPLAY, TRUSTED)[: 2 - consented], consent=consented)
    for name, way in NAMED.items():
        found[f"file: {name}"] = Attack(from_place(way), (REPLAY, TRUSTED))
    for name, part in OUTSIDE.items():
        for kind, up in (("absolute", "/"), ("climbing", "../" * 40)):
            attack = Attack(by_model(part, up), (TRUSTED, RENDER), "outside of what it came with")
            found[f"model: {kind} {name}"] = attack
    for name, part in BOMBS.items():
        found[f"model: {name}"] = Attack(of({}, model(mjcf(more=part))), (REPLAY, RENDER))
    for name, text in NO_XML.items():
        found[f"model: {name}"] = Attack(of({}, model(text)), (REPLAY, RENDER))
    for name, (make, said) in ARCHIVES.items():
        attack = Attack(lambda path, at, make=make: forge.write(path, archive=make()), (REPLAY, "inspect FILE"), said)
        found[f"archive: {name}"] = attack
    for name, (changes, every) in ENDLESS.items():
        found[f"size: {name}"] = Attack(of(changes, every=every), (REPLAY,))
    for name, groups in WORDS.items():
        found[f"words: {name}"] = Attack(of(**groups))
    return found


# --- folders of campaigns

HONEST = """
laws = ["pd"]
samples = 2
[experiment]
duration = 0.02
model = "hand.xml"
[vary]
mass_scale = {{ uniform = [0.9, 1.1] }}
reference = ["lissajous", {{ name = "recorded", file = "{motion}" }}]
"""
"""Campaign whose folder is forged."""


class Draft:
    """Copy of an honest folder that is changed before it is sent.

    Args:
        folder: the copy.
        place: the receiver's machine.
    """

    def __init__(self, folder: Path, place: Place) -> None:
        self.folder, self.place = folder, place
        self.description: dict[str, Any] = json.loads((folder / RESOLVED).read_text())

    def changed(self, **changes: Any) -> "Draft":
        """Change the description of the campaign; names with ``_`` are of its experiment."""
        campaign = self.description["campaign"]
        for name, value in changes.items():
            (campaign["experiment"] if name[0] == "_" else campaign)[name.lstrip("_")] = value
        return self

    def carrying(self, place: str, content: bytes) -> "Draft":
        """Carry one more file, or another content of one, with its checksum."""
        file = self.folder / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        self.description["files"][place] = sha256(content).hexdigest()
        return self

    def older(self) -> "Draft":
        """Say that it is of a version that carried no files."""
        del self.description["files"]
        return self

    def sent(self) -> None:
        """Write the description."""
        (self.folder / RESOLVED).write_text(json.dumps(self.description))


def _linked(draft: Draft, place: str) -> Draft:
    """Put a link to the private file, or its folder, in place of a file or folder."""
    target = draft.folder / place
    private = draft.place.secret
    if target.is_dir():
        shutil.rmtree(target)
        private = private.parent
    target.unlink(missing_ok=True)
    target.symlink_to(private)
    return draft


def _named(draft: Draft, place: str) -> Draft:
    """Say that a place outside of the folder is carried."""
    file = draft.folder / place
    draft.description["files"][place] = sha256(file.read_bytes()).hexdigest()
    return draft.changed(_reference={"name": "recorded", "file": f"{{folder}}/{place}"})


def _law(name: str) -> dict[str, Any]:
    return {"pd": {"name": name, "stiffness": 0.2}}


MINE = "{folder}/files/mine/mine.py:Evil"
BOTH, ALL = (RESUME, AGAIN), (RESUME, AGAIN, f"{RESUME} --trust", f"{AGAIN} --trust")
FOLDER_CODE: dict[str, tuple[Callable[[Draft], Draft], tuple[str, ...]]] = {
    "a law on this disk": (lambda draft: draft.changed(laws=_law(f"{draft.place.evil}:Evil")), ALL),
    "a law beside": (lambda draft: draft.changed(laws=_law("evil.py:Evil")), ALL),
    "a law that it carries": (
        lambda draft: draft.changed(laws=_law(MINE)).carrying("files/mine/mine.py", draft.place.evil.read_bytes()),
        BOTH,
    ),
    "bytecode beside a law": (
        lambda draft: (
            draft.changed(laws=_law(MINE))
            .carrying("files/mine/mine.py", b"import evil")
            .carrying("files/mine/evil.pyc", draft.place.evil.with_suffix(".pyc").read_bytes())
        ),
        ALL,
    ),
    "bytecode in place of a law": (
        lambda draft: (
            draft.changed(laws=_law(MINE))
            .carrying("files/mine/mine.py", draft.place.evil.read_bytes().replace(b"write_text", b"with_name"))
            .carrying(CACHED.format("files/mine", "mine"), draft.place.evil.with_suffix(".pyc").read_bytes())
        ),
        ALL,
    ),
    "a motion": (lambda draft: draft.changed(_reference={"name": f"{draft.place.evil}:Evil"}), ALL),
    "a varied motion": (
        lambda draft: draft.changed(vary={"reference.name": {"choice": ["lissajous", f"{draft.place.evil}:Evil"]}}),
        ALL,
    ),
    "a varied table": (
        lambda draft: draft.changed(vary={"reference": {"choice": [{"name": "evil.py:Evil"}]}}),
        ALL,
    ),
    "a law, of an older version": (lambda draft: draft.changed(laws=_law(f"{draft.place.evil}:Evil")).older(), BOTH),
}
"""Ways in which a folder would run code, with the commands that refuse it."""
FOLDER_FILES: dict[str, tuple[Callable[[Draft], Draft], tuple[str, ...]]] = {
    "a model on this disk": (lambda draft: draft.changed(_model=str(draft.place.secret)), ALL),
    "a motion on this disk": (
        lambda draft: draft.changed(_reference={"name": "recorded", "file": str(draft.place.secret)}),
        ALL,
    ),
    "a motion beside": (lambda draft: draft.changed(_reference="recorded:secret.csv"), ALL),
    "a motion by climbing": (
        lambda draft: draft.changed(_reference={"name": "recorded", "file": "{folder}/files/../../private/secret.csv"}),
        ALL,
    ),
    "the whole of a motion": (
        lambda draft: draft.changed(
            _reference={"name": "recorded", "file": str(draft.place.secret)}, _duration="whole"
        ),
        ALL,
    ),
    "a varied whole of a motion": (
        lambda draft: draft.changed(
            _reference={"name": "recorded", "file": str(draft.place.secret)}, vary={"duration": {"choice": ["whole"]}}
        ),
        ALL,
    ),
    "a varied model": (lambda draft: draft.changed(vary={"model": {"choice": [str(draft.place.secret)]}}), ALL),
    "a link to a motion": (lambda draft: _linked(draft, "files/motion/motion.csv"), ALL),
    "a link to a folder": (lambda draft: _linked(draft, "files/motion"), ALL),
    "a link to all": (lambda draft: _linked(draft, "files"), ALL),
    "a place by climbing": (lambda draft: _named(draft, "../private/secret.csv"), ALL),
    "an absolute place": (lambda draft: _named(draft, str(draft.place.secret)), ALL),
    "a motion, of an older version": (
        lambda draft: draft.changed(_reference={"name": "recorded", "file": str(draft.place.secret)}).older(),
        BOTH,
    ),
    "a model, of an older version": (lambda draft: draft.changed(_model=str(draft.place.secret)).older(), BOTH),
}
"""Ways in which a folder would open a file of this disk, with the commands that refuse it."""
BATCHES: dict[str, Callable[[Path], Any]] = {
    "edited": lambda file: file.write_bytes(file.read_bytes()[:-9] + b"0" + file.read_bytes()[-8:]),
    "cut": lambda file: file.write_bytes(file.read_bytes()[:100]),
    "a pipe": lambda file: (file.unlink(), os.mkfifo(file)),
    "a folder": lambda file: (file.unlink(), file.mkdir()),
    "a device": lambda file: (file.unlink(), file.symlink_to("/dev/zero")),
}
"""Changes of a file of episodes."""
DIGITS = "1" * 5000
TEXTS: dict[str, Callable[[str], str]] = {
    "empty": lambda text: "",
    "cut": lambda text: text[:300],
    "a list": lambda text: "[]",
    "deep": lambda text: "[" * 100_000,
    "digits": lambda text: text.replace('"samples": 2', f'"samples": {DIGITS}'),
    "a huge campaign": lambda text: text.replace('"samples": 2', '"samples": 1000000000000000'),
    "a huge batch": lambda text: text.replace('"batch_size": 1', '"batch_size": 1000000000000000'),
    "another format": lambda text: text.replace('"format": 1', '"format": 99'),
    "no files": lambda text: text.replace('"files": {', '"files": [], "others": {', 1),
    "files that are numbers": lambda text: text.replace('"files": {', '"files": {"files/a": 1, ', 1),
    "a law of words": lambda text: text.replace('"laws": {"pd"', '"laws": {' + json.dumps(ODD), 1),
    "versions of words": lambda text: text.replace(
        '"versions": {', f'"versions": {{{json.dumps(ODD)}: {json.dumps(ODD)}, '
    ),
    "a digest of words": lambda text: json.dumps({**json.loads(text), "digest": ODD}),
}
"""Other texts of ``campaign.json``."""


def folders(honest: Path) -> dict[str, Attack]:
    """Return all attacks by folders of campaigns, by kind and name.

    Args:
        honest: folder of :data:`HONEST`, complete.
    """

    def by_draft(change: Callable[[Draft], Draft]) -> Callable[[Path, Place], Any]:
        return lambda path, at: change(Draft(shutil.copytree(honest, path), at)).sent()

    def by_model(part: str, up: str) -> Callable[[Path, Place], Any]:
        return by_draft(lambda draft: draft.carrying("files/hand/hand.xml", outside(part, up, draft.place).encode()))

    def by_batch(change: Callable[[Path], Any]) -> Callable[[Path, Place], Any]:
        return lambda path, at: change(min((shutil.copytree(honest, path) / EPISODES).iterdir()))

    def by_text(change: Callable[[str], str]) -> Callable[[Path, Place], Any]:
        def make(path: Path, at: Place) -> None:
            file = shutil.copytree(honest, path) / RESOLVED
            file.write_text(change(json.dumps(json.loads(file.read_text()))))

        return make

    found: dict[str, Attack] = {}
    for kind, table in (("code", FOLDER_CODE), ("file", FOLDER_FILES)):
        for name, (change, refused) in table.items():
            found[f"{kind}: {name}"] = Attack(by_draft(change), refused, consent=refused == BOTH)
    for name, part in OUTSIDE.items():
        for kind, up in (("absolute", "/"), ("climbing", "../" * 40)):
            found[f"model: {kind} {name}"] = Attack(by_model(part, up), ALL, "outside of what it came with")
    found |= {f"batch: {name}": Attack(by_batch(change)) for name, change in BATCHES.items()}
    found |= {f"text: {name}": Attack(by_text(change)) for name, change in TEXTS.items()}
    return found
