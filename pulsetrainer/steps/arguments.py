"""What can be refused by a look at the arguments alone; loads nothing, so that the answer comes at once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from inspect import signature
from typing import Any

from pulsetrainer.errors import ArgumentError, UsageError

EXCITATIONS = ("identification", "diagnostic")
MOST_LEVELS = 500  # 400 take three minutes and 1.4 GB


def check_beat(beat: str | int | None) -> None:
    """Raise UsageError for what is neither the number of a beat nor the mean; None is no choice."""
    if beat is not None and beat != "mean" and not (str(beat).isdecimal() and int(beat) > 0):
        raise UsageError(
            f"`beat` must be a whole number, 1 for the first beat, or mean, got {beat!r}",
            hint="give `beat` 1, or `beat` mean",
        )


def check_force_range(low: float | None, high: float | None) -> None:
    """Raise UsageError for an empty range; None is an end that the model chooses."""
    if low is not None and high is not None and not high > low:
        raise UsageError(
            f"the force range is empty: `force_min` {low:g} is not below `force_max` {high:g}",
            hint="swap or change the two",
        )


def check_asked_for(answers: object, quiz: int, pulses: Sequence[str]) -> None:
    """Raise UsageError for pulses named twice or not at all, answers without a quiz, a quiz that is none."""
    if not pulses or len(set(pulses)) < len(pulses):
        raise UsageError(
            "a session needs pulses, each named once, got " + (", ".join(pulses) or "none"),
            hint="name some of the library: normal,bifid",
        )
    if quiz:
        check_quiz(len(pulses), quiz)
    elif answers:
        raise UsageError(
            "`answers` were given, but no quiz asks for them",
            hint="give `quiz` with the number of questions, or leave `answers` out",
        )


def check_quiz(choices: int, questions: int) -> None:
    """Raise UsageError for fewer than two pulses to choose from, or fewer questions than pulses."""
    if choices < 2:
        raise UsageError(
            f"a quiz needs at least two pulses to choose from, got {choices}",
            hint="name more, such as `pulses` normal,bifid",
        )
    if questions < choices:
        raise UsageError(
            f"a quiz of {questions} question{'s' * (questions != 1)} cannot ask each of {choices} pulses",
            hint=f"ask at least {choices}",
        )


def check_is(kind: type | tuple[type, ...], *given: object) -> None:
    """Raise ArgumentError for what is of another kind, such as the name of the file that it is in."""
    for one in given:
        if not isinstance(one, kind):
            wanted = " or ".join(_a(k) for k in (kind if isinstance(kind, tuple) else (kind,)))
            name = str(one) if isinstance(one, str) or hasattr(one, "__fspath__") else ""
            raise ArgumentError(
                f"expected {wanted}, got {repr(name) if name else _a(type(one))}",
                hint=f"pt.load({name!r}) gives it" if name else "see its help",
            )


def _a(kind: type) -> str:
    return f"an {kind.__name__}" if kind.__name__[0] in "AEIOaeio" else f"a {kind.__name__}"


def kinds_checked(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Return a verb that raises ArgumentError for an artefact of another kind than its annotations name."""
    from pulsetrainer.artefacts import KINDS

    whole, known = signature(verb), {kind.__name__: kind for kind in KINDS.values()}
    kinds = {}
    for name, parameter in whole.parameters.items():
        words = re.findall(r"\w+", re.sub(r"Sequence\[.*?\]|None", "", str(parameter.annotation)))
        if words and known.keys() >= set(words):
            kinds[name] = tuple(known[word] for word in words)

    @wraps(verb)
    def checked(*given: Any, **named: Any) -> Any:
        try:
            bound = whole.bind(*given, **named).arguments
        except TypeError:  # the verb says it better
            return verb(*given, **named)
        for name, allowed in kinds.items():
            one = bound.get(name)
            if one is not None and (isinstance(one, str) or not isinstance(one, Iterable)):
                check_is(allowed, one)
        return verb(*given, **named)

    return checked


def check_levels(levels: int | None) -> None:
    """Raise ArgumentError for what is no number of levels; None is no choice."""
    if levels is not None and (not 2 <= levels <= MOST_LEVELS or levels != int(levels)):
        raise ArgumentError(
            f"`levels` must be a whole number from 2 to {MOST_LEVELS}, got {levels}",
            hint="48 levels suit most devices",
        )


def several(kind: type | tuple[type, ...], given: Any) -> list[Any]:
    """Return what was given, one or many, as a list; raises as ``check_is``."""
    whole = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    check_is(kind, *whole)
    return whole


def named(names: Sequence[str], usual: Sequence[str], *, argument: str = "names") -> Sequence[str]:
    """Return the names that were given, or the usual ones; ArgumentError where there is not one for each."""
    if names and len(names) != len(usual):
        expected, got = (", ".join(map(repr, one)) for one in (usual, names))
        raise ArgumentError(
            f"`{argument}` must hold {len(usual)}, such as {expected}; got {len(names)}: {got}",
            hint=f"give a list with one name for each, in this order, or leave `{argument}` out",
        )
    return names or usual


def check_once(files: Sequence[object]) -> None:
    """Raise UsageError for a file that is named twice where each is to count once."""
    for number, path in enumerate(files):
        if path in files[:number]:
            raise UsageError(f"{path} is named twice, and would count double", hint="name each file once")


def check_several(evaluations: Sequence[object]) -> None:
    """Raise UsageError where there are fewer than two to compare."""
    if len(evaluations) < 2:
        raise UsageError(
            f"compare needs at least two evaluations, got {len(evaluations)}",
            hint="pulsetrainer compare before.h5 after.h5",
        )
