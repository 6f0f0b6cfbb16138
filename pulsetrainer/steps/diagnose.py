"""Diagnose: what a model gets wrong on some runs, the cause by name, and what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pulsetrainer.artefacts import Diagnosis, Model, Run
from pulsetrainer.diagnosis import procedure
from pulsetrainer.diagnosis.artefact import diagnosis_of
from pulsetrainer.diagnosis.question import question_of
from pulsetrainer.errors import UsageError
from pulsetrainer.steps.arguments import named, several
from pulsetrainer.steps.evaluate import beside_its_fit
from pulsetrainer.steps.one_thread import one_thread
from pulsetrainer.steps.progress import Progress, silent


@one_thread
def diagnose(
    runs: Run | Sequence[Run],
    model: Model,
    *,
    quick: bool = False,
    seed: int = 0,
    names: Sequence[str] = (),
    progress: Progress = silent,
) -> Diagnosis:
    """Find out what a model gets wrong on some runs: the causes by name, and the model extended by them.

        M(u) = (output causes) o P o (input causes) (u)

    with P a Preisach operator whose weights are refitted together with the parameters of the causes.
    ``diagnosis.procedure`` lists the stages that lead to the verdict.

    Parameters
    ----------
    runs
        Of one device, in the units of the model.
    quick
        Only screen: it takes seconds, strengths are linearised, and nothing can be extended by what is found.
    seed
        Seed of the simulated null distribution.
    names
        Names of the runs and, last, of the model, for messages.
    progress
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    UsageError
        There is no run.
    DataError
        Runs and model differ in their units or ranges, the model is read as relays, a run is too short or
        mostly gaps, or its input or output does not vary.

    Source: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973 (the joint fit); Davison and Hinkley, Bootstrap
    Methods and their Application, 1997 (the simulated null).

    Examples
    --------
    >>> import pulsetrainer as pt
    >>> run, model = pt.load("tests/data/files-0.1/run.h5"), pt.load("tests/data/files-0.1/model.h5")
    >>> pt.diagnose(run, model, quick=True).quick
    True
    """
    whole = several(runs)
    if not whole:
        raise UsageError(
            "diagnose needs at least one run", hint="pulsetrainer capture diagnostic -o diagnostic.h5"
        )
    rng = np.random.default_rng(seed)
    called = named(names, [*(f"run {k}" for k in range(1, len(whole) + 1)), "the model"])
    question = question_of(
        whole, model, rng=rng, quick=quick, progress=progress, names=called, named=bool(names)
    )
    found = diagnosis_of(procedure.diagnose(question))
    why = beside_its_fit(model, whole[0], found.rms_percent) if len(whole) == 1 else ""
    said = (f"{called[-1]} leaves {found.rms_percent:.3g} % of {called[0]} here: {why}",) if why else ()
    return replace(found, notes=(*found.notes, *said))
