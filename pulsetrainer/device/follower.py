"""Following a play: the telemetry is handed over as it comes, and makes a trace in the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

from pulsetrainer.device import codes
from pulsetrainer.device.plausibility import ForceWatch
from pulsetrainer.device.player import Player
from pulsetrainer.device.schemes import Clock, Sleep
from pulsetrainer.device.trace import Block, Trace
from pulsetrainer.device.wording import FORCE_REMEDY

OnBlock = Callable[[Block], None]  # gets telemetry as it comes
Asked = Callable[[], bool]  # is asked again and again
INTERRUPTED = "interrupted"  # the fault of a play that the user stopped
STOPPED = "stopped"
_TAKE_EVERY_S = 0.02  # in bigger pieces than the wire's: each one costs a change of threads


class Follower:
    """Takes in what a player brings back while it plays in a thread of its own."""

    def __init__(self, player: Player, tick_rate_Hz: float, *, monotonic: Clock, sleep: Sleep) -> None:
        self._player, self._tick_rate_Hz = player, tick_rate_Hz
        self._monotonic, self._sleep = monotonic, sleep
        self._watch = ForceWatch()

    def follow(
        self, on_block: OnBlock | None, should_stop: Asked | None, *, keep: bool, top_up: Asked | None
    ) -> bool:
        """Hand over the telemetry as it comes until the play has ended; True if Ctrl-C hastened the end."""
        player, watch = self._player, self._watch
        passed = forgotten = 0
        ended = interrupted = False
        while not ended:
            try:
                ended = player.ended.is_set()  # before the count: then nothing comes after it
                count = len(player.received)
                fresh, passed = player.received[passed:count], count
                player.taken_at_s = self._monotonic()
                if any(b.count for b in fresh):
                    block = Block.from_wire(fresh, player.decimation)
                    watch.add(block.tick / self._tick_rate_Hz, block.current_A, block.force_N)
                    if watch.fault:
                        player.stop(watch.fault, FORCE_REMEDY)
                    if on_block is not None:
                        on_block(block)
                if not keep:
                    player.forget(forgotten, passed)
                    forgotten = passed
                hungry = top_up is not None and not ended and top_up()
                if should_stop is not None and should_stop():
                    player.stop(STOPPED)
                if not ended and not hungry:
                    self._sleep(_TAKE_EVERY_S)
            except KeyboardInterrupt:
                interrupted = True
                player.stop(INTERRUPTED)
        return interrupted

    def trace(self, *, interrupted: bool) -> Trace:
        """Return what a play that has ended brought back."""
        player, implausible = self._player, self._watch.finish()
        outcome = player.outcome
        block = Block.from_wire(player.received, player.decimation)
        assert outcome is not None
        received = player.samples
        if outcome.produced >= 0:
            dropped = outcome.produced - received
        else:  # the device is gone: what is missing between the samples that came
            dropped = player.last_tick // player.decimation + 1 - received
        return Trace(
            **{one.name: getattr(block, one.name) for one in fields(block)},
            tick_rate_Hz=self._tick_rate_Hz,
            dropped_samples=dropped,
            # Interrupted even if it came during the last ramp: the user wants out.
            complete=outcome.played_to_end and not interrupted and not implausible,
            fault=outcome.fault or (INTERRUPTED if interrupted else implausible),
            samples=received,
            remedy=outcome.remedy or (FORCE_REMEDY if implausible else ""),
            underrun=bool(outcome.fault) and player.seen[0] == codes.Fault.UNDERRUN,
            fault_code=player.seen[0] if outcome.fault else 0,
        )
