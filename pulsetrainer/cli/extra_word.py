"""A word that no command takes: a command that does not exist, an argument too many, a value of a switch."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pulsetrainer.cli.instead import BEHIND, NO_COMMAND, OFF, SWITCHED
from pulsetrainer.cli.next_step import HOLDS
from pulsetrainer.cli.values import named
from pulsetrainer.errors import UsageError, in_words
from pulsetrainer.files.input_file import in_quotes, likely_kind
from pulsetrainer.files.pulses import library

_PORT = re.compile(r"/dev/|COM\d|(bench|qemu|socket):|tty")


def value_of(option: str, words: Sequence[str]) -> str:
    """Return what was typed behind an option, or in it after ``=``, as a shell takes it."""
    at = next((k for k, word in enumerate(words) if word.partition("=")[0] == option), len(words))
    value = "".join(words[at : at + 1]).partition("=")[2] or "".join(words[at + 1 : at + 2])
    return value and shlex.quote(value)


def command_for(word: str, near: str, parsed: Any, words: Sequence[str]) -> str:
    """What to type in the place of a word that is no command: a file, a line in quotes, capitals."""
    if word == "help" and (of := [word for word in words if word in parsed.commands]):
        return f"pulsetrainer {of[0]} --help"
    if word in NO_COMMAND:
        return NO_COMMAND[word]
    first = word.strip().partition(" ")[0]
    if first != word and first in parsed.commands:
        return f"leave out the quotes: pulsetrainer {word}"
    if Path(word).is_file():
        return f"to look into a file: pulsetrainer show {shlex.quote(word)}"
    if first.lower() in parsed.commands:
        near = first.lower()
    return f"did you mean {near}? All commands: pulsetrainer --help" if near else "pulsetrainer --help"


def one_too_many(extra: str, command: str, parsed: Any, words: Sequence[str]) -> UsageError:
    """What stands behind the arguments that a command takes."""
    every = [extra] if extra in words else extra.split()
    word, params, name = every[0], parsed.params, command.rpartition(" ")[2]
    before = words[words.index(word) - 1] if word in words else ""
    if word.lower() in SWITCHED and any(before in (*p.opts, *p.secondary_opts) for p in params):
        return for_a_switch(before, word, params)
    taken = " and ".join(named(p) for p in params if not p.opts[0].startswith("-")) or "only options"
    too_many = "is one too many" if len(every) == 1 else "are too many"
    return UsageError(
        f"{command} takes {taken}; {', '.join(map(repr, every))} {too_many}",
        hint=in_quotes(words, name) or _meant_by(every, (name, taken), params, words),
    )


def _meant_by(every: list[str], of: tuple[str, str], params: Sequence[Any], words: Sequence[str]) -> str:
    """What to do with words too many: what the first is tells what it was meant for."""
    word, single = every[0], len(every) == 1
    kind, quoted, typed = likely_kind(Path(word)), shlex.quote(word), {one.partition("=")[0] for one in words}
    taken = {one.opts[0]: HOLDS.get(one.name, ()) for one in params if not typed & {*one.opts}}
    unknown, port = not kind and word.endswith(".h5"), quoted if _PORT.match(word) else "PORT"
    option = next((o for o in taken if o[0] == "-" and (kind in taken[o] or (unknown and taken[o]))), "")
    to_write = word.endswith(".toml") if of[0] == "tune" else "--update" in typed and not Path(word).exists()
    pulses = ",".join(filter(None, (value_of("--pulses", words), word)))
    also = next(filter(None, map(BEHIND.get, (f"{of[0]} {kind}", *of, "" if kind else "-"))), "")
    ways = {
        f"a {in_words(taken.get(option, ()))} is an option: {option} {quoted}": option,
        f"a port is an option: --port {port}": "--port" in taken and port == quoted,
        f"pulses are an option: --pulses {pulses}": of[0] == "session" and {*word.split(",")} <= {*library()},
        f"the file to write is an option: -o {quoted}": "-o" in taken and to_write,
        f"one {in_words([kind])} at a time: run it once for each": any(kind in one for one in taken.values()),
        f"leave {'it' if single else 'them'} out{also and '; '}{also.format(extra=quoted, port=port)}": True,
    }
    return next(way for way, fits in ways.items() if fits)


def for_a_switch(option: str, value: str, params: Sequence[Any]) -> UsageError:
    """A word such as yes or no behind an option that is on where it is given."""
    off = [one.secondary_opts[-1:] for one in params if option in one.opts and value.lower() in OFF]
    ways = [f"to switch it off: {other[0]}" if other else f"leave {option} out" for other in off]
    said = f"{option} is a switch and takes no value, got {value!r}"
    return UsageError(said, hint=(*ways, f"write {option} alone")[0])
