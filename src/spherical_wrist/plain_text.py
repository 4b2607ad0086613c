"""Text of other people shown as text, wherever it is shown: names, labels, reasons and versions.

A terminal obeys escape sequences, matplotlib reads mathematics between dollar signs, and the viewer reads Markdown.
"""

import re

_PICTURES = {code: 0x2400 + code for code in range(32) if chr(code) not in "\n\t"}
_OTHERS = (0x7F, *range(0x80, 0xA0), 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
_VISIBLE = {**_PICTURES, **dict.fromkeys(_OTHERS, 0xFFFD)}
"""Signs for control characters, and for those that change the direction of writing."""
_MARKDOWN = re.compile(r"[\\`*\[\]<>]|(?<!\w)_|_(?!\w)")


def visible(text: str) -> str:
    """Replace control characters, which a terminal would obey and not show, by signs for them."""
    return text.translate(_VISIBLE)


def escaped(text: str) -> str:
    """Write control characters as JSON does; they occur within its strings only."""
    return text.translate({ord(sign): f"\\u{ord(sign):04x}" for sign in set(text) if visible(sign) != sign})


def literal(text: str) -> str:
    """Return text that matplotlib draws as it is; its fonts have one sign for all control characters."""
    return "".join(sign if visible(sign) == sign else "\ufffd" for sign in text).replace("$", r"\$")


def markdown(text: str) -> str:
    """Return text in one line that Markdown shows as it is: without links, pictures, code and emphasis."""
    return _MARKDOWN.sub(r"\\\g<0>", visible(" ".join(text.split())))
