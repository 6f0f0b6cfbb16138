"""Trouble with the device at the command line: a message and remedy of its own, the recorded part kept."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
import tty
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from program import PROGRAM, Ran, pulsetrainer, until_recorded
from pulsetrainer import load, save
from pulsetrainer.device.codes import PROTOCOL_MAJOR, PROTOCOL_MINOR
from pulsetrainer.device.opening import open_device
from pulsetrainer.simulation.build import firmware_executable
from wording import refusal

DRIVE = Path(__file__).parents[1] / "data/files-0.1/drive.h5"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="the bench needs a pty")


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with ten seconds of a slow wave to capture."""
    t = np.arange(0, 10, 0.05)
    table = np.column_stack([t, 0.5 - 0.4 * np.cos(2 * np.pi * t / 2)])
    np.savetxt(tmp_path / "wave.csv", table, delimiter=",", header="t_s,current_A", comments="")
    return tmp_path


def capture(port: str, *more: str) -> list[str]:
    """Return the words of a capture without conditioning."""
    return ["capture", "wave.csv", "--port", port, "--no-condition", "-o", "run.h5", *more]


@pytest.fixture
def firmware():
    """A firmware process on a pty of its own, as a foreign device would be; call with flags and options."""
    running: list[subprocess.Popen[str]] = []

    def start(*options: str, defines: tuple[str, ...] = ()) -> tuple[str, subprocess.Popen[str]]:
        words = [str(firmware_executable(defines)), "--leash", *options]
        process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        running.append(process)
        assert process.stdout is not None
        return process.stdout.readline().strip(), process

    yield start
    for process in running:
        process.kill()
        process.communicate()


def refused(folder: Path, port: str, name: str, **names: object) -> None:
    """Capture must fail before it begins: exit 4, a message of the table, no file."""
    refusal(pulsetrainer(folder, *capture(port, "--json")), 4, name, port=port, **names)
    assert sorted(p.name for p in folder.iterdir()) == ["wave.csv"]


def kept(folder: Path, least: int) -> int:
    """The run was kept: readable, complete=false, nothing else left behind; return its samples."""
    assert sorted(p.name for p in folder.iterdir()) == ["run.h5", "wave.csv"]
    with h5py.File(folder / "run.h5") as file:
        assert not file.attrs["complete"]
        time_s = file["time"][:]
    assert len(time_s) >= least
    assert np.all(np.diff(time_s) > 0)
    shown = pulsetrainer(folder, "show", "run.h5", "--json")
    assert shown.json["facts"]["complete"] is False
    assert shown.json["facts"]["samples"] == len(time_s)
    return len(time_s)


def _started(folder: Path, port: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*PROGRAM, *capture(port)], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.parametrize(("step", "name"), [(-1, "older device"), (1, "older program")])
def test_another_protocol_names_both_versions_and_who_is_older(folder, firmware, step, name):
    """Exit 4 before anything moves."""
    major, minor = PROTOCOL_MAJOR, PROTOCOL_MINOR
    port, _ = firmware(defines=(f"-DPT_PROTOCOL_MAJOR={major + step}u",))
    refused(
        folder, port, name, theirs=f"speaks protocol {major + step}.", ours=f"this program {major}.{minor}"
    )


@pytest.mark.parametrize(
    ("define", "version", "name"),
    [
        ("-DPT_FIRMWARE_MAJOR=1u", "1.", "older program"),
        ("-DPT_FIRMWARE_MINOR=0u", "0.0.", "older device"),
    ],
)
def test_another_firmware_names_both_versions_and_who_is_older(folder, firmware, define, version, name):
    """The same protocol but another generation of firmware: exit 4 before anything moves."""
    port, _ = firmware(defines=(define,))
    refused(folder, port, name, theirs=f"firmware {version}", ours="this program's firmware 0.")


