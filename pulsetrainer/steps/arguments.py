"""What can be refused by a look at the arguments alone; loads nothing, so that the answer comes at once."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from inspect import Signature, signature
from os import PathLike
from typing import Any

from pulsetrainer.errors import ArgumentError, UsageError

EXCITATIONS = ("identification", "diagnostic")
_NUMBERS = {"int", "float", "int | None", "float | None"}
_WHOLE = ("int", "int | None")
MOST_FITTED = 500  # levels: 400 take three minutes and 1.4 GB


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
    if not pulses:
        raise UsageError("a session needs pulses, got none", hint="name some of the library: normal,bifid")
    if twice := [name for name, times in Counter(pulses).items() if times > 1]:
        raise UsageError(
            f"{twice[0]} is named twice, and each pulse gets an equal share",
            hint="name each pulse once, such as normal,bifid",
        )
    if quiz:
        check_quiz(len(pulses), quiz)
    elif answers:
        raise UsageError(
            "`answers` was given without `quiz`",
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


def _check_is(kinds: tuple[type, ...], one: object, verb: str) -> None:
    """Raise ArgumentError for what is of another kind, such as the name of the file that it is in."""
    if not isinstance(one, kinds):
        name = str(one) if isinstance(one, str) or hasattr(one, "__fspath__") else ""
        raise ArgumentError(
            f"expected {' or '.join(map(_a, kinds))}, got {repr(name) if name else _a(type(one))}",
            hint=f"pt.load({name!r}) gives it"
            if "." in name
            else f"help(pt.{verb}) shows the order of the arguments",
        )


def _check_plain(name: str, annotation: str, one: object) -> None:
    """Raise ArgumentError for text as a number, no seed, no device, and what names no file."""
    if annotation in _NUMBERS and isinstance(one, str):
        raise ArgumentError(
            f"`{name}` must be a number, got {one!r}", hint="write it without quotes and without a unit"
        )
    if annotation in _WHOLE and isinstance(one, float) and not one.is_integer():
        raise ArgumentError(f"`{name}` must be a whole number, got {one:g}", hint="write it without decimals")
    if name == "rate_Hz" and isinstance(one, int | float) and not one > 0:
        raise ArgumentError(f"`rate_Hz` must be more than 0, got {one:g}", hint="give samples a second")
    if name == "seed" and isinstance(one, int | float) and one < 0:
        raise ArgumentError(f"`seed` must be a whole number, 0 or more, got {one}", hint="0 is the usual one")
    if annotation == "Device" and not hasattr(one, "info"):
        port = one if isinstance(one, str) else "bench:"
        raise ArgumentError(
            f"expected a device, got {one!r}", hint=f"with pt.open_device({port!r}) as device: ..."
        )
    if annotation == "Path | str" and not (isinstance(one, str | PathLike) and str(one).strip()):
        got = repr(one) if isinstance(one, str) else _a(type(one))
        raise ArgumentError(f"`{name}` must name a file, got {got}", hint="give its name, such as 'run.h5'")


def _a(kind: type) -> str:
    if kind is type(None):
        return "None"
    return f"an {kind.__name__}" if kind.__name__[0] in "AEIOaeio" else f"a {kind.__name__}"


class _Plain(str):
    """An annotation as it was written, without the quotes that a text has in a signature."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def readable(verb: Callable[..., Any]) -> Signature:
    """Return the signature of a verb as it is written, for help and the reference."""
    written = signature(verb)
    plain = [
        one if one.annotation is one.empty else one.replace(annotation=_Plain(one.annotation))
        for one in written.parameters.values()
    ]
    return written.replace(parameters=plain, return_annotation=_Plain(written.return_annotation))


