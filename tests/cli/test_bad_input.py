"""Every way to feed the program the wrong thing: a clear message, its exit code, nothing half-written."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from program import PROGRAM, pulsetrainer


@pytest.fixture
def ready(small_chain, tmp_path) -> Path:
    """A folder of the test's own with a small run, a model, a drive and a playback."""
    return Path(shutil.copytree(small_chain, tmp_path / "ready"))


def refused(folder: Path, words: list[object], code: int, *said: str, env=None) -> str:
    """Run a command that must fail: its code, what its message says, no traceback, no new file."""
    before = sorted(path.name for path in folder.rglob("*"))
    done = pulsetrainer(folder, *words, env=env)
    assert done.code == code, done
    assert "Traceback" not in done.err, done.err
    assert done.err.startswith(("error: ", "note: ")), done.err
    assert "\n  try: " in done.err, f"no next step in: {done.err}"
    for text in said:
        assert re.search(text, done.err), f"{text!r} not in: {done.err}"
    assert sorted(path.name for path in folder.rglob("*")) == before, "something was written"
    return done.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["identify", "model.h5", "-o", "x.h5"], ["model.h5", "expected a run", "got a model"]),
        (["identify", "played.h5", "-o", "x.h5"], ["played.h5", "expected a run", "got a playback"]),
        (["invert", "normal", "--model", "run.h5", "-o", "x.h5"], ["run.h5", "expected a model", "identify"]),
        (["play", "model.h5", "-o", "x.h5"], ["model.h5", "expected a waveform", "invert"]),
        (["evaluate", "drive.h5", "-o", "x.h5"], ["drive.h5", "waveform"]),
        (["identify", "absent.h5", "-o", "x.h5"], ["absent.h5"]),
    ],
)
def test_the_wrong_kind_of_file_names_both_kinds_and_the_next_step(ready, words, said):
    """Expected a model, got a run; run identify."""
    refused(ready, words, 3, *said)


def test_an_existing_output_is_refused_and_kept(ready):
    """Without --overwrite nothing is replaced; with it, it is."""
    before = (ready / "model.h5").read_bytes()
    refused(ready, ["identify", "run.h5", "-o", "model.h5"], 2, "model.h5 already exists", "--overwrite")
    refused(ready, ["capture", "identification", "-o", "model.h5"], 2, "model.h5 already exists")
    refused(ready, ["play", "drive.h5", "-o", "model.h5"], 2, "model.h5 already exists")
    refused(ready, ["plot", "run.h5", "-o", "model.h5"], 2)
    assert (ready / "model.h5").read_bytes() == before
    assert (
        pulsetrainer(ready, "identify", "run.h5", "--levels", "12", "-o", "model.h5", "--overwrite").code == 0
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t_s,current_A\n0,0\n1,0.1\n", ["force_N"]),
        ("t_s,current_A,force_N\n0,0,0\n1,nan,1\n2,1,2\n", ["current_A", "(line|row) 3|nan|NaN"]),
        ("t_s,current_A,force_N\n0,0,0\n2,1,1\n1,2,2\n", ["time", "increase"]),
        ("t_s,current_A,force_N\n0,0,0\n1,abc,1\n", ["abc", "line 3", "current_A"]),
        ("", ["empty"]),
    ],
    ids=["missing column", "NaN", "time goes back", "text", "empty"],
)
def test_import_names_file_and_column(run, tmp_path, text, said):
    """A table that cannot be used."""
    (tmp_path / "bad.csv").write_text(text)
    words = ["import", "bad.csv", "--input", "current_A", "--output", "force_N", "-o", "run.h5"]
    refused(tmp_path, words, 3, "bad.csv", *said)


def test_a_waveform_beyond_the_force_range_names_the_range(ready):
    """And a range that would do."""
    words = ["invert", "normal", "--model", "model.h5", "--force-max", "40", "-o", "x.h5"]
    refused(ready, words, 3, "40 N", r"reaches \d", "--force-max")


