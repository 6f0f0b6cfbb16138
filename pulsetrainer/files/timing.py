"""Where the time of a record comes from: a column, a rate or none; what excludes what."""

from __future__ import annotations

import math

from pulsetrainer.errors import UsageError


def check_timing(time: str | None, rate_Hz: float | None, *, no_time: bool, resampled: bool = False) -> None:
    """Raise UsageError for what contradicts itself, before a long table is read.

    More than one of a time column, a rate and no time; a rate that is not positive; no time, but even steps
    of it.
    """
    if time is not None and rate_Hz is not None:
        raise UsageError(
            f"both a time column ({time}) and a rate ({rate_Hz:g} Hz) were given",
            hint="give `time` or `rate_Hz`, not both",
        )
    if no_time and (time is not None or rate_Hz is not None):
        raise UsageError(
            f"`no_time` was given together with {'`time`' if time is not None else '`rate_Hz`'}",
            hint="leave one of the two out",
        )
    if rate_Hz is not None and not 0 < rate_Hz < math.inf:
        raise UsageError(f"`rate_Hz` must be above 0, got {rate_Hz:g} Hz", hint="for instance `rate_Hz` 1000")
    if no_time and resampled:
        raise UsageError(
            "`no_time` was given together with `resample`: a run without time has no time steps",
            hint="leave one of the two out",
        )
