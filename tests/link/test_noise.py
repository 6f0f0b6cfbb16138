"""A wire that drops, flips, adds, repeats, delays and cuts: nothing wrong gets through, losses are told."""

from __future__ import annotations

import time

import numpy as np
import pytest
from link_wire import within

from pulsetrainer.device import messages as m
from pulsetrainer.device.codes import PARAMETERS, Fault, State
from pulsetrainer.device.exchange import Exchange, NoAnswerError, RefusedError
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.transport import SerialTransport
from pulsetrainer.simulation.bad_wire import KINDS, NoisyLine, NoisyTransport
from pulsetrainer.simulation.bench import Bench

RATE = 1e-4  # one bad byte in ten thousand


def _through(line: NoisyLine, data: bytes, piece: int) -> bytes:
    for at in range(0, len(data), piece):
        line.push(data[at : at + piece], 0.0)
    return line.pull(1e9)


def test_a_quiet_wire_changes_nothing():
    """Without noise what goes in comes out."""
    data = bytes(range(256)) * 10
    assert _through(NoisyLine(0.0, 1), data, 100) == data


def test_the_seed_decides_whatever_the_slices():
    """Equal bytes are damaged equally, read in one piece or one by one; another seed damages others."""
    data = np.random.default_rng(0).bytes(20_000)
    whole = _through(NoisyLine(1e-3, 5), data, len(data))
    assert whole != data
    assert _through(NoisyLine(1e-3, 5), data, 1) == whole
    assert _through(NoisyLine(1e-3, 6), data, len(data)) != whole


def test_every_kind_of_damage_happens_at_the_stated_rate():
    """In a million bytes each of the six kinds, about a thousand in all."""
    line = NoisyLine(1e-3, 2)
    _through(line, bytes(1_000_000), 4096)
    assert set(line.damaged) == set(KINDS)
    assert 700 < line.damaged.total() < 1200  # a cut hides what would come within it
    every = NoisyLine(1.0, 2)
    for k in range(200):
        every.push(b"a", 1e3 * k)  # no cut lasts so long
    assert every.damaged.total() == 200
    both = NoisyTransport(SerialTransport, 1e-3, 5, monotonic=time.monotonic)
    assert [_through(one, bytes(20_000), 4096) for one in (both.to_device, both.to_host)] == [
        _through(NoisyLine(1e-3, seed), bytes(20_000), 4096) for seed in (10, 11)
    ]


def test_what_each_kind_of_damage_adds_or_takes():
    """One to eight bytes before, one to 160 of the last ones again, none in place of a lost one."""
    line, more = NoisyLine(0.2, 3), {kind: set() for kind in KINDS}
    for k in range(60_000):
        own, before = bytes((k % 256,)), line.damaged.copy()
        line.push(own, float(k))  # no cut or delay lasts for a second
        came = line.pull(k + 0.5)
        for kind in line.damaged - before:
            more[kind].add(len(came) - 1)
            assert came.startswith(own) or kind not in ("duplicate", "delay")
            assert came.endswith(own) or kind != "insert"
            assert came != own or kind != "flip"
    assert more.pop("insert") == set(range(1, 9))
    assert more.pop("duplicate") == set(range(1, 161))
    assert more == {"drop": {-1}, "cut": {-1}, "flip": {0}, "delay": {0}}


def test_delayed_bytes_keep_their_order():
    """What is late holds back what comes behind it."""
    line = NoisyLine(1.0, 4)
    while not line.damaged["delay"]:
        line.clear()
        line.push(b"a", 1.0)
    assert line.pull(1.0) == b""
    assert line.pull(1.061).endswith(b"a")


def _reference() -> np.ndarray:
    """Sixty seconds of 75 bpm, full range, 1 kHz, A."""
    phase = np.arange(60_000) % 800
    up = 0.75 - 0.75 * np.cos(np.pi * np.clip(phase / 100, 0, 1))
    return np.where(phase < 100, up, 0.75 + 0.75 * np.cos(np.pi * (phase - 100) / 700))


