"""A device that is open: who it is, and playing a current while recording what it reports."""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.player import Player, describe_fault
from pulsetrainer.device.ports import find_device_port
from pulsetrainer.device.recording import Block, FloatArray, Recording
from pulsetrainer.device.session import TIMEOUTS_S, Session
from pulsetrainer.device.transport import SerialTransport, Transport
from pulsetrainer.errors import ArgumentError, DeviceError, PulsetrainerError
from pulsetrainer.simulation.bad_wire import NoisyTransport
from pulsetrainer.simulation.bench import Bench
from pulsetrainer.simulation.emulator import (
    QEMU_BAD_WIRE_TIMEOUTS_S,
    QEMU_PIECE_S,
    QEMU_PORT,
    QEMU_TIMEOUTS_S,
    Emulator,
)
from pulsetrainer.simulation.options import Wire

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

_LOG = logging.getLogger(__name__)
PORT_VARIABLE = "PULSETRAINER_PORT"
DEFAULT_PORT = "bench:"
_INTERRUPTED = "interrupted"
_STOPPED = "stopped"
_RAMP_S = 0.11  # the device counts its way back to zero as on-time
_TAKE_EVERY_S = 0.02  # in bigger pieces than the wire's: each one costs a change of threads


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Who the device is and its limits, as it reports them."""

    serial: str
    firmware: str
    protocol: str
    build: str
    tick_rate_Hz: float
    current_limit_A: float
    force_limit_N: float
    on_time_limit_s: float
    heartbeat_s: float
    wave_buffer_samples: int
    reset_cause: str
    latched_fault: str  # what an earlier play ended with; the next play clears it

    @classmethod
    def from_wire(cls, hello: m.HelloReply, latched_fault: str) -> DeviceInfo:
        """Return what a greeting says."""
        return cls(
            serial=hello.serial.rstrip(b"\0").decode("ascii", errors="replace"),
            firmware=f"{hello.firmware_major}.{hello.firmware_minor}.{hello.firmware_patch}",
            protocol=f"{hello.major}.{hello.minor}",
            build=f"{hello.build_hash:08x}",
            tick_rate_Hz=float(hello.tick_rate_Hz),
            current_limit_A=hello.current_limit / 10_000,
            force_limit_N=hello.force_trip / 1_000,
            on_time_limit_s=float(hello.on_time_s),
            heartbeat_s=hello.heartbeat_ms / 1_000,
            wave_buffer_samples=hello.wave_buffer,
            reset_cause=codes.ResetCause(hello.reset_cause).name.lower(),
            latched_fault=latched_fault,
        )


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits that shall be in force; None leaves the device's own. They can only be lowered."""

    current_A: float | None = None
    force_N: float | None = None


