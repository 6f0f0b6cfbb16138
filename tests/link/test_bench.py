"""The bench: its port's text, its compiler, its process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import DeviceError, UsageError
from pulsetrainer.simulation import build
from pulsetrainer.simulation.bench import Bench
from pulsetrainer.simulation.options import (
    BREAKS,
    QEMU_SETTINGS,
    BenchOptions,
    Wire,
    in_real_time,
    parse_bench,
    serial_of,
)
from wording import raises


@pytest.mark.parametrize(
    ("port", "options"),
    [
        ("bench:", BenchOptions()),
        ("bench://", BenchOptions()),
        ("bench:?ideal", BenchOptions(ideal=True)),
        ("bench:?ideal=1&speed=real", BenchOptions(ideal=True, speed="real")),
        ("bench:?seed=3&creep=0.05", BenchOptions(settings=(("seed", "3"), ("creep", "0.05")))),
        ("bench:?seed=3&serial=4", BenchOptions(settings=(("seed", "3"),), serial="4")),
        ("bench:?break=reset@2", BenchOptions(breaks=("reset@2",))),
        ("bench:?wire=1e-4&wire-seed=3", BenchOptions(wire=Wire(1e-4, 3))),
    ],
)
def test_ports_that_make_sense(port, options):
    """The text of a bench port is taken apart."""
    assert parse_bench(port) == options
    assert parse_bench(in_real_time(port)).speed == (options.speed if "speed" in port else "steady")


@pytest.mark.parametrize(
    "port", ["bench:?speed=max", "bench:?seed=3&speed=max", "qemu:", "/dev/ttyUSB0", "auto"]
)
def test_a_port_keeps_the_speed_that_it_names(port):
    """And a device has its own."""
    assert in_real_time(port) == port


@pytest.mark.parametrize(
    "port",
    [
        "bench",
        "bench:ideal",
        "bench:?speed=fast",
        "bench:?ideal=yes",
        "bench:?wire=much",
        "bench:?wire=0.2",
        "bench:?wire=nan",
        "bench:?wire-seed=-1",
        "bench:?serial=A1",
    ],
)
def test_ports_that_do_not(port):
    """What cannot be understood is a usage error with an example."""
    with pytest.raises(UsageError) as caught:
        parse_bench(port)
    assert "bench:" in caught.value.hint


@pytest.mark.parametrize(
    ("port", "message", "hint"),
    [
        ("bench:?crep=1", "no parameter 'crep'", "creep"),
        (
            "bench:?zzzz=1",
            "no parameter 'zzzz'",
            "plant/solenoid_params.c lists, such as noise",
        ),
        ("bench:?friction=1", "no parameter 'friction'", "did you mean coulomb?"),
        ("bench:?drift=1", "no parameter 'drift'", "did you mean thermal-drift or offset-drift?"),
        ("bench:?creep=7", "creep=7 is outside 0 to 0.5", "give creep a value in that range; it sets: "),
        ("bench:?creep=lots", "creep=lots is not a number from 0 to 0.5", ""),
        ("bench:?creep=", "creep= is not a number from 0 to 0.5", ""),
        ("bench:?seed=3,creep=0.1", "seed=3,creep=0.1 is not", "put & between"),
        ("bench:?break=leg@1", "cannot break 'leg@1'", "current-rail"),
        ("bench:?break=reset@1&break=leg@1", "cannot break 'leg@1'", "current-rail"),
        ("bench:?break=reset@soon", "cannot break 'reset@soon'", "WHAT@SECONDS"),
    ],
)
def test_unknown_and_impossible_parameters_teach(port, message, hint):
    """Name, range and meaning of what was mistyped."""
    with pytest.raises(UsageError) as caught:
        Bench(port)
    assert message in caught.value.message
    assert hint in caught.value.hint


def test_what_can_break_is_what_the_firmware_lists():
    """One list in Python, one in C: the same names in the same order."""
    told = subprocess.check_output([str(build.firmware_executable()), "--list"], text=True)
    assert tuple(told.partition("\n\n")[2].split()) == BREAKS


def test_what_the_emulated_device_takes_has_the_ranges_that_the_firmware_lists():
    """Its image does not refuse a value itself: the host must know the ranges."""
    told = subprocess.check_output([str(build.firmware_executable()), "--list"], text=True)
    rows = [line.split("\t") for line in told.partition("\n\n")[0].splitlines()]
    ranges = {row[0]: (float(row[2]), float(row[3])) for row in rows}
    assert {name: ranges[name] for name in QEMU_SETTINGS} == QEMU_SETTINGS


def _executable(cache: str) -> str:
    os.environ["XDG_CACHE_HOME"] = cache
    return str(build.firmware_executable())


@pytest.mark.slow
def test_two_processes_may_build_at_once(tmp_path):
    """Both get the same whole executable, nothing half-made stays behind."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        first, second = pool.map(_executable, [str(tmp_path)] * 2)
    assert first == second
    assert [p.name for p in Path(first).parent.iterdir()] == [Path(first).name]


def test_the_cache_is_used(monkeypatch):
    """A second call compiles nothing; other flags are another executable."""
    first = build.firmware_executable()
    monkeypatch.setattr(build.subprocess, "run", lambda *_, **__: pytest.fail("compiled again"))
    assert build.firmware_executable() == first


