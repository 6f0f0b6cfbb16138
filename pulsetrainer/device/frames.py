"""Frames on the wire: COBS(type, seq, payload, complemented CRC-16) between zero bytes.

The CRC is CRC-16/CCITT-FALSE, sent complemented and big-endian: a frame of zeros, or one whose tail
was cut where the CRC register happens to be zero, is then wrong. Together with the exact length of
each message type no damaged frame is known to pass.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Iterator
from dataclasses import dataclass

from cobs import cobs

from pulsetrainer.device.codes import MAX_PAYLOAD

_OVERHEAD = 4  # type, seq, CRC
_MAX_ENCODED = MAX_PAYLOAD + _OVERHEAD + 1


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame: message type, sequence number and payload of at most 128 bytes."""

    type: int
    seq: int
    payload: bytes


def _crc(data: bytes) -> int:
    return crc_hqx(data, 0xFFFF) ^ 0xFFFF


def encode(frame: Frame) -> bytes:
    """Return the frame as sent: a zero byte (ends whatever noise came before), COBS, a zero byte."""
    if len(frame.payload) > MAX_PAYLOAD:
        raise ValueError(f"a payload is at most {MAX_PAYLOAD} bytes, got {len(frame.payload)}")
    body = bytes((frame.type, frame.seq)) + frame.payload
    encoded: bytes = cobs.encode(body + _crc(body).to_bytes(2, "big"))
    return b"\0" + encoded + b"\0"


def decode(encoded: bytes) -> Frame | None:
    """Return the frame between two zero bytes, or None if it is damaged."""
    if len(encoded) > _MAX_ENCODED:
        return None
    try:
        body: bytes = cobs.decode(encoded)
    except cobs.DecodeError:
        return None
    if len(body) < _OVERHEAD or _crc(body[:-2]) != int.from_bytes(body[-2:], "big"):
        return None
    return Frame(body[0], body[1], body[2:-2])


class FrameReader:
    """Cuts a byte stream into frames and counts the damaged ones."""

    def __init__(self) -> None:
        self._rest = bytearray()
        self.damaged = 0

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Yield the frames completed by ``data``."""
        self._rest += data
        *chunks, rest = self._rest.split(b"\0")
        # A line that never sends a zero must not fill the memory.
        self._rest = rest if len(rest) <= 2 * _MAX_ENCODED else bytearray(b"\1" * (_MAX_ENCODED + 1))
        for chunk in chunks:
            if not chunk:
                continue
            frame = decode(bytes(chunk))
            if frame is None:
                self.damaged += 1
            else:
                yield frame

    def clear(self) -> None:
        """Forget a half-received frame."""
        self._rest.clear()
