"""Recordings in the web viewer: the page, whom it may talk to, and what a browser makes of it."""

import io
import json
import re
import signal
import socket
import subprocess
import sys
import time
from http.client import HTTPConnection
from urllib.parse import parse_qs, urlsplit

import numpy as np
import psutil
import pytest
from matplotlib.image import imread

import needs
from sampling import some
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.colours import AXES, DESIRED, rgb
from spherical_wrist.errors import ViewerError
from spherical_wrist.recording.address import free_port, is_listening
from spherical_wrist.recording.web import served_viewer

WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--window-size=900,450",  # and in one process less: all is drawn in software
    "--in-process-gpu",
]
CURVES = tuple(map(rgb, AXES))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "run.rrd"
    record(simulate(Experiment(duration=3.0)), path)
    return path


def fetched(url, path):
    where = urlsplit(url)
    connection = HTTPConnection(where.hostname, where.port, timeout=30)
    connection.request("GET", path)
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


def test_the_page_is_rerun_s_own_but_may_talk_to_this_machine_only(recording):
    before = set(psutil.Process().children(recursive=True))  # of other tests
    with served_viewer(recording, free_port()) as served:
        answer, page = fetched(served.url, "/")
        assert answer.status == 200
        assert b"Rerun Viewer" in page
        assert not re.search(rb'<link[^>]*"https:', page)
        policy = answer.getheader("Content-Security-Policy")
        sources = {word for part in policy.split(";") for word in part.split()[1:]}
        hosts = {urlsplit(source).netloc for source in sources if "//" in source}
        assert hosts == {str(served.address)}
        assert "default-src 'self'" in policy
        assert parse_qs(urlsplit(served.url).query)["url"] == [served.address.url]
        answer, program = fetched(served.url, "/re_viewer_bg.wasm")
        assert (answer.getheader("Content-Type"), program[:4]) == ("application/wasm", b"\0asm")
        assert int(answer.getheader("rerun-final-length")) == len(program)
        assert fetched(served.url, "/nothing/here")[0].status == 404
        everyone = [psutil.Process(), *psutil.Process().children(recursive=True)]
        sockets = [each for one in everyone for each in one.net_connections("inet")]
        assert {each.laddr.ip for each in sockets if each.status == psutil.CONN_LISTEN} == {"127.0.0.1"}
    assert set(psutil.Process().children(recursive=True)) <= before


def test_a_port_that_is_taken_is_an_error(recording):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with pytest.raises(ViewerError, match=f"127.0.0.1:{port}.*--port"), served_viewer(recording, port):
            pass


@pytest.mark.parametrize("number", some([signal.SIGINT, signal.SIGTERM], 2))
def test_the_command_prints_the_address_and_ends_with_a_signal(recording, number):
    port = free_port()
    command = [*WRIST, "view", str(recording), "--web", "--no-browser", "--port", str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        url = process.stdout.readline().strip()
        assert url.startswith(f"http://127.0.0.1:{port}/?url=")
        assert "--viewer 127.0.0.1:" in process.stdout.readline()
        servers = psutil.Process(process.pid).children(recursive=True)
        assert fetched(url, "/")[0].status == 200
        process.send_signal(number)
        _, err = process.communicate(timeout=120)
    assert (process.returncode, err) == (128 + number, "")
    assert servers
    assert not any(server.is_running() for server in servers)
    assert not is_listening(port)


@pytest.mark.slow
def test_a_browser_shows_the_recording_and_asks_nobody_else(recording, tmp_path):
    needs.chromium()
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = needs.program("chromium")
    for flag in (*FLAGS, f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL"})
    with served_viewer(recording, free_port()) as served:
        browser = webdriver.Chrome(options=options, service=Service(needs.program("chromedriver")))
        try:
            browser.get("about:blank")
            time.sleep(0.5)
            browser.get_log("performance")  # what the browser's own start page asked for
            browser.get(served.url)
            picture = shown(browser)
            events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
        finally:
            browser.quit()
    asked = [each["params"]["request"]["url"] for each in events if each["method"] == "Network.requestWillBeSent"]
    hosts = {urlsplit(url).netloc for url in asked if urlsplit(url).scheme not in ("data", "blob", "chrome")}
    assert hosts == {urlsplit(served.url).netloc, str(served.address)}
    for colour in CURVES:
        drawn = np.abs(picture[:, 460:] - np.array(colour) / 255.0).max(axis=2) < 0.1
        assert drawn.any(axis=0).sum() > 200, "a curve goes from one side of the plots to the other"


def shown(browser, patience=180.0):
    """The page once it shows the wrist before our own background, and has come to rest."""
    deadline, before = time.monotonic() + patience, b""
    while time.monotonic() < deadline:
        png = browser.get_screenshot_as_png()
        picture = imread(io.BytesIO(png))[..., :3]
        scene = np.abs(picture[:, :440] - np.array([58, 64, 74]) / 255.0).max(axis=2) < 0.01
        wrist = np.abs(picture[:, :440] - np.array(rgb(DESIRED)) / 255.0).max(axis=2) < 0.15
        if scene.mean() > 0.15 and wrist.sum() > 50 and png == before:
            return picture
        before = png
        time.sleep(0.5)
    raise AssertionError("the browser does not show the recording")
