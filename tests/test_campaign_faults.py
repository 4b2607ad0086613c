"""Campaigns whose processes are killed, and what their clusters open to the network.

Every fault comes at a random moment of a seeded generator, and the table in the end must be that of a run without
faults, bit for bit.
"""

import asyncio
import multiprocessing
import os
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import dask
import numpy as np
import psutil
import pytest
from distributed.cli import dask_scheduler, dask_worker
from distributed.comm import connect
from distributed.security import Security
from distributed.utils import get_mp_context

from sampling import count, long, some
from spherical_wrist.campaign.cluster import Cluster, Tls, connected, run_all
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, campaign_lock
from spherical_wrist.campaign.sweep import Listener, read_campaign, resume, sweep
from spherical_wrist.errors import ParameterError

TEXT = """
laws = ["fuzzy_sliding_computed_torque", "computed_torque"]
samples = 150
batch = 10
seed = 3
[experiment]
duration = 0.2
[vary]
mass_scale = { uniform = [0.5, 1.5] }
"disturbance.level" = { uniform = [0.0, 0.3] }
"""
BATCHES = 30
SEEDS = range(count(1, 1))
pytestmark = pytest.mark.slow
WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
HERE = Cluster(workers=0, threads=2)
IMPORTED = ("distributed", "spherical_wrist.campaign.batch", "spherical_wrist.simulation.simulate")
"""Modules that a worker imports, which take most of the time that it needs to begin."""


@pytest.fixture(scope="module", autouse=True)
def quick_workers():
    """Fork worker processes of this one from a process that has done their imports; those of the command do their own.

    They are processes like any other, which are killed, refuse strangers, and are begun anew.
    """
    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        get_mp_context().set_forkserver_preload(list(IMPORTED))
        yield


def begun(path, text=TEXT):
    file = path.with_suffix(".toml")
    file.write_text(text)
    with campaign_lock(path):
        return Folder.create(path, file, read_campaign(file))


def contents(path):
    return {file.name: file.read_bytes() for file in (path / "episodes").iterdir()}


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """The files of an undisturbed run."""
    folder = begun(tmp_path_factory.mktemp("faults") / "whole")
    with campaign_lock(folder.path):
        assert sweep(folder, HERE, Listener()) == folder.campaign.size
    return contents(folder.path)


