"""A diagnosis as text: what ``print`` and the command show of it."""

from __future__ import annotations

import math
import re
from collections.abc import Container, Iterator, Sequence
from itertools import chain, count, pairwise
from typing import Any

from pulsetrainer.artefacts import Cause, Diagnosis, Parameter
from pulsetrainer.artefacts.units import more_easily, with_unit
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.diagnosis.wording import joined
from pulsetrainer.report.tables import Facts, Table

_SHOWN = 8  # causes in the table
_NOTHING = 1e-3  # of an interval: a value of less is rounding
_NARROW = 0.01  # of the value
_CURVE = re.compile(r"[fg]\d+")  # the values of a learned curve, of a gain: one by one they say nothing
_OF_A_CURVE = ("state", "low", "high")
DRAWN = "the report (--html) draws it"
# what is left by each model: in words, then the fields of single samples and of short averages
ERRORS = (
    ("the model as given", "rms_percent", ""),
    ("a model fitted anew to these recordings", "", "static_percent"),
    ("that model with the causes found", "extended_rms_percent", "extended_percent"),
    ("noise alone (averages: plus the levels)", "noise_percent", "floor_percent"),
)
IN_MODEL = "the model as given contains it already"
COLUMNS = {
    "explains": "share of the squared error beyond noise that goes with this cause in the model; shares of "
    "causes that look alike overlap; of one that was not found, a first estimate without a refit",
    "held-out share": "what the cause takes away of the squared error beyond noise that the model leaves "
    "without it, on parts of the recordings that were left out of the fit",
}


def sections(found: Diagnosis) -> Iterator[Facts | Table]:
    """Yield what there is to say, in the order in which a person would ask."""
    held = found.verdict in found.in_model
    how = ("quick screen",) * found.quick + ("in doubt",) * in_doubt(found) + (IN_MODEL,) * held
    how += tuple(rivals(one) for one in found.found if one.cause == found.verdict and one.confounded_with)
    yield Facts(f"verdict: {found.verdict}" + (f" ({', '.join(how)})" if how else ""), {})
    if seen := unnamed(found):
        yield Facts(f"seen, but not named: {seen}, which is {too_little(found)}", {})
    for one in found.found:
        yield Facts(f"{'in doubt' if one.doubts else 'found'}: {one.cause}, {one.text}", _said(one))
    yield Table(
        "error that is left, rms, % of the span of the output",
        ("left by", "single samples", "short averages"),
        tuple(
            (words, *(_figure(getattr(found, name), ".3f") if name else None for name in fields))
            for words, *fields in ERRORS
            if stands(found, fields)
        ),
    )
    columns = ("cause", "found", "explains, %", "held-out\nshare, %")
    rows = tuple(_row(one, found) for one in tried(found))
    # those found were told above
    explained = {one.cause: one.text for one in tried(found) if one.text and not one.found}
    if tells_shares(found):
        yield Table("causes, strongest first", columns, rows)
        explained = COLUMNS | explained
    else:
        yield Table("causes, strongest first", columns[:2], tuple(row[:2] for row in rows))
    if explained:
        yield Facts("in this table", explained)
    yield Facts("evidence", {str(k): text for k, text in enumerate(evidence(found), start=1)})
    yield Facts("next", {" " * k: one for k, one in enumerate(found.advice)})


def tried(found: Diagnosis) -> list[Cause]:
    """Return the causes of the table, here and on the page: those found, then the strongest others."""
    others = [one for one in found.causes if not one.found]
    return [*found.found, *others[: max(_SHOWN - len(found.found), 0)]]


def evidence(found: Diagnosis) -> list[str]:
    """Return the evidence, but for what stands word by word with a cause that was found."""
    said = {f"{one.cause}: {one.text.removesuffix('.')}." for one in found.found}
    return [line for line in found.evidence if line not in said]


def in_doubt(found: Diagnosis) -> bool:
    """Tell whether something speaks against the cause that the verdict names."""
    return any(one.cause == found.verdict and bool(one.doubts) for one in found.found)


def beside(found: Diagnosis) -> tuple[list[str], list[str]]:
    """Return what else was found, each once: without doubt, and where the verdict is sure, in doubt."""
    others = [one for one in found.found if one.cause != found.verdict]
    doubted = [] if in_doubt(found) else [one.cause for one in others if one.doubts]
    sure = [one.cause for one in others if one.cause not in doubted]
    return list(dict.fromkeys(sure)), list(dict.fromkeys(doubted))


def unnamed(found: Diagnosis) -> str:
    """Return the strongest cause that noise alone hardly looks like, where none was found; else nothing."""
    if found.verdict not in ("none", "inconclusive") or found.found:
        return ""
    seen = (one.cause for one in found.causes if one.p_value is not None and one.p_value <= LIMITS.p_max)
    return next(seen, "")


def too_little(found: Diagnosis) -> str:
    """Say why the cause that was seen is not named."""
    return "too small to matter" + ("" if found.quick else " or not confirmed by the refit")


def stands(found: Diagnosis, fields: Sequence[str]) -> bool:
    """Tell whether a row of ``ERRORS`` applies: without causes there is no model with them."""
    return "extended_percent" not in fields or bool(found.found and not found.quick)


