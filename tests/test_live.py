"""Runs in a viewer while they are simulated: what arrives there, and that nothing that happens there harms the run."""

import contextlib
import http.server
import io
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest
import rerun as rr
from matplotlib.image import imread
from rerun.experimental import ViewerClient

import needs
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.cli import main
from spherical_wrist.errors import ViewerError
from spherical_wrist.recording import live
from spherical_wrist.recording.address import Address, check_viewer, free_port, is_listening, read_address
from spherical_wrist.recording.live_run import close_view, live_view
from spherical_wrist.recording.process import rerun_process
from spherical_wrist.recording.screenshot import screenshot
from spherical_wrist.reference import Reference

pytestmark = pytest.mark.slow
RUN = Experiment(duration=3.0)
NO_FOOTER = pytest.mark.filterwarnings("ignore:RRD file has no footer")
"""Rerun's program saves what arrives without one."""


def wait_for(condition, patience=60.0, pause=0.05):
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(pause)


@contextlib.contextmanager
def receiver(*arguments):
    """Rerun's own server, which takes runs as a viewer does, without drawing them."""
    port = free_port()
    with rerun_process([*map(str, arguments), "--serve-grpc", "--port", str(port)]) as server:
        wait_for(lambda: is_listening(port))
        yield server.process, Address(port=port)


@pytest.fixture
def listening():
    with receiver() as found:
        yield found


OTHERS = set()
"""Processes that tests of other files have left to this one, such as the helpers of multiprocessing."""


@pytest.fixture(scope="module", autouse=True)
def others():
    OTHERS.update(psutil.Process().children(recursive=True))


def children():
    everyone = set(psutil.Process().children(recursive=True)) - OTHERS
    return [child for child in everyone if child.name() != "rerun"]


def bits(run):
    return {name: array.tobytes() for name, array in run.channels.items()}


# --- the run is the same ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", sorted(set(Reference.members) - {"recorded"}))
@pytest.mark.parametrize("hardware", ["ideal", "realistic"])
def test_the_bits_of_a_run_do_not_depend_on_being_watched(reference, hardware):
    disturbance = {"name": "noise", "amplitude": 0.003}
    experiment = Experiment(
        reference=reference, disturbance=disturbance, sensing=hardware, actuation=hardware, duration=2.4
    )
    pieces = []
    alone, watched = simulate(experiment), simulate(experiment, watch=pieces.append)
    assert bits(watched) == bits(alone)
    assert watched.metrics == alone.metrics
    assert [len(piece) for piece in pieces] == [1000, 1000, 400]


def test_watching_without_keeping_anything_shows_the_same():
    pieces = []
    run = simulate(RUN, keep_series=False, record_every=7, watch=pieces.append)
    assert len(run) == 0
    seen = np.concatenate([piece.error for piece in pieces])
    assert seen.tobytes() == simulate(RUN, record_every=7).error.tobytes()