def moment(seed):
    """Return the number of batches stored before the fault comes, and the delay after that [s]."""
    random = np.random.default_rng(seed)
    return int(random.integers(1, BATCHES // 3)), float(random.uniform(0.0, 0.1))


def stored(path):
    return len(list(path.glob("episodes/*.parquet")))


def wait_for(path, batches, alive=lambda: True):
    end = time.monotonic() + 120.0
    while stored(path) < batches:
        assert time.monotonic() < end, "nothing is stored"
        assert alive(), "it ended by itself"
        time.sleep(0.002)


def finish(path):
    """Resumes a campaign to its end; what was stored before must stay as it was, and not be run again."""
    before = {file: file.stat().st_mtime_ns for file in (path / "episodes").glob("*.parquet")}
    with campaign_lock(path):
        folder = resume(path)
        ran = sweep(folder, HERE, Listener(warn=pytest.fail))
    assert ran == folder.campaign.size - 10 * len(before)
    assert all(file.stat().st_mtime_ns == then for file, then in before.items())
    assert not list((path / "episodes").glob(".*"))
    return len(before)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_command_is_killed(expected, tmp_path, seed):
    batches, later = moment([seed, 1])
    (tmp_path / "c.toml").write_text(TEXT)
    path = tmp_path / "c"
    with subprocess.Popen([*WRIST, "sweep", str(tmp_path / "c.toml"), "-o", str(path), "--workers", "1"]) as command:
        wait_for(path, batches, lambda: command.poll() is None)
        time.sleep(later)
        workers = psutil.Process(command.pid).children(recursive=True)
        command.send_signal(signal.SIGKILL)
    assert workers
    assert not psutil.wait_procs(workers, timeout=60.0)[1]  # they end with it
    assert batches <= finish(path) < BATCHES
    assert contents(path) == expected


@pytest.mark.parametrize("seed", SEEDS)
def test_a_worker_is_killed(expected, tmp_path, seed):
    """The others and its successor do its work; the sweep goes on by itself."""
    folder = begun(tmp_path / "c")
    batches, later = moment([seed, 2])
    killed = []

    def kill():
        wait_for(folder.path, batches)
        time.sleep(later)
        workers = sorted(multiprocessing.active_children(), key=lambda process: process.pid)
        victim = workers[np.random.default_rng(seed).integers(len(workers))]
        victim.kill()
        killed.append(victim.pid)

    killer = threading.Thread(target=kill)
    killer.start()
    with campaign_lock(folder.path):
        assert sweep(folder, Cluster(workers=2, threads=1), Listener()) == folder.campaign.size
    killer.join()
    assert killed
    assert contents(folder.path) == expected
    assert finish(folder.path) == BATCHES


NURSERY = """
import importlib, os, runpy, signal, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
while line := sys.stdin.readline():
    born = os.fork()
    if not born:
        break
    print(born, flush=True)
else:
    sys.exit()
signal.signal(signal.SIGCHLD, signal.SIG_DFL)
os.dup2(2, 1)
sys.argv = line.strip().split("\\t")
runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
"""
"""Runs modules as ``python -m`` does, in processes of their own that find the slow imports done."""


@pytest.fixture(scope="module")
def nursery():
    """A function that begins ``python -m`` with its arguments, and returns the process."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen([sys.executable, "-c", NURSERY, *IMPORTED], **pipes) as process:

        def begin(*arguments):
            process.stdin.write("\t".join(arguments) + "\n")
            process.stdin.flush()
            return psutil.Process(int(process.stdout.readline()))

        yield begin
        process.stdin.close()


@contextmanager
def cluster_of(begin, *options, workers=1, protocol="tcp"):
    """A scheduler and its workers as processes of their own: the scheduler's, its address, and theirs."""
    with socket_free() as port:
        address = f"{protocol}://127.0.0.1:{port}"
    where = ["--host", "127.0.0.1", "--port", str(port), "--protocol", protocol, "--no-dashboard"]
    worker = [dask_worker.__name__, address, "--host", "127.0.0.1", "--no-dashboard", "--no-nanny", "--nthreads", "1"]
    scheduler = begin(dask_scheduler.__name__, *where, *options)
    team = [begin(*worker, *options) for _ in range(workers)]
    try:
        yield scheduler, address, tuple(team)
    finally:
        for process in (*team, scheduler):
            with suppress(psutil.NoSuchProcess):
                process.kill()
        psutil.wait_procs([*team, scheduler])


@contextmanager
def socket_free():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        yield bound.getsockname()[1]


class Remote(NamedTuple):
    """A cluster of three workers, for all the faults of a seed: its processes end one after another."""

    seed: int
    scheduler: psutil.Process
    address: str
    team: list[psutil.Process]


@pytest.fixture(scope="module", params=SEEDS)
def remote(nursery, request):
    with cluster_of(nursery, workers=3) as (scheduler, address, team):
        yield Remote(request.param, scheduler, address, list(team))


def at_work(process):
    """Waits until a worker has begun a batch, as its processor says."""

    def worked():
        return sum(process.cpu_times()[:2])

    before, end = worked(), time.monotonic() + 120.0
    while worked() < before + 0.3:
        assert time.monotonic() < end, "it does nothing"
        time.sleep(0.01)


@pytest.mark.parametrize("duration", some([0.2, 100.0], 2))
def test_a_worker_is_told_to_end(expected, tmp_path, remote, duration):
    """As at the time limit of a job: another runs the batch that it has begun, also where that would take seconds."""
    text = TEXT if duration == 0.2 else TEXT.replace("0.2", str(duration), 1).replace("150", "10")
    folder = begun(tmp_path / "c", text)
    told, left = remote.team.pop(0), []
    batches, later = moment([remote.seed, 5])

    def end():
        if duration == 0.2:
            wait_for(folder.path, batches)
        else:
            at_work(told)
        time.sleep(later)
        left.append(folder.files.count - stored(folder.path))
        told.send_signal(signal.SIGTERM)

    ender = threading.Thread(target=end)
    ender.start()
    with campaign_lock(folder.path):
        assert sweep(folder, Cluster(remote.address), Listener(warn=pytest.fail)) == folder.campaign.size
    ender.join()
    assert left[0] > 0
    told.wait(timeout=60.0)
    assert all(process.is_running() for process in remote.team)
    assert finish(folder.path) == folder.files.count
    if duration == 0.2:
        assert contents(folder.path) == expected


def test_the_scheduler_is_killed(expected, tmp_path, remote):
    folder = begun(tmp_path / "c")
    batches, later = moment([remote.seed, 3])

    def kill():
        wait_for(folder.path, batches)
        time.sleep(later)
        remote.scheduler.kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with campaign_lock(folder.path), pytest.raises(CampaignError) as error:
        sweep(folder, Cluster(remote.address), Listener())
    killer.join()
    assert "the connection to the scheduler is lost" in str(error.value)
    assert f"wrist sweep {folder.path} --resume" in str(error.value)
    assert batches <= finish(folder.path) < BATCHES
    assert contents(folder.path) == expected


@long
@pytest.mark.parametrize("seed", SEEDS)
def test_the_command_is_killed_again_and_again(expected, tmp_path, seed):
    random = np.random.default_rng([seed, 4])
    folder = begun(tmp_path / "c")
    while stored(folder.path) < BATCHES:
        command = subprocess.Popen([*WRIST, "sweep", str(folder.path), "--resume"], stdout=subprocess.DEVNULL)
        with suppress(subprocess.TimeoutExpired):
            command.wait(timeout=random.uniform(2.0, 5.0))
        os.kill(command.pid, signal.SIGKILL) if command.poll() is None else None
        command.wait()
    assert finish(folder.path) == BATCHES
    assert contents(folder.path) == expected


def listening():
    """Return the addresses at which this process and all that it began listen."""
    found = set()
    for each in (psutil.Process(), *psutil.Process().children(recursive=True)):
        with suppress(psutil.NoSuchProcess):  # it may end while it is looked at
            found |= {one.laddr for one in each.net_connections() if one.status == psutil.CONN_LISTEN}
    return found


def sys_path():
    return [each for each in sys.path if Path(each).is_dir()]


def answers(asked, patience):
    """Return True for each address where a Dask process answers somebody with such an identity.

    It would then run any code for him. All are asked at the same time, and given up after a time [s].
    """

    async def ask(address, security):
        comm = await connect(address, timeout=patience, **security.get_connection_args("client"))
        await comm.write({"op": "identity", "reply": True})
        await comm.read()
        comm.abort()

    async def answered(address, security):
        with suppress(OSError, TimeoutError):
            await asyncio.wait_for(ask(address, security), patience)
            return True
        return False

    async def ask_all():
        return await asyncio.gather(*(answered(*each) for each in asked))

    return asyncio.run(ask_all())


def test_clusters_of_this_machine_let_nobody_in(monkeypatch):
    """Worker processes listen on the loopback interface only, and refuse whoever lacks their cluster's identity."""
    places, load = [], ssl.SSLContext.load_cert_chain

    def loaded(context, certificate, key):
        assert Path(key).parent.stat().st_mode & 0o077 == 0  # the key is on the disk for this moment
        places.append(Path(key))
        return load(context, certificate, key)

    monkeypatch.setattr(ssl.SSLContext, "load_cert_chain", loaded)
    with connected(HERE) as client:
        assert [result for _, result in run_all(client, abs, [-1, -2], lambda task: (task,))]
        assert not listening()
    assert not places
    with connected(Cluster(workers=1, threads=1)) as client:
        assert [result for _, result in run_all(client, abs, [-1, -2], lambda task: (task,))]
        found = listening()
        assert {address.ip for address in found} == {"127.0.0.1"}
        assert len(found) == 3  # scheduler, worker, and what watches over the worker
        mine = {"tls": client.security}
        strangers = {"tls": Security.temporary(), "tcp": Security()}

        def asked(identities):
            return [(f"{kind}://127.0.0.1:{port}", each) for _, port in found for kind, each in identities.items()]

        assert all(answers(asked(mine), 60.0))
        assert not any(answers(asked(strangers), 2.0))
        scratch = [Path(each) for found in client.run(sys_path).values() for each in found if "dask" in each]
        assert scratch
        assert all(each.parent.stat().st_mode & 0o077 == 0 for each in scratch)
    assert places
    assert not any(key.exists() for key in places)
    assert not listening()
    assert not [each for each in sys.path if "dask" in each]


def test_a_task_that_kills_every_worker_is_given_up(monkeypatch):
    monkeypatch.setattr("spherical_wrist.campaign.cluster.ALLOWED_FAILURES", 1)
    given_up = pytest.raises(CampaignError, match="ended all of 2 workers")
    with connected(Cluster(workers=1, threads=1)) as client, given_up:
        list(run_all(client, os._exit, [3], lambda task: (task,)))


def test_the_shape_of_the_cluster_fits_the_machine(monkeypatch):
    def shape(cores, **options):
        monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(cores)))
        return Cluster(**options).shape()

    assert shape(1) == (0, 1)
    assert shape(2) == (0, 2)
    assert shape(4) == (0, 4)
    assert shape(16) == (4, 4)
    assert shape(6) == (2, 3)
    assert shape(16, threads=3) == (0, 3)
    assert shape(16, workers=8) == (8, 2)
    assert shape(2, workers=0) == (0, 2)
    assert shape(2, workers=3, threads=2) == (3, 2)


