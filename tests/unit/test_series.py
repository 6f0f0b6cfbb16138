"""The series of every kind as a table, and the way back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from store_examples import model, playback, run, waveform

from pulsetrainer.artefacts import Evaluation, ModelEvaluation, Run
from pulsetrainer.artefacts.units import is_unit, split_unit
from pulsetrainer.errors import DataError
from pulsetrainer.files import store
from pulsetrainer.files.run_from_table import run_from_table
from pulsetrainer.files.series import series_of
from pulsetrainer.files.table import write_table

# all but what stands for no reading in any table; Hypothesis draws numbers of the source too
NUMBERS = st.floats(-1e99, 1e99, allow_nan=False).filter(lambda one: abs(one) not in (9.9e37, 9.91e37))


FILES = sorted((Path(__file__).parents[1] / "data" / "files-0.1").glob("*.h5"))


@pytest.mark.parametrize("artefact", [run(), model(), waveform(), playback()], ids=lambda one: one.kind)
def test_every_kind_has_columns_of_one_length_with_units(artefact):
    """Headings that import reads: a name and a unit."""
    _check(artefact)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_file_can_be_exported(path):
    """Diagnoses and evaluations too."""
    _check(store.read_any(path))


def _check(artefact) -> None:
    columns = series_of(artefact)
    assert len({column.shape for column in columns.values()}) == 1
    for heading in columns:
        quantity, unit = split_unit(heading)
        assert quantity
        assert is_unit(unit) or quantity in ("repeat", "number"), heading  # a count has none


@settings(max_examples=50, deadline=None)
@given(
    steps=st.lists(st.floats(1e-9, 1e3), min_size=2, max_size=20),
    units=st.sampled_from([("A", "N"), ("A/m", "T"), ("1", "nA m^2"), ("N/(A)^2", "%"), ("N/(A*s)", "T")]),
    data=st.data(),
)
def test_what_is_exported_and_imported_is_the_same_to_the_last_bit(tmp_path_factory, steps, units, data):
    """Time, input, output and reference, whatever their size."""
    t = np.cumsum(steps)
    some = st.lists(NUMBERS, min_size=t.size, max_size=t.size).map(np.asarray)
    u, y, asked = (data.draw(some) for _ in range(3))
    one = Run(t, u, y, asked, None, *units, "voltage", "position, of the tip")
    path = tmp_path_factory.mktemp("there") / "run.csv"
    write_table(path, series_of(one))
    back = run_from_table(
        path, time="time", input="voltage", output="position, of the tip", reference="reference"
    ).run
    for name in ("time_s", "input", "output", "reference"):
        np.testing.assert_array_equal(getattr(back, name), getattr(one, name))
    assert (back.input_unit, back.output_unit) == units


def test_a_run_without_time_has_no_column_of_it():
    """And two columns of one name get a number."""
    u = np.arange(5.0)
    one = Run(None, u, 2 * u, input_unit="deg", output_unit="deg", input_quantity="a", output_quantity="a")
    assert list(series_of(one)) == ["a#1 [deg]", "a#2 [deg]"]


def test_models_of_unequal_length_stand_one_below_another():
    """A number tells them apart; what one does not have is missing."""

    def of(n: int, t) -> ModelEvaluation:
        return ModelEvaluation("m", 0.0, 0.0, 0.0, 0.0, t, np.ones(n), np.zeros(n))

    columns = series_of(Evaluation(models=(of(2, np.arange(2.0)), of(3, None))))
    np.testing.assert_array_equal(columns["number"], [1, 1, 2, 2, 2])
    np.testing.assert_array_equal(columns["time [s]"], [0, 1, np.nan, np.nan, np.nan])
    np.testing.assert_array_equal(columns["measured output [N]"], np.ones(5))


def test_an_artefact_without_series_is_said_to_have_none():
    """An evaluation of nothing."""
    with pytest.raises(DataError):
        series_of(Evaluation())


def test_the_weights_of_a_model_stand_at_their_cells():
    """Switching up is never below switching down; every cell of the plane once."""
    columns = series_of(model(5))
    up, down = columns["switches up from [A]"], columns["switches down from [A]"]
    assert np.all(up >= down)
    assert len(set(zip(up, down, strict=True))) == up.size == 15
    assert "Preisach weights mu [N/A^2]" in columns
