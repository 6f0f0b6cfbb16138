"""One play: upload by credit, start, keep the buffer filled, and show the device that the host is alive.

Runs in a thread of its own, so that a slow disk under the telemetry never starves a device that
switches off after 200 ms of silence. The thread vouches for the whole program, though: when nobody
takes its data for some seconds it stops the device itself.
"""

from __future__ import annotations

import contextlib
import threading
import zlib
from dataclasses import dataclass

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.exchange import AbandonedError, Exchange, NoAnswerError, RefusedError
from pulsetrainer.device.feed import Feed
from pulsetrainer.device.schemes import Clock
from pulsetrainer.device.transport import PortLostError
from pulsetrainer.device.wording import (
    NOT_OFF_REMEDY,
    UNKNOWN_REMEDY,
    describe_fault,
    describe_not_off,
    flows_A,
    remedy_of,
    told,
)
from pulsetrainer.errors import DeviceError, PulsetrainerError

_BEATS = 5  # in the time that the device is patient, by the wall clock and by its own
_DRAIN_S = 0.3  # for telemetry on its way after the end
_RAMP_S = 1.0
_CHECK_SAMPLES = 1000  # of an open-ended wave, between two questions whether they are what was sent
_TAKER_S = 10.0  # nobody took the telemetry for so long: the program hangs


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a play ended."""

    produced: int  # samples the device made, -1: it could not be asked
    played_to_end: bool
    fault: str
    remedy: str = ""  # what to do about the fault, where something better than finding its cause is known


NOTHING = m.Telemetry(0, 0, 0, 0, 0, b"")  # in the place of a block that nobody needs any more


def tells_duty(hello: m.HelloReply) -> bool:
    """Return whether the device's telemetry carries the duty."""
    return (hello.major, hello.minor) >= (codes.PROTOCOL_MAJOR, codes.DUTY_SINCE_MINOR)


