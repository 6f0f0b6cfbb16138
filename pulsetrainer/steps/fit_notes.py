"""What a fit says of itself in words: its form, and whether it describes the record at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pulsetrainer.artefacts import BoolArray, Model, Run
from pulsetrainer.artefacts.units import counted, quantity_in_words, with_unit
from pulsetrainer.core.fit import Fitted
from pulsetrainer.core.forms import SMALLEST, leaves_more_than_noise
from pulsetrainer.core.input_noise import white
from pulsetrainer.core.loop import drawn, loop_of
from pulsetrainer.core.metrics import root_mean_square
from pulsetrainer.core.output_curve import rivals
from pulsetrainer.diagnosis import velocity
from pulsetrainer.diagnosis.thresholds import LIMITS

POOR = 0.05  # of the output's span, rms: a model that leaves more of what is not noise describes nothing
MUCH = LIMITS.matters  # of the output's span, rms: who leaves more should ask why ...
MANY = 3.0  # ... where that is so many times the noise of single samples
_UNCOUNTED = 1000.0  # times the noise: more is not counted
# % of the cells, by minor loops: where fewer are, nothing tells whether loops are congruent
TOLD_APART = 20.0
_CLIPPED = "saturation"  # the cause that is taken out of an output that its recorder cut off
_BEYOND = 0.01  # of the output's span: where a model goes less far beyond what is known, it does no harm
UNEXPLAINED = 0.5  # of the output's standard deviation: what leaves more explains next to nothing


def _named(of: Run | Model) -> tuple[str, str]:
    """Return output and input as they stand in a sentence."""
    return quantity_in_words(of.output_quantity), quantity_in_words(of.input_quantity)


def of_form(fitted: Fitted, run: Run, asked: str) -> list[str]:
    """Say what was done where the form is not the direct one, and why where nobody asked for it."""
    output, given = _named(run)
    if fitted.form == "dual":
        how = f"fitted with the roles exchanged, {given} over {output} (dual form)"
        loop = loop_of(fitted.operator)
        runs = f", its loop runs {drawn(loop, fitted.operator.polarity)}" if loop != "none" else ""
        why = f"the {output} leads the {given}{runs}"
    elif fitted.form == "signed":
        how = "fitted with weights of either sign (signed form)"
        why = "no loop that runs one way fits this record"
    else:
        return []
    if asked == "auto" and loop_of(fitted.operator) == "clockwise":
        how += f"; if {given} and {output} were swapped by mistake, record or import them the right way"
    held = (
        f"; the record leaves open what follows some reversals of the {given}: there the weights are held "
        f"back so that the {output} stays near its recorded range"
    )
    said = f"{why}: {how}" if asked == "auto" else f"{how}, as was asked"
    return [said + (held if fitted.identified.ridge else "")]


def of_wild(masks: Sequence[BoolArray]) -> list[str]:
    """Say how many samples were left out because they are wild."""
    count, size = sum(int(mask.sum()) for mask in masks), sum(mask.size for mask in masks)
    if not count:
        return []
    wild = counted(count, "wild sample", "is", "are")
    return [f"{wild} left out of the fit ({100 * count / size:.2g} % of the record)"]


def of_clipped(fitted: Fitted, runs: Sequence[Run]) -> list[str]:
    """Say how far an output is known that its recorder cut off, where the model goes on beyond.

    Nothing tells there what the samples were that are left out.
    """
    said = [
        y[~run.counts] for run, y in zip(runs, fitted.predicted, strict=True) if _CLIPPED in run.corrected
    ]
    guessed, known = np.concatenate([*said, np.zeros(0)]), fitted.counted_output
    low, high, slack = float(known.min()), float(known.max()), _BEYOND * float(np.ptp(known))
    ends = [("from", low)] if guessed.min(initial=np.inf) < low - slack else []
    ends += [("up to", high)] if guessed.max(initial=-np.inf) > high + slack else []
    if not ends:
        return []
    told = " ".join(f"{way} {with_unit(f'{end:.4g}', runs[0].output_unit)}" for way, end in ends)
    cut_off = f"the recorder cut the {_named(runs[0])[0]} off, which is known only {told}"
    return [f"{cut_off}: beyond that the model is a guess"]


def leaves_much(fitted: Fitted) -> bool:
    """Whether a fit leaves many times the noise, and enough to matter."""
    return fitted.misfit > MUCH and _times(fitted) > MANY


def _times(fitted: Fitted) -> float:
    """What a fit leaves, as a multiple of the noise from sample to sample; infinite without any."""
    residuals = fitted.counted(fitted.residuals)
    left, noise = root_mean_square(np.concatenate(residuals)), max(white(one) for one in residuals)
    return left / noise if noise > 0.0 else float("inf")


def of_rest(fitted: Fitted) -> list[str]:
    """Say that a fit leaves many times the noise, and enough to matter; nothing where it does not."""
    if not leaves_much(fitted):
        return []
    count, share = _times(fitted), fitted.misfit
    times = f"{count:.0f} times" if count < _UNCOUNTED else "far more than"
    found = f"the model leaves {100 * share:.1f} % of the span (rms), {times} the noise from sample to sample"
    return [f"{found}: pulsetrainer diagnose shows what it misses"]


def of_no_minor_loops(fitted: Fitted, run: Run, minor_percent: float) -> list[str]:
    """Say that the signed form is a guess between the recorded reversals where hardly a minor loop was."""
    if fitted.form != "signed" or minor_percent >= TOLD_APART:
        return []
    output, given = _named(run)
    said = (
        f"minor loops tell only {minor_percent:.0f} % of the cells apart: with weights of either sign the "
        f"{output} is a guess after any reversal of the {given} that this record does not hold. "
        "Record loops within the major one too"
    )
    return [said]


def of_guessed_turns(model: Model) -> list[str]:
    """Say, before a model is inverted, that its record hardly held a minor loop."""
    fit = model.fit
    if fit is None or fit.loop == "none" or not fit.minor_percent < TOLD_APART:
        return []
    said = (
        f"the record of this model has hardly any minor loops (cells told apart: {fit.minor_percent:.0f} %): "
        f"where the {_named(model)[0]} turns within its range the drive is a guess, which the expected "
        "error does not count. Identify on a record with loops within the major one"
    )
    return [said]


def of_noisy_ends(model: Model) -> list[str]:
    """Say, before a model is inverted, that the ends of its input lie in the noise of the measured one.

    Of our own device nothing is said: its firmware keeps the current within its range.
    """
    fit = model.fit
    if fit is None or model.captured or model.form == "dual" or not fit.false_reversals:
        return []
    ends = with_unit(f"{model.edges[0]:.4g} and {model.edges[-1]:.4g}", model.input_unit)
    noise = with_unit(f"{fit.input_noise:.2g}", model.input_unit)
    said = f"the drive goes to the ends of the record, {ends}, which include its noise of {noise}"
    return [f"{said}: an amplifier whose range ends just short of them may clip the drive there"]


def warning(fitted: Fitted, runs: Sequence[Run], asked: str, minor_percent: float) -> str:
    """Say that no form describes the record, and why where that is plain; nothing where one does."""
    residuals, output = fitted.counted(fitted.residuals), fitted.counted_output
    left = root_mean_square(np.concatenate(residuals))
    span = float(np.ptp(output))
    first = runs[0]
    if left <= POOR * span:
        told = fitted.form == "signed" and minor_percent >= TOLD_APART
        return _of_loops_that_differ(fitted, first, span) if told else ""
    compared = velocity.compare(fitted.records, [run.dt_s for run in runs], fitted.residuals)
    if compared.wrong:
        return velocity.warning(compared, first.input_quantity, first.output_quantity)
    if not leaves_more_than_noise(residuals, span) and left <= UNEXPLAINED * float(np.std(output)):
        return ""
    name, given = _named(first)
    what = "No static form (direct, dual, signed)" if asked == "auto" else f"The {asked} form does not"
    verb = " describes this record" if asked == "auto" else " describe this record"
    return (
        f"{what}{verb}: the best fit leaves {100 * left / span:.1f} % of the span. The "
        f"{name} may depend on the speed, on a second input, or hardly on the {given}"
        + ("" if asked == "auto" else ". With no form named, the one that suits is found")
    )


def _of_loops_that_differ(fitted: Fitted, run: Run, span: float) -> str:
    """Say that minor loops of one range differ from place to place, as those of no Preisach operator do."""
    found = rivals(fitted.records, fitted.operator.low, fitted.operator.high)
    if found is None or found.congruent(SMALLEST * span):
        return ""
    output, given = _named(run)
    return (
        f"No static form (direct, dual, signed) describes this record: the same swing of the {given} changes "
        f"the {output} differently from place to place (its minor loops are not congruent), as where it is "
        "the square of a quantity that lags. No model of this program follows that: weights of either sign "
        f"miss {100 * found.signed / span:.2g} % of the span where they were not fitted, and more after "
        "other reversals than those recorded, so use this model for inputs like the recorded one"
    )
