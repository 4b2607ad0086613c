"""The README's example of learning: it is short, it runs, and what it learns holds on wrists it has not seen."""

import re
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
(EXAMPLE,) = (text for text in BLOCKS if "import gymnasium" in text)


def test_it_learns(capsys):
    assert len(EXAMPLE.strip().splitlines()) <= 25
    scope = {"__name__": "example"}
    exec(compile(EXAMPLE, "example", "exec"), scope)
    assert scope["learnt"] > scope["default"] + 0.05
    assert "with the default gains" in capsys.readouterr().out
