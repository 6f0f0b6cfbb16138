"""A device that is open: who it is, and playing a current while recording what it reports."""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Self

from numpy.typing import ArrayLike

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.exchange import Exchange
from pulsetrainer.device.feed import Feed
from pulsetrainer.device.follower import STOPPED, Asked, Follower, OnBlock
from pulsetrainer.device.gains import DELIVERED, Gains
from pulsetrainer.device.heat import HeatMemory, course
from pulsetrainer.device.identity import DeviceInfo
from pulsetrainer.device.limits import RAMP_S, Limits, check_cool, checked_wire, ticks_per_sample, to_wire
from pulsetrainer.device.player import Player, tells_duty
from pulsetrainer.device.schemes import Clock, OpenPort, Sleep
from pulsetrainer.device.trace import FloatArray, Trace
from pulsetrainer.device.wording import FLASH, NOT_OFF_REMEDY, describe_fault, describe_not_off, flows_A
from pulsetrainer.errors import ArgumentError, DeviceError, PulsetrainerError

_LOG = logging.getLogger(__name__)
_REST_S = 0.5  # for a run that an earlier program left to come to rest
# The limits that the greeting tells, by their parameters' names.
_GREETED = {
    **{name: name for name in ("current_limit", "current_trip", "force_trip", "slew_limit")},
    "on_time": "on_time_s",
    "heartbeat": "heartbeat_ms",
}
_STREAMS_SINCE = (2, 1)  # the protocol of the first firmware that takes a wave without a known end


