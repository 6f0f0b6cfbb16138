"""The figures of the demo: kept in demo.json, written into the README.

    python docs/demo.py EVALUATION.h5 PREDICTION.h5 IDEAL.h5

keeps the figures of three evaluations: of the pulses played, of the models on a run that was not fitted, and of the
pulses on the ideal bench. ``docs/make.py`` writes the README from what is kept.
"""  # noqa: INP001 - a folder of pages with its scripts, not a package

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from pulsetrainer.artefacts import Evaluation
from pulsetrainer.files import store

ROOT = Path(__file__).parents[1]
KEPT = Path(__file__).with_name("demo.json")
BEGIN = "<!-- figures of the demo: `make docs` writes them -->\n"
END = "<!-- end of the figures -->\n"

# Carneiro, Abreu, Restivo 2018: what the published device reached
PUBLISHED = {
    "mean_error_reduction_percent": {"normal": 73.9, "bifid": 70.3},
    "scaled.max_abs_error_percent": {"normal": 28.7, "bifid": 28.7},
    "compensated.max_abs_error_percent": {"normal": 7.8, "bifid": 7.8},
}
ROWS = {
    "mean error, scaled": ("scaled.mean_abs_error_percent", 2),
    "mean error, compensated": ("compensated.mean_abs_error_percent", 2),
    "reduction of the mean error, % of scaled": ("mean_error_reduction_percent", 1),
    "max error, scaled": ("scaled.max_abs_error_percent", 1),
    "max error, compensated": ("compensated.max_abs_error_percent", 1),
}
METHODS = ("closest-match", "continuous", "extended")
PULSES = ("normal", "bifid")
BEAT_S = 0.8  # of the normal pulse: 75 a minute
WORDS = """\
`closest-match`: relays, the nearest level and a smoothing spline, as published. `continuous`: the same weights per
cell read as a piecewise constant density and inverted exactly. `extended`: the model after `diagnose` has found, without
being told, that the field follows the current late, the finger creeps and the coil heats; its prediction of a run that was
never fitted is {gain:.0f} % better too. How often such a diagnosis is right: [blind tests](docs/blind.md). On an ideal
bench (`--port 'bench:?ideal'`, static hysteresis and sensor noise only) the continuous inversion leaves a mean error
{least:.1f} % to {most:.1f} % smaller than the scaled drive, and at most {largest:.1f} % of full force.
"""


def figures(evaluation: Path, prediction: Path, ideal: Path) -> dict[str, Any]:
    """Return the figures of three evaluations, four digits each."""
    _, model = store.read(prediction, Evaluation).models
    return {
        "played": _played(evaluation),
        "ideal": _played(ideal),
        "gain_percent": _digits(model.gain_percent),
        "beat": _beat(evaluation),
    }


def _beat(path: Path) -> dict[str, Any]:
    """Return the last beat of the normal pulse by the extended inverse, a sample every 5 ms: s and N."""
    one = next(
        w for w in store.read(path, Evaluation).waveforms if (w.name, w.inversion) == ("normal", "extended")
    )
    last = one.time_s > one.time_s[-1] - BEAT_S
    rows = {"target": one.target, "scaled": one.scaled.output, "compensated": one.compensated.output}
    kept = {name: [_digits(value) for value in values[last][::5]] for name, values in rows.items()}
    time = one.time_s[last][::5] - one.time_s[last][0]
    return {"time_s": [_digits(value) for value in time], **kept}


def _played(path: Path) -> dict[str, dict[str, float]]:
    """Return the figures of each pulse and inversion, as ``tests/regression/bounds.toml`` names them."""
    kept: dict[str, dict[str, float]] = {}
    for one in store.read(path, Evaluation).waveforms:
        for metric, _ in ROWS.values():
            drive, _, name = metric.rpartition(".")
            value = getattr(getattr(one, drive) if drive else one, name)
            kept.setdefault(f"{one.name}.{one.inversion}", {})[metric] = _digits(value)
    return kept


def _digits(value: float) -> float:
    return float(f"{value:.4g}")


def readme() -> str:
    """Return the README with the figures that are kept."""
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{block(json.loads(KEPT.read_text(encoding='utf-8')))}{END}{after}"


def block(kept: dict[str, Any]) -> str:
    """Return the table and the sentences with figures."""
    heads = ["% of full force"]
    for pulse in PULSES:
        heads += [f"{pulse}: published", *METHODS]
    lines = [heads, ["---"] * len(heads)]
    for words, (metric, digits) in ROWS.items():
        cells = [words]
        for pulse in PULSES:
            cells.append(f"{PUBLISHED[metric][pulse]}" if metric in PUBLISHED else "")
            cells += [f"{kept['played'][f'{pulse}.{one}'][metric]:.{digits}f}" for one in METHODS]
        lines.append(cells)
    table = "\n".join(f"| {' | '.join(cells)} |".replace("|  |", "| |") for cells in lines)
    ideal = kept["ideal"].values()
    reductions = [one["mean_error_reduction_percent"] for one in ideal]
    words = WORDS.format(
        gain=kept["gain_percent"],
        least=min(reductions),
        most=max(reductions),
        largest=max(one["compensated.max_abs_error_percent"] for one in ideal),
    )
    return f"{table}\n\n{words}"


if __name__ == "__main__":
    text = json.dumps(figures(*map(Path, sys.argv[1:])), indent=1)
    rows = re.sub(r"\[[^\[\]]*\]", lambda numbers: " ".join(numbers[0].split()), text)  # a list on one line
    KEPT.write_text(rows + "\n", encoding="utf-8")
