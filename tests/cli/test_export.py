"""Export: a table of whatever a file holds, that import reads to the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from program import pulsetrainer
from pulsetrainer.artefacts import Run
from pulsetrainer.files import store
from wording import refusal

KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"


@pytest.fixture
def folder(tmp_path):
    """A record with uneven stamps and uneven numbers, imported."""
    rng = np.random.default_rng(8)
    t = np.cumsum(rng.uniform(0.5e-8, 1.5e-8, 300))
    rows = np.stack((t, rng.standard_normal(300), 1e6 * rng.standard_normal(300)), axis=1)
    np.savetxt(tmp_path / "scope.csv", rows, fmt="%.17g", delimiter=",", header="t_s,u,y", comments="")
    words = ["scope.csv", "--input", "u", "--output", "y", "--input-unit", "mV", "--output-unit", "nA m^2"]
    assert pulsetrainer(tmp_path, "import", *words, "-o", "run.h5").code == 0
    return tmp_path


def test_a_run_goes_out_and_comes_back(folder):
    """The same time, input, output and units, to the last bit."""
    done = pulsetrainer(folder, "export", "run.h5", "-o", "run.csv", "--json")
    assert done.code == 0, done
    assert done.json["kind"] == "run"
    assert done.json["rows"] == 300
    assert done.json["columns"] == ["time [s]", "u [mV]", "y [nA m^2]"]
    done = pulsetrainer(folder, "import", "run.csv", "--input", "u", "--output", "y", "-o", "back.h5")
    assert done.code == 0, done
    first, back = (store.read(folder / f"{name}.h5", Run) for name in ("run", "back"))
    for name in ("time_s", "input", "output"):
        np.testing.assert_array_equal(getattr(back, name), getattr(first, name))
    assert (back.input_unit, back.output_unit) == ("mV", "nA m^2")


def test_an_existing_table_is_kept_unless_it_may_go(folder):
    """As every output is; and a table is a CSV."""
    (folder / "run.csv").write_text("mine")
    done = pulsetrainer(folder, "export", "run.h5", "-o", "run.csv", "--json")
    assert done.code == 2
    assert done.json["error"]["kind"] == "usage"
    assert (folder / "run.csv").read_text() == "mine"
    assert pulsetrainer(folder, "export", "run.h5", "-o", "run.csv", "--overwrite").code == 0
    assert pulsetrainer(folder, "export", "run.h5", "-o", "table.h5").code == 2
    assert not (folder / "table.h5").exists()


@pytest.mark.parametrize(
    "name",
    [
        "model",
        "diagnosis",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("run", "drive", "played", "evaluation")),
    ],
)
def test_a_figure_with_its_data(tmp_path, name):
    """`plot --data`: beside the figure the table that `export` writes, word for word."""
    file = KEPT / f"{name}.h5"
    done = pulsetrainer(tmp_path, "plot", file, "-o", "figure.png", "--data", "--json")
    assert done.code == 0, done.err
    assert done.json["data"] == "figure.csv"
    assert pulsetrainer(tmp_path, "export", file, "-o", "table.csv").code == 0
    assert (tmp_path / "figure.csv").read_bytes() == (tmp_path / "table.csv").read_bytes()
    (tmp_path / "figure.png").unlink()
    refusal(
        pulsetrainer(tmp_path, "plot", file, "-o", "figure.png", "--data", "--json"),
        2,
        "table exists",
        file="figure.csv",
    )
    assert not (tmp_path / "figure.png").exists()
