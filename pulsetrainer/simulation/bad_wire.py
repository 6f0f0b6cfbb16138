"""A bad wire: drops, flips, inserts, duplicates, delays and cuts bytes between host and device, from a seed.

It sits between exchange and port, so that it works the same on whatever the port is. Damage is drawn per
byte and direction: equal bytes meet equal damage however the operating system slices them.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable

import numpy as np

from pulsetrainer.device.transport import Transport
from pulsetrainer.simulation.options import Wire

KINDS = ("drop", "flip", "insert", "duplicate", "delay", "cut")
_LONGEST_INSERT = 8
_LONGEST_DUPLICATE = 160  # more than a whole frame: what repeats may be valid
_LONGEST_CUT = 300  # bytes, and no longer than they take at the wire's speed: a loose contact
_BYTE_S = 10 / 921_600
_DELAY_S = (0.005, 0.060)  # longer than the patience of a first try


class NoisyLine:
    """One direction of the wire; ``damaged`` counts what it did, by kind."""

    def __init__(self, rate: float, seed: int) -> None:
        self._rate = rate
        self._rng = np.random.default_rng(seed)
        self._until_next = self._gap()
        self._to_cut = 0
        self._cut_until_s = 0.0
        self._recent = b""
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._delay_s = 0.0
        self.damaged: Counter[str] = Counter()

    def _gap(self) -> int:
        return int(self._rng.geometric(self._rate)) if self._rate > 0 else 1 << 62

    def push(self, data: bytes, now_s: float) -> None:
        """Take in bytes at a moment."""
        at = 0
        if now_s > self._cut_until_s:
            self._to_cut = 0
        while at < len(data):
            lost = min(self._to_cut, len(data) - at)
            self._to_cut -= lost
            at += lost
            intact = min(self._until_next - 1, len(data) - at)
            self._until_next -= intact
            self._deliver(data[at : at + intact], now_s)
            at += intact
            if at < len(data):
                self._until_next = self._gap()
                self._deliver(self._event(data[at], now_s), now_s)
                at += 1

    def _event(self, byte: int, now_s: float) -> bytes:
        """Return what comes out instead of ``byte``."""
        rng = self._rng
        kind = KINDS[rng.integers(len(KINDS))]
        self.damaged[kind] += 1
        intact = bytes((byte,))
        match kind:
            case "drop":
                return b""
            case "flip":
                return bytes((byte ^ int(rng.integers(1, 256)),))
            case "insert":
                return rng.bytes(int(rng.integers(1, _LONGEST_INSERT + 1))) + intact
            case "duplicate":
                again = (self._recent + intact)[-int(rng.integers(1, _LONGEST_DUPLICATE + 1)) :]
                return intact + again
            case "delay":
                self._delay_s = float(rng.uniform(*_DELAY_S))
                return intact
            case _:
                self._to_cut = int(rng.integers(_LONGEST_CUT))
                self._cut_until_s = now_s + self._to_cut * _BYTE_S
                return b""

    def _deliver(self, data: bytes, now_s: float) -> None:
        if not data:
            return
        self._recent = (self._recent + data)[-_LONGEST_DUPLICATE:]
        earliest_s = self._waiting[-1][0] if self._waiting else 0.0  # the order stays
        self._waiting.append((max(now_s + self._delay_s, earliest_s), data))
        self._delay_s = 0.0

    def pull(self, now_s: float) -> bytes:
        """Return what has come out by a moment."""
        out = bytearray()
        while self._waiting and self._waiting[0][0] <= now_s:
            out += self._waiting.popleft()[1]
        return bytes(out)

    def clear(self) -> None:
        """Forget what is on its way."""
        self._waiting.clear()


class NoisyTransport:
    """A transport with a bad wire in both directions."""

    def __init__(self, inner: Transport, rate: float, seed: int, *, monotonic: Callable[[], float]) -> None:
        self._inner = inner
        self._monotonic = monotonic
        self.to_device = NoisyLine(rate, 2 * seed)
        self.to_host = NoisyLine(rate, 2 * seed + 1)

    def _send_what_is_due(self) -> None:
        due = self.to_device.pull(self._monotonic())
        if due:
            self._inner.write(due)

    def read(self) -> bytes:
        """Return what has come through, waiting a few milliseconds for the first byte."""
        self._send_what_is_due()
        self.to_host.push(self._inner.read(), self._monotonic())
        return self.to_host.pull(self._monotonic())

    def write(self, data: bytes) -> None:
        """Send ``data`` into the wire."""
        self.to_device.push(data, self._monotonic())
        self._send_what_is_due()

    def discard(self) -> None:
        """Forget what has arrived."""
        self._inner.discard()
        self.to_host.clear()

    def close(self) -> None:
        """Give the port back; what is still on the wire is lost."""
        self._inner.close()


def through(wire: Wire, transport: Transport, monotonic: Callable[[], float]) -> Transport:
    """Return the transport as it is at the other end of a wire that may be bad."""
    return NoisyTransport(transport, wire.rate, wire.seed, monotonic=monotonic) if wire.rate else transport