def test_a_damaged_file_is_named(ready, tmp_path):
    """Truncated, no HDF5 at all, HDF5 of somebody else, a folder."""
    whole = (ready / "run.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.h5").write_text("not HDF5")
    (tmp_path / "folder.h5").mkdir()
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.arange(3)
    for name in ("cut", "text", "folder", "other"):
        refused(tmp_path, ["identify", f"{name}.h5", "-o", "x.h5"], 3, f"{name}.h5")


def test_an_absent_port_is_exit_4(ready):
    """Named, with the next step."""
    refused(ready, ["capture", "identification", "--port", "/dev/ttyNONE", "-o", "x.h5"], 4, "/dev/ttyNONE")
    refused(ready, ["play", "drive.h5", "--port", "/dev/ttyNONE", "-o", "x.h5"], 4, "/dev/ttyNONE")


def test_an_unknown_bench_parameter_offers_the_nearest(ready):
    """bench:?crep is a typing error, not a device."""
    refused(
        ready, ["capture", "identification", "--port", "bench:?crep=0.1", "-o", "x.h5"], 2, "crep", "creep"
    )


def test_no_compiler_names_both_remedies(ready, tmp_path):
    """Without cc and without ziglang the bench cannot be built: exit 4."""
    env = {"PATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache"), "CC": ""}
    err = refused(ready, ["capture", "identification", "-o", "x.h5"], 4, "compiler", env=env)
    assert "ziglang" in err
    assert re.search(r"apt|gcc|build-essential", err)


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--rate", "1e-308", "the rate must divide the device's 10000 Hz, got 1e-308 Hz"),
        ("--rate", "1e308", "the rate must divide"),
        ("--speed", "1e-300", "would have 7.35e+304 samples"),
        ("--speed", "1e300", "from one sample to the next the signal would go 1e+297"),
        ("--current-max", "1e308", "would have inf samples"),
    ],
)
def test_numbers_no_device_can_follow_are_refused_before_anything_moves(run, option, value, said):
    """The smallest and the largest number of the machine: in words, also in a dry run."""
    for name in ("identification", "diagnostic") if option != "--speed" else ("identification",):
        shown = run("capture", name, option, value, "--dry-run", "-o", "never.h5")
        assert shown.code == 3
        assert said in shown.err
        assert "try:" in shown.err


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0,0\n,0.5\n0.2,1\n", "nan in column t_s, line 3"),
        ("0,0\n0.1,\n0.2,1\n", "nan in column {value}, line 3"),
        ("0,0\n0.1,inf\n0.2,1\n", "inf in column {value}, line 3"),
        ("0,0\n0.1,1\n0.1,0.5\n", "does not increase at line 4"),
        ("nan,0\nnan,1\nnan,0.5\n", "no numbers in column t_s"),
    ],
)
@pytest.mark.parametrize(
    ("words", "value"),
    [(("capture", "x.csv", "--dry-run"), "current_A"), (("invert", "x.csv", "--model", "model.h5"), "p")],
)
def test_tables_of_signals_and_pulses_are_refused_by_line(ready, words, value, rows, said):
    """Missing, infinite or repeated: whatever reads a time and a value names the line."""
    (ready / "x.csv").write_text(f"t_s,{value}\n{rows}")
    refused(ready, [*words, "-o", "never.h5"], 3, said.format(value=value))


@pytest.mark.parametrize(
    ("time", "top", "said"),
    [
        ("1e308", "1", "t_s, .* 1e.100"),
        ("3", "1e308", "p, .* 1e.100"),
        ("1e90", "1", "4 times 1e.93 samples"),
    ],
)
def test_pulses_beyond_all_numbers_are_refused_in_words(ready, time, top, said):
    """What no quantity reaches, and a period that no memory holds."""
    first = f"-{time}" if time == "1e308" else "0"
    (ready / "x.csv").write_text(f"t_s,p\n{first},-{top}\n1,0\n2,{top}\n{time},0.5\n")
    refused(ready, ["invert", "x.csv", "--model", "model.h5", "-o", "never.h5"], 3, said)


