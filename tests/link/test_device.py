"""Playing and recording on the real firmware."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from link_wire import within

from pulsetrainer.device import player
from pulsetrainer.device.codes import CURRENT_UNIT_A, PARAMETERS
from pulsetrainer.device.device import Device
from pulsetrainer.device.limits import check_peak
from pulsetrainer.device.messages import GetParam, Telemetry
from pulsetrainer.device.opening import open_device
from pulsetrainer.device.schemes import redact
from pulsetrainer.device.trace import Block
from pulsetrainer.errors import ArgumentError, DeviceError, UsageError
from pulsetrainer.simulation import build
from pulsetrainer.simulation.bench import open_bench
from wording import raises


def test_handshake_says_who_and_how_much(device):
    """The device names itself and its limits."""
    info = device.info
    assert info.serial == "BENCH-0"
    assert (info.tick_rate_Hz, info.current_limit_A, info.force_limit_N) == (10_000, 1.5, 15.0)
    assert (info.heartbeat_s, info.reset_cause, info.latched_fault) == (0.2, "power", "")


def test_counts_come_back_as_the_nearest_numbers_of_their_unit():
    """477 mN stood in a table as 0.47700000000000004."""
    counts = np.arange(-32766, 32766, dtype="<i2")  # three a sample
    block = Block.from_wire([Telemetry(1, 0, 0, 0, counts.size // 3, counts.tobytes())], 10)
    told = np.stack((block.reference_A, block.current_A, block.force_N), axis=1)
    units = (10_000, 10_000, 1000)
    assert told.tolist() == [
        [n / u for n, u in zip(row, units, strict=True)] for row in counts.reshape(-1, 3).tolist()
    ]


def test_every_sample_of_a_play_comes_back_aligned(device, pulse):
    """Telemetry at 1 kHz is the reference sample for sample; the current follows within 1 % of 1.5 A."""
    recording = device.play(pulse, 1000)
    assert recording.complete
    assert (recording.fault, recording.dropped_samples) == ("", 0)
    np.testing.assert_array_equal(recording.tick, 10 * np.arange(len(pulse)))
    np.testing.assert_allclose(recording.time_s, np.arange(len(pulse)) / 1000)
    np.testing.assert_allclose(recording.reference_A, pulse, atol=CURRENT_UNIT_A)
    assert np.abs(recording.current_A - recording.reference_A).max() < 0.015
    assert recording.force_N.max() > 5


def test_interpolation_is_linear_at_the_tick(device):
    """At 10 kHz telemetry the reference between two samples is straight."""
    corners = np.array([0.0, 0.1, 0.05, 0.2])
    recording = device.play(corners, 100, decimation=1)
    assert recording.complete
    expected = np.interp(recording.tick, 100 * np.arange(4), corners)
    assert len(recording.tick) == 301
    np.testing.assert_allclose(recording.reference_A, expected, atol=1.01 * CURRENT_UNIT_A)


def test_duty_and_current_tell_the_resistance(device):
    """At rest d (V + 0.6 V) - 0.6 V = R i: of two holds, 12 V and 5 ohm."""
    recording = device.play(np.repeat([0.3, 0.9], 1000), 1000)
    assert recording.complete
    duty, current = (
        values.reshape(2, 1000)[:, 500:].mean(axis=1) for values in (recording.duty, recording.current_A)
    )
    np.testing.assert_allclose(duty * 12.6 - 0.6, 5.0 * current * (1 + 0.012 * 0.05), rtol=2e-3)


def test_firmware_that_does_not_tell_the_duty_is_told_apart(pulse):
    """Protocol 2.1: everything else is as ever, the duty is unknown; what needs it names both versions."""
    executable = build.firmware_executable(("-DPT_PROTOCOL_MINOR=1u",))
    with Device(open_bench("bench:", time.monotonic, executable)) as device:
        recording = device.play(pulse, 1000)
        assert recording.complete
        assert np.abs(recording.current_A - recording.reference_A).max() < 0.015
        assert np.all(np.isnan(recording.duty))
        assert recording.duty.shape == recording.force_N.shape
        with pytest.raises(DeviceError) as raised:
            device.needs_duty("a measurement")
        assert "2.1" in raised.value.message
        assert "2.2" in raised.value.message


@pytest.mark.slow
@pytest.mark.parametrize(("rate_Hz", "decimation"), [(10_000, 1), (1000, 7), (250, 100), (2, 1000)])
def test_rates_and_decimations(device, rate_Hz, decimation):
    """Any rate that divides the tick, any decimation: the ticks are where they should be."""
    reference = np.linspace(0.2, 0.3, 41 if rate_Hz < 10 else 3000)
    recording = device.play(reference, rate_Hz, decimation=decimation)
    last = (len(reference) - 1) * round(10_000 / rate_Hz)
    assert recording.complete
    np.testing.assert_array_equal(recording.tick, np.arange(0, last + 1, decimation))


def test_a_single_sample_is_a_play(device):
    """The shortest reference is one sample."""
    recording = device.play([0.2], 1000)
    assert recording.complete
    assert recording.tick.tolist() == [0]


def test_a_long_waveform_streams_through_the_small_buffer(device):
    """90 s at 1 kHz through a buffer of 1024 samples: nothing lost, in a few seconds of wall time."""
    reference = 0.75 - 0.75 * np.cos(2 * np.pi * 1.25 * np.arange(90_000) / 1000)
    with within(20):
        recording = device.play(reference, 1000)
    assert recording.complete
    assert (len(recording.tick), recording.dropped_samples) == (90_000, 0)
    np.testing.assert_allclose(recording.reference_A, reference, atol=CURRENT_UNIT_A)


def test_four_full_strokes_a_second_are_tracked(device):
    """A 4 Hz full-range pulse train stays within 1 % of the range at every tick."""
    reference = 0.75 - 0.75 * np.cos(2 * np.pi * 4 * np.arange(2000) / 1000)
    recording = device.play(reference, 1000, decimation=1)
    assert np.abs(recording.current_A - recording.reference_A).max() < 0.015


def test_blocks_arrive_in_order_and_make_up_the_recording(device, pulse):
    """on_block sees every sample once, in order, while the play goes on."""
    blocks: list[Block] = []
    recording = device.play(np.tile(pulse, 5), 1000, on_block=blocks.append)
    np.testing.assert_array_equal(np.concatenate([b.tick for b in blocks]), recording.tick)
    np.testing.assert_array_equal(np.concatenate([b.force_N for b in blocks]), recording.force_N)


def test_plays_follow_each_other(device, pulse):
    """A device can be played again and again; each recording starts at tick 0."""
    for _ in range(3):
        recording = device.play(pulse, 1000)
        assert recording.complete
        assert recording.tick[0] == 0


def test_equal_benches_give_equal_numbers(pulse):
    """However time passes outside, the same bench and reference give the same record, bit for bit."""
    records = []
    for pause_s in (0.0, 0.3):
        with open_device("bench:?seed=3&creep=0.05") as device:
            time.sleep(pause_s)
            device.play(pulse, 1000)
            time.sleep(pause_s)
            records.append(device.play(pulse, 1000))
    np.testing.assert_array_equal(records[0].force_N, records[1].force_N)
    np.testing.assert_array_equal(records[0].current_A, records[1].current_A)


@pytest.mark.parametrize("speed", ["real", "steady"])
def test_real_speed_is_the_wall_clock(pulse, speed):
    """One second is played in one second."""
    with open_device(f"bench:?speed={speed}") as device:
        begun = time.monotonic()
        recording = device.play(pulse[:1000], 1000)
        took_s = time.monotonic() - begun
    assert recording.complete
    assert 0.95 < took_s < 10


@pytest.mark.parametrize(
    ("reference", "rate_Hz", "says"),
    [
        ([0.1, np.nan], 1000, "sample 1 of the reference is not a number"),
        ([0.1, 0.2, 1.6], 1000, "sample 2 of the reference is 1.6 A; the device plays 0..1.5 A"),
        ([-0.1], 1000, "sample 0 of the reference is -0.1 A"),
        ([], 1000, "shape"),
        ([[0.1]], 1000, "shape"),
        ([0.1], 3000, "3000 Hz does not divide the device's 10000 Hz"),
        ([0.1], 0.5, "by a whole number up to 10000"),
        ([0.1], 1e-305, "by a whole number up to 10000"),
        ([0.1], 0, "not possible"),
        ([0.1], np.inf, "not possible"),
        (np.zeros(901), 1, "900"),
        ([1.5, 1.500055], 1000, "sample 1 "),
        ([0.0, -0.000055], 1000, "sample 1 "),
    ],
)
def test_what_cannot_be_played_is_refused_before_arming(device, reference, rate_Hz, says):
    """A reference outside the device's limits is a clear error and nothing happens."""
    with raises(ArgumentError, "names it", named=says):
        device.play(reference, rate_Hz)
    assert device._status().session == 0
    assert device.play([-0.000045, 0.1, 1.500045], 1000).complete  # nearer than half a count


