"""The notebooks run, from the first cell to the last, and show what they make."""

from __future__ import annotations

import re

import nbformat
import pytest
from nbclient import NotebookClient
from pages import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_its_artefacts(path):
    """Artefacts as text and figure, without escapes of a terminal or an empty output beside them."""
    notebook = nbformat.read(path, 4)
    client = NotebookClient(notebook, timeout=250, resources={"metadata": {"path": str(path.parent)}})
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pages = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    assert len(pages) >= 2
    for page in pages:
        assert "<svg" in page
        assert "\x1b" not in page
        assert "warning  " not in page  # what is shown to a newcomer is a model that describes its record
    assert not [output for output in outputs if output.output_type in ("error", "stderr")]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    """What it shows is made anew: nothing of an older version stays on a page."""
    notebook = nbformat.read(path, 4)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_site_takes_along_what_a_notebook_reads(path):
    """`make site` copies the records whose names stand there in full; of a name in pieces it knows none."""
    text = path.read_text(encoding="utf-8")
    named = re.findall(r"tests/data/([^\\\"]*)", text)
    assert all((ROOT / "tests" / "data" / name.split(")")[0]).is_file() for name in named)
