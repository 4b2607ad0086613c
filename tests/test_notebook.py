"""The notebook runs from top to bottom; here its cells, and with WRIST_THOROUGH=1 in a kernel of Jupyter."""

import ast
import json
import re
from pathlib import Path

import pytest

from sampling import long

NOTEBOOK = Path(__file__).parents[1] / "scripts" / "paper.ipynb"
CELLS = ["".join(cell["source"]) for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"]
SHORTER = {
    "duration=4.0": "duration=0.5",
    '"duration": 4.0': '"duration": 0.5',
    "duration=2.0": "duration=0.2",
    "samples=16": "samples=2",
}
"""Changes of the cells that make them quick."""


def test_it_is_stored_without_what_it_printed():
    notebook = json.loads(NOTEBOOK.read_text())
    for cell in notebook["cells"]:
        assert cell["cell_type"] == "markdown" or (cell["outputs"], cell["execution_count"]) == ([], None)


def test_its_cells_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    scope, shown = {"__name__": "notebook"}, []
    for cell in CELLS:
        tree = ast.parse(re.sub("|".join(map(re.escape, SHORTER)), lambda found: SHORTER[found[0]], cell))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, "cell", "exec"), scope)
        if last is not None:
            shown.append(eval(compile(ast.Expression(last.value), "cell", "eval"), scope))
    html = [value for value in shown if hasattr(value, "_repr_html_") or hasattr(value, "_repr_png_")]
    assert len(html) >= 8
    assert r"\begin{tabular}" in capsys.readouterr().out
    assert (tmp_path / "comparison.pdf").read_bytes().startswith(b"%PDF")


@long
def test_it_runs_in_a_kernel(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, resources={"metadata": {"path": str(tmp_path)}}, timeout=300).execute()
    kinds = [set(output.data) for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs
             if output.output_type in ("execute_result", "display_data")]  # fmt: skip
    assert sum("text/html" in each for each in kinds) >= 7
    assert sum("image/png" in each for each in kinds) >= 1
