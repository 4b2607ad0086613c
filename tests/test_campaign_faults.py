"""Campaigns whose processes are killed, and what their clusters open to the network.

Every fault comes at a random moment of a seeded generator, and the table in the end must be that of a run without
faults, bit for bit.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import dask
import numpy as np
import psutil
import pytest
from distributed.cli import dask_scheduler, dask_worker

from sampling import THOROUGH, count
from spherical_wrist.campaign.cluster import Cluster, Tls, connected, run_all
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, campaign_lock
from spherical_wrist.campaign.sweep import Listener, read_campaign, resume, sweep
from spherical_wrist.errors import ParameterError

TEXT = """
laws = ["fuzzy_sliding_computed_torque", "computed_torque"]
samples = 300
batch = 10
seed = 3
[experiment]
duration = 0.2
[vary]
mass_scale = { uniform = [0.5, 1.5] }
"disturbance.level" = { uniform = [0.0, 0.3] }
"""
BATCHES = 60
SEEDS = range(count(1, 1))
pytestmark = pytest.mark.slow
WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
HERE = Cluster(workers=0, threads=2)


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
    assert not psutil.wait_procs(workers, timeout=10.0)[1]  # they end with it
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
        workers = [p for p in psutil.Process().children(recursive=True) if any("spawn_main" in a for a in p.cmdline())]
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


@contextmanager
def cluster_of(*options, workers=1, protocol="tcp"):
    """A scheduler and its workers as processes of their own: the scheduler's, its address, and theirs."""
    start = [sys.executable, "-m"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with socket_free() as port:
        address = f"{protocol}://127.0.0.1:{port}"
    where = ["--host", "127.0.0.1", "--port", str(port), "--protocol", protocol, "--no-dashboard"]
    scheduler = subprocess.Popen([*start, dask_scheduler.__name__, *where, *options], **quiet)
    worker = [*start, dask_worker.__name__, address, "--host", "127.0.0.1", "--no-dashboard", "--no-nanny"]
    team = [subprocess.Popen([*worker, "--nthreads", "1", *options], **quiet) for _ in range(workers)]
    try:
        yield scheduler, address, team
    finally:
        for process in (*team, scheduler):
            with suppress(OSError):
                process.kill()
            process.wait()


@contextmanager
def socket_free():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        yield bound.getsockname()[1]


@pytest.mark.parametrize("duration", [0.2, 20.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_worker_is_told_to_end(expected, tmp_path, seed, duration):
    """As at the time limit of a job: another runs the batch that it has begun, also where that would take seconds."""
    text = TEXT if duration == 0.2 else TEXT.replace("0.2", str(duration), 1).replace("300", "15")
    folder = begun(tmp_path / "c", text)
    with cluster_of(workers=2) as (_, address, team):

        def end():
            wait_for(folder.path, 1)
            time.sleep(float(np.random.default_rng([seed, 5]).uniform(0.0, 0.5)))
            team[0].send_signal(signal.SIGTERM)

        ender = threading.Thread(target=end)
        ender.start()
        with campaign_lock(folder.path):
            assert sweep(folder, Cluster(address), Listener(warn=pytest.fail)) == folder.campaign.size
        ender.join()
        team[0].wait(timeout=20.0)
        assert team[1].poll() is None
    assert finish(folder.path) == folder.files.count
    if duration == 0.2:
        assert contents(folder.path) == expected


@pytest.mark.parametrize("seed", SEEDS)
def test_the_scheduler_is_killed(expected, tmp_path, seed):
    folder = begun(tmp_path / "c")
    batches, later = moment([seed, 3])
    with cluster_of() as (scheduler, address, _):

        def kill():
            wait_for(folder.path, batches)
            time.sleep(later)
            scheduler.kill()

        killer = threading.Thread(target=kill)
        killer.start()
        with campaign_lock(folder.path), pytest.raises(CampaignError) as error:
            sweep(folder, Cluster(address), Listener())
        killer.join()
    assert "the connection to the scheduler is lost" in str(error.value)
    assert f"wrist sweep {folder.path} --resume" in str(error.value)
    assert batches <= finish(folder.path) < BATCHES
    assert contents(folder.path) == expected


@pytest.mark.skipif(not THOROUGH, reason="a kill of the command is tried above; WRIST_THOROUGH=1 repeats it")
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


def listening(process):
    return {
        connection.laddr.ip
        for each in (process, *process.children(recursive=True))
        for connection in each.net_connections()
        if connection.status == psutil.CONN_LISTEN
    }


def test_clusters_of_this_machine_listen_on_the_loopback_interface_only():
    for cluster in (HERE, Cluster(workers=1, threads=1)):
        with connected(cluster) as client:
            assert [result for _, result in run_all(client, abs, [-1, -2], lambda task: (task,))]
            assert listening(psutil.Process()) == {"127.0.0.1"}
    assert not listening(psutil.Process())


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
def test_a_cluster_by_tls(tmp_path):
    ca, cert, key = (tmp_path / name for name in ("ca.pem", "cert.pem", "key.pem"))
    new = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1"]
    subprocess.run([*new, "-subj", "/CN=localhost", "-keyout", key, "-out", cert], check=True, capture_output=True)
    shutil.copy(cert, ca)  # it signed itself
    options = ["--tls-ca-file", str(ca), "--tls-cert", str(cert), "--tls-key", str(key)]
    with cluster_of(*options, protocol="tls") as (_, address, _):
        with connected(Cluster(address, tls=Tls(ca, cert, key))) as client:
            assert [result for _, result in run_all(client, abs, [-7], lambda task: (task,))] == [7]
        with pytest.raises(CampaignError, match="no scheduler"), connected(Cluster(address.replace("tls", "tcp"))):
            pass
    without = Cluster("tls://127.0.0.1:1", tls=Tls(ca, cert, tmp_path / "none.pem"))
    with pytest.raises(ParameterError, match="no such file"), connected(without):
        pass