class Device:
    """An open device; closing it stops and disarms it, always."""

    def __init__(
        self,
        port: OpenPort,
        *,
        monotonic: Clock = time.monotonic,
        sleep: Sleep = time.sleep,
        now: Clock = time.time,
        memory: HeatMemory | None = None,
    ) -> None:
        self._port = port
        self._now = now
        self._memory = memory or HeatMemory()
        self._seen = (0, 0)  # first and worst fault that whoever opened the device can know of
        self._exchange = Exchange(port.transport, port.name, monotonic=monotonic, timeouts_s=port.timeouts_s)
        self._monotonic = monotonic
        self._sleep = sleep
        self._player: Player | None = None
        self._turn = threading.Lock()  # held by whoever talks to the device, and to change who plays
        self._gains = DELIVERED
        self._greet()

    def _greet(self) -> None:
        with self._turn:
            self._hello = self._exchange.hello()
        status = self._rest()
        if flows_A(status):
            raise DeviceError(describe_not_off(status), hint=NOT_OFF_REMEDY)
        self._seen = (status.fault, status.worst)
        latched = describe_fault(status, self._hello.tick_rate_Hz)
        self.info = DeviceInfo.from_wire(self._hello, latched)
        if status.flags & codes.STATUS_HEAT_ASSUMED:
            self._tell_heat()

    def _rest(self) -> m.StatusReply:
        """Return the state once a greeting has brought down whatever ran."""
        deadline = self._monotonic() + _REST_S
        status = self._status()
        while (status.state == codes.State.RAMPING or flows_A(status)) and self._monotonic() < deadline:
            with self._turn:
                self._exchange.receive()
            status = self._status()
        return status

    def _tell_heat(self) -> None:
        """Tell a device that has been without power what its coil has left of the heat of its last play."""
        heat = 0.0 if self._port.starts_cold else self._memory.recall(self.info.serial, self._now())
        if heat is not None:
            self._ask(m.CoilHeat(math.ceil(min(heat, 1.0) / codes.HEAT_UNIT)))

    def _remember_heat(self, heat: float, in_s: float = 0.0) -> None:
        if not self._port.starts_cold:
            self._memory.remember(self.info.serial, heat, self._now() + in_s)

    def _check_heat(self, reference_A: FloatArray, rate_Hz: float) -> None:
        """Refuse what would be cut off in mid-play by the heat of the coil, and say how long to wait."""
        status = self._status()
        heat = status.heat * codes.HEAT_UNIT
        check_cool(heat, reference_A, rate_Hz, assumed=bool(status.flags & codes.STATUS_HEAT_ASSUMED))
        # Should nobody be left to ask afterwards, as if it had been played to its end.
        most = float(course(heat, reference_A, rate_Hz).max())
        self._remember_heat(most, reference_A.size / rate_Hz)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop, disarm and give the port back."""
        try:
            with contextlib.suppress(PulsetrainerError):
                self.stop()
            playing = self._player
            if playing is not None:  # in another thread, which is just stopping the device
                playing.ended.wait()
        finally:
            self._port.close()

    @property
    def heat(self) -> float:
        """Heat of the coil now, of the limit at which the device stops."""
        return self._status().heat * codes.HEAT_UNIT

    @property
    def tells_duty(self) -> bool:
        """Whether telemetry carries the duty, from which the coil's resistance is told."""
        return tells_duty(self._hello)

    def needs_duty(self, what: str) -> None:
        """Raise DeviceError where the firmware is from before it told the duty, which is needed here."""
        if not self.tells_duty:
            raise DeviceError(
                f"{what} needs the duty of the coil's voltage; the device's firmware {self.info.firmware} "
                f"speaks protocol {self.info.protocol}, which does not report it: that came with "
                f"{codes.PROTOCOL_MAJOR}.{codes.DUTY_SINCE_MINOR}",
                hint=FLASH,
            )

    @property
    def longest_play_s(self) -> float:
        """Longest reference that the device plays in one go, s."""
        return self.info.on_time_limit_s - RAMP_S

    def stop(self) -> None:
        """Ramp the current to zero and disarm; any thread may ask, at any time.

        While a play goes on in another thread this returns at once, and STOP is the next that the device
        hears; the play then ends as ``stopped``. It is the only method that may be called meanwhile.
        """
        with self._turn:
            if self._player is not None:
                self._player.stop(STOPPED)
            else:
                self._exchange.request(m.Stop())

    def _ask(self, command: m.Message) -> Any:
        """Ask while nothing is played: one thread talks to the device at a time."""
        with self._turn:
            if self._player is not None:
                raise DeviceError(
                    f"the device is playing; {type(command).__name__} has to wait",
                    hint="wait for the play to end, or stop() it",
                )
            return self._exchange.request(command)

    def _status(self) -> m.StatusReply:
        return self._ask(m.Status())

    def set_parameter(self, name: str, value: int) -> int:
        """Set a parameter of the firmware in device units and return what the device now holds.

        Limits can only be lowered: the range ends at the absolute limit compiled into the firmware.
        """
        if name not in codes.PARAMETER:
            known = ", ".join(codes.PARAMETER)
            raise ArgumentError(f"the device has no parameter {name!r}", hint=f"there are: {known}")
        row = codes.PARAMETER[name]
        if not row.minimum <= value <= row.maximum:
            raise ArgumentError(
                f"{name}={value} is outside {row.minimum}..{row.maximum} {row.unit}",
                hint="a limit can only be lowered below the one compiled into the firmware",
            )
        reply: m.ParamReply = self._ask(m.SetParam(row.id, value))
        if reply.value != value:
            raise DeviceError(f"the device did not take {name}={value}", hint="flash the firmware again")
        if name in _GREETED:  # a new greeting would restore the defaults
            limit: dict[str, Any] = {_GREETED[name]: value}
            self._hello = replace(self._hello, **limit)
            self.info = DeviceInfo.from_wire(self._hello, self.info.latched_fault)
        return reply.value

    @property
    def gains(self) -> Gains:
        """Gains of the current loop that the next play has."""
        return self._gains

    def set_gains(self, gains: Gains) -> None:
        """Set the gains of the current loop; a new greeting would restore those delivered."""
        for name, value in gains.values().items():
            self.set_parameter(name, value)
        self._gains = gains

    def lower(self, limits: Limits) -> None:
        """Put limits in force that are stricter than the device's own; raises as ``Limits.within``."""
        current_A, force_N = limits.within(self.info.current_limit_A, self.info.force_limit_N)
        if limits.current_A is not None:
            self.set_parameter("current_limit", round(current_A / codes.CURRENT_UNIT_A))
        if limits.force_N is not None:
            self.set_parameter("force_trip", round(force_N / codes.FORCE_UNIT_N))
        _LOG.info("in force: at most %g A and %g N", current_A, force_N)

    def play(
        self,
        reference_A: ArrayLike,
        rate_Hz: float,
        *,
        decimation: int = 10,
        on_block: OnBlock | None = None,
        keep: bool = True,
        should_stop: Asked | None = None,
    ) -> Trace:
        """Play a coil current and return what the device measured meanwhile.

        The reference, shape (n,) in A at ``rate_Hz``, is interpolated linearly to the device's tick; its
        first sample is tick 0. Telemetry is one sample every ``decimation`` ticks. ``on_block`` gets it
        in pieces as it comes; without ``keep`` that is all there is of it: the trace that is returned
        has counts only, and memory stays flat. Ctrl-C, ``should_stop`` or a fault of the device stop the
        output first; what was recorded until then is returned with ``complete=False``. The device ends
        disarmed.

        ArgumentError if the reference cannot be played: nothing has been armed then. DeviceError if the
        device cannot be talked to before it starts.
        """
        wire = checked_wire(
            reference_A,
            rate_Hz,
            current_A=self.info.current_limit_A,
            on_time_s=self.info.on_time_limit_s,
            tick_rate_Hz=self.info.tick_rate_Hz,
        )
        if not 1 <= decimation <= codes.MAX_DECIMATION:
            raise ArgumentError(
                f"decimation {decimation} is outside 1..{codes.MAX_DECIMATION}",
                hint="10 gives 1000 samples a second",
            )
        self._check_heat(codes.CURRENT_UNIT_A * wire.astype(float), rate_Hz)
        player = self._player_of(Feed(wire), rate_Hz, decimation)
        return self._perform(player, on_block, should_stop, keep=keep)

    def stream(
        self,
        more: Callable[[], FloatArray | None],
        rate_Hz: float,
        *,
        lead_s: float = 0.4,
        decimation: int = 10,
        on_block: OnBlock | None = None,
        should_stop: Asked | None = None,
    ) -> Trace:
        """Play a coil current that is made while it is played.

        ``more`` returns the next samples (n,) in A at ``rate_Hz``, or None at the end. It is called between
        pieces of telemetry, as soon as less than ``lead_s`` is left to play: that is how late a change takes
        effect, and how long ``more`` may take. The rest is as in ``play``; memory stays flat.

        ArgumentError if there is no sample at all, or one that the device cannot play: the output is stopped
        first. DeviceError if the firmware knows no open-ended waves, or as in ``play``.
        """
        if (self._hello.major, self._hello.minor) < _STREAMS_SINCE:
            raise DeviceError(
                f"the device's firmware {self.info.firmware} speaks protocol {self.info.protocol}, which has "
                f"no open-ended waves; they came with {'.'.join(map(str, _STREAMS_SINCE))}",
                hint=FLASH,
            )
        feed = Feed()
        player = self._player_of(feed, rate_Hz, decimation)
        lead = round(lead_s * rate_Hz)

        def top_up() -> bool:
            if feed.ended or feed.size - player.played >= lead:
                return False
            samples = more()
            if samples is None:
                feed.ended = True
            else:
                feed.append(to_wire(samples, limit_A=self.info.current_limit_A))
            return True

        while top_up():  # nothing is played yet
            pass
        if feed.size == 0:
            raise ArgumentError("there is nothing to play", hint="give at least one sample")
        self._remember_heat(1.0)  # at most: should nobody be left to ask afterwards
        return self._perform(player, on_block, should_stop, keep=False, top_up=top_up)

    def _player_of(self, feed: Feed, rate_Hz: float, decimation: int) -> Player:
        return Player(
            self._exchange,
            feed,
            ticks_per_sample(rate_Hz, self.info.tick_rate_Hz),
            decimation,
            hello=self._hello,
            seen=self._seen,
            monotonic=self._monotonic,
            piece_s=self._port.piece_s,
        )

    def _perform(
        self,
        player: Player,
        on_block: OnBlock | None,
        should_stop: Asked | None,
        *,
        keep: bool,
        top_up: Asked | None = None,
    ) -> Trace:
        """Let a player play in a thread of its own, and follow what it brings back."""
        thread = threading.Thread(target=player.run, name="pulsetrainer-play", daemon=True)
        follower = Follower(player, self.info.tick_rate_Hz, monotonic=self._monotonic, sleep=self._sleep)
        interrupted = False
        with self._turn:
            if self._player is not None:
                raise DeviceError(
                    "the device is playing already", hint="wait for the play to end, or stop() it"
                )
            self._player = player  # from here on it is waited for: nothing lies between this and the thread
        try:
            thread.start()
            interrupted = follower.follow(on_block, should_stop, keep=keep, top_up=top_up)
        finally:
            player.stop(STOPPED)
            while thread.is_alive():  # it is stopping the device: not to be interrupted, and soon over
                try:
                    thread.join()
                except KeyboardInterrupt:
                    interrupted = True
            with self._turn:
                self._player = None
                self._seen = player.seen
            if player.heat >= 0:
                self._remember_heat(player.heat * codes.HEAT_UNIT)
        if player.error is not None:
            raise player.error
        return follower.trace(interrupted=interrupted)
