"""What the command-line parser objects to, in the words of this program."""

from __future__ import annotations

import difflib
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pulsetrainer.cli.extra_word import command_for, for_a_switch, one_too_many, value_of
from pulsetrainer.cli.instead import NO_OPTION, SHELLS
from pulsetrainer.cli.values import bad_value, meaning_of, must_be, named
from pulsetrainer.errors import UsageError
from pulsetrainer.files.input_file import likely_kind, name_columns

_EXAMPLE = re.compile(r"^\s*Example: (.+)$", re.MULTILINE)
# of options that take a word or a number: what they look like
_EXAMPLES = {
    "--bootstrap": "--bootstrap 200 is usual",
    "--smoothing": "--smoothing auto, or a share of the input's range such as --smoothing 0.02",
    "--resample": "--resample even for the median time step, or a rate such as --resample 1000",
}
_COLUMNS = ("input_column", "output_column")
_LONG_DASHES = ("\N{EN DASH}", "\N{EM DASH}", "\N{MINUS SIGN}")
_UNKNOWN = re.compile(r"No such command '(.*?)'(?:\..*? '(.*?)')?")  # the nearest comes first
_EXTRA = re.compile(r"Got unexpected extra argument(?:s|\(s\))? \((.*)\)")


def usage_of(error: Exception, words: Sequence[str]) -> UsageError | None:
    """Return what the parser objects to in the ``words`` that were typed; None where it is not the parser."""
    explain = getattr(error, "format_message", None)
    if explain is None:
        return None
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", "pulsetrainer")
    parameter: Any = getattr(error, "param", None)
    kind, help_ = type(error).__name__, f"{command} --help"
    if kind == "NoSuchOption":
        given = _as_typed(str(getattr(error, "option_name", "")), words)
        near, moved = _alike(given, context), _elsewhere(given, context, words)
        hint = f"did you mean {' or '.join(near)}?" if near else help_
        name = command.rpartition(" ")[2]
        behind = shlex.join(words[words.index(name) + 1 :]) if name in words else ""
        known = NO_OPTION.get(f"{name} {given}") or NO_OPTION.get(given, "")
        out = value_of("-o", words) or "out.h5"
        known = moved or known.format(behind=behind, value=value_of(given, words), out=out).rstrip()
        if Path(given).is_file():
            known = f"if that is the name of a file, write ./{given}"
        return UsageError(f"{command} has no option {given}", hint=known or hint)
    if kind == "MissingParameter" and parameter is not None:
        return _missing(parameter, context, help_)
    if kind == "BadParameter" and parameter is not None:
        return bad_value(parameter, context, must_be(parameter, error), help_)
    option = getattr(error, "param_hint", None)  # of what a command finds out itself
    if kind == "BadParameter" and isinstance(option, str):
        said = f"{option} {str(getattr(error, 'message', error)).rstrip('.')}"
        return UsageError(said, hint=_EXAMPLES.get(option, help_))
    return (
        _with_or_without_value(error, context, help_, words)
        if kind == "BadOptionUsage"
        else _other(str(explain()).rstrip("."), command, getattr(context, "command", None), words)
    )


def check_apart(words: Sequence[str]) -> None:
    """UsageError for ``-output x.h5`` and ``-o=x.h5``: to the parser they name the files utput and =x.h5.

    And for the long dash of a word processor, and ``--show-completion zsh``, which takes no value.
    """
    typed = words[: words.index("--") if "--" in words else None]
    for word, behind in zip(typed, (*typed[1:], "FILE"), strict=False):
        if word.startswith(("-ou", "-o=")):
            option, _, value = word.partition("=")
            name = shlex.quote(value or behind)
            column = "import" in words and option != "-o" and not name.endswith(".h5")
            raise UsageError(
                f"there is no option {word}" + ": give the file to write after -o and a space" * (not column),
                hint=f"a long name has two dashes: -{option} {name}" if column else f"-o {name}",
            )
        if word.startswith(_LONG_DASHES) and not Path(word).exists():
            short = word.lstrip("".join(_LONG_DASHES))
            dash = "-" if len(short) == 1 or short[:1].isdigit() else "--"
            raise UsageError(
                f"{word} begins with a long dash, as a word processor makes it, not with a hyphen",
                hint=f"type it again with a hyphen: {dash}{short}",
            )
    first, second = (*words, "", "")[:2]  # typer asks the surroundings for the shell, not the words
    if first in ("--show-completion", "--install-completion") and second:
        raise UsageError(
            f"{first} takes no value, got {second!r}: it is for the shell that it runs in",
            hint=f"start {second}, and run there: pulsetrainer {first}"
            if second in SHELLS
            else f"write {first} alone",
        )