@pytest.mark.parametrize(
    ("limit_A", "peak_A", "may_rise"), [(1.0, 1.2, True), (1.0, 1.6, False), (1.5, 1.6, False)]
)
def test_only_a_limit_that_was_lowered_can_be_raised(limit_A, peak_A, may_rise):
    """And only as far as the device allows: a current beyond that needs another drive."""
    with pytest.raises(ArgumentError) as caught:
        check_peak(np.array([0.0, peak_A]), limit_A)
    assert ("`limit_current_A`" in caught.value.hint) is may_rise


def test_decimation_is_checked(device):
    """A decimation of nothing is refused."""
    with raises(ArgumentError, "names it", named="decimation 0"):
        device.play([0.1], 1000, decimation=0)


def test_parameters_can_only_lower_limits(device):
    """A limit above the compiled one is refused by the program, and by the device itself."""
    assert device.set_parameter("force_trip", 5000) == 5000
    for row in PARAMETERS:
        with raises(ArgumentError, "names it", named=row.name):
            device.set_parameter(row.name, row.maximum + 1)
    with raises(ArgumentError, "names it", named="magic"):
        device.set_parameter("magic", 1)


def test_should_stop_ends_a_play(device):
    """The caller can end a play; what came until then is kept, the device is disarmed."""
    seen = []
    recording = device.play(
        np.full(500_000, 0.5),
        1000,
        on_block=seen.append,
        should_stop=lambda: sum(len(b.tick) for b in seen) > 1000,
    )
    assert not recording.complete
    assert recording.fault == "stopped"
    assert 1000 < len(recording.tick) < 500_000
    assert recording.dropped_samples == 0
    assert device._status().state == 0