@pytest.mark.slow
def test_a_device_that_is_not_ours(folder):
    """Something talks behind the port, but not our protocol."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    stop = threading.Event()

    def talk() -> None:
        while not stop.wait(0.02):
            try:
                os.write(ours, b"$GPGGA,123519,4807.038,N*47\r\n")
            except BlockingIOError:
                continue

    talker = threading.Thread(target=talk, daemon=True)
    talker.start()
    try:
        refused(folder, os.ttyname(theirs), "not our device")
    finally:
        stop.set()
        talker.join()
        os.close(ours)
        os.close(theirs)


def test_a_second_program_on_the_port(folder, firmware):
    """The port is busy, and the one that has it is not disturbed."""
    port, _ = firmware()
    with open_device(port) as device:
        refused(folder, port, "port is busy")
        assert device.play([0.1, 0.2], 1000).complete


@pytest.mark.slow
@pytest.mark.realtime
def test_a_port_that_vanishes_in_mid_capture(folder, firmware):
    """The device pulled out: told as such, what came until then is kept."""
    port, device = firmware("--speed", "real")
    process = _started(folder, port)
    until_recorded(folder, 60_000, process)
    time.sleep(1.0)
    device.kill()
    _, err = process.communicate(timeout=30)
    refusal(Ran(process.returncode, "", err), 4, "port is gone")
    assert kept(folder, 900) < 10_000


@pytest.mark.realtime
def test_a_host_that_is_stopped_finds_the_device_off(folder):
    """Asleep for a second, buffers full: the device switched off by itself, says why, the part is kept."""
    process = _started(folder, "bench:?speed=real")
    until_recorded(folder, 60_000, process)
    process.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    process.send_signal(signal.SIGCONT)
    _, err = process.communicate(timeout=30)
    refusal(Ran(process.returncode, "", err), 4, "host was silent")
    kept(folder, 100)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds the device's process in /proc")
def test_a_computer_that_falls_asleep_is_no_silent_host(folder):
    """Host and emulated device asleep for a second, the device awake first: it waits, nothing is lost."""
    table = np.loadtxt(folder / "wave.csv", delimiter=",", skiprows=1)
    t = np.arange(0, 120, 0.05)
    np.savetxt(
        folder / "wave.csv",
        np.column_stack([t, np.interp(t % 10, *table.T)]),
        delimiter=",",
        header="t_s,current_A",
        comments="",
    )
    process = _started(folder, "bench:")
    until_recorded(folder, 60_000, process)
    (device,) = map(int, Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split())
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.2)  # the device waits for its host
    os.kill(device, signal.SIGSTOP)
    time.sleep(1.2)  # a write of the host's may take 2 s
    os.kill(device, signal.SIGCONT)
    time.sleep(0.1)
    process.send_signal(signal.SIGCONT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, (out, err)
    with h5py.File(folder / "run.h5") as file:
        assert file.attrs["complete"]
        assert file["time"][-1] > 119


@pytest.mark.slow
@pytest.mark.parametrize(
    "what", ["force-high", "current-rail", "force-frozen", "tick-overrun", "reset", "hang"]
)
def test_what_breaks_in_mid_capture_is_told_and_the_part_kept(folder, what):
    """The device's first cause is the message; two seconds are in the file."""
    wave = np.column_stack([[0, 1, 2, 3, 4, 5], [0, 1.5, 0, 1.5, 0, 1.5]])
    np.savetxt(folder / "wave.csv", wave, delimiter=",", header="t_s,current_A", comments="")
    done = pulsetrainer(folder, *capture(f"bench:?break={what}@2", "--json"))
    refusal(done, 4, what)
    # what a broken force sensor told would stay in the record
    then = {
        "force-frozen": "--overwrite",
        "current-rail": "--resume",
        "reset": "--resume",
        "hang": "--resume",
    }
    assert then.get(what, "") in done.json["error"]["hint"]
    assert ("--resume" in done.json["error"]["hint"]) == (
        what in ("current-rail", "tick-overrun", "reset", "hang")
    )
    assert 1900 < kept(folder, 1900) < 4600


@pytest.mark.parametrize(
    ("what", "at_s", "stroke_A"),
    [
        ("force-zero", 0.0, 1.5),
        ("force-zero", 0.0, 0.4),
        ("force-zero", 5.9, 0.8),
        ("force-frozen", 0.0, 1.25),
        ("force-frozen", 5.9, 0.8),
        ("force-half", 0.0, 1.2),
    ],
)
def test_a_play_whose_force_reading_is_dead_stuck_or_half_never_ends_well(tmp_path, what, at_s, stroke_A):
    """From the start or in the last moments of the first play, with a limit that it can not trip: exit 4."""
    drive = load(DRIVE)
    scale = stroke_A / float(drive.compensated.max())
    nothing_foretold = np.full(drive.time_s.size, np.nan)
    drives = {"compensated": scale * drive.compensated, "scaled": scale * drive.scaled}
    save(replace(drive, predicted=nothing_foretold, **drives), tmp_path / "drive.h5")
    words = ["play", "drive.h5", "-o", "played.h5", "--port", f"bench:?break={what}@{at_s}", "--json"]
    refusal(
        pulsetrainer(tmp_path, *words, "--limit-force", "5" if what == "force-zero" and not at_s else "14"),
        4,
        "force reading",
    )


def test_a_play_that_ends_in_its_first_repeat_says_that_nothing_was_written(tmp_path):
    """Both drives belong to a repeat; half of one is no playback."""
    words = ["play", str(DRIVE), "-o", "played.h5", "--port", "bench:?break=reset@1", "--json"]
    refusal(pulsetrainer(tmp_path, *words), 4, "no whole repeat", file="played.h5")
    assert not (tmp_path / "played.h5").exists()


def test_losses_on_a_bad_wire_are_in_the_file(folder):
    """A capture through a bad wire is complete, and says how many samples it lacks."""
    done = pulsetrainer(folder, *capture("bench:?wire=0.0005&wire-seed=4", "--json"))
    assert done.code == 0, done
    with h5py.File(folder / "run.h5") as file:
        assert file.attrs["complete"]
        dropped = int(file.attrs["dropped_samples"])
        samples = file["time"].shape[0]
        header = str(dict(file.attrs))
    assert dropped > 0
    assert samples + dropped == 9951
    assert "wire" not in header
    shown = pulsetrainer(folder, "show", "run.h5", "--json").json
    assert shown["facts"]["dropped_samples"] == dropped


@pytest.mark.slow
def test_a_stranger_that_holds_the_port_open_is_no_hang(folder):
    """Nobody behind the port: an answer within seconds."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    try:
        begun = time.monotonic()
        refused(folder, os.ttyname(theirs), "nobody answers")
        assert time.monotonic() - begun < 20
    finally:
        os.close(ours)
        os.close(theirs)
