"""Laws of the wire frames."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.device.frames import Frame, FrameReader, decode, encode

BYTES = st.integers(0, 255)
FRAMES = st.builds(Frame, BYTES, BYTES, st.binary(max_size=128))


@given(FRAMES)
def test_decode_undoes_encode(frame):
    """A frame comes back as it was, and its wire form holds no zero inside."""
    wire = encode(frame)
    assert wire[0] == wire[-1] == 0
    assert 0 not in wire[1:-1]
    assert decode(wire[1:-1]) == frame


@given(st.lists(FRAMES, max_size=6), st.binary(max_size=40), st.randoms(use_true_random=False))
def test_reader_finds_every_frame_however_the_stream_is_cut(frames, noise, random):
    """Noise before the first frame costs none of them; neither does any cut of the stream."""
    stream = noise + b"".join(map(encode, frames))
    reader, found = FrameReader(), []
    while stream:
        cut = random.randint(1, len(stream))
        found += reader.feed(stream[:cut])
        stream = stream[cut:]
    # Noise may by itself hold a frame, but no such accident loses one of ours.
    assert found[len(found) - len(frames) :] == frames


@given(FRAMES, st.data())
def test_a_damaged_frame_is_not_taken_for_another(frame, data):
    """One changed byte never yields a frame."""
    wire = bytearray(encode(frame)[1:-1])
    at = data.draw(st.integers(0, len(wire) - 1))
    wire[at] ^= data.draw(st.integers(1, 255))
    if 0 in wire:
        pieces = [decode(bytes(p)) for p in wire.split(b"\0") if p]
        assert pieces == [None] * len(pieces)
    else:
        assert decode(bytes(wire)) is None


@given(FRAMES, st.data())
def test_a_truncated_frame_is_dropped(frame, data):
    """A frame that lost its end is no frame."""
    wire = encode(frame)[1:-1]
    assert decode(wire[: data.draw(st.integers(0, len(wire) - 1))]) is None


def test_a_line_without_zeros_does_not_fill_the_memory():
    """An endless run without a delimiter is forgotten, the frame after it is read.

    No more is kept than twice the longest frame, which the zeros of its wire form are no part of.
    """
    reader = FrameReader()
    longest = len(encode(Frame(1, 1, bytes(128)))) - 2
    for size in (1000, *[1] * 1000):
        assert list(reader.feed(b"\xaa" * size)) == []
        assert longest < len(reader._rest) <= 2 * longest
    frame = Frame(1, 2, b"abc")
    assert list(reader.feed(encode(frame))) == [frame]
    assert reader.damaged == 1


def test_a_payload_beyond_the_limit_is_refused():
    """128 bytes fit, 129 do not."""
    encode(Frame(1, 1, bytes(128)))
    with pytest.raises(ValueError):  # noqa: PT011 - nothing else is wrong with it
        encode(Frame(1, 1, bytes(129)))
