"""One family of errors, each with its exit code and a next step.

Every message says what happened, where (file, dataset, port, argument), what was
expected and what was got; ``hint`` says what to do next. Only ``cli.guard`` turns
an error into an exit.
"""

from __future__ import annotations


class PulsetrainerError(Exception):
    """Base of the family: a message for a person, a hint, an exit code, a stable kind for scripts."""

    exit_code = 70
    kind = "bug"

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class QualityError(PulsetrainerError):
    """A quality gate failed: the work was done, its result is not good enough."""

    exit_code = 1
    kind = "quality"


class UsageError(PulsetrainerError):
    """The command line does not make sense, or would overwrite a file."""

    exit_code = 2
    kind = "usage"


class DataError(PulsetrainerError):
    """A file, an artefact or the numbers in it cannot be used."""

    exit_code = 3
    kind = "data"


class ArgumentError(DataError, ValueError):
    """A number or array handed to the core has the wrong shape or value; also a ``ValueError``."""

    kind = "argument"


class DeviceError(PulsetrainerError):
    """The device, its port or its firmware did not do what was asked."""

    exit_code = 4
    kind = "device"


class ConvergenceError(PulsetrainerError):
    """An iteration ended before its stopping rule was met."""

    exit_code = 5
    kind = "not-converged"


class Interrupted(PulsetrainerError):  # noqa: N818 - the user's wish, not a fault
    """The user pressed Ctrl-C; the output was stopped and what was recorded was kept."""

    exit_code = 130
    kind = "interrupted"