def test_ctrl_c_stops_first_and_keeps_what_was_recorded(device):
    """KeyboardInterrupt anywhere in a play: the output stops, no sample that was made is lost."""

    def interrupt(block: Block) -> None:
        if block.tick[-1] > 5000:
            raise KeyboardInterrupt

    recording = device.play(np.full(500_000, 0.5), 1000, on_block=interrupt)
    assert (recording.complete, recording.fault, recording.dropped_samples) == (False, "interrupted", 0)
    np.testing.assert_array_equal(recording.tick, 10 * np.arange(len(recording.tick)))
    assert device._status().state == 0
    assert device.play([0.1], 1000).complete


def test_an_error_of_the_caller_stops_the_device(device):
    """An exception in on_block reaches the caller, the output is off by then."""

    def fail(_: Block) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        device.play(np.full(500_000, 0.5), 1000, on_block=fail)
    assert device._status().state == 0


def test_stop_from_another_thread(device):
    """Device.stop ends a play that another thread waits for."""
    other = threading.Thread(target=device.stop)
    recording = device.play(np.full(800_000, 0.3), 1000, on_block=lambda _: other.ident or other.start())
    other.join()
    assert (recording.complete, recording.fault) == (False, "stopped")


def test_a_slow_reader_does_not_trip_the_device(pulse):
    """on_block may take longer than the device's patience of 200 ms."""
    with open_device("bench:?speed=real") as device:
        recording = device.play(pulse, 1000, on_block=lambda _: time.sleep(0.4))
    assert recording.complete
    assert recording.dropped_samples == 0


def test_a_reader_that_hangs_is_stopped(monkeypatch):
    """The playing thread does not vouch for a program that no longer takes its data."""
    monkeypatch.setattr(player, "_TAKER_S", 0.3)
    with open_device("bench:?speed=real") as device:
        recording = device.play(np.full(20_000, 0.5), 1000, on_block=lambda _: time.sleep(1.0))
    assert not recording.complete
    assert "did not collect its data" in recording.fault
    assert "the disk is too slow" in recording.remedy
    assert recording.tick[-1] < 30_000


def test_closing_always_disarms(pulse):
    """Leaving the context ends the firmware process."""
    with open_device("bench:") as device:
        device.play(pulse, 1000)
        bench = device._port.machine
    assert bench._process.returncode == 0


def test_the_environment_names_the_port(monkeypatch):
    """Without a port PULSETRAINER_PORT decides, then the bench."""
    monkeypatch.setenv("PULSETRAINER_PORT", "/dev/no-such-port")
    with raises(DeviceError, "no such port", port="/dev/no-such-port"):
        open_device(None)
    monkeypatch.delenv("PULSETRAINER_PORT")
    with open_device(None) as device:
        assert device.info.serial == "BENCH-0"


def test_the_port_is_redacted_for_provenance():
    """The bench's hidden parameters never leave with a port's name; other ports are named in full."""
    assert redact("bench:?creep=0.05&seed=3&heat=1") == "bench:?seed=3"
    assert redact("bench:?creep=0.05&wire-seed=3") == "bench:"
    assert redact("bench:") == "bench:"
    assert redact("/dev/ttyUSB0") == "/dev/ttyUSB0"


def test_nothing_hidden_is_readable(wire):
    """Two benches that differ in every hidden parameter are one and the same to ask."""
    told = []
    for port in ("bench:?seed=3&ideal", "bench:?seed=3&creep=0.05&noise=0.01&coulomb=1&speed=real"):
        one = wire(port)
        hello = one.session.hello()
        status = one.status()
        parameters = [one.ask(GetParam(row.id)) for row in PARAMETERS]
        told.append((_without_nonce(hello), _without_nonce(status), parameters))
    assert told[0] == told[1]


def _without_nonce(message):
    """What a message tells but the nonce and the readings of the moment, which are noise."""
    passing = {"boot_nonce", "current", "force"}
    return [getattr(message, name) for name, _ in message.wire_fields() if name not in passing]


def test_bad_bench_ports_are_usage_errors():
    """An unknown parameter is answered with its neighbours."""
    with raises(UsageError, "no such bench parameter", asked="`port`"):
        open_device("bench:?crep=0.05")
