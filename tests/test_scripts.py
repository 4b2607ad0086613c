"""The set-up of `.venv`: what of the lock running takes, and uv's settings as those of pip."""

import importlib.util
import re
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PIN = re.compile(r"^(\S+)==(\S+)", re.MULTILINE)

spec = importlib.util.spec_from_file_location("pip_settings", ROOT / "scripts" / "pip_settings.py")
pip_settings = importlib.util.module_from_spec(spec)
spec.loader.exec_module(pip_settings)


def needed(names):
    """Distributions that these ask for, here, by what they say themselves once they are installed."""
    found, left = set(), [(Requirement(name).name, Requirement(name).extras) for name in names]
    while left:
        name, extras = left.pop()
        if (key := (canonicalize_name(name), frozenset(extras))) in found:
            continue
        found.add(key)
        for text in requires(name) or []:
            each = Requirement(text)
            if each.marker is None or any(each.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
                left.append((each.name, each.extras))
    return {name for name, _ in found}


def test_what_running_takes_comes_first_in_the_lock_and_nothing_else_does():
    first, line, rest = (ROOT / "requirements.lock").read_text().partition("\n# only to test")
    assert line
    running, others = ([canonicalize_name(name) for name, _ in PIN.findall(part)] for part in (first, rest))
    assert len(running) == len(set(running))
    assert not set(running) & set(others)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    asked, groups = project["project"]["dependencies"], project["dependency-groups"]
    wanted = needed([*asked, *(name for group in groups["run"] for name in groups[group["include-group"]])])
    assert wanted <= set(running)
    elsewhere = {canonicalize_name(name) for name in re.findall(r"^(\S+)==\S+ ;", first, re.MULTILINE)}
    assert set(running) <= wanted | elsewhere, "these are not needed to run"


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ([], {}),
        (["global.index-url='https://a/simple'"], {"UV_DEFAULT_INDEX": "https://a/simple"}),
        (
            [":env:.index-url='https://c'", "global.index-url='https://a'", "install.index-url='https://b'"],
            {"UV_DEFAULT_INDEX": "https://c"},
        ),
        (["install.index-url='https://b'", "global.index-url='https://a'"], {"UV_DEFAULT_INDEX": "https://b"}),
        (["download.index-url='https://b'"], {}),
        (["global.extra-index-url='\\nhttps://a\\nfile:///b'"], {"UV_INDEX": "https://a file:///b"}),
        (["global.trusted-host='a.example b:8080'"], {"UV_INSECURE_HOST": "a.example b:8080"}),
        (["global.proxy='p:3128'"], dict.fromkeys(("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"), "http://p:3128")),
        (["global.default-timeout='9'", "global.timeout='8'"], {"UV_HTTP_TIMEOUT": "8"}),
        (["global.no-index='true'", "global.find-links='/ /nowhere'"], {"UV_NO_INDEX": "true", "UV_FIND_LINKS": "/"}),
        (["global.cert='/a.pem'", "global.constraint='/c.txt'"], {"SSL_CERT_FILE": "/a.pem"}),
        (["global.cert='/'"], {"SSL_CERT_DIR": "/"}),
    ],
)
def test_uv_is_set_to_what_pip_is(lines, expected):
    usual = pip_settings.uv_variables({}, {})
    assert pip_settings.uv_variables(pip_settings.read_settings(lines), {}) == usual | expected


def test_certificates_that_pip_takes_from_the_environment_are_passed_on():
    bundle = {"REQUESTS_CA_BUNDLE": "/env.pem"}
    assert pip_settings.uv_variables({}, bundle)["SSL_CERT_FILE"] == "/env.pem"
    assert pip_settings.uv_variables({"cert": "/own.pem"}, bundle)["SSL_CERT_FILE"] == "/own.pem"


def test_pip_tells_its_settings(monkeypatch, capsys, tmp_path):
    """Asked of pip itself, which merges its files: one of them is given by an environment variable."""
    (tmp_path / "pip.conf").write_text("[global]\nindex-url = https://file.example/simple\nretries = 7\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    monkeypatch.setenv("PIP_INDEX_URL", "https://given.example/simple")
    pip_settings.main()
    printed = capsys.readouterr().out.splitlines()
    assert "UV_DEFAULT_INDEX=https://given.example/simple" in printed
    assert "UV_HTTP_RETRIES=7" in printed