def test_without_a_compiler_both_remedies_are_named(monkeypatch):
    """No cc, no ziglang: a device error with both ways out."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(build.shutil, "which", lambda _: None)
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(DeviceError) as caught:
        build.firmware_executable()
    assert caught.value.exit_code == 4
    assert "apt install gcc" in caught.value.hint
    assert "pip install ziglang" in caught.value.hint


def test_ziglang_is_used_where_there_is_no_cc(monkeypatch):
    """The package index's compiler steps in."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(build.shutil, "which", lambda _: None)
    monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: name == "ziglang" or None)
    assert build.find_compiler() == [sys.executable, "-m", "ziglang", "cc"]


def test_a_compiler_that_fails_is_quoted(monkeypatch, tmp_path):
    """The compiler's own words are in the error, nothing is cached."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with raises(DeviceError, "does not compile"):
        build.firmware_executable(("-DPT_PROTOCOL_MAJOR=not a number",))
    assert list((tmp_path / "pulsetrainer" / "firmware").iterdir()) == []


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_is_done_without(monkeypatch, tmp_path):
    """A file where the cache folder should be: compiled once for this process, where there is any room."""
    (tmp_path / "pulsetrainer").write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made = tmp_path / "made"
    monkeypatch.setattr(build.tempfile, "mkdtemp", lambda **_: made)
    build._folder_of_this_process.cache_clear()
    assert {build.firmware_executable(), build.firmware_executable()} == set(made.iterdir())
    build._folder_of_this_process.cache_clear()

    def nowhere(**_):
        raise OSError("no room")

    monkeypatch.setattr(build.tempfile, "mkdtemp", nowhere)
    with raises(DeviceError, "no cache", folder=tmp_path):
        build.firmware_executable()


def _gone(pid: int, seconds: float = 10.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        stat = Path(f"/proc/{pid}/stat")
        try:
            if stat.read_text(encoding="utf-8").rpartition(")")[2].split()[0] == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False


HOST = """
import signal
import numpy as np
import pulsetrainer.simulation
from pulsetrainer.device.opening import open_device
signal.signal(signal.SIGINT, signal.default_int_handler)  # tests run in the background have it ignored
device = open_device("bench:?speed=real")
def tell(block):
    print(device._port.machine.pid, block.tick[-1], flush=True)
recording = device.play(np.full(60_000, 0.5), 1000, on_block=tell)
device.close()
print("END", recording.complete, recording.fault, len(recording.tick), recording.dropped_samples, flush=True)
"""


@pytest.fixture
def host():
    """A program that plays for a minute; its firmware process's id once it plays."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOST], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    pid = int(process.stdout.readline().split()[0])
    yield process, pid
    process.kill()
    process.communicate()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the process in /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_host_killed_in_mid_play_leaves_no_process(host, how):
    """However the host program ends, its firmware process ends too."""
    process, pid = host
    assert not _gone(pid, 0.1)
    process.send_signal(how)
    process.wait()
    assert _gone(pid)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the process in /proc")
def test_ctrl_c_in_the_terminal_stops_the_device_in_order(host):
    """SIGINT to the whole process group: the record until then is whole, the firmware process gone."""
    process, pid = host
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    out, _ = process.communicate(timeout=20)
    end = out.splitlines()[-1].split()
    assert end[:3] == ["END", "False", "interrupted"]
    assert int(end[3]) > 300
    assert end[4] == "0"
    assert _gone(pid)


@pytest.mark.realtime
@pytest.mark.parametrize(("speed", "goes_on"), [("steady", True), ("real", False)])
def test_a_steady_bench_waits_for_a_busy_computer(speed, goes_on):
    """A host that is held up for longer than the heartbeat; on a real device it would be gone."""
    job = HOST.replace("speed=real", f"speed={speed}").replace("60_000", "2_000")
    process = subprocess.Popen([sys.executable, "-c", job], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.35)
    process.send_signal(signal.SIGCONT)
    end = process.communicate(timeout=30)[0].splitlines()[-1].split()
    assert end[:2] == ["END", str(goes_on)]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads processor time from /proc")
def test_an_idle_bench_costs_nothing():
    """An open, disarmed bench sleeps."""
    with open_device("bench:") as device:
        stat = Path(f"/proc/{device._port.machine.pid}/stat")

        def ticks() -> int:
            fields = stat.read_text(encoding="utf-8").rpartition(")")[2].split()
            return int(fields[11]) + int(fields[12])

        before = ticks()
        time.sleep(0.5)
        assert ticks() - before <= 2


def test_the_firmware_runs_alone_from_a_terminal():
    """Without a leash it serves until its host closes the pty."""
    process = subprocess.Popen(
        [str(build.firmware_executable())], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    path = process.stdout.readline().strip()
    with open_device(path) as device:
        assert device.play([0.1, 0.2], 1000).complete
    assert process.wait(timeout=10) == 0
    process.stdout.close()


@pytest.mark.parametrize(
    "words", [["--set", "creep"], ["--speed", "slow"], ["--what"], ["--break", "it"], ["--set"]]
)
def test_the_firmware_refuses_bad_arguments(words):
    """Exit status 2 and a line that says why."""
    done = subprocess.run(
        [str(build.firmware_executable()), *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.strip()


@pytest.mark.parametrize(
    ("port", "serial"),
    [
        ("bench:", "BENCH-0"),
        ("bench:?seed=3&noise-seed=5", "BENCH-3"),
        ("bench:?seed=16777215", "BENCH-16777215"),
        ("bench:?seed=9&serial=4", "BENCH-4"),
    ],
)
def test_another_seed_is_another_device(port, serial):
    """By its serial number, so that gains, heat and models of one are not taken for those of another."""
    with open_device(port) as device:
        assert device.info.serial == serial
    assert serial_of(port) == serial
