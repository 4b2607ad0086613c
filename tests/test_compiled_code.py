"""Machine code on disk: found again without numba, and never worse than a compilation whatever is in its place."""

import errno
import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spherical_wrist import Experiment, simulate
from spherical_wrist.control import FuzzySlidingComputedTorque
from spherical_wrist.control.contract import COMMAND
from spherical_wrist.loop import compiler, object_cache
from spherical_wrist.loop.machine_code import CompiledError, MachineCode
from test_laws import compiled_steps, signals

SIMULATE = "from spherical_wrist import Experiment, simulate; simulate(Experiment(duration=0.05))"
RUN = (
    "import sys; sys.argv = ['wrist', 'run', '--duration', '0.05', '-o', 'run.rrd']\n"
    "from spherical_wrist.cli import main\ntry:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
)
HEAVY = (
    "import sys; print(*sorted({'numba', 'scipy', 'matplotlib', 'duckdb', 'dask'} & set(sys.modules)), file=sys.stderr)"
)


def double(values):
    """A function to compile."""
    for i in range(len(values)):
        for j in range(values.shape[1]):
            values[i, j] *= 2.0


def raises(values):
    """A function that fails when it runs."""
    if values[0, 0] > 0.0:
        raise ValueError


def fresh(function):
    """The function from the cache on disk, or compiled: not the one that this process has."""
    return compiler._package_function.__wrapped__(function, (np.float64,))


@pytest.fixture(autouse=True)
def told_anew():
    """Let every test hear the warnings that a process gives once."""
    object_cache._warn.cache_clear()


@pytest.fixture
def compilations(monkeypatch):
    """Names of the functions that are compiled from now on."""
    from spherical_wrist.loop import numba_backend

    names, emit = [], numba_backend.emit
    monkeypatch.setattr(
        numba_backend, "emit", lambda function, *rest: names.append(function.__name__) or emit(function, *rest)
    )
    return names


@pytest.mark.parametrize("code", [SIMULATE, RUN], ids=["simulate", "wrist run"])
def test_a_warm_process_imports_no_compiler(code, tmp_path):
    simulate(Experiment(duration=0.05))  # the cache has it now
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{HEAVY}"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr.strip()


def test_code_from_the_cache_is_not_compiled_again(compilations, monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    for _ in range(3):
        values = np.ones((2, 2))
        fresh(double)(values)
        assert (values == 2.0).all()
    assert compilations == ["double"]
    assert tmp_path.stat().st_mode & 0o777 == 0o700 or tmp_path.stat().st_mode & 0o022 == 0


def damaged(content):
    """Faults of a file in the cache."""
    yield b""
    yield content[:20]
    yield content[:-1]
    yield content[:-1] + bytes([content[-1] ^ 1])
    yield object_cache.MAGIC + bytes(32) + b"[]\n"
    yield b"\x80\x04." + content
    for place in (40, 70, len(content) // 2):
        yield content[:place] + bytes([content[place] ^ 255]) + content[place + 1 :]


def test_a_damaged_file_costs_a_compilation_and_one_line(compilations, monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    fresh(double)
    [file] = tmp_path.glob("*.object")
    whole = file.read_bytes()
    key = file.stem
    for content in damaged(whole):
        file.write_bytes(content)
        object_cache._warn.cache_clear()
        with pytest.warns(UserWarning, match=f"{file.name}.*compiled again: it is damaged"):
            assert object_cache.read(key) is None
        assert object_cache.read(key) is None  # and is not told again
    fresh(double)
    assert len(compilations) == 2
    assert object_cache.read(key) is not None


@pytest.mark.parametrize("harm", [os.mkfifo, os.mkdir, lambda path: path.symlink_to(path)])
def test_what_is_no_file_costs_a_compilation_and_one_line(compilations, monkeypatch, tmp_path, harm):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    fresh(double)
    [file] = tmp_path.glob("*.object")
    file.unlink()
    harm(file)
    with pytest.warns(UserWarning, match="compiled again"):
        fresh(double)
    assert len(compilations) == 2
    assert object_cache.read(file.stem) is not None


def test_a_file_under_another_name_is_not_taken(monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    object_cache.write("a" * 64, MachineCode("f", 0, (), b"code"))
    assert object_cache.read("a" * 64) == MachineCode("f", 0, (), b"code")
    (tmp_path / f"{'a' * 64}.object").rename(tmp_path / f"{'b' * 64}.object")
    with pytest.warns(UserWarning, match="damaged"):
        assert object_cache.read("b" * 64) is None


@pytest.mark.parametrize("place", ["/proc/nowhere", "file/below", "open to all", "x" * 300])
def test_without_a_folder_there_is_no_cache(compilations, monkeypatch, tmp_path, place):
    (tmp_path / "file").write_text("")
    (tmp_path / "open to all").mkdir()
    (tmp_path / "open to all").chmod(0o777)
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path / place))
    values = np.ones((1, 1))
    with pytest.warns(UserWarning, match="cannot be kept"):
        fresh(double)(values)
    fresh(double)(values)  # which is not told again
    assert values == 4.0
    assert len(compilations) == 2
    assert not list(tmp_path.rglob("*.object"))


@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EROFS, errno.EDQUOT])
def test_a_full_or_read_only_disk_costs_a_compilation_and_one_line(compilations, monkeypatch, tmp_path, fault):
    """Code that is kept already is used; a new function is compiled, and nothing is left of the attempt to keep it."""
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    fresh(double)
    [file] = tmp_path.glob("*.object")

    def full(self, target):
        raise OSError(fault, os.strerror(fault))

    monkeypatch.setattr(Path, "replace", full)
    fresh(double)
    assert compilations == ["double"]
    with pytest.warns(UserWarning, match=os.strerror(fault)):
        fresh(raises)
    assert compilations == ["double", "raises"]
    assert list(tmp_path.iterdir()) == [file]