def test_live_or_not_the_command_leaves_the_same_recording(listening, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    told = []
    for file, options in (("plain.rrd", []), ("live.rrd", ["--live", "--viewer", str(listening[1])])):
        monkeypatch.setattr(sys, "argv", ["wrist", "run", "--duration", "3", "--json", "-o", file, *options])
        with pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        assert (end.value.code, printed.err) == (0, "")
        told.append(json.loads(printed.out)["metrics"])
    plain, shown = load_recording("plain.rrd"), load_recording("live.rrd")
    assert told[0] == told[1] == dict(plain.metrics)
    assert bits(shown) == bits(plain)
    same = ("description", "outcome", "metrics", "measurement", "versions", "every")
    assert {name: getattr(shown, name) for name in same} == {name: getattr(plain, name) for name in same}
    assert not children()


# --- what arrives ----------------------------------------------------------------------------------------------------


def curves(path, entity, component="Scalars:scalars", depth=1):
    """Return the values recorded of an entity, in the order of time, in one flat array."""
    batches = [chunk.to_record_batch() for chunk in rr.chunk.RrdReader(path).stream() if chunk.entity_path == entity]
    timed = [batch for batch in batches if batch.schema.get_field_index("sim_time") >= 0]
    timed.sort(key=lambda batch: batch.column("sim_time")[0].value)
    columns = [batch.column(component) for batch in timed if batch.schema.get_field_index(component) >= 0]
    for _ in range(depth):
        columns = [column.flatten() for column in columns]
    return np.concatenate([column.to_numpy(zero_copy_only=False) for column in columns])


@NO_FOOTER
def test_every_row_arrives_and_so_does_how_it_ended(tmp_path):
    saved = tmp_path / "arrived.rrd"
    port = free_port()
    with rerun_process(["--save", str(saved), "--port", str(port)]) as server:
        wait_for(lambda: is_listening(port))
        with live_view(RUN, Address(port=port)) as view:

            def watch(series):
                view.show(series)
                wait_for(lambda: view._taken == view._given)  # piece by piece

            run = simulate(RUN, watch=watch)
            assert close_view(view, run) == ""
        server.process.send_signal(signal.SIGINT)
        server.process.wait(60)
    for name in ("error", "surface", "torque", "disturbance", "slope", "rate_error"):
        assert curves(saved, f"/plots/{name}").tobytes() == getattr(run, name).tobytes()
    turns = curves(saved, "/world/wrist", "Transform3D:quaternion")
    assert len(turns) == len(run) // 10  # as many as in a file, one each 10 ms
    trail = curves(saved, "/world/tip/actual", "LineStrips3D:strips", depth=3).reshape(-1, 2, 3)
    assert trail[:, 1].tobytes() == run.tip[::10].astype(np.float32).tobytes()
    assert trail[1:, 0].tobytes() == trail[:-1, 1].tobytes()  # each goes on where the one before ended
    texts = [chunk for chunk in rr.chunk.RrdReader(saved).stream() if chunk.entity_path == "/summary/metrics"]
    said = [chunk.to_record_batch().column("TextDocument:text")[0].as_py()[0] for chunk in texts]
    assert any("simulating" in text for text in said)
    assert any(f"{run.metrics.rms_error_rad:.4g}" in text for text in said)


def test_a_viewer_shows_in_the_end_what_it_shows_of_the_file(tmp_path):
    needs.vulkan()
    size = (900, 600)
    port = free_port()
    window = ["--headless", "--hide-welcome-screen", "--port", str(port), "--window-size", f"{size[0]}x{size[1]}"]
    with rerun_process(window, {"RUST_LOG": "error"}):
        wait_for(lambda: is_listening(port))
        with live_view(RUN, Address(port=port)) as view:
            run = simulate(RUN, watch=view.show)
            assert close_view(view, run) == ""
        record(run, tmp_path / "run.rrd")
        client = ViewerClient.connect(Address(port=port).url)
        file_picture = pixels(screenshot(tmp_path / "run.rrd", size=size).png)
        assert file_picture.std() > 0.1

        def the_same():
            with contextlib.suppress(RuntimeError, ConnectionError):
                live_picture = pixels(client.take_screenshot())
                return (np.abs(live_picture - file_picture).max(axis=2) > 0.1).mean() < 0.0005
            return False

        wait_for(the_same, 90.0, pause=0.4)  # the viewer draws each time


def pixels(png):
    """All but the bars above and below."""
    return imread(io.BytesIO(png))[40:-40, :, :3]


# --- nothing that happens to the viewer harms the run ----------------------------------------------------------------


def test_a_viewer_that_is_closed_is_told_in_a_line(listening):
    process, address = listening
    pieces = []

    def watch(series):
        pieces.append(series)
        if len(pieces) == 2:
            wait_for(lambda: view._taken)
            process.kill()
            process.wait()
        view.show(series)

    with live_view(RUN, address) as view:
        run = simulate(RUN, watch=watch)
        assert close_view(view, run) == f"the viewer on {address} was closed; the run went on without it"
    assert bits(run) == bits(simulate(RUN))
    assert not children()


def test_a_viewer_that_hangs_holds_up_nothing(listening, monkeypatch):
    """Neither the run, nor its end, nor the memory: of what waits, every second row goes."""
    process, address = listening
    monkeypatch.setattr(live, "_PATIENCE", 1.0)
    monkeypatch.setattr(live, "WAITING", 1500)
    long = Experiment(duration=60.0)
    most, slowest, pieces = 0, 0.0, 0

    def watch(series):
        nonlocal most, slowest, pieces
        pieces += 1
        if pieces == 3:
            wait_for(lambda: view._taken)
            process.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        view.show(series)
        slowest = max(slowest, time.monotonic() - began)
        most = max(most, sum(map(len, view._waiting)))

    with live_view(long, address) as view:
        run = simulate(long, watch=watch)
        began = time.monotonic()
        assert close_view(view, run) == f"the viewer on {address} does not answer; the run went on without it"
        assert time.monotonic() - began < 10.0
    assert pieces == 60
    assert most <= 1500
    assert slowest < 1.0
    assert not children()
    process.send_signal(signal.SIGCONT)


@NO_FOOTER
def test_what_a_slow_viewer_cannot_keep_up_with_is_thinned(monkeypatch, tmp_path):
    saved, port = tmp_path / "arrived.rrd", free_port()
    monkeypatch.setattr(live, "WAITING", 1500)
    with rerun_process(["--save", str(saved), "--port", str(port)]) as server:
        wait_for(lambda: is_listening(port))
        with live_view(RUN, Address(port=port)) as view:
            run = simulate(RUN)
            view.show(run.rows(slice(0, 1000)))
            wait_for(lambda: view._taken == 1000)
            # the thread must not take the next pieces one by one: it waits for the lock that this holds
            with view._changed:
                for begin in range(1000, 3000, 100):
                    view.show(run.rows(slice(begin, begin + 100)))
            told = close_view(view, run)
        server.process.send_signal(signal.SIGINT)
        server.process.wait(60)
    arrived = curves(saved, "/plots/error").reshape(-1, 3)
    assert 1000 + 700 < len(arrived) < 3000
    assert told == (
        f"the viewer could not keep up: the live view has {100 * len(arrived) / 3000:.2g} % of the run's rows"
    )
    assert arrived[:1000].tobytes() == run.error[:1000].tobytes()
    # what is left is in order, and reaches to the end
    order = [int(np.flatnonzero((run.error == row).all(axis=1))[0]) for row in arrived]
    assert (np.diff(order) > 0).all()
    assert order[-1] > 2990


def test_a_run_that_fails_leaves_no_process(listening):
    def fail():
        with live_view(RUN, listening[1]):
            assert len(children()) == 1
            raise RuntimeError("by itself")

    with pytest.raises(RuntimeError, match="by itself"):
        fail()
    assert not children()


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_run_that_is_killed_leaves_no_process(listening):
    """Even while the process between waits for a viewer that hangs."""
    code = (
        "import sys, time\n"
        "from spherical_wrist import Experiment, simulate\n"
        "from spherical_wrist.recording.live_run import live_view\n"
        "from spherical_wrist.recording.address import read_address\n"
        "run = simulate(Experiment(duration=1.0))\n"
        "with live_view(Experiment(), read_address(sys.argv[1])) as view:\n"
        "    while True:\n        view.show(run)\n        time.sleep(0.01)\n"
        "        if view._taken: print(view._relay.pid, flush=True)\n"
    )
    command = [sys.executable, "-c", code, str(listening[1])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        between = psutil.Process(int(process.stdout.readline()))
        listening[0].send_signal(signal.SIGSTOP)
        time.sleep(0.3)
        process.kill()
    wait_for(lambda: not between.is_running() or between.status() == psutil.STATUS_ZOMBIE, 60.0)
    listening[0].send_signal(signal.SIGCONT)


# --- before anything is simulated ------------------------------------------------------------------------------------


def command(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["wrist", "run", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    printed = capsys.readouterr()
    assert (end.value.code, printed.out) == (2, "")
    assert printed.err.startswith("wrist: error: ")
    assert printed.err.count("\n") == 1
    return printed.err


def test_nobody_listening_is_one_line_and_nothing_is_simulated(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("spherical_wrist.simulation.simulate.simulate", None)
    port = free_port()
    said = command(monkeypatch, capsys, "--live", "--viewer", f"127.0.0.1:{port}")
    assert f"no viewer listens on 127.0.0.1:{port}: start one with `wrist view`" in said
    assert not list(tmp_path.iterdir())
    if not is_listening(9876):
        assert "no viewer listens on 127.0.0.1:9876" in command(monkeypatch, capsys, "--live")


def test_something_else_that_listens_is_no_viewer():
    with http.server.HTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler) as server:
        thread = threading.Thread(target=server.handle_request, daemon=True)
        thread.start()
        with pytest.raises(ViewerError, match="is no viewer"):
            check_viewer(Address(port=server.server_port))
        thread.join()


def test_something_that_does_not_answer_is_given_up(monkeypatch):
    monkeypatch.setattr("spherical_wrist.recording.address._PATIENCE", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as server, pytest.raises(ViewerError, match="does not answer"):
        check_viewer(Address(port=server.getsockname()[1]))


@pytest.mark.parametrize("text", ["", "host", "9876", ":9876", "host:", "host:x", "host:0", "host:65536", "a:b:1"])
def test_what_is_no_address_is_one_line(text, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert "viewer" in command(monkeypatch, capsys, "--viewer", text)


def test_addresses():
    assert read_address("somewhere:80") == ("somewhere", 80)
    assert read_address("[::1]:9876") == ("::1", 9876)
    assert str(read_address("[::1]:9876")) == "[::1]:9876"
    assert Address().url == "rerun+http://127.0.0.1:9876/proxy"


def test_the_environment_may_switch_rerun_off(listening, monkeypatch):
    """Then the live view is not there, which is said, and the run goes on."""
    monkeypatch.setitem(os.environ, "RERUN", "off")
    with live_view(RUN, listening[1]) as view:
        run = simulate(RUN, watch=view.show)
        assert "RERUN" in close_view(view, run)