def _elsewhere(option: str, context: Any, words: Sequence[str]) -> str:
    """Return the line with an option on the side of the command that it belongs to; else empty."""
    commands = getattr(getattr(context, "command", None), "commands", {})
    at = next((k for k, word in enumerate(words) if word.partition("=")[0] == option), len(words))
    if option == "--settings":
        end, side = at + 1 + ("=" not in words[at]), "before"
        line = [*(*words, "FILE")[at:end], *words[:at], *words[end:]]
    else:
        own = {name for name, one in commands.items() if any(option in param.opts for param in one.params)}
        end, side = next((k for k, word in enumerate(words) if k > at and word in own), at), "after"
        line = [*words[:at], *words[end:], *words[at:end]]
    return f"put it {side} the command: {shlex.join(['pulsetrainer', *line])}" if line != [*words] else ""


def _as_typed(option: str, words: Sequence[str]) -> str:
    """Return an option as it was typed: of ``-rate`` the parser tells ``-r`` alone, of ``-help`` ``-e``."""
    if len(option) != 2:
        return option
    typed = [word.partition("=")[0] for word in words if re.match("-[^-]", word) and option[1] in word]
    return next((word for word in typed if word.startswith(option)), (*typed, option)[0])


def _alike(given: str, context: Any) -> list[str]:
    """Return the options that an unknown one may mean; of a letter, those that begin with it."""
    params = getattr(getattr(context, "command", None), "params", ())
    offered = [one for one in params if not getattr(one, "hidden", False)]
    names = [name[2:] for one in offered for name in one.opts if name.startswith("--")]
    if len(given) == 2:
        near = [name for name in names if name.startswith(given[1:]) or (given, name) == ("-f", "overwrite")]
    else:
        typed = given.lstrip("-").lower()
        near = difflib.get_close_matches(typed, names, n=2) or [n for n in names if n.startswith(typed)]
    return [f"--{name}" for name in near]


def _missing(parameter: Any, context: Any, help_: str) -> UsageError:
    example = _EXAMPLE.search(context.command.help or "")
    like = example[1] if example else help_
    lacks = [p for p in context.command.params if p.required and context.params.get(p.name) is None]
    each = [f"{named(one)} ({meaning_of(one)})" for one in lacks]
    several = f"{', '.join(each[:-1])} and {each[-1]} are missing" if len(each) > 1 else ""
    said = several or f"{named(parameter)} is missing: {meaning_of(parameter)}"
    given: list[Path] = context.params.get("files") or []
    if given and parameter.name in _COLUMNS:
        options = {_COLUMNS.index(one.name): named(one) for one in lacks if one.name in _COLUMNS}
        said, like = name_columns(Path(given[0]), options, said)
    typed = context.meta.get("pulsetrainer.cli.naming", ())
    if parameter.name == "model" and (loose := [one for one in typed if likely_kind(Path(one)) == "model"]):
        like = f"a model is an option: --model {shlex.quote(loose[0])}"
    return UsageError(said, hint=like)


def _with_or_without_value(error: Exception, context: Any, help_: str, words: Sequence[str]) -> UsageError:
    """A value where none goes, or none where one does."""
    option = getattr(error, "option_name", "an option")
    params = getattr(getattr(context, "command", None), "params", ())
    if "not take" in str(getattr(error, "message", "")):
        return for_a_switch(option, value_of(option, words), params)
    one = next((one for one in params if option in one.opts), None)
    choices = ", ".join(getattr(getattr(one, "type", None), "choices", ()))
    meaning = f": one of {choices}" if choices else f": {meaning_of(one).partition(';')[0]}" if one else ""
    return UsageError(f"{option} needs a value{meaning}", hint=f"write it after {option}, or see {help_}")


def _other(said: str, command: str, parsed: Any, words: Sequence[str]) -> UsageError:
    """What has no words of its own here, but for one argument too many and a command that does not exist."""
    if extra := _EXTRA.match(said):
        return one_too_many(extra[1], command, parsed, words)
    if unknown := _UNKNOWN.match(said):
        hint = command_for(unknown[1], unknown[2], parsed, words)
        return UsageError(f"there is no command {unknown[1]!r}", hint=hint)
    return UsageError(said, hint=f"{command} --help")
