"""What the command-line parser objects to, in the words of this program."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pulsetrainer.errors import PulsetrainerError, UsageError

_EXAMPLE = re.compile(r"^\s*Example: (.+)$", re.MULTILINE)
# of options that take a word or a number: what they look like
_EXAMPLES = {
    "--smoothing": "--smoothing auto, or a share of the input's range such as --smoothing 0.02",
    "--resample": "--resample even for the median time step, or a rate such as --resample 1000",
}
# what is often given as an argument to a command that has none of that kind
_INSTEAD = {
    "session": "several pulses are separated by commas: --pulses normal,bifid",
    "tune": "a drive is an option: pulsetrainer tune --drive {extra}",
    "ports": "to look at one: pulsetrainer doctor --port {extra}",
    "doctor": "a port is an option: pulsetrainer doctor --port {extra}",
}
_UNKNOWN = re.compile(r"No such command '(.*?)'(?:\..* '(.*)')?")
_EXTRA = re.compile(r"Got unexpected extra argument(?:s|\(s\))? \((.*)\)")
_GOT = re.compile(r"'?(.*?)'? is not (?:a valid|in the range)")


def usage_of(error: Exception, named: str = "") -> UsageError | None:
    """Return what the parser objects to, or None when the error is not the parser's.

    ``named`` is the command, which the parser does not always tell.
    """
    explain = getattr(error, "format_message", None)
    if explain is None:
        return None
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "pulsetrainer")
    parameter: Any = getattr(error, "param", None)
    kind, help_ = type(error).__name__, f"{command} --help"
    if kind == "NoSuchOption":
        near = getattr(error, "possibilities", None) or _beginning_alike(error, context)
        said = f"{command} has no option {getattr(error, 'option_name', '')}"
        return UsageError(said, hint=f"did you mean {' or '.join(near)}?" if near else help_)
    if kind == "MissingParameter" and parameter is not None:
        return _missing(parameter, context, help_)
    if kind == "BadParameter" and parameter is not None:
        return UsageError(f"{_named(parameter)} {_must(parameter, error)}", hint=_without(parameter, help_))
    option = getattr(error, "param_hint", None)  # of what a command finds out itself
    if kind == "BadParameter" and isinstance(option, str):
        said = f"{option} {str(getattr(error, 'message', error)).rstrip('.')}"
        return UsageError(said, hint=_EXAMPLES.get(option, help_))
    return (
        _with_or_without_value(error, named)
        if kind == "BadOptionUsage"
        else _other(str(explain()).rstrip("."), command, getattr(context, "command", None))
    )


def _beginning_alike(error: Exception, context: Any) -> list[str]:
    """Return the options that begin with the letter of a short one that there is not."""
    given = str(getattr(error, "option_name", ""))
    names = [name for one in getattr(getattr(context, "command", None), "params", ()) for name in one.opts]
    return [name for name in names if len(given) == 2 and name.startswith(f"--{given[1:]}")]


def _missing(parameter: Any, context: Any, help_: str) -> UsageError:
    example = _EXAMPLE.search(getattr(getattr(context, "command", None), "help", None) or "")
    like = example[1] if example else help_
    said = f"{_named(parameter)} is missing: {_meaning(parameter)}"
    given: list[Path] = (context.params.get("files") or []) if context is not None else []
    columns = _columns(given) if parameter.name in ("input_column", "output_column") else ()
    if len(columns) > 1:
        first, second = map(shlex.quote, columns[-2:])
        said += f"; {given[0]} has {', '.join(columns)}"
        like = f"name two of them, such as --input {first} --output {second}"
    return UsageError(said, hint=like)


def _with_or_without_value(error: Exception, command: str) -> UsageError:
    """A value where none goes, or none where one does; the parser does not tell of which command."""
    takes = "takes no value" if "not take" in str(getattr(error, "message", "")) else "needs a value"
    return UsageError(
        f"{getattr(error, 'option_name', 'an option')} {takes}",
        hint=" ".join(("pulsetrainer", *filter(None, [command]), "--help")),
    )


def _columns(files: Sequence[Path]) -> tuple[str, ...]:
    """Return the columns of the first table that is to be imported; none where it cannot be read."""
    from pulsetrainer.files.csv_dialect import detect

    if not files or Path(files[0]).suffix.lower() not in (".csv", ".tsv", ".txt", ".dat"):
        return ()
    with contextlib.suppress(PulsetrainerError, OSError, ValueError):
        return detect(Path(files[0])).names
    return ()


def _other(said: str, command: str, parsed: Any) -> UsageError:
    """What has no words of its own here, but for one argument too many and a command that does not exist."""
    help_ = f"{command} --help"
    if extra := _EXTRA.match(said):
        return _one_too_many(extra[1], command, parsed)
    unknown = _UNKNOWN.match(said)
    if unknown is None:
        return UsageError(said, hint=help_)
    if unknown[1] == "help":
        return UsageError(
            "there is no command 'help'", hint="pulsetrainer --help, or pulsetrainer identify --help"
        )
    near = f"did you mean {unknown[2]}? All commands: " if unknown[2] else ""
    return UsageError(f"there is no command {unknown[1]!r}", hint=f"{near}{help_}")


def _one_too_many(extra: str, command: str, parsed: Any) -> UsageError:
    """What stands behind the arguments that a command takes."""
    taken = [p.human_readable_name for p in getattr(parsed, "params", ()) if not p.opts[0].startswith("-")]
    instead = _INSTEAD.get(command.rpartition(" ")[2], "{command} --help")
    beside = "one file at a time; evaluations or sessions side by side: pulsetrainer compare a.h5 b.h5"
    return UsageError(
        f"{command} takes {' and '.join(taken) or 'options only'}, got {extra} besides",
        hint=beside if taken == ["FILE.h5"] else instead.format(command=command, extra=extra),
    )


def _named(parameter: Any) -> str:
    """Name of an option as it is typed, or of an argument as the help names it."""
    names = sorted((name for name in parameter.opts if name.startswith("-")), key=len)
    if not names:
        return str(parameter.human_readable_name)
    return names[0] if len(names) == 1 else f"{names[0]} ({names[-1]})"


def _meaning(parameter: Any) -> str:
    text = (getattr(parameter, "help", None) or "what the command works on").rstrip(".")
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def _must(parameter: Any, error: Exception) -> str:
    """What a value must be, and what it was."""
    said = str(getattr(error, "message", error)).rstrip(".")
    got = _GOT.match(said)
    if got is None or not hasattr(parameter.type, "name"):
        return said
    kind = "a whole number" if "int" in parameter.type.name else "a number"
    low, high = (getattr(parameter.type, end, None) for end in ("min", "max"))
    within = (
        f" from {low:g} to {high:g}" if high is not None else f", {low:g} or more" if low is not None else ""
    )
    return f"must be {kind}{within}, got {repr(got[1]) if 'valid' in got[0] else got[1].removesuffix('.0')}"


def _without(parameter: Any, help_: str) -> str:
    """What happens when an option is left out."""
    default = getattr(parameter, "default", None)
    if isinstance(default, int | float) and not isinstance(default, bool):
        return f"leave it out for the usual {default:g}, or see {help_}"
    return help_ if getattr(parameter, "required", False) else f"leave it out, or see {help_}"