def test_libraries_warn_those_who_asked_for_details(ready):
    """A slope that overflows inside an interpolation is harmless: no line of source reaches a technician."""
    (ready / "steep.csv").write_text("t_s,p\n0,0\n1,1e-308\n2,0.5\n3,1\n4,0.2\n")
    words = ("invert", "steep.csv", "--model", "model.h5", "-o", "steep.h5", "--periods", "1", "--overwrite")
    assert "Warning" not in pulsetrainer(ready, *words).err
    assert "RuntimeWarning" in pulsetrainer(ready, "--verbose", *words).err


@pytest.mark.parametrize("command", ["capture", "show", "invert", "identify"])
def test_names_that_no_file_system_takes_are_refused_in_words(ready, command):
    """Five thousand letters, with and without a suffix that promises a file."""
    more = {"show": (), "invert": ("--model", "model.h5")}.get(command, ())
    out = () if command == "show" else ("-o", "never.h5")
    for name in ("x" * 5000, "x" * 5000 + ".csv"):
        refused(ready, [command, name, *more, *out], 3, "x{20}", "too long")


def test_a_signal_in_milliseconds_is_one(ready):
    """The unit in the heading counts, as it does for import."""
    (ready / "ms.csv").write_text("t_ms,current_A\n0,0\n500,1\n1000,0\n")
    plan = pulsetrainer(ready, "capture", "ms.csv", "--dry-run", "--json", "-o", "never.h5").json
    assert plan["samples"] == 1001


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("capture", "identification", "--repeats", "1000000"), "1000000 times 98001 samples"),
        (("invert", "normal", "--model", "model.h5", "--periods", "1000000"), "1000000 times 800 samples"),
        (("play", "drive.h5", "--repeats", "1000000"), "1000000 times [0-9]+ samples"),
    ],
)
def test_more_than_memory_and_days_can_hold_is_refused_at_once(ready, words, said):
    """The count of samples is told before they are made."""
    refused(ready, [*words, "-o", "never.h5"], 3, said, "are more than")


def test_usage_errors_are_exit_2_in_words(run):
    """A missing option, an unknown command, an unknown signal or waveform."""
    for words in (["identify", "run.h5"], ["frobnicate"], ["capture", "noise", "-o", "x.h5"]):
        done = run(*words)
        assert done.code == 2, done
        assert done.err.startswith("error: "), done.err
        assert "Traceback" not in done.err


def test_errors_are_json_too(run):
    """With --json stdout holds one object, also for an error."""
    done = run("identify", "absent.h5", "-o", "x.h5", "--json")
    assert done.code == 3
    assert done.json["schema"] == 1
    assert done.json["command"] == "identify"
    assert set(done.json["error"]) == {"kind", "message", "hint"}
    assert "absent.h5" in done.json["error"]["message"]


def test_brackets_in_names_are_no_markup(run, tmp_path):
    """Names such as [bold].h5 are printed as they are."""
    done = run("identify", "[bold]x[/red].h5", "-o", "x.h5")
    assert done.code == 3
    assert "[bold]x[/red].h5" in done.err


def test_control_c_stops_the_output_and_keeps_what_was_recorded(tmp_path):
    """At wall-clock speed: interrupted after some seconds, exit 130, a readable run with complete=false."""
    process = subprocess.Popen(
        [*PROGRAM, "capture", "identification", "--port", "bench:?speed=real", "-o", "run.h5"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ,
        # what runs in the background of a shell has SIGINT ignored, and hands that on
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - one thread
    )
    deadline = time.monotonic() + 60
    while not any(path.stat().st_size > 100_000 for path in tmp_path.iterdir()):  # recording has begun
        assert time.monotonic() < deadline, process.communicate(timeout=5)
        assert process.poll() is None, process.communicate()
        time.sleep(0.1)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, (out, err)
    assert "kept in run.h5" in err
    with h5py.File(tmp_path / "run.h5") as file:
        assert not file.attrs["complete"]
        kept = file["output"].shape[0]
    assert kept > 500
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    shown = pulsetrainer(tmp_path, "show", "run.h5", "--json")
    assert shown.json["facts"]["samples"] == kept
    assert shown.json["facts"]["complete"] is False