def answer(one: Cause, found: Diagnosis) -> str:
    """Say whether a cause was found, and if not, why."""
    if one.found:
        return "in doubt" if one.doubts else "yes"
    instead = [other.cause for other in found.found if one.cause in other.confounded_with]
    if instead:
        return f"no: an alternative to {instead[0]}"
    if one.p_value is None:
        return "no"
    if one.p_value > LIMITS.p_max:
        return "no: noise does as much"
    if not found.quick:
        return "no: not confirmed by the refit"
    return "no: another explains more" if found.found else "no: too small to matter"


def parameters(several: Sequence[Parameter], *, drawn: str = DRAWN) -> dict[str, str]:
    """Return parameters by name, each with unit, interval and meaning; of a curve, where it is ``drawn``."""
    said: dict[str, str] = {}
    # what was chosen, such as how many time constants there are, comes after what was measured
    for one in sorted(several, key=lambda one: one.chosen):
        if not of_a_curve(one):
            said[_numbered(one.name, said)] = parameter(one) + _amplitude(one, several)
    values = [one for one in several if _CURVE.fullmatch(one.name)]
    begins = [k for k, one in enumerate(values) if one.name[1:] == values[0].name[1:]]
    for begin, end in pairwise([*begins, len(values)]):
        of_gain = values[begin].name.startswith("g")
        times, unit, to = (100.0, "%", "gain") if of_gain else (1.0, values[begin].unit, "output")
        curve = [0.0, *(times * one.value for one in values[begin:end])]
        ends = with_unit(f"{min(curve):.3g} to {max(curve):.3g}", unit)
        said[_numbered("curve", said)] = f"{ends}: what it adds to the {to}; {drawn}"
    return said


def _numbered(name: str, said: Container[str]) -> str:
    """Return a name, or, where it is taken, with the next number."""
    names = chain((name,), (f"{name} {number}" for number in count(2)))
    return next(one for one in names if one not in said)


def of_a_curve(one: Parameter) -> bool:
    """Tell whether a parameter is a value of a learned curve, or says where the curve lies."""
    return bool(_CURVE.fullmatch(one.name)) or one.name in _OF_A_CURVE


def parameter(one: Parameter) -> str:
    """Return a parameter with its unit, its 95 % interval and what it is of."""
    known = math.isfinite(one.lower) and one.lower < one.upper
    # a narrow interval needs the digits of the value
    digits = 4 if one.upper - one.lower < _NARROW * abs(one.upper) else 3
    low, high = f"{one.lower:.{digits}g}", f"{one.upper:.{digits}g}"
    half = max(one.upper - one.value, one.value - one.lower)
    between = f"{low} to {high}" if low != high else f"± {half:.1g}"  # "7 to 7" would tell nothing
    interval = f" (95 %: {between})" if known else ""
    value = one.value if not known or abs(one.value) > _NOTHING * (one.upper - one.lower) else 0.0
    said = with_unit(f"{value:.4g}", one.unit)
    if easy := more_easily(value, one.unit):
        said += f" = {easy}"
    return said + interval + (f": {one.meaning}" if one.meaning else "")


def _amplitude(one: Parameter, several: Sequence[Parameter]) -> str:
    """Say behind a cosine how large it is together with its sine."""
    sine = [s for s in several if "cosine" in one.name and s.name == one.name.replace("cosine", "sine")]
    size = with_unit(f"{math.hypot(one.value, sine[0].value):.3g}", one.unit) if sine else ""
    return f"; with the sine, an amplitude of {size}" if sine else ""


def rivals(one: Cause) -> str:
    """Return what a cause cannot be told from."""
    return f"could equally be {joined(one.confounded_with, 'or')}"


def _said(one: Cause) -> dict[str, str]:
    return {
        **parameters(one.parameters),
        **({"or": rivals(one)} if one.confounded_with else {}),
        **({"why in doubt": "; ".join(one.doubts)} if one.doubts else {}),
    }


def explains(one: Cause, found: Diagnosis) -> float:
    """Return the share of the error that a cause explains.

    NaN where none is beyond noise, of a cause that explains no more than noise would, of one that could be
    instead of another, since beside that one it explains nothing, and of one that was read off the raw data,
    whose samples are left out.
    """
    beyond = not found.static_percent <= found.floor_percent
    untested = one.found and one.p_value is None  # of the model as given, or read off the raw data
    instead = not one.found and any(one.cause in other.confounded_with for other in found.found)
    by_noise = not one.found and one.p_value is not None and one.p_value > LIMITS.p_max
    unknown = instead or by_noise or (untested and one.explains_percent == 0.0)
    return one.explains_percent if (beyond or untested) and not unknown else math.nan


def tells_shares(found: Diagnosis) -> bool:
    """Tell whether any cause has a share: not where nothing is beyond noise and nothing was fitted.

    Those of a quick screen are first estimates, each as if it were alone: together they say nothing. Nor do
    those of an error that is too small to matter.
    """
    small = found.verdict == "none" and not found.found
    return not (found.quick or small) and any(math.isfinite(explains(one, found)) for one in found.causes)


def _row(one: Cause, found: Diagnosis) -> tuple[Any, ...]:
    gain = one.held_out_gain_percent if one.found else math.nan
    share = _figure(explains(one, found), ".1f")
    return (one.cause, answer(one, found), share, _figure(gain, ".1f"))


def _figure(value: float, form: str) -> str | None:
    return format(value, form) if math.isfinite(value) else None
