"""A value that an option does not take: what it must be, what it was, who set it, how it is written."""

from __future__ import annotations

import difflib
import math
import re
from typing import Any

from typer import BadParameter

from pulsetrainer.errors import UsageError
from pulsetrainer.files.settings import SETTINGS

_GOT = re.compile(r"'?(.*?)'? is not (?:a valid|in the range)")
_FACTORS = {"m": 1e-3, "k": 1e3}  # of units that a number was given in
_SECONDS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}  # as in units, which loads numpy
_NEARLY_A_NUMBER = re.compile(r", got '(-?\d+)(?:[.,](\d+))?\s*([^\d\s.,]*)'$")
_CLOCK = re.compile(r", got '(\d+):([0-5]\d)'$")  # minutes and seconds
_UNIT = re.compile(r", (%|A|A/s|Hz|min|N|s|V)(?=[ .;,])")  # of a number, as its help says it: "Top, A."


def bad_value(parameter: Any, context: Any, must: str, help_: str) -> UsageError:
    """Return what is wrong with the value of an option; where nobody typed it, with what set it."""
    if elsewhere := set_by(parameter, context):
        return UsageError(f"{elsewhere[0]} (for {named(parameter)}) {must}", hint=elsewhere[1])
    hint = _as_a_number(parameter, must) or _choice(parameter, must, context) or _without(parameter, help_)
    return UsageError(f"{named(parameter)} {must}", hint=hint)


def set_by(parameter: Any, context: Any) -> tuple[str, str] | None:
    """Return what set a value that nobody typed as an option, and how it is put right; None: it was typed."""
    source = context.get_parameter_source(parameter.name) if context is not None else None
    if source is not None and source.name == "ENVIRONMENT":
        return f"the variable {parameter.envvar}", f"correct it, or take it away: unset {parameter.envvar}"
    if source is not None and source.name == "DEFAULT_MAP":
        key = next(one.key for one in SETTINGS if one.variable == parameter.envvar)
        return f"{key} in {context.find_root().obj}", f"correct it there, or give {named(parameter)}"
    return None


def named(parameter: Any) -> str:
    """Name of an option as it is typed, or of an argument as the help names it."""
    names = sorted((name for name in parameter.opts if name.startswith("-")), key=len)
    if not names:
        word = str(parameter.human_readable_name)
        return word.upper() if word.islower() else word  # as in the help, where it is given no other
    return names[0] if len(names) == 1 else f"{names[0]} ({names[-1]})"


def meaning_of(parameter: Any) -> str:
    """Return what an option or argument means, as its help says it."""
    text = (getattr(parameter, "help", None) or "what the command works on").rstrip(".")
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def must_be(parameter: Any, error: Exception) -> str:
    """What a value must be, and what it was."""
    said = str(getattr(error, "message", error)).rstrip(".")
    got = _GOT.match(said)
    if got is None or not hasattr(parameter.type, "name"):
        return said
    kind = "a whole number" if "int" in parameter.type.name else "a number"
    value = repr(got[1]) if "valid" in got[0] else got[1].removesuffix(".0")
    return f"must be {kind}{_within(parameter)}, got {value}"


def _within(parameter: Any) -> str:
    low, high = (getattr(parameter.type, end, None) for end in ("min", "max"))
    least = "" if low is None else f", {low:g} or more"
    return least if high is None else f" from {low:g} to {high:g}"


def check_finite(context: Any) -> None:
    """Raise BadParameter for an option that is nan or inf, which a range lets pass."""
    for one in context.command.params:
        value = context.params.get(one.name)
        if isinstance(value, float) and not math.isfinite(value):
            said = f"must be a finite number{_within(one)}, got {value}"
            raise BadParameter(said, ctx=context, param=one)


def _as_a_number(parameter: Any, must: str) -> str:
    """How the number is written that was given with a decimal comma, or with its unit; else empty."""
    must = _CLOCK.sub(lambda at: f", got '{int(at[1]) + int(at[2]) / 60:.4g}min'", must)
    given = _NEARLY_A_NUMBER.search(must) if "float" in getattr(parameter.type, "name", "") else None
    if given is None:
        return ""
    number, unit = given[1] + (f".{given[2]}" if given[2] else ""), given[3]
    said = _UNIT.search(meaning_of(parameter) + ".")
    if not unit:
        return f"write it with a point and without a unit: {number}"
    if (said and unit == said[1]) or (unit == "bpm" and "beats a minute" in meaning_of(parameter)):
        return f"write the number alone, in {unit}: {number}"
    if said and unit[1:] == said[1] and unit[0] in _FACTORS:
        return f"write it in {said[1]}, without the unit: {float(number) * _FACTORS[unit[0]]:g}"
    if said and {unit, said[1]} <= _SECONDS.keys():
        factor = _SECONDS[unit] / _SECONDS[said[1]]
        return f"write it in {said[1]}, without the unit: {float(number) * factor:g}"
    # what is typed in % must not be taken for N
    how = "give the value itself, not a share of it" if unit == "%" else f"give it without {unit}"
    return f"{how}: {named(parameter)} is the {meaning_of(parameter)}"


def _choice(parameter: Any, must: str, context: Any) -> str:
    """Which of the words that an option takes is meant, or which option takes this one; else empty."""
    given, choices = re.match("'(.*?)' is not one of", must), getattr(parameter.type, "choices", ())
    word = given[1] if given else ""
    for other in context.command.params if context is not None else ():
        if word in getattr(other.type, "choices", ()) and not other.hidden:
            return f"{word} belongs to another option: {other.opts[0]} {word}"
    near = difflib.get_close_matches(word.lower(), list(choices), n=1)
    return f"did you mean {near[0]}?" if near else ""


def _without(parameter: Any, help_: str) -> str:
    """What happens when an option is left out."""
    default = getattr(parameter, "default", None)
    if named(parameter) == "--delay":  # 0 takes out nothing
        return "give how late the output was recorded, in s, such as --delay 0.001"
    if named(parameter) == "--port":  # left out, it would be the simulated device
        lists = "pulsetrainer ports lists them"
        return f"give its name ({lists}); if a script gives it, check that its variable is set"
    if isinstance(default, int | float) and not isinstance(default, bool):
        return f"leave it out for the usual {default:g}, or see {help_}"
    return help_ if getattr(parameter, "required", False) else f"leave it out, or see {help_}"