class Device:
    """An open device; closing it stops and disarms it, always."""

    def __init__(
        self,
        session: Session,
        transport: Transport,
        bench: Bench | Emulator | None,
        *,
        monotonic: Callable[[], float],
        sleep: Callable[[float], None],
        piece_s: float = np.inf,
    ) -> None:
        self._piece_s = piece_s  # of the reference in one frame while it plays
        self._session = session
        self._transport = transport
        self._bench = bench
        self._monotonic = monotonic
        self._sleep = sleep
        self._player: Player | None = None
        self._greet()

    def _greet(self) -> None:
        self._hello = self._session.hello()
        latched = describe_fault(self._status(), self._hello.tick_rate_Hz)
        self.info = DeviceInfo.from_wire(self._hello, latched)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop, disarm and give the port back."""
        try:
            with contextlib.suppress(PulsetrainerError):
                self.stop()
        finally:
            self._transport.close()
            if self._bench is not None:
                self._bench.close()

    @property
    def longest_play_s(self) -> float:
        """Longest reference that the device plays in one go, s."""
        return self.info.on_time_limit_s - _RAMP_S

    def stop(self) -> None:
        """Ramp the current to zero and disarm; from another thread it ends a play."""
        if self._player is not None:
            self._player.stop(_STOPPED)
        else:
            self._session.request(m.Stop())

    def _status(self) -> m.StatusReply:
        reply = self._session.request(m.Status())
        if not isinstance(reply, m.StatusReply):
            raise DeviceError(
                "the device answered Status with something else", hint="flash the firmware again"
            )
        return reply

    def set_parameter(self, name: str, value: int) -> int:
        """Set a parameter of the firmware in device units and return what the device now holds.

        Limits can only be lowered: the range ends at the absolute limit compiled into the firmware.
        """
        rows = {p.name: p for p in codes.PARAMETERS}
        if name not in rows:
            raise ArgumentError(f"the device has no parameter {name!r}", hint=f"there are: {', '.join(rows)}")
        row = rows[name]
        if not row.minimum <= value <= row.maximum:
            raise ArgumentError(
                f"{name}={value} is outside {row.minimum}..{row.maximum} {row.unit}",
                hint="a limit can only be lowered below the one compiled into the firmware",
            )
        reply = self._session.request(m.SetParam(row.id, value))
        if not isinstance(reply, m.ParamReply) or reply.value != value:
            raise DeviceError(f"the device did not take {name}={value}", hint="flash the firmware again")
        self._greet()  # the limits in force have changed
        return reply.value

    def lower(self, limits: Limits) -> None:
        """Put limits in force that are stricter than the device's own.

        Raises
        ------
        ArgumentError
            if a limit is not positive, or above the device's own.
        """
        info = self.info
        for what, parameter, wanted, own, quantum, unit in (
            ("current", "current_limit", limits.current_A, info.current_limit_A, codes.CURRENT_UNIT_A, "A"),
            ("force", "force_trip", limits.force_N, info.force_limit_N, codes.FORCE_UNIT_N, "N"),
        ):
            if wanted is None:
                continue
            if not 0 < wanted <= own:
                raise ArgumentError(
                    f"a {what} limit of {wanted:g} {unit} was asked for; the device's own is {own:g} {unit}",
                    hint="a limit can only be lowered",
                )
            self.set_parameter(parameter, round(wanted / quantum))
            _LOG.info("%s limit lowered from %g to %g %s", what, own, wanted, unit)

    def play(
        self,
        reference_A: ArrayLike,
        rate_Hz: float,
        *,
        decimation: int = 10,
        on_block: Callable[[Block], None] | None = None,
        keep: bool = True,
        should_stop: Callable[[], bool] | None = None,
    ) -> Recording:
        """Play a coil current and return what the device measured meanwhile.

        The reference, shape (n,) in A at ``rate_Hz``, is interpolated linearly to the device's tick; its
        first sample is tick 0. Telemetry is one sample every ``decimation`` ticks. ``on_block`` gets it
        in pieces as it comes; without ``keep`` that is all there is of it: the recording that is returned
        has counts only, and memory stays flat. Ctrl-C, ``should_stop`` or a fault of the device stop the
        output first; what was recorded until then is returned with ``complete=False``. The device ends
        disarmed.

        Raises
        ------
        ArgumentError
            if the reference cannot be played; nothing has been armed then.
        DeviceError
            if the device cannot be talked to before it starts.
        """
        ticks_per_sample = self._ticks_per_sample(rate_Hz)
        wire = self._checked(reference_A, ticks_per_sample)
        if not 1 <= decimation <= codes.MAX_DECIMATION:
            raise ArgumentError(
                f"decimation {decimation} is outside 1..{codes.MAX_DECIMATION}",
                hint="10 gives 1000 samples a second",
            )
        player = Player(
            self._session,
            wire,
            ticks_per_sample,
            decimation,
            hello=self._hello,
            monotonic=self._monotonic,
            piece_s=self._piece_s,
        )
        self._player = player
        thread = threading.Thread(target=player.run, name="pulsetrainer-play", daemon=True)
        thread.start()
        interrupted = False
        try:
            interrupted = self._follow(player, on_block, should_stop, keep=keep)
        finally:
            player.stop(_STOPPED)
            while thread.is_alive():  # it is stopping the device: not to be interrupted, and soon over
                try:
                    thread.join()
                except KeyboardInterrupt:
                    interrupted = True
            self._player = None
        if player.error is not None:
            raise player.error
        return self._recording(player, interrupted)

    def _follow(
        self,
        player: Player,
        on_block: Callable[[Block], None] | None,
        should_stop: Callable[[], bool] | None,
        *,
        keep: bool,
    ) -> bool:
        """Hand over the telemetry as it comes until the play has ended; True if Ctrl-C hastened the end."""
        passed = forgotten = 0
        ended = interrupted = False
        while not ended:
            try:
                ended = player.ended.is_set()  # before the count: then nothing comes after it
                count = len(player.received)
                fresh, passed = player.received[passed:count], count
                player.taken_at_s = self._monotonic()
                if on_block is not None and any(b.count for b in fresh):
                    on_block(Block.from_wire(fresh, player.decimation))
                if not keep:
                    player.forget(forgotten, passed)
                    forgotten = passed
                if should_stop is not None and should_stop():
                    player.stop(_STOPPED)
                if not ended:
                    self._sleep(_TAKE_EVERY_S)
            except KeyboardInterrupt:
                interrupted = True
                player.stop(_INTERRUPTED)
        return interrupted

    def _recording(self, player: Player, interrupted: bool) -> Recording:
        outcome = player.outcome
        block = Block.from_wire(player.received, player.decimation)
        assert outcome is not None
        received = player.samples
        if outcome.produced >= 0:
            dropped = outcome.produced - received
        else:  # the device is gone: what is missing between the samples that came
            dropped = player.last_tick // player.decimation + 1 - received if received else 0
        return Recording(
            tick=block.tick,
            reference_A=block.reference_A,
            current_A=block.current_A,
            force_N=block.force_N,
            tick_rate_Hz=self.info.tick_rate_Hz,
            dropped_samples=dropped,
            # Interrupted even if it came during the last ramp: the user wants out.
            complete=outcome.played_to_end and not interrupted,
            fault=outcome.fault or (_INTERRUPTED if interrupted else ""),
            samples=received,
            remedy=outcome.remedy,
        )

    def _ticks_per_sample(self, rate_Hz: float) -> int:
        if not (np.isfinite(rate_Hz) and rate_Hz > 0):
            raise ArgumentError(f"a sample rate of {rate_Hz} Hz is not possible", hint="1000 Hz is usual")
        exact = self.info.tick_rate_Hz / rate_Hz
        ticks = round(exact)
        if ticks < 1 or ticks > codes.MAX_TICKS_PER_SAMPLE or abs(exact - ticks) > 1e-9 * exact:
            nearest = self.info.tick_rate_Hz / min(max(ticks, 1), codes.MAX_TICKS_PER_SAMPLE)
            raise ArgumentError(
                f"the reference's rate of {rate_Hz:g} Hz does not divide the device's "
                f"{self.info.tick_rate_Hz:g} Hz",
                hint=f"resample it to {nearest:g} Hz",
            )
        return ticks

    def _checked(self, reference_A: ArrayLike, ticks_per_sample: int) -> NDArray[np.int16]:
        """Return the reference in wire units if the device may play it."""
        reference: FloatArray = np.asarray(reference_A, dtype=np.float64)
        if reference.ndim != 1 or reference.size == 0:
            raise ArgumentError(
                f"a reference is a row of samples, got an array of shape {reference.shape}",
                hint="one current in A per sample",
            )
        bad = np.flatnonzero(~np.isfinite(reference))
        if bad.size:
            raise ArgumentError(f"sample {bad[0]} of the reference is not a number", hint="mend the waveform")
        # Half a wire unit of tolerance: rounding must not refuse a waveform that uses the whole range.
        limit, half = self.info.current_limit_A, codes.CURRENT_UNIT_A / 2
        out = np.flatnonzero((reference < -half) | (reference > limit + half))
        if out.size:
            raise ArgumentError(
                f"sample {out[0]} of the reference is {reference[out[0]]:g} A; "
                f"the device plays 0..{limit:g} A ({out.size} of {reference.size} samples are outside)",
                hint="scale the waveform into the range",
            )
        seconds = (reference.size - 1) * ticks_per_sample / self.info.tick_rate_Hz
        if seconds > self.longest_play_s:
            raise ArgumentError(
                f"the reference is {seconds:g} s long; the device stays on for at most "
                f"{self.info.on_time_limit_s:g} s",
                hint="play it in several pieces",
            )
        return np.rint(reference / codes.CURRENT_UNIT_A).astype(np.int16)


def redact(port: str) -> str:
    """Return the port without a bench's parameters, which must never reach an artefact."""
    return DEFAULT_PORT if port.startswith("bench:") else port


