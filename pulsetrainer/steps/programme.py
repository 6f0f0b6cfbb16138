"""The programme of a session without a quiz: which pulse, rate and amplitude at which time, and the end."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pulsetrainer.artefacts.units import counted
from pulsetrainer.core.heartbeat import FASTEST_BPM, SLOWEST_BPM
from pulsetrainer.errors import UsageError
from pulsetrainer.steps.conductor import Decision, Play

USUAL_MINUTES = 5.0
LEAST_MINUTES = 0.05  # more than half of it is over before the first beat
MOST_MINUTES = 1440  # a day: a longer one is a slip of the keys, and would be planned for minutes
MOST_BEATS = 240 * MOST_MINUTES  # at the fastest rate


@dataclass(frozen=True, slots=True)
class Change:
    """What is different from a time on; None: as before."""

    time_s: float
    rate: float | None = None  # beats a minute
    amplitude: float | None = None  # % of the reach
    pulse: str | None = None


def check_rate(rate: float | None) -> None:
    """Raise UsageError for a rate outside 20 to 240 beats a minute."""
    if rate is not None and not SLOWEST_BPM <= rate <= FASTEST_BPM:
        raise UsageError(
            f"`rate` must be {SLOWEST_BPM:g} to {FASTEST_BPM:g} beats a minute, got {rate:g}",
            hint="a usual rate is 75",
        )


def check_amplitude(amplitude: float | None) -> None:
    """Raise UsageError for an amplitude that is not above 0, or more than the reach."""
    if amplitude is not None and not 0.0 < amplitude <= 100.0:
        raise UsageError(
            f"an amplitude of {amplitude:g} % cannot be pressed: 100 % is all that the model reaches",
            hint="ask for more than 0 and at most 100 %",
        )


def _check_length(minutes: float | None, beats: int | None) -> None:
    if minutes is not None and beats is not None:
        raise UsageError(
            f"a session ends after minutes or after beats, got both: `minutes` {minutes:g}, `beats` {beats}",
            hint="give one of the two",
        )
    if beats is not None and not 1 <= beats <= MOST_BEATS:
        raise UsageError(
            f"`beats` must be 1 or more and at most {MOST_BEATS}, got {beats}",
            hint="for instance 20 beats, which last about a quarter of a minute",
        )
    if minutes is not None and not LEAST_MINUTES <= minutes <= MOST_MINUTES:
        raise UsageError(
            f"`minutes` must be {LEAST_MINUTES} (3 s) or more and at most {MOST_MINUTES} (a day), "
            f"got {minutes:g}",
            hint="a usual length is 5; for a few beats give `beats` 20",
        )


def hardly_felt(shares: Mapping[str, float]) -> list[str]:
    """Say which shares of a session, %, are so small that they may have been meant as parts of one."""
    return [
        f"{name} of {share:g} % is hardly felt: {100 * share:g} % is written as {100 * share:g}"
        for name, share in shares.items()
        if 0.0 < share < 1.0
    ]


def too_late(times_s: Sequence[float], minutes: float | None) -> list[str]:
    """Say how many of the changes at these times (s) come after the end of a session."""
    end_s = 60.0 * (USUAL_MINUTES if minutes is None else minutes)
    late = [time_s for time_s in times_s if time_s >= end_s]
    if not late:
        return []
    which = (
        f"{len(late)} of {counted(len(times_s), 'change')} ({late[0]:g} s{' and later' * (len(late) > 1)})"
    )
    return [f"{which} will not happen: the session ends at {end_s:g} s (`minutes`)"]


def number_of(name: str, pulses: Sequence[str]) -> int:
    """Return the place of a pulse in the session's list; UsageError where it is not there."""
    if name in pulses:
        return list(pulses).index(name)
    near = difflib.get_close_matches(name, pulses, n=3, cutoff=0.4) or list(pulses)
    raise UsageError(
        f"the session has no pulse {name!r}", hint=f"did you mean {' or '.join(near)}? add it to `pulses`"
    )


class Programme:
    """Plays the pulses one after the other, each for an equal share of the time, until something changes.

    It ends after so many ``beats`` or ``minutes``; neither: after five minutes. A change of the pulse ends
    the taking of turns. UsageError where a rate, an amplitude or a pulse cannot be played, or no end is told.
    """

    def __init__(
        self,
        pulses: Sequence[str],
        *,
        rate: float | None = None,
        amplitude: float = 100.0,
        beats: int | None = None,
        minutes: float | None = None,
        changes: Sequence[Change] = (),
    ) -> None:
        _check_length(minutes, beats)
        for change in (Change(0.0, rate, amplitude), *changes):
            check_rate(change.rate)
            check_amplitude(change.amplitude)
        self.names = tuple(pulses)
        self._beats, self._number = beats, 0  # of the beat that was asked for last
        self._seconds = 60.0 * (USUAL_MINUTES if minutes is None else minutes)
        self.start = Play(0, amplitude / 100.0, rate)
        self._changes = [
            (change, None if change.pulse is None else number_of(change.pulse, pulses))
            for change in sorted(changes, key=lambda one: one.time_s)
        ]

    @property
    def rates(self) -> tuple[float | None, ...]:
        """Every rate that is asked for, that of the start first."""
        return (self.start.bpm, *(change.rate for change, _ in self._changes if change.rate is not None))

    def _share(self, number: int, time_s: float) -> float:
        """How much of it is over."""
        return number / self._beats if self._beats else time_s / self._seconds

    def share_at(self, time_s: float) -> float:
        """How much of it is over at a time; where beats are counted, by the one that was given out last."""
        return min(self._share(self._number, time_s), 1.0)  # the last beat is under way after the end

    def __call__(self, number: int, time_s: float) -> Decision:
        """Return what is played next."""
        self._number, share = number, self._share(number, time_s)
        if share >= 1.0:
            return None
        play = replace(self.start, pulse=int(share * len(self.names)))
        for change, pulse in self._changes:
            if change.time_s > time_s:
                break
            amplitude = None if change.amplitude is None else change.amplitude / 100.0
            play = play.changed(pulse, amplitude, change.rate)
        return play
