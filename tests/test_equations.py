"""Every equation of the paper is named at the code that implements it, and by a test."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
MENTION = re.compile(r"eq\.\s*((?:\(\d+\)(?:\s*–\s*\(\d+\))?(?:,\s*|\s+and\s+|\s+or\s+)?)+)", re.IGNORECASE)
SPAN = re.compile(r"\((\d+)\)(?:\s*–\s*\((\d+)\))?")
NAMED = re.compile(r"def test_\w*?equations?_(\d+)(?:_(to|and)_(\d+))?")


def mentioned(text):
    """Numbers of the equations that a text mentions, with those between the ends of a range."""
    spans = (span for mention in MENTION.findall(text) for span in SPAN.findall(mention))
    return {n for first, last in spans for n in range(int(first), int(last or first) + 1)}


def named(text):
    """Numbers of the equations that tests carry in their names."""
    found = set()
    for first, word, last in NAMED.findall(text):
        found |= set(range(int(first), int(last) + 1)) if word == "to" else {int(n) for n in (first, last) if n}
    return found


def texts(folder):
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / folder).rglob("*.py")))


def test_every_equation_is_named_at_its_code():
    assert mentioned(texts("src")) >= set(range(1, 49))


def test_every_equation_is_named_by_a_test():
    tests = texts("tests")
    assert mentioned(tests) | named(tests) >= set(range(1, 49))