def _through(wire: Wire, transport: Transport, monotonic: Callable[[], float]) -> Transport:
    """Return the transport as it is at the other end of a wire that may be bad."""
    return NoisyTransport(transport, wire.rate, wire.seed, monotonic=monotonic) if wire.rate else transport


def open_device(
    port: str | None,
    *,
    limits: Limits | None = None,
    monotonic: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Device:
    """Open a device and greet it; without a port the environment's ``PULSETRAINER_PORT``, else the bench.

    Raises
    ------
    UsageError
        if the port's text makes no sense.
    ArgumentError
        if a limit is beyond the device's own.
    DeviceError
        if the port is absent, busy or not permitted, nobody answers, or the protocol differs.
    """
    port = port or os.environ.get(PORT_VARIABLE) or DEFAULT_PORT
    machine: Bench | Emulator | None = None
    transport: Transport | None = None
    try:
        name = port
        timeouts_s: tuple[float, ...] = TIMEOUTS_S
        if port.startswith("bench:"):
            machine = bench = Bench(port)
            name = DEFAULT_PORT
            transport = SerialTransport(bench.path, name)
            transport = _through(bench.options.wire, transport, monotonic)
        elif port.startswith("qemu:"):
            machine = emulator = Emulator(port)
            name = QEMU_PORT
            transport = _through(emulator.options.wire, emulator.transport, monotonic)
            timeouts_s = QEMU_BAD_WIRE_TIMEOUTS_S if emulator.options.wire.rate else QEMU_TIMEOUTS_S
        else:
            name = find_device_port() if port == "auto" else port
            transport = SerialTransport(name)
        session = Session(transport, name, monotonic=monotonic, timeouts_s=timeouts_s)
        piece_s = QEMU_PIECE_S if isinstance(machine, Emulator) else np.inf
        device = Device(session, transport, machine, monotonic=monotonic, sleep=sleep, piece_s=piece_s)
        _LOG.info(
            "%s: %s, firmware %s, protocol %s, limits %g A and %g N",
            *(redact(port), device.info.serial, device.info.firmware, device.info.protocol),
            *(device.info.current_limit_A, device.info.force_limit_N),
        )
        device.lower(limits or Limits())
        return device  # noqa: TRY300 - what fails up to here closes the port
    except BaseException:
        if transport is not None:
            transport.close()
        if machine is not None:
            machine.close()
        raise