def test_the_cache_of_an_installation_is_used(compilations, monkeypatch, tmp_path):
    """It belongs to root, who need not be the user, and only he writes to it; nobody else's is used."""
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    fresh(double)
    owner = tmp_path.stat().st_uid
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    if owner:  # the tests run as somebody: as root, the files are root's already
        monkeypatch.setattr(object_cache, "ROOT", owner)
    fresh(double)
    assert len(compilations) == 1
    monkeypatch.setattr(object_cache, "ROOT", owner + 2)
    with pytest.warns(UserWarning, match="it belongs to another user"):
        fresh(double)
    assert len(compilations) == 2


def test_code_that_others_may_write_to_is_not_run(compilations, monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    fresh(double)
    [file] = tmp_path.glob("*.object")
    file.chmod(0o666)
    with pytest.warns(UserWarning, match="other users may write to it"):
        fresh(double)
    assert len(compilations) == 2
    assert file.stat().st_mode & 0o077 == 0


LAW = """from spherical_wrist.control import Law


class Copied(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = 20.0 * signal.error[i]
"""


def test_a_law_in_another_folder_or_imported_is_found_in_the_cache(compilations, monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path / "cache"))
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "copied.py").write_text(LAW)
        law = Experiment(law=f"{tmp_path / folder / 'copied.py'}:Copied").law
        compiler.compiled_law(law)
    assert compilations == ["step"]
    monkeypatch.syspath_prepend(str(tmp_path / "two"))
    for _ in range(2):
        sys.modules.pop("copied", None)
        compiler.compiled_law(importlib.import_module("copied").Copied())
    assert compilations == ["step", "step"]  # under its own name, once
    sys.modules.pop("copied", None)


def test_only_so_many_files_are_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("WRIST_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(object_cache, "KEPT", 3)
    for number in range(5):
        object_cache.write(f"{number:064d}", MachineCode("f", 0, (), b""))
        os.utime(tmp_path / f"{number:064d}.object", (number, number))
    assert sorted(file.stem for file in tmp_path.iterdir()) == [f"{number:064d}" for number in (2, 3, 4)]


def test_an_exception_in_compiled_code_is_one_here():
    compiled = fresh(raises)
    compiled(np.zeros((1, 1)))
    with pytest.raises(CompiledError):
        compiled(np.ones((1, 1)))


def test_arrays_that_are_not_in_one_piece_are_refused():
    with pytest.raises(ValueError, match="contiguous"):
        fresh(double)(np.zeros((4, 4))[:, ::2])


def test_the_bits_are_those_of_numbas_own_dispatcher(monkeypatch):
    """Linking, optimising and loading of our own change nothing of what numba generates."""
    import numba

    from spherical_wrist.compat import numba as codegen
    from spherical_wrist.loop import numba_backend

    law, given = FuzzySlidingComputedTorque(), signals(200)
    ours, _ = compiled_steps(law, given)
    scope = {**vars(compiler), "_step": type(law).step, "_LAYOUT": law.layout(), "_STATE": law.state_layout()}
    step = type(compiler._unpack_and_step)(compiler._unpack_and_step.__code__, scope, "step")
    monkeypatch.setattr(codegen, "_compiled", {})
    task = codegen.Task(compiler._foreign, numba_backend.REPLACED)
    monkeypatch.setattr(codegen, "_task", task)
    theirs = np.full(len(given) * COMMAND.itemsize // 8, np.nan).view(COMMAND)
    dispatcher, packed, state = numba.njit(error_model="numpy")(step), law.packed(), np.zeros(1)
    for k in range(len(given)):
        dispatcher(given[k], packed, state, theirs[k])
    assert ours.tobytes() == theirs.tobytes()
