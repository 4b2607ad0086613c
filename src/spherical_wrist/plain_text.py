"""Text of other people shown as text, wherever it is shown: names, labels, reasons and versions.

A terminal obeys escape sequences, matplotlib reads mathematics between dollar signs, the viewer reads Markdown, and a
paper LaTeX.
"""

import re
from collections.abc import Callable

_PICTURES = {code: 0x2400 + code for code in range(32) if chr(code) not in "\n\t"}
_OTHERS = (0x7F, *range(0x80, 0xA0), 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
_VISIBLE = {**_PICTURES, **dict.fromkeys(_OTHERS, 0xFFFD)}
"""Signs for control characters, and for those that change the direction of writing."""
_LATEX = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "%": r"\%", "#": r"\#", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': "''", "`": r"\textasciigrave{}", "-": "-{}", "\n": " ", "\t": " ", "–": "--", "—": "---",
    "…": r"\ldots{}", "’": "'", "“": "``", "”": "''",
}  # fmt: skip
"""LaTeX of signs in text; of a hyphen before another one, which would become a dash."""
_LATEX_MATHEMATICS = {
    "×": r"\times", "−": "-", "·": r"\cdot", "±": r"\pm", "≤": r"\le", "≥": r"\ge", "≈": r"\approx", "∞": r"\infty",
    "°": r"^\circ", "′": "'", "‖": r"\Vert", "∫": r"\int", "√": r"\surd", "→": r"\to", "Δ": r"\Delta", "Σ": r"\Sigma",
    "Ω": r"\Omega", "α": r"\alpha", "β": r"\beta", "γ": r"\gamma", "δ": r"\delta", "ε": r"\varepsilon",
    "κ": r"\kappa", "λ": r"\lambda", "µ": r"\mu", "μ": r"\mu", "ρ": r"\rho", "σ": r"\sigma", "τ": r"\tau",
    "φ": r"\varphi", "ω": r"\omega", "ė": r"\dot{e}",
}  # fmt: skip
"""LaTeX of signs that it has in mathematics only."""
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_LATEX_SIGN = re.compile(r"[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|-(?=-)|[^\w .,:;/()\[\]=+*!?@'-]|[_°µ]|[Α-ωė]")
_MARKDOWN = re.compile(r"[\\`*\[\]<>]|(?<!\w)_|_(?!\w)")


def visible(text: str) -> str:
    """Replace control characters, which a terminal would obey and not show, by signs for them."""
    return text.translate(_VISIBLE)


def escaped(text: str) -> str:
    """Write control characters as JSON does; they occur within its strings only."""
    return text.translate({ord(sign): f"\\u{ord(sign):04x}" for sign in set(text) if visible(sign) != sign})


def broken(text: str, fits: Callable[[str], bool]) -> list[str]:
    """Break a text into lines that fit: after blanks, commas, colons, underscores and slashes, else anywhere.

    Line breaks and tabs, for which fonts have no sign, are blanks.

    Args:
        text: the text.
        fits: function that returns True for a line that is not too long.
    """
    lines = [""]
    for piece in re.findall(r"[^ ,:_/]*[ ,:_/]|[^ ,:_/]+", re.sub(r"\s", " ", text)):
        if lines[-1] and not fits((lines[-1] + piece).rstrip()):
            lines.append("")
        lines[-1] += piece
        while len(lines[-1]) > 1 and not fits(lines[-1].rstrip()):
            line = lines[-1]
            cut = next((end for end in range(len(line) - 1, 1, -1) if fits(line[:end].rstrip())), 1)
            lines[-1:] = [line[:cut], line[cut:]]
    return [line.rstrip() for line in lines]


def literal(text: str) -> str:
    """Return text that matplotlib draws as it is; its fonts have one sign for all control characters."""
    return "".join(sign if visible(sign) == sign else "\ufffd" for sign in text).replace("$", r"\$")


def markdown(text: str) -> str:
    """Return text in one line that Markdown shows as it is: without links, pictures, code and emphasis."""
    return _MARKDOWN.sub(r"\\\g<0>", visible(" ".join(text.split())))


def latex(text: str) -> str:
    """Return text that LaTeX sets as it is, in any font."""

    def sign(found: re.Match[str]) -> str:
        if found[0] in _LATEX:
            return _LATEX[found[0]]
        if found[0] in _LATEX_MATHEMATICS:
            return f"${_LATEX_MATHEMATICS[found[0]]}$"
        raised = found[0].translate(_RAISED)
        return f"$^{{{raised}}}$" if raised != found[0] else "?" if visible(raised) != raised else raised

    return _LATEX_SIGN.sub(sign, text)


def latex_mathematics(text: str) -> str:
    """Return LaTeX of a text as matplotlib reads it, with mathematics between dollar signs."""
    symbols = str.maketrans({sign: f"{{{code}}}" for sign, code in _LATEX_MATHEMATICS.items()})
    return "".join(
        f"${part.translate(symbols)}$" if place % 2 else latex(part.replace(r"\$", "$"))
        for place, part in enumerate(re.split(r"(?<!\\)\$", text))
    )