class Player:
    """Plays one wave; ``received`` grows by wire blocks until ``ended`` is set."""

    def __init__(
        self,
        exchange: Exchange,
        feed: Feed,
        ticks_per_sample: int,
        decimation: int,
        *,
        hello: m.HelloReply,
        seen: tuple[int, int],
        monotonic: Clock,
        piece_s: float = float("inf"),
    ) -> None:
        self._exchange = exchange
        self.seen = seen  # first and worst fault that whoever plays has been told of
        self._feed = feed
        self._ticks_per_sample = ticks_per_sample
        self.decimation = decimation
        self._hello = hello
        self._kind = m.TelemetryDuty if tells_duty(hello) else m.Telemetry
        self._monotonic = monotonic
        self._piece_s = piece_s
        self._short = m.WaveData.MAX_ITEMS  # samples a frame while the buffer is well filled
        self._sent = 0
        self._crc = 0  # of what was sent
        self._checked = 0  # so many samples are known to have arrived as they were sent
        self._told_end = feed.total != codes.WAVE_OPEN
        self._ack = m.Ack(0, codes.State.IDLE, 0, 0, 0, 0)
        self._play_session: int | None = None  # known once the reference has arrived
        self._tick = 0  # latest known tick of the device
        self.last_tick = -1  # of the last sample received; -1 before the first
        self._tick_at_send = 0
        self._last_block = False
        # A plain list: appending is atomic, and a Ctrl-C in the reader's thread can lose nothing of it.
        self.received: list[m.Telemetry] = []
        self.samples = 0  # received so far
        self.ended = threading.Event()
        self._stop = threading.Event()
        self._stop_reason = ""
        self._stop_remedy = ""
        self.taken_at_s = monotonic()
        self.heat = -1  # of the coil after the play, -1: it could not be asked
        self.outcome: Outcome | None = None
        self.error: BaseException | None = None

    @property
    def played(self) -> int:
        """Samples whose time has come, as far as is known."""
        return self._tick // self._ticks_per_sample

    def forget(self, start: int, stop: int) -> None:
        """Let go of the samples of these blocks: a long play must not fill the memory."""
        for number in range(start, stop):
            self.received[number] = NOTHING

    def stop(self, reason: str, remedy: str = "") -> None:
        """Ask for the output to be stopped at once; the first reason counts."""
        if not self._stop_reason:
            self._stop_reason, self._stop_remedy = reason, remedy
        self._stop.set()

    def run(self) -> None:
        """Play; leaves ``outcome`` or ``error``."""
        self._exchange.on_telemetry = self._take
        try:
            self.outcome = self._play()
        except BaseException as error:  # noqa: BLE001 - carried over to the caller's thread
            self.error = error
        finally:
            self._exchange.on_telemetry = lambda _: None
            self.ended.set()

    def _take(self, block: m.Telemetry) -> None:
        if block.session != self._play_session or type(block) is not self._kind:
            return  # stale bytes of an earlier play, or of an older host's
        last_tick = block.first_tick + (block.count - 1) * self.decimation
        if block.count:
            if block.first_tick <= self.last_tick or block.first_tick % self.decimation:
                return  # a wire that repeats itself
            if last_tick > (self._feed.size - 1) * self._ticks_per_sample:
                return  # no such sample was asked for: damage that happens to fit the checksum
            self.last_tick = last_tick
            self._tick = max(self._tick, last_tick)
        self._last_block = self._last_block or bool(block.flags & codes.FLAG_LAST)
        self.received.append(block)
        self.samples += block.count

    def _request(self, command: m.Message) -> None:
        """Ask; once the play is to be stopped nothing but STOP is still waited for."""
        self._tick_at_send = self._tick
        urgent = isinstance(command, m.Stop)
        self._ack = self._exchange.request(command, None if urgent else self._stop.is_set)
        if self._ack.session == self._play_session:
            self._tick = max(self._tick, self._ack.tick)

    def _status(self) -> m.StatusReply:
        return self._exchange.request(m.Status())

    # --- the steps of a play ---------------------------------------------------------------------

    def _upload(self) -> None:
        self._request(m.Stop())  # whatever an earlier program left half done
        deadline = self._monotonic() + _RAMP_S
        while self._ack.state == codes.State.RAMPING and self._monotonic() < deadline:
            self._exchange.receive()
            self._request(m.Stop())
        if self._ack.fault:
            self._clear(self._status())
        self._request(m.Stream(self.decimation))
        self._request(m.WaveBegin(self._feed.total, self._ticks_per_sample, self._feed.crc32))
        while self._send_chunk(self._ack.credit):
            pass
        self._request(m.WaveCommit(self._sent, self._crc))
        self._checked = self._sent

    def _clear(self, status: m.StatusReply) -> None:
        """Clear the fault that has been told; one that nobody was told of is told now, and stays."""
        before, self.seen = self.seen, (status.fault, status.worst)
        if self.seen != before:
            raise DeviceError(
                "the device has switched off by itself since it was last asked: "
                f"{describe_fault(status, self._hello.tick_rate_Hz)}",
                hint=remedy_of(status.fault) or UNKNOWN_REMEDY,
            )
        self._request(m.ClearFault(*self.seen))
        self.seen = (0, 0)  # nor is it that of this play

    def _send_chunk(self, credit: int) -> bool:
        """Send the next samples if the device has room for a whole frame of them."""
        most = self._short if credit < self._hello.wave_buffer // 2 else m.WaveData.MAX_ITEMS
        count = min(most, self._feed.size - self._sent)
        if count == 0 or credit < count:
            return False
        piece = self._feed.piece(self._sent, count)
        self._request(m.WaveData(self._sent, count, piece))
        self._sent += count
        self._crc = zlib.crc32(piece, self._crc)
        return True

    def _check_sent(self) -> bool:
        """Ask now and then whether all samples of an open-ended wave have arrived as sent; tell its end."""
        end = self._feed.ended and self._sent == self._feed.size
        if self._told_end or (not end and self._sent - self._checked < _CHECK_SAMPLES):
            return False
        self._request(m.WaveCheck(self._sent, self._crc, int(end)))
        self._checked, self._told_end = self._sent, end
        return True

    def _credit(self) -> int:
        """Room in the device's buffer by what telemetry says it has played; never more than there is."""
        return max(
            self._ack.credit, min(self._hello.wave_buffer, self._hello.wave_buffer - self._sent + self.played)
        )

    def _beat_due(self) -> bool:
        beat_s = self._hello.heartbeat_ms / 1000 / _BEATS
        if self._monotonic() - self._exchange.sent_at_s >= beat_s:
            return True
        return self._tick - self._tick_at_send >= beat_s * self._hello.tick_rate_Hz

    def _stream(self) -> None:
        """Keep the buffer full until the play ends, whoever ends it."""
        in_piece = self._piece_s * self._hello.tick_rate_Hz / self._ticks_per_sample
        self._short = int(min(m.WaveData.MAX_ITEMS, max(1, in_piece)))
        while self._ack.state == codes.State.RUNNING and not self._last_block:
            if self._monotonic() - self.taken_at_s > _TAKER_S:
                self.stop(
                    f"the program did not collect its data for {_TAKER_S:g} s",
                    "the disk is too slow: write elsewhere, close other programs",
                )
            if self._stop.is_set():
                return
            if self._send_chunk(self._credit()) or self._check_sent():
                continue
            if self._beat_due():
                self._request(self._exchange.next_beat())
            else:
                self._exchange.receive()

    def _finish(self) -> m.StatusReply:
        """Stop, whatever the device is thought to be doing; then wait for the ramp and the last telemetry."""
        self._request(m.Stop())
        deadline = self._monotonic() + _RAMP_S
        status = self._status()
        driven = {codes.State.RUNNING, codes.State.RAMPING}
        while (status.state in driven or flows_A(status)) and self._monotonic() < deadline:
            self._exchange.receive()
            status = self._status()
        deadline = self._monotonic() + _DRAIN_S
        while not self._last_block and self._monotonic() < deadline:
            self._exchange.receive()
        self.seen = (status.fault, status.worst)
        self.heat = status.heat
        return status

    def _play(self) -> Outcome:
        refused = ""
        try:
            try:
                self._upload()
                # Telemetry may overtake a lost reply to START: know its session beforehand.
                self._play_session = (self._ack.session + 1) & 0xFF
                self._request(m.Arm(self._hello.boot_nonce))
                self._request(m.Start())
                self._stream()
            except AbandonedError:  # it is to be stopped
                if self._play_session is None:
                    return Outcome(0, played_to_end=False, fault=self._stop_reason)
            except RefusedError as error:
                if self._play_session is None:
                    raise
                refused = error.message  # it left the state we thought it in; its status will say why
            return self._judge(self._finish(), refused)
        except (PortLostError, NoAnswerError) as error:
            if self._play_session is None:
                raise
            return Outcome(-1, played_to_end=False, fault=error.message, remedy=error.hint)
        finally:  # disarm, whatever happened; a device that cannot be reached does it by itself
            with contextlib.suppress(PulsetrainerError):
                self._exchange.request(m.Stop())

    def _judge(self, status: m.StatusReply, refused: str) -> Outcome:
        if status.boot_nonce != self._hello.boot_nonce:
            cause = told(codes.ResetCause, status.reset_cause)
            return Outcome(
                -1,
                played_to_end=False,
                fault=f"the device restarted in mid-play (cause: {cause})",
                remedy="check its power supply and cable; nothing was started again",
            )
        last_tick = (self._feed.size - 1) * self._ticks_per_sample
        limit_N = self._hello.force_trip * codes.FORCE_UNIT_N
        fault = describe_fault(status, self._hello.tick_rate_Hz, limit_N)
        if not fault or self._stop_remedy:  # with a remedy it is a finding of the host, which came first
            fault = f"{self._stop_reason} (then: {fault})" if fault else self._stop_reason
        not_off = describe_not_off(status)
        if not_off:  # above everything else
            fault = f"{not_off} (first: {fault})" if fault else not_off
        if not fault and status.state != codes.State.IDLE:
            state = told(codes.State, status.state)
            fault = f"the device did not come to rest after the play (state: {state})"
        # Refused before it started: the numbers in the status are those of an earlier play.
        started = status.session == self._play_session
        to_end = started and status.tick > last_tick and not fault
        if not fault and not to_end:
            fault = refused or "the device ended the play early"
        produced = status.produced if started else 0
        remedy = NOT_OFF_REMEDY if not_off else self._stop_remedy or remedy_of(status.fault, limit_N)
        return Outcome(produced, to_end, fault, remedy)
