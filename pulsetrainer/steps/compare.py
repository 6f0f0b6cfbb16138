"""Compare: evaluations or sessions side by side: before and after, device by device, learner by learner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pulsetrainer.artefacts import Evaluation, Session
from pulsetrainer.artefacts.evaluation import HEADLINES
from pulsetrainer.artefacts.units import counted, shown
from pulsetrainer.errors import DataError
from pulsetrainer.steps.arguments import check_several, named, several
from pulsetrainer.steps.quiz import score

_RISING = (  # more is better
    "mean_error_reduction_percent", "gain_percent", "right_percent", "right_from_percent", "right_to_percent",
)  # fmt: skip
_IN_UNITS = ("rms", "offset")  # of a model; the others are always in one unit
_SAME = 0.005  # smaller is no change: two digits are shown; of what is in units it is a share


@dataclass(frozen=True, slots=True)
class Metric:
    """One figure in all evaluations; None where an evaluation does not have it."""

    name: str
    values: tuple[float | None, ...]
    change: float | None  # last minus first of those that have it; None where these are in other units
    better: bool | None  # None: no change beyond the spread between repeats, or nothing to compare
    units: tuple[str, ...] = ()  # in which the values are; empty where it is always the same one


def compare(
    evaluations: Sequence[Evaluation] | Sequence[Session],
    *,
    names: Sequence[str] = (),
    everything: bool = False,
) -> tuple[Metric, ...]:
    """Return the figures of several evaluations or sessions side by side, and how each changed.

    Parameters
    ----------
    evaluations
        The oldest first. Of sessions: the share right with its 95 % interval, the time to the answer, and how
        true the pulses were.
    names
        Their names, for messages.
    everything
        All figures instead of the headlines.

    Raises
    ------
    UsageError
        There are fewer than two evaluations.
    DataError
        They have no figure in common.

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> before = pt.load("tests/data/files-0.1/evaluation.h5")
    >>> [metric.better for metric in pt.compare([before, before])]
    [None, None, None]
    """
    evaluations = several(evaluations)
    check_several(evaluations)
    titles = named(names, [f"number {k}" for k in range(1, len(evaluations) + 1)])
    sessions = [one for one in evaluations if isinstance(one, Session)]
    if sessions and len(sessions) < len(evaluations):
        given = ", ".join(
            f"{name} is {'a session' if isinstance(one, Session) else 'an evaluation'}"
            for name, one in zip(titles, evaluations, strict=True)
        )
        raise DataError(
            f"evaluations and sessions cannot be compared with each other: {given}",
            hint="give only one kind",
        )
    tested = [one for one in evaluations if isinstance(one, Evaluation)]
    every = [_of_session(one) for one in sessions] or _named(tested, [one.figures() for one in tested])
    spreads = _named(tested, [_spreads(one) for one in tested])
    units = _named(tested, [_units(one) for one in tested])
    headlines = tuple(f".{one}" for one in HEADLINES)
    wanted = [
        n for n in dict.fromkeys(n for one in every for n in one) if everything or n.endswith(headlines)
    ]
    metrics = tuple(_metric(name, every, spreads, units) for name in wanted)
    if not any(sum(v is not None for v in m.values) > 1 for m in metrics):
        made = ["playback" if one.waveforms else "run" for one in tested]
        of = ", ".join(f"{name} is of a {one}" for name, one in zip(titles, made, strict=False))
        raise DataError(
            f"no two of {', '.join(titles)} have a figure in common" + f": {of}" * (len({*made}) > 1),
            hint="evaluate the same pulses, with the same inversion, or the same models",
        )
    return metrics


def differing_quizzes(compared: Sequence[Evaluation | Session], names: Sequence[str]) -> list[str]:
    """Say that learners were not asked the same, so that their shares right tell little of each other."""
    quizzes = {
        name: one.quiz
        for name, one in zip(names, compared, strict=True)
        if isinstance(one, Session) and one.quiz is not None
    }
    if len({(len(quiz.asked), *sorted(quiz.choices)) for quiz in quizzes.values()}) < 2:
        return []
    said = [
        f"{name} has {counted(len(quiz.asked), 'question')} on {len(quiz.choices)} pulses "
        f"({100 * score(quiz).chance:.0f} % by guessing)"
        for name, quiz in quizzes.items()
    ]
    return [f"the quizzes are not alike: {', '.join(said)}"]


def differing_units(compared: Sequence[Evaluation | Session], names: Sequence[str]) -> list[str]:
    """Say that models predict outputs in different units, of which only percentages can be compared."""
    units = {
        name: shown(model.output_unit) or "1"
        for name, one in zip(names, compared, strict=True)
        if isinstance(one, Evaluation)
        for model in one.models
    }
    if len(set(units.values())) < 2:
        return []
    said = ", ".join(f"{name} is in {unit}" for name, unit in units.items())
    return [f"the outputs are in different units ({said}): only what is in percent is compared"]


def _units(one: Evaluation) -> dict[str, str]:
    """Return the unit of each figure that is in the unit of the output."""
    stems = one.stems[len(one.waveforms) :]
    return {
        f"{stem}.{name}": shown(model.output_unit)
        for stem, model in zip(stems, one.models, strict=True)
        for name in _IN_UNITS
    }


def _spreads(one: Evaluation) -> dict[str, float]:
    """How far each figure goes from one repeat to the next, by its name; of none that is not known."""
    found = {}
    for stem, w in zip(one.stems, one.waveforms, strict=False):
        spread = w.error_spread_percent
        if w.scaled.mean_abs_error_percent > 0:
            found[f"{stem}.mean_error_reduction_percent"] = 100.0 * spread / w.scaled.mean_abs_error_percent
        for drive in ("scaled", "compensated"):
            found |= dict.fromkeys((f"{stem}.{drive}.{m}_error_percent" for m in ("mean_abs", "rms")), spread)
            found[f"{stem}.{drive}.max_abs_error_percent"] = w.noise_percent
            # a beat goes up and down through the full force: twice the error in area
            found[f"{stem}.{drive}.hysteresis_percent"] = 2.0 * spread
    return {name: spread for name, spread in found.items() if np.isfinite(spread)}


def _named(evaluations: Sequence[Evaluation], every: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Figures of each evaluation under names that are alike where they are to be compared.

    Where no evaluation holds a pulse twice its inversion is left out of the name: before and after may
    differ by just that. A single model is "model", whatever its file is called.
    """
    by_pulse = all(len({w.name for w in one.waveforms}) == len(one.waveforms) for one in evaluations)
    one_model = all(len(one.models) < 2 for one in evaluations)
    found = []
    for one, figures in zip(evaluations, every, strict=True):
        renamed = {f"{w.name}.{w.inversion}.": f"{w.name}." for w in one.waveforms} if by_pulse else {}
        if one_model:
            renamed |= {f"{m.short_name}.": "model." for m in one.models}
        named = figures
        for old, new in renamed.items():
            named = {new + n.removeprefix(old) if n.startswith(old) else n: v for n, v in named.items()}
        found.append(named)
    return found