def kinds_checked(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Return a verb that raises ArgumentError for an artefact of another kind than its annotations name.

    Where they name a sequence, each that is in it is looked at. Text as a number, what is no device, and what
    names no file are refused too. Its signature is readable.
    """
    whole = signature(verb)
    kinds = {name: _kinds_in(str(one.annotation)) for name, one in whole.parameters.items()}

    @wraps(verb)
    def checked(*given: Any, **named: Any) -> Any:
        try:
            bound = whole.bind(*given, **named)
        except TypeError:  # the verb says it better
            return verb(*given, **named)
        for name, one in bound.arguments.items():
            annotation = str(whole.parameters[name].annotation)
            _check_plain(name, annotation, one)
            alone, each = kinds[name]
            if each and isinstance(one, Iterable) and not isinstance(one, str):
                bound.arguments[name] = several(one)  # which may be gone through only once
                for single in bound.arguments[name]:
                    _check_is(each, single, verb.__name__)
            elif (alone or each) and (one is not None or "None" not in annotation):
                _check_is(alone or each, one, verb.__name__)
        return verb(*bound.args, **bound.kwargs)

    shown: Any = checked
    shown.__signature__ = readable(verb)
    return checked


def _kinds_in(annotation: str) -> tuple[tuple[type, ...], tuple[type, ...]]:
    """Return the kinds of artefact that an annotation names alone, and those in a sequence."""
    from pulsetrainer.artefacts import KINDS

    known = {kind.__name__: kind for kind in KINDS.values()}
    alone = re.findall(r"\w+", re.sub(r"Sequence\[.*?\]|None", "", annotation))
    each = re.findall(r"\w+", " ".join(re.findall(r"Sequence\[(.*?)\]", annotation)))
    if not known.keys() >= {*alone, *each}:
        return (), ()
    return tuple(known[word] for word in alone), tuple(known[word] for word in each)


def check_levels(levels: int | None, most: int = MOST_FITTED) -> None:
    """Raise ArgumentError for what is no number of levels; None is no choice."""
    if levels is not None and (not 2 <= levels <= most or levels != int(levels)):
        raise ArgumentError(
            f"`levels` must be a whole number from 2 to {most}, got {levels}",
            hint="48 levels suit most devices",
        )


def several(given: Any) -> list[Any]:
    """Return what was given, one or many, as a list."""
    return list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]


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
            raise UsageError(f"{path} is named twice, and would be counted twice", hint="name each file once")


def check_several(evaluations: Sequence[object]) -> None:
    """Raise UsageError where there are fewer than two to compare."""
    if len(evaluations) < 2:
        raise UsageError(
            f"compare needs at least two evaluations, got {len(evaluations)}",
            hint="pulsetrainer compare before.h5 after.h5",
        )


def check_measured(names: Sequence[str], given: Sequence[Any], models: Sequence[Any]) -> None:
    """Raise UsageError for artefacts, with a name each, that `evaluate` does not take together."""
    counts = Counter(one.kind for one in given)
    if counts["playback"] == len(given) > 0:
        if models:
            raise UsageError(
                f"{names[0]} is a playback, and models are tested on a run",
                hint="leave `model` out, or give a run: pulsetrainer evaluate run.h5 --model model.h5",
            )
    elif not (counts["run"] == len(given) == 1 and models):
        order = {kind: counts[kind] for kind in ("playback", "run", "session")} | {"model": len(models)}
        got = [f"{count} {word}{'s' if count > 1 else ''}" for word, count in order.items() if count]
        raise UsageError(
            "evaluate takes playbacks, or one run together with the models to test on it, or one session; "
            f"got {', '.join(got) or 'nothing'}",
            hint=_one_by_one([(shlex.quote(name), one.kind) for name, one in zip(names, given, strict=True)]),
        )


def _one_by_one(given: Sequence[tuple[str, str]]) -> str:
    """Say how files are evaluated, each kind by itself: ``given`` are their names and kinds."""
    playbacks, runs, sessions = (
        [name for name, kind in given if kind == wanted] for wanted in ("playback", "run", "session")
    )
    if len(sessions) > 1:
        return f"one session at a time; to see them side by side: pulsetrainer compare {' '.join(sessions)}"
    ways = [*sessions, *([" ".join(playbacks)] if playbacks else [])]
    ways += [f"{run} --model model.h5" for run in runs or (() if ways else ("run.h5",))]
    several = "each by itself: " if len(ways) > 1 else ""
    return several + ", and ".join(f"pulsetrainer evaluate {way}" for way in ways)