def test_nobody_answers():
    with socket_free() as port:
        nobody = Cluster(f"tcp://127.0.0.1:{port}")
    soon = dask.config.set({"distributed.comm.timeouts.connect": "0.3s"})
    with soon, pytest.raises(CampaignError, match="no scheduler can be reached"), connected(nobody):
        pass
    with pytest.raises(ParameterError, match="no such scheduler file"), connected(Cluster("nowhere")):
        pass


@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl to make certificates")
def test_a_cluster_by_tls(nursery, tmp_path):
    ca, cert, key = (tmp_path / name for name in ("ca.pem", "cert.pem", "key.pem"))
    new = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1"]
    subprocess.run([*new, "-subj", "/CN=localhost", "-keyout", key, "-out", cert], check=True, capture_output=True)
    shutil.copy(cert, ca)  # it signed itself
    options = ["--tls-ca-file", str(ca), "--tls-cert", str(cert), "--tls-key", str(key)]
    with cluster_of(nursery, *options, protocol="tls") as (_, address, _):
        with connected(Cluster(address, tls=Tls(ca, cert, key))) as client:
            assert [result for _, result in run_all(client, abs, [-7], lambda task: (task,))] == [7]
        with pytest.raises(CampaignError, match="no scheduler"), connected(Cluster(address.replace("tls", "tcp"))):
            pass
    without = Cluster("tls://127.0.0.1:1", tls=Tls(ca, cert, tmp_path / "none.pem"))
    with pytest.raises(ParameterError, match="no such file"), connected(without):
        pass