def _of_session(one: Session) -> dict[str, float]:
    found = {f"session.pressed.{name}": value for name, value in one.figures().items() if np.isfinite(value)}
    if one.quiz is not None:
        result = score(one.quiz)
        found |= {
            "quiz.right_percent": 100.0 * result.share,
            "quiz.right_from_percent": 100.0 * result.interval[0],
            "quiz.right_to_percent": 100.0 * result.interval[1],
        }
        if np.isfinite(result.response_s):
            found["quiz.response_s"] = result.response_s
    return found


def _metric(
    name: str,
    every: Sequence[dict[str, float]],
    spreads: Sequence[dict[str, float]],
    units: Sequence[dict[str, str]],
) -> Metric:
    values = tuple(one.get(name) for one in every)
    said = tuple(one.get(name, "") for one in units) if any(name in one for one in units) else ()
    there = [k for k, value in enumerate(values) if value is not None]
    if len(there) < 2 or (said and said[there[0]] != said[there[-1]]):
        return Metric(name, values, None, None, said)
    first, last = (every[k][name] for k in (there[0], there[-1]))
    spread = max((one.get(name, 0.0) for one in spreads), default=0.0)
    same = max(_SAME * (max(abs(first), abs(last)) if said else 1.0), spread)
    rising = name.endswith(_RISING)
    better = (last > first) if rising else (abs(last) < abs(first))  # an offset may be negative
    return Metric(name, values, last - first, better if abs(last - first) >= same else None, said)