@pytest.fixture(scope="module")
def clean():
    """The same bench and reference on a good wire."""
    with open_device("bench:?seed=3") as device:
        return device.play(_reference(), 1000)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_minute_of_telemetry_through_a_bad_wire(clean, seed, capsys):
    """No sample that is not bit for bit that of the good wire; every lost one counted; played to its end."""
    for _ in range(3):  # again where the computer was too busy to send what was lost in time
        with within(60), open_device(f"bench:?seed=3&wire={RATE}&wire-seed={seed}") as device:
            recording = device.play(_reference(), 1000)
            wire = device._port.transport
            assert device._exchange.damaged > 0
        if not recording.underrun:
            break
    assert isinstance(wire, NoisyTransport)
    with capsys.disabled():
        print(
            f"\na minute at 1 kHz, one bad byte in 10 000, seed {seed}: {wire.to_host.damaged.total()} + "
            f"{wire.to_device.damaged.total()} hurts, {recording.dropped_samples} samples lost and counted, "
            f"{len(recording.tick)} right"
        )
    assert wire.to_host.damaged.total() > 20
    assert wire.to_device.damaged.total() > 3
    assert recording.complete, recording.fault
    assert recording.dropped_samples > 0
    assert len(recording.tick) + recording.dropped_samples == len(clean.tick) == 60_000
    assert np.all(np.diff(recording.tick) > 0)
    row = np.searchsorted(clean.tick, recording.tick)
    np.testing.assert_array_equal(clean.tick[row], recording.tick)
    for name in ("reference_A", "current_A", "force_N"):
        np.testing.assert_array_equal(getattr(clean, name)[row], getattr(recording, name))


def test_a_recorder_gets_what_the_recording_has():
    """Pieces handed over while it plays are in order and make up the whole, repeated blocks left out."""
    pieces = []
    with open_device("bench:?wire=0.001&wire-seed=11") as device:
        recording = device.play(_reference()[:10_000], 1000, on_block=pieces.append)
    ticks = np.concatenate([p.tick for p in pieces])
    assert np.all(np.diff(ticks) > 0)
    np.testing.assert_array_equal(ticks, recording.tick)


@pytest.mark.slow
def test_thousands_of_commands_on_a_worse_wire():
    """One bad byte in 300: each answer is the answer to its command, each value the last one accepted."""
    bench = Bench("bench:?ideal")
    transport = NoisyTransport(SerialTransport(bench.path), 1 / 300, 9, monotonic=time.monotonic)
    session = Exchange(transport, "bench:", monotonic=time.monotonic)
    rng = np.random.default_rng(1)
    held = {p.id: {p.default} for p in PARAMETERS}  # what the device may hold
    given_up = 0
    try:
        session.hello()
        with within(60):
            for _ in range(2500):
                row = PARAMETERS[rng.integers(len(PARAMETERS))]
                value = int(rng.integers(row.minimum, row.maximum + 1))
                asked = m.SetParam(row.id, value) if rng.random() < 0.5 else m.GetParam(row.id)
                try:
                    reply = session.request(asked)
                except NoAnswerError:
                    given_up += 1
                    if isinstance(asked, m.SetParam):
                        held[row.id].add(value)
                    continue
                assert isinstance(reply, m.ParamReply)
                assert reply.id == row.id
                if isinstance(asked, m.SetParam):
                    held[row.id] = {value}
                assert reply.value in held[row.id]
                held[row.id] = {reply.value}
        # On a good wire again: the device holds what was sent and nothing else was ever done.
        for line in (transport.to_device, transport.to_host):
            line._rate, line._until_next = 0.0, 1 << 62
        for row in PARAMETERS:
            reply = session.request(m.GetParam(row.id))
            assert reply.value in held[row.id]
        status = session.request(m.Status())
        assert (status.state, status.fault, status.session) == (State.IDLE, Fault.NONE, 0)
        assert session.damaged > 50
        assert transport.to_device.damaged.total() > 50
        assert given_up < 25
    finally:
        transport.close()
        bench.close()
    assert bench._process.returncode == 0
    assert bench._process.stdin.closed  # a program with many benches keeps no pipe


def test_nothing_is_accepted_that_was_not_sent():
    """Noise alone, hundreds of kilobytes of it: not one command is executed."""
    bench = Bench("bench:?ideal")
    transport = SerialTransport(bench.path)
    session = Exchange(transport, "bench:", monotonic=time.monotonic)
    try:
        session.hello()
        before = session.request(m.Status())
        rng = np.random.default_rng(2)
        for _ in range(100):
            transport.write(rng.bytes(4000).replace(b"\1", b"\0"))
            while transport.read():
                pass
        assert session.request(m.Status()) == before
        for row in PARAMETERS:
            reply = session.request(m.GetParam(row.id))
            assert isinstance(reply, m.ParamReply)
            assert reply.value == row.default
    finally:
        transport.close()
        bench.close()


def test_a_wire_too_bad_to_play_on_is_told_and_soon():
    """One bad byte in thirty: the play ends with a reason instead of hanging, or it was completed."""
    with within(30), open_device("bench:?wire=0.0001&wire-seed=1") as device:
        for line in (device._port.transport.to_device, device._port.transport.to_host):
            line._rate, line._until_next = 1 / 30, 1
        said = ""
        try:
            said = device.play(_reference()[:5000], 1000).fault
        except (NoAnswerError, RefusedError) as error:
            said = error.message
    assert "did not answer" in said or "refused" in said or "heard nothing" in said
