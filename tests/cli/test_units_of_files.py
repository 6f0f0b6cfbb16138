"""Units in the files of real commands: pint knows them all."""

from __future__ import annotations

import h5py
import pint

from program import pulsetrainer


def test_every_unit_of_a_real_diagnosis_is_a_unit(tmp_path):
    """What comes with the data and what causes bring: datasets and parameters of run, model and diagnosis."""
    for words in (
        ("capture", "identification", "--levels", "12", "--speed", "12", "-o", "run.h5"),
        ("identify", "run.h5", "--levels", "12", "-o", "model.h5"),
        ("diagnose", "run.h5", "--model", "model.h5", "--quick", "-o", "diagnosis.h5"),
    ):
        assert pulsetrainer(tmp_path, *words).code == 0, words
    registry = pint.UnitRegistry()
    seen = set()

    def look(_name, item):
        for key in ("units", "unit", "input_unit", "output_unit", "weights_unit"):
            if key in item.attrs:
                seen.add(item.attrs[key])

    for name in ("run", "model", "diagnosis"):
        with h5py.File(tmp_path / f"{name}.h5") as file:
            look("/", file)
            file.visititems(look)
    assert {"A", "N", "s", "percent", "1/s"} <= seen
    for unit in seen:
        registry.parse_units(unit)
