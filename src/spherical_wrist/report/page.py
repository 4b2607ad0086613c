"""The page: one HTML file that needs no network, no script and no other file."""

from collections.abc import Iterator, Mapping
from html import escape
from importlib.resources import files
from typing import Any

from spherical_wrist.report.closing import methods, worst
from spherical_wrist.report.dependence import dependence
from spherical_wrist.report.findings import Curves
from spherical_wrist.report.laws import failures, law_against_law, precision
from spherical_wrist.report.opening import opening


def page(told: Mapping[str, Any], curves: Curves) -> str:
    """The page of a report.

    Args:
        told: what it says, as :mod:`spherical_wrist.report.findings` tells it.
        curves: what its pictures show.
    """
    title = f"Campaign {told['campaign']['folder'].rstrip('/').rpartition('/')[2]}"
    style = files("spherical_wrist.report").joinpath("page.css").read_text(encoding="utf-8")
    body = "\n".join(_sections(told, curves))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<h1>{escape(title)}</h1>\n{body}\n"
        "</body>\n</html>\n"
    )


def _sections(told: Mapping[str, Any], curves: Curves) -> Iterator[str]:
    yield opening(told)
    yield precision(told, curves)
    yield failures(told)
    if len(told["laws"]) > 1:
        yield law_against_law(told)
    if curves.parameters:
        yield dependence(told, curves)
    yield worst(told)
    yield methods(told)
