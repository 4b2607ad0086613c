"""Settings of pip, written as environment variables of uv, which does not read pip's files.

``python scripts/pip_settings.py`` prints lines ``NAME=VALUE``. They give uv the indexes, certificates
and proxies that this interpreter's pip uses. Settings that choose versions are left out: the lock names them.
"""

import ast
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

VARIABLES = {
    "index-url": "UV_DEFAULT_INDEX",
    "cert": "SSL_CERT_FILE",
    "client-cert": "SSL_CLIENT_CERT",
    "default-timeout": "UV_HTTP_TIMEOUT",
    "timeout": "UV_HTTP_TIMEOUT",
    "retries": "UV_HTTP_RETRIES",
}
"""Variables of uv that take the value of a setting as it is; of two that set one variable, the later counts."""

SECTIONS = ("global", "install", ":env:")
"""Sections of pip's settings that apply to `pip install`; a later one counts more."""


def read_settings(lines: Iterable[str]) -> dict[str, str]:
    """Return the settings of `pip install` from the lines of `pip config list`, such as ``global.cert='/a.pem'``."""
    found: dict[str, dict[str, str]] = {section: {} for section in SECTIONS}
    for line in lines:
        key, _, value = line.partition("=")
        section, _, name = key.strip().partition(".")
        if section in found:
            found[section][name] = str(ast.literal_eval(value))
    return {name: value for section in SECTIONS for name, value in found[section].items()}


def uv_variables(settings: Mapping[str, str], environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that make uv use what pip uses.

    Args:
        settings: settings of `pip install` by name.
        environment: variables that pip itself, or the library below it, reads.
    """
    variables = {VARIABLES[name]: settings[name] for name in VARIABLES if settings.get(name)}
    # the certificates of the system, as pip takes them; a file given by name comes before them
    variables["UV_SYSTEM_CERTS"] = "true"
    bundle = environment.get("REQUESTS_CA_BUNDLE") or environment.get("CURL_CA_BUNDLE")
    if bundle:
        variables.setdefault("SSL_CERT_FILE", bundle)
    if Path(variables.get("SSL_CERT_FILE", "/dev/null")).is_dir():
        variables["SSL_CERT_DIR"] = variables.pop("SSL_CERT_FILE")
    if settings.get("proxy"):
        variables |= dict.fromkeys(("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"), _url(settings["proxy"]))
    if settings.get("trusted-host"):
        variables["UV_INSECURE_HOST"] = " ".join(settings["trusted-host"].split())
    if settings.get("extra-index-url"):
        variables["UV_INDEX"] = " ".join(settings["extra-index-url"].split())
    # pip takes the locked version from whichever index has it; uv would stop at the first that knows the package
    variables["UV_INDEX_STRATEGY"] = "unsafe-best-match"
    folders = list(_existing(settings.get("find-links", "").split()))
    if folders:
        variables["UV_FIND_LINKS"] = ",".join(folders)
    if settings.get("no-index", "").lower() in ("1", "true", "yes", "on"):
        variables["UV_NO_INDEX"] = "true"
    return variables


def _url(proxy: str) -> str:
    return proxy if "://" in proxy else f"http://{proxy}"


def _existing(places: Iterable[str]) -> Iterator[str]:
    """Yield addresses, and the folders that exist: pip passes over the others, and uv stops at them."""
    for place in places:
        if "://" in place:
            yield place
        elif (path := Path(place).expanduser()).exists():
            yield str(path.absolute())


def main() -> None:
    """Print the variables for the pip of this interpreter.

    Raises:
        CalledProcessError: pip does not tell its settings.
    """
    command = [sys.executable, "-I", "-m", "pip", "--disable-pip-version-check", "config", "list"]
    shown = subprocess.run(command, check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    variables = uv_variables(read_settings(shown.stdout.splitlines()), os.environ)
    sys.stdout.write("".join(f"{name}={value}\n" for name, value in variables.items()))


if __name__ == "__main__":
    main()
