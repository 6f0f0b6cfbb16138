"""The one funnel: every error that is raised becomes a message, a hint and an exit code here."""

from __future__ import annotations

import contextlib
import errno
import json
import logging
import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from pulsetrainer.cli.console import say
from pulsetrainer.cli.next_step import as_options, next_step
from pulsetrainer.cli.starting import interrupt, loaded
from pulsetrainer.cli.usage import check_apart, usage_of
from pulsetrainer.errors import TRY, DataError, Interrupted, PulsetrainerError, UsageError

_NOWHERE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_READER_GONE = 141  # as a shell tells SIGPIPE
_STOPPED = "stopped by you; what was not finished was not written"
_DEBUG_HINT = "run it again with --debug for the whole traceback, and report it"


def funnel(program: Callable[..., Any], argv: Sequence[str]) -> int:
    """Run the program on ``argv`` and return its exit code; nothing but ``SystemExit`` gets past."""
    debug = "--debug" in argv
    if "--verbose" in argv:
        _be_verbose()
    # --force is what --overwrite was called in 0.1
    words = [{"--force": "--overwrite"}.get(w, w) for w in argv if w not in ("--debug", "--verbose")]
    problem: PulsetrainerError
    try:
        loaded()
        check_apart(words)
        code = _run(program, words)
        sys.stdout.flush()  # here, not at the end of the process, where a full disk has no words
    except PulsetrainerError as error:
        problem = error
        _trace(debug)
    except KeyboardInterrupt as error:
        problem = Interrupted(_STOPPED)
        for note in getattr(error, "__notes__", ()):
            problem.add_note(note)
    except BrokenPipeError:  # no failure, nor all of it done: what comes after the printing is not
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _READER_GONE
    except Exception as error:  # noqa: BLE001 - the last resort, which is the point of this function
        if type(error).__name__ == "NoArgsIsHelpError":  # a bare command is not wrong: this is its help
            sys.stdout.write(f"{error}\n")
            return UsageError.exit_code
        problem = usage_of(error, words) or _problem_of(error)
        _trace(debug)
    else:
        return int(code or 0)
    with contextlib.suppress(OSError):  # nowhere to say it: the exit code still does
        report(problem, command=_command_in(words), as_json="--json" in words)
    return problem.exit_code


def _command_in(words: Sequence[str]) -> str:
    """Return the command: the first word that is no option, nor the file of settings that one names."""
    pairs = zip(["", *words], words, strict=False)
    return next((word for before, word in pairs if word[:1] != "-" and before != "--settings"), "")


def _run(program: Callable[..., Any], words: Sequence[str]) -> Any:
    try:
        code = program(args=words, standalone_mode=False, prog_name="pulsetrainer")
    except SystemExit as end:  # what the parser makes of a reader that went away: 1, which is a quality gate
        if isinstance(end.__context__, BrokenPipeError):
            raise end.__context__ from None
        raise
    if code == Interrupted.exit_code:  # what the parser makes of Ctrl-C
        raise KeyboardInterrupt
    return code


def hush_libraries(argv: Sequence[str]) -> None:
    """Keep what libraries warn of, such as an overflow or a home without a cache, for those who ask."""
    if {"--verbose", "--debug"} & set(argv):
        return
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")


def end_like_ctrl_c() -> None:
    """Let a closed terminal, or a batch system that ends the job, stop the output and keep the data."""
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # not under nohup
            signal.signal(number, interrupt)


def _be_verbose() -> None:
    """Let the package's log lines through to stderr, each with its time."""
    logging.basicConfig(
        stream=sys.stderr, format="%(asctime)s.%(msecs)03d %(name)s: %(message)s", datefmt="%H:%M:%S"
    )
    logging.getLogger("pulsetrainer").setLevel(logging.DEBUG)


def _trace(debug: bool) -> None:
    if debug:
        traceback.print_exc()


def report(problem: PulsetrainerError, *, command: str, as_json: bool) -> None:
    """Write a problem to stderr for a person, and with ``as_json`` to stdout for a script."""
    message, hint = as_options(problem.message), as_options(next_step(problem))
    if as_json:
        error = {"kind": problem.kind, "message": message, "hint": hint}
        sys.stdout.write(json.dumps({"schema": 1, "command": command, "error": error}) + "\n")
    say("error: ", message)
    for note in getattr(problem, "__notes__", ()):
        if not note.startswith(TRY):
            say("note: ", note)
    if hint:
        say("  try: ", hint)


def _problem_of(error: Exception) -> PulsetrainerError:
    """Return what lies outside the program: no memory, nowhere to write the results to; else it is a bug."""
    if type(error).__name__ == "Abort":  # Ctrl-C, as the parser words it
        return Interrupted(_STOPPED)
    if isinstance(error, MemoryError):
        return DataError("there is not enough memory for this", hint="use fewer levels, or a shorter record")
    told = _of_the_system(error) if isinstance(error, OSError) else None
    return told or PulsetrainerError(f"a bug: {type(error).__name__}: {error}", hint=_DEBUG_HINT)


def _of_the_system(error: OSError) -> DataError | None:
    """Return what is wrong with a name, a folder or the place that the results go to; None for the rest."""
    if error.errno == errno.ENAMETOOLONG:
        name = str(error.filename)
        return DataError(
            f"the name {name[:20]}... has {len(name)} characters: {error.strerror}", hint="shorten it"
        )
    if isinstance(error, FileNotFoundError) and error.filename is None:  # of where relative names begin
        return DataError("the folder you are in does not exist any more", hint="go to another one: cd ~")
    if error.filename and (isinstance(error, PermissionError) or error.errno == errno.EROFS):
        return DataError(f"{error.filename}: {error.strerror}", hint="make it writable, or use another place")
    if error.filename is None and error.errno in _NOWHERE:
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left would fail again
        return DataError(
            f"the results could not be printed: {error.strerror}", hint="free some space, or print elsewhere"
        )
    return None
