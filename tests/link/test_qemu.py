"""The emulated Cortex-M4F behind ``--port qemu:``."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from pulsetrainer import doctor
from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import DeviceError, UsageError
from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation import build, emulator
from pulsetrainer.simulation.build import DEBIAN_PACKAGES
from pulsetrainer.simulation.options import BREAKS, QEMU_SETTINGS, QemuOptions, Wire, parse_qemu
from wording import raises

RANGE_A = 1.5
needs_emulator = pytest.mark.skipif(
    not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
    reason=f"needs apt-get install -y --no-install-recommends {DEBIAN_PACKAGES}",
)


def strokes(seconds: float) -> np.ndarray:
    """Four full strokes a second at 1 kHz, A."""
    return 0.75 - 0.75 * np.cos(2 * np.pi * 4 * np.arange(round(seconds * 1000)) / 1000)


def emulators(session: int) -> list[str]:
    """Emulators of this process session that are still running."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = stat.read_text(encoding="utf-8").rpartition(")")
        except OSError:
            continue
        state, _, _, in_session = rest.split()[:4]
        if int(in_session) == session and state != "Z":
            found.append(name)
    return found


def gone(session: int, seconds: float = 5.0) -> bool:
    """Whether nothing of the process session is left within a time."""
    deadline = time.monotonic() + seconds
    while emulators(session):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


# --- without an emulator ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("port", "says", "hint"),
    [
        ("qemu:?creep=0.05", "no parameter 'creep'", "bench:?"),
        ("qemu:fast", "not a port", "qemu:?break"),
        ("qemu:?", "not a port", "qemu:?break"),
        ("qemu:?break=leg@1", "cannot break 'leg@1'", "current-rail"),
        ("qemu:?break=hag", "did you mean hang", "break=WHAT@SECONDS"),
        ("qemu:?break=hang@soon", "cannot break 'hang@soon'", "break=WHAT@SECONDS"),
        ("qemu:?break=hang@", "cannot break 'hang@'", "break=WHAT@SECONDS"),
        ("qemu:?break=hang@1e9", "cannot break", "break=WHAT@SECONDS"),
        ("qemu:?ambient=warm", "qemu parameter ambient=warm", "ambient=20"),
        ("qemu:?coil=-1", "qemu parameter coil=-1", "ambient=20"),
        (
            "qemu:?wire=1",
            "qemu parameter wire must be the share of bytes to damage, from 0 to 0.1, got 1",
            '"qemu:?wire=0.0001"',
        ),
        (
            "qemu:?wire-seed=x",
            "qemu parameter wire-seed must be a whole number of up to nine digits, got x",
            "wire-seed",
        ),
    ],
)
def test_parameters_that_make_no_sense_teach(port, says, hint):
    """The plant of the image has no parameters, the bench's has; the rest is explained."""
    with raises(UsageError, "no such emulator", said=says, hint=hint):
        open_device(port)


def test_breaks_and_settings_are_put_where_the_firmware_looks_for_them():
    """Words of four bytes, as board.c has them from where mps2.ld says on; a tick more, as 0 is never."""
    source = (firmware_dir() / "port" / "mps2" / "board.c").read_text(encoding="utf-8")
    kept = source.partition("struct retained {")[2].partition("}")[0]
    place = 0x2000_0000 + 4 * kept.partition("break_tick")[0].removesuffix("uint32_t ").count("uint32_t")
    port = "qemu:?coil=3&" + "&".join(f"break={what}@{k}.5" for k, what in enumerate(BREAKS))
    ticks = [5_001 + 10_000 * k for k in range(len(BREAKS))]
    words = [(place + 4 * k, tick) for k, tick in enumerate(ticks)]
    words.append((place + 4 * len(BREAKS) + 12 + 4 * [*QEMU_SETTINGS].index("coil"), 0x4040_0000))  # 3.0
    told = emulator._loads(parse_qemu(port))
    assert told[1::2] == [f"loader,addr={at:#x},data={data:#x},data-len=4" for at, data in words]


def test_parameters_that_make_sense():
    """Breaks and a bad wire, in any number and order."""
    assert parse_qemu("qemu:") == parse_qemu("qemu://") == QemuOptions()
    port = "qemu:?break=reset@1.5&wire=1e-4&break=hang&wire-seed=7"
    assert parse_qemu(port) == QemuOptions(((8, 1.5), (9, 0.0)), Wire(1e-4, 7))
    assert parse_qemu("qemu:?ambient=-20&coil=3").settings == (("ambient", -20.0), ("coil", 3.0))


@pytest.mark.parametrize(
    "missing", [("qemu-system-arm",), ("arm-none-eabi-gcc",), ("qemu-system-arm", "arm-none-eabi-gcc")]
)
def test_what_is_missing_is_named_with_its_packages(monkeypatch, missing):
    """Neither comes with the package: all that is missing, how to get it, and the way without."""
    monkeypatch.setattr(shutil, "which", lambda name: None if name in missing else f"/usr/bin/{name}")
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda _: None)
    said = " and ".join(missing)
    with raises(DeviceError, "no emulator", missing=said, packages=DEBIAN_PACKAGES):
        open_device("qemu:")
    (found,) = doctor._emulator()
    assert said in found.found
    assert found.state == "warning"


