"""Any table: whatever its scales, offsets and units, the commands end with a result or with a plain error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from program import pulsetrainer

OWN_ERROR = (2, 3, 5)  # usage, data, not converged
UNITS = ("", "A", "mV", "kOhm", "µm", "nA m^2", "m/s²", "%", "kA/m", "1", "lb", "°C", "1/s", "furlong", "[]")
SAMPLES = (1, 12, 60, *(400,) * 5)
SHAPES = ("lags", "lags", "leads", "line", "constant", "speed", "two levels")


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers whose logarithm is spread evenly."""
    return st.floats(low, high).map(lambda power: 10.0**power)


tables = st.fixed_dictionaries(
    {
        "samples": st.sampled_from(SAMPLES),
        "step": powers(-9, 6),
        "begin": st.sampled_from((0.0, -1e3, 1e9)),
        "u": st.tuples(powers(-12, 12), st.sampled_from((0.0, 1.0, -3.0, 1e6))),  # scale, offset in scales
        "y": st.tuples(powers(-12, 12), st.sampled_from((0.0, 1.0, -3.0, 1e6))),
        "sign": st.sampled_from((1.0, -1.0)),
        "noise": st.sampled_from((0.0, 0.003, 0.003, 0.3)),
        "shape": st.sampled_from(SHAPES),
        "digits": st.sampled_from((4, 9, 17)),
        "units": st.tuples(st.sampled_from(UNITS), st.sampled_from(UNITS)),
        "seed": st.integers(0, 99),
    }
)


def written(path, table) -> None:
    """Write a table."""
    rng = np.random.default_rng(table["seed"])
    n = table["samples"]
    u = np.interp(np.arange(n), np.linspace(0, max(n - 1, 1), 12), np.append(0.0, rng.uniform(0, 1, 11)))
    late = u.copy()
    for k in range(1, n):
        late[k] = np.clip(late[k - 1], u[k] - 0.15, u[k] + 0.15)
    y = {
        "lags": 0.5 * (u + late),
        "leads": 1.5 * u - 0.5 * late,
        "line": u,
        "constant": 0.0 * u,
        "speed": np.gradient(u) if n > 1 else u,
        "two levels": np.round(late),
    }[table["shape"]]
    y = table["sign"] * (y + table["noise"] * rng.normal(size=n))
    time = table["begin"] + table["step"] * np.arange(n)
    columns = [time, *(scale * (x + offset) for x, (scale, offset) in ((u, table["u"]), (y, table["y"])))]
    heads = [
        "t_s",
        *(f"{name} ({unit})" if unit else name for name, unit in zip("uy", table["units"], strict=True)),
    ]
    places = (17, table["digits"], table["digits"])
    rows = (
        ",".join(f"{x:.{k}g}" for x, k in zip(row, places, strict=True)) for row in zip(*columns, strict=True)
    )
    path.write_text("\n".join([",".join(heads), *rows, ""]))


@pytest.mark.parametrize("examples", [5, pytest.param(25, marks=pytest.mark.slow)])
def test_no_table_ends_in_a_bug(tmp_path_factory, examples):
    """Import, identify, diagnose and invert: exit 0, or an error of ours with a message, and then no file."""

    @settings(max_examples=examples, deadline=None, suppress_health_check=[HealthCheck.too_slow])
    @given(table=tables)
    def no_bug(table):
        _chain_of_commands(tmp_path_factory, table)

    no_bug()


def _chain_of_commands(tmp_path_factory, table) -> None:
    folder = tmp_path_factory.mktemp("table")
    written(folder / "a.csv", table)
    for words in (
        ("import", "a.csv", "--input", "u", "--output", "y", "-o", "a.h5"),
        ("identify", "a.h5", "--levels", "12", "-o", "m.h5"),
        ("diagnose", "a.h5", "--model", "m.h5", "--quick", "-o", "d.h5"),
        ("invert", "normal", "--model", "m.h5", "-o", "w.h5"),
    ):
        done = pulsetrainer(folder, *words)
        if done.code != 0:
            assert done.code in OWN_ERROR, (words, done)
            assert done.err.strip(), words
            assert not (folder / words[-1]).exists()
            if words[0] != "diagnose":
                break
