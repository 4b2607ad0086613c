"""Files are written whole or not at all, on file systems with and without nameless files, and nothing is left."""

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rigs import one_line
from spherical_wrist import files
from spherical_wrist.errors import RecordingError
from spherical_wrist.files import LEFT_AFTER, check_writable, make_folder, write_together, write_whole


def no_nameless_files(monkeypatch):
    monkeypatch.delattr(os, "O_TMPFILE", raising=False)


def no_proc(monkeypatch):
    monkeypatch.setattr(files, "_opened", lambda descriptor: Path(f"/no/proc/{descriptor}"))


def refused_by_the_file_system(monkeypatch):
    before = os.open

    def refuse(path, flags, mode=0o777):
        if hasattr(os, "O_TMPFILE") and flags & os.O_TMPFILE == os.O_TMPFILE:
            raise OSError(errno.EOPNOTSUPP, "not supported")
        return before(path, flags, mode)

    monkeypatch.setattr(os, "open", refuse)


@pytest.fixture(params=[None, no_nameless_files, no_proc, refused_by_the_file_system])
def folder(request, monkeypatch, tmp_path):
    """An empty folder, on this system as it is and on poorer ones."""
    if request.param:
        request.param(monkeypatch)
    return tmp_path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_new_file_and_one_that_takes_the_place_of_another(folder):
    for content in (b"one", b"two" * 10**6, b""):
        write_whole(folder / "a.rrd", content)
        assert (folder / "a.rrd").read_bytes() == content
        assert names(folder) == ["a.rrd"]


def test_permissions_are_those_of_any_new_file(folder):
    before = os.umask(0o027)
    try:
        write_whole(folder / "a", b"")
    finally:
        os.umask(before)
    assert (folder / "a").stat().st_mode & 0o777 == 0o640


def test_a_symbolic_link_stays_one_and_other_hard_links_keep_their_content(folder):
    (folder / "file").write_bytes(b"old")
    (folder / "link").symlink_to("file")
    os.link(folder / "file", folder / "other")
    write_whole(folder / "link", b"new")
    assert (folder / "link").is_symlink()
    assert (folder / "file").read_bytes() == b"new"
    assert (folder / "other").read_bytes() == b"old"
    (folder / "dangling").symlink_to("made")
    write_whole(folder / "dangling", b"new")
    assert (folder / "made").read_bytes() == b"new"


def test_a_failure_while_writing_leaves_what_was_there(folder, monkeypatch):
    (folder / "a").write_bytes(b"old")

    def full(descriptor, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(RecordingError, match="free some space") as error:
        write_whole(folder / "a", b"new")
    assert "No space left on device" in one_line(error.value)
    assert (folder / "a").read_bytes() == b"old"
    assert names(folder) == ["a"]


def test_files_that_belong_together_are_all_replaced_or_none(folder):
    write_together({folder / "a": b"old", folder / "b": b"old"})
    (folder / "c").mkdir()
    with pytest.raises(RecordingError, match=r"/c' cannot be written: it is a directory"):
        write_together({folder / "a": b"new", folder / "b": b"new", folder / "c": b"new"})
    assert (folder / "a").read_bytes() == (folder / "b").read_bytes() == b"old"
    assert names(folder) == ["a", "b", "c"]
    write_together({folder / "a": b"new", folder / "b": b"new"})
    assert (folder / "a").read_bytes() == (folder / "b").read_bytes() == b"new"


def test_what_cannot_be_written_is_refused_beforehand(folder):
    check_writable(folder / "fine")
    assert names(folder) == []
    os.mkfifo(folder / "fifo")
    (folder / "file").touch()
    long = folder / ("n" * 256)
    for path in (folder, folder / "fifo", folder / "no" / "a", folder / "file" / "a", long, Path("/dev/null")):
        for act in (check_writable, lambda path: write_whole(path, b"new")):
            with pytest.raises(RecordingError, match="cannot be written") as error:
                act(path)
            one_line(error.value)
    with pytest.raises(RecordingError, match="cannot be made"):
        make_folder(folder / "file" / "a")
    assert names(folder) == ["fifo", "file"]


def test_what_a_killed_command_left_is_cleared_away_but_not_what_another_one_writes(folder):
    left, running, strange = (folder / f".wrist-{digit * 16}.part" for digit in "0az")
    for path in (left, running, strange):
        path.touch()
    for path in (left, strange):
        os.utime(path, (0, time.time() - LEFT_AFTER - 1.0))
    check_writable(folder / "a")
    assert names(folder) == sorted([running.name, strange.name])
    os.utime(running, (0, 0))
    make_folder(folder)
    assert names(folder) == [strange.name]


@pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="needs files without a name")
@pytest.mark.parametrize("old", [None, b"old"])
def test_killed_at_the_worst_moment_nothing_is_left(tmp_path, old):
    """Everything is on the disk but the name."""
    if old:
        (tmp_path / "a").write_bytes(old)
    code = (
        "import os, signal\nfrom pathlib import Path\nfrom spherical_wrist.files import write_whole\n"
        "os.fsync = lambda descriptor: os.kill(os.getpid(), signal.SIGKILL)\nwrite_whole(Path('a'), b'new' * 10**6)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False)
    assert done.returncode == -9
    assert names(tmp_path) == (["a"] if old else [])
    assert not old or (tmp_path / "a").read_bytes() == old