def test_ziglang_stands_in_for_the_arm_compiler(monkeypatch):
    """Without root: the compiler from the package index builds the image too."""
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda _: object())
    assert build.find_arm_compiler()[:4] == [sys.executable, "-m", "ziglang", "cc"]
    monkeypatch.setattr(shutil, "which", {"qemu-system-arm": "/usr/bin/qemu-system-arm"}.get)
    assert [one.state for one in doctor._emulator()] == ["ok"]


# --- with one -----------------------------------------------------------------------------------


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_two_starts_are_told_apart():
    """It says who it is and why it started; the boot nonce differs from start to start."""
    nonces = set()
    for _ in range(2):
        with open_device("qemu:") as device:
            assert (device.info.serial, device.info.reset_cause) == ("QEMU-0", "power")
            assert device.info.build != "00000000"
            nonces.add(device._hello.boot_nonce)
    assert len(nonces) == 2


@pytest.fixture
def tell(capsys):
    """Print a measured figure past pytest's capture."""

    def say(text: str) -> None:
        with capsys.disabled():
            print("\n" + text)

    return say


def measure_pace(tell) -> float:
    """Play strokes for some ten seconds and return ticks over wall time; everything else must be right."""
    arrivals: list[tuple[float, int]] = []
    with open_device("qemu:") as device:
        recording = device.play(
            strokes(10.5), 1000, on_block=lambda b: arrivals.append((time.monotonic(), int(b.tick[-1])))
        )
    assert "missed its tick" not in recording.fault
    if not recording.complete:  # the computer was away: the device saw a silent host and did its duty
        tell(f"stopped: {recording.fault}")
        return 0.0
    # Some blocks after the start: the emulator has caught up by then.
    (first_s, first), (last_s, last) = arrivals[10], arrivals[-1]
    ratio = (last - first) / 10_000 / (last_s - first_s)
    error = np.abs(recording.current_A - recording.reference_A).max() / RANGE_A
    tell(
        f"qemu: ticks/wall {ratio:.4f} over {last_s - first_s:.1f} s, lost {recording.dropped_samples}, "
        f"tracking error {100 * error:.2f} % of the range"
    )
    assert last_s - first_s > 9.9
    assert recording.dropped_samples == 0
    np.testing.assert_array_equal(recording.tick, 10 * np.arange(len(recording.tick)))
    assert error < 0.01
    return ratio


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_ten_seconds_of_strokes_at_the_pace_of_the_wall_clock(tell):
    """Ticks over wall time 0.99 to 1.01 with telemetry on, no tick or sample lost, tracking under 1 %."""
    ratios: list[float] = []
    while len(ratios) < 3:  # a computer busy with something else may take the emulator's time away
        ratios.append(measure_pace(tell))
        if 0.99 < ratios[-1] < 1.01:
            return
    pytest.fail(f"ticks/wall {ratios}")


