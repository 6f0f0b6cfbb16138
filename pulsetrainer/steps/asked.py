"""What can be refused by a look at what was asked for; loads nothing, so that the answer comes at once."""

from __future__ import annotations

from collections.abc import Sequence

from pulsetrainer.errors import UsageError

EXCITATIONS = ("identification", "diagnostic")


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


def check_asked_for(answers: object, quiz: int) -> None:
    """Raise UsageError for answers that no quiz asks for."""
    if answers and not quiz:
        raise UsageError(
            "`answers` were given, but no quiz asks for them",
            hint="give `quiz` with the number of questions, or leave `answers` out",
        )


def check_several(evaluations: Sequence[object]) -> None:
    """Raise UsageError where there are fewer than two to compare."""
    if len(evaluations) < 2:
        raise UsageError(
            f"compare needs at least two evaluations, got {len(evaluations)}",
            hint="pulsetrainer compare before.h5 after.h5",
        )
