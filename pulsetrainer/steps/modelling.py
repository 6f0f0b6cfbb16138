"""Names that moved: to ``core.initial_state``, ``diagnosis.prediction`` and ``artefacts.run``."""

from __future__ import annotations

from pulsetrainer.artefacts import Run
from pulsetrainer.core.initial_state import known_from, start_of
from pulsetrainer.diagnosis.prediction import extended_of, operator_of, predict

__all__ = ["extended_of", "known_from", "operator_of", "parts_of", "predict", "start_of", "step_of"]


def step_of(run: Run) -> float | None:
    """Time step of a run, s."""
    return run.dt_s


def parts_of(run: Run) -> tuple[Run, ...]:
    """Return the parts of a run that are long enough to say something."""
    return run.parts(100)