@needs_emulator
@pytest.mark.realtime
def test_reference_is_the_one_of_the_bench(tell):
    """The same core plays the same reference: equal at every tick, whatever the processor."""
    with open_device("qemu:") as device:
        emulated = device.play(strokes(1), 1000, decimation=1)
    with open_device("bench:") as device:
        native = device.play(strokes(1), 1000, decimation=1)
    assert emulated.complete
    received = np.isin(native.tick, emulated.tick)
    np.testing.assert_array_equal(emulated.reference_A, native.reference_A[received])
    # Noise of its own, and the plant in single precision: 2 counts of current.
    assert np.abs(emulated.current_A - native.current_A[received]).max() < 0.005
    for name, recording in (("host", native), ("cortex-m4f", emulated)):
        error = np.abs(recording.current_A - recording.reference_A).max() / RANGE_A
        tell(f"{name}: 4 Hz full strokes, tracking error at 10 kHz {100 * error:.2f} % of the range")
        assert error < 0.01


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_a_wave_without_a_known_end_is_played_to_its_end():
    """Made in pieces while it is played: every sample is there, nothing came too late."""
    for _ in range(3):  # a computer busy with something else may be away for longer than the heartbeat
        pieces = iter(np.split(strokes(6), 12))
        with open_device("qemu:") as device:
            trace = device.stream(lambda pieces=pieces: next(pieces, None), 1000, lead_s=1.0)
        if trace.complete:
            break
    assert (trace.fault, trace.underrun) == ("", False)
    assert trace.samples + trace.dropped_samples == 6000


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_step_settles_quickly(tell):
    """A step of two thirds of the range: settled into 1 % of the range soon after the slew limit lets it."""
    at, low, high = 500, 0.2, 1.2  # all of it fits the buffer: the line is too slow to stream at 10 kHz
    slewed_s = (high - low) / 150  # 15 mA a tick
    reference = np.where(np.arange(1000) < at, low, high)
    for port in ("bench:", "qemu:"):
        with open_device(port) as device:
            recording = device.play(reference, 10_000, decimation=1)
        assert recording.complete
        after = recording.current_A[recording.tick >= at]
        outside = np.flatnonzero(np.abs(after - high) > 0.01 * RANGE_A)
        settling_s = (outside.max() + 1) / 10_000
        overshoot = (after.max() - high) / (high - low)
        tell(
            f"{port} step of {high - low:g} A: settling {1000 * settling_s:.1f} ms "
            f"({1000 * slewed_s:.1f} of it the slew limit), overshoot {100 * overshoot:.2f} % of the step"
        )
        assert settling_s < slewed_s + 0.0035
        # The current filter is late: at the corner of the ramp the loop still believes to be behind.
        assert overshoot < 0.05


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_bad_wire_costs_counted_samples_only(seed, tell):
    """Three bad bytes in ten thousand: played to its end, each reference right, the lost ones counted."""
    reference = strokes(6)
    for _ in range(3):  # a computer busy with something else may be away for longer than the heartbeat
        with open_device(f"qemu:?wire=0.0003&wire-seed={seed}") as device:
            recording = device.play(reference, 1000)
            wire = device._port.transport
        if "heard nothing" not in recording.fault:
            break
        tell(f"stopped: {recording.fault}")
    lost = recording.dropped_samples
    tell(
        f"qemu: bad wire, seed {seed}: {wire.to_host.damaged.total()} + {wire.to_device.damaged.total()} "
        f"hurts, {lost} of {len(reference)} samples lost"
    )
    assert recording.complete, recording.fault
    assert 0 < lost == len(reference) - len(recording.tick)
    sent = np.rint(reference / 1e-4)[recording.tick // 10]
    np.testing.assert_array_equal(np.rint(recording.reference_A / 1e-4), sent)
    assert np.abs(recording.current_A - recording.reference_A).max() < 0.01 * RANGE_A


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_an_emulator_that_dies_leaves_what_was_recorded():
    """Killed in mid-play: the recording is kept, incomplete, and says why."""
    with open_device("qemu:") as device:
        session = device._port.machine.pid

        def kill(block):
            if block.tick[-1] > 2000:
                os.killpg(session, signal.SIGKILL)

        recording = device.play(strokes(5), 1000, on_block=kill)
    assert not recording.complete
    assert "the port qemu: is gone" in recording.fault
    assert 200 <= len(recording.tick) < 4000
    assert gone(session)


@needs_emulator
def test_an_emulator_that_will_not_start_is_quoted(monkeypatch):
    """What the emulator complained about reaches the user."""
    monkeypatch.setattr("pulsetrainer.simulation.emulator._REAL_TIME", "shift=nonsense")
    with raises(DeviceError, "names it", named="shift"):
        open_device("qemu:")


HOST = """
import sys
import pulsetrainer.simulation
from pulsetrainer.device.opening import open_device
device = open_device("qemu:")
print(device._port.machine.pid, flush=True)
device.play([0.5] * 60_000, 1000)
"""


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
@pytest.mark.parametrize("how", ["close", "SIGKILL", "SIGTERM"])
def test_no_emulator_is_left_behind(how):
    """However the host program ends, its emulator ends too."""
    if how == "close":
        with open_device("qemu:") as device:
            session = device._port.machine.pid
            assert any("qemu" in name for name in emulators(session))
    else:
        host = subprocess.Popen([sys.executable, "-c", HOST], stdout=subprocess.PIPE, text=True)
        assert host.stdout is not None
        session = int(host.stdout.readline())
        assert any("qemu" in name for name in emulators(session))
        host.send_signal(signal.Signals[how])
        host.communicate()
    assert gone(session)


@needs_emulator
@pytest.mark.realtime
def test_commands_take_the_port_unchanged(tmp_path):
    """`pulsetrainer capture FILE.csv --port qemu:` and `show` of what it wrote."""
    table = tmp_path / "strokes.csv"
    rows = "".join(f"{k / 1000:.3f},{value:.4f}\n" for k, value in enumerate(strokes(1)))
    table.write_text("time_s,current_A\n" + rows, encoding="utf-8")
    program = [sys.executable, "-m", "pulsetrainer"]
    words = ["capture", str(table), "--port", "qemu:", "-o", "run.h5"]
    for command in (words, ["show", "run.h5"]):
        done = subprocess.run(
            [*program, *command], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
        )
        assert done.returncode == 0, done.stderr
    assert "QEMU-0" in done.stdout


@needs_emulator
@pytest.mark.realtime
@pytest.mark.slow
def test_a_warmer_room_reaches_the_emulated_device():
    """40 K: the force is 0.00195 a kelvin lower, with the same current."""
    means = []
    for port in ("qemu:", "qemu:?ambient=40"):
        with open_device(port) as device:
            recording = device.play(np.full(700, 1.0), 1000)
        assert recording.complete, recording.fault
        means.append(recording.force_N[300:].mean())
    assert means[1] / means[0] == pytest.approx(1 - 0.00195 * 40, rel=0.01)
