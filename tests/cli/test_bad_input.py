"""Every way to feed the program the wrong thing: a clear message, its exit code, nothing half-written."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import pulsetrainer as pt
from command_lines import EXCITATION
from program import PROGRAM, Ran, pulsetrainer, until_recorded
from wording import refusal, tells

MODEL = ("--model", "model.h5", "-o", "x.h5")
OUT = ("-o", "x.h5")
KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"


@pytest.fixture
def ready(small_chain, tmp_path) -> Path:
    """A folder of the test's own with a small run, a model, a drive and a playback."""
    return Path(shutil.copytree(small_chain, tmp_path / "ready"))


def refused(folder: Path, words: list[object], code: int, name: str, env=None, **names: object) -> None:
    """Run a command that must fail: its code and kind, its row of the table of messages, no new file."""
    before = sorted(path.name for path in folder.rglob("*"))
    refusal(pulsetrainer(folder, *words, "--json", env=env), code, name, **names)
    assert sorted(path.name for path in folder.rglob("*")) == before, "something was written"


@pytest.mark.parametrize(
    ("words", "file", "expected", "got", "verb"),
    [
        (["identify", "model.h5", "-o", "x.h5"], "model.h5", "a run", "a model", "show model.h5"),
        (["identify", "played.h5", "-o", "x.h5"], "played.h5", "a run", "a playback", "capture"),
        (["invert", "normal", "--model", "run.h5", "-o", "x.h5"], "run.h5", "a model", "a run", "identify"),
        (["play", "model.h5", "-o", "x.h5"], "model.h5", "a drive", "a model", "invert"),
        (
            ["evaluate", "drive.h5", "-o", "x.h5"],
            "drive.h5",
            "a playback, a run or a session",
            "a drive",
            "play",
        ),
    ],
)
def test_the_wrong_kind_of_file_names_both_kinds_and_the_next_step(ready, words, file, expected, got, verb):
    """Expected a model, got a run; run identify."""
    refused(ready, words, 3, "wrong kind", file=file, expected=expected, got=got, verb=verb)


def test_an_absent_file_is_named_with_those_that_are_there(ready):
    """A name that was mistyped."""
    refused(ready, ["identify", "absent.h5", "-o", "x.h5"], 3, "absent", file="absent.h5", near="run.h5")


def test_no_damaged_file_is_offered(ready):
    """Cut, flipped, empty, junk: none of them is a next step, whether by kind or by name."""
    whole = (ready / "run.h5").read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for name, content in {"cut": whole[:middle], "flipped": flipped, "empty": b"", "junk": b"junk"}.items():
        (ready / f"run-{name}.h5").write_bytes(content)
    (ready / "run-x.csv").touch()
    for words in (["identify", "run-.h5", "-o", "x.h5"], ["show", "run-.h5"], ["diagnose", "run-.h5", *MODEL],
                  ["import", "run-.h5", "--input", "u", "--output", "y", "-o", "x.h5"],
                  ["capture", "run-.csv", "-o", "x.h5"]):  # fmt: skip
        done = pulsetrainer(ready, *words)
        assert done.code == 3, done
        assert not [file.name for file in ready.glob("run-*") if file.name in done.err], done.err
    assert "run.h5" in pulsetrainer(ready, "show", "run-.h5").err


def test_an_existing_output_is_refused_and_kept(ready):
    """Without --overwrite nothing is replaced; with it, it is."""
    before = (ready / "model.h5").read_bytes()
    refused(ready, ["identify", "run.h5", "-o", "model.h5"], 2, "exists", file="model.h5")
    refused(ready, ["capture", "identification", "-o", "model.h5"], 2, "exists", file="model.h5")
    refused(ready, ["play", "drive.h5", "-o", "model.h5"], 2, "exists", file="model.h5")
    refused(ready, ["plot", "run.h5", "-o", "model.h5"], 2, "no such figure", file="model.h5")
    for words in (("identify", "run.h5"), ("capture", "identification")):  # only a recording can go on
        done = pulsetrainer(ready, *words, "-o", "model.h5")
        assert ("--resume" in done.err) is (words[0] == "capture")
    assert (ready / "model.h5").read_bytes() == before


def test_a_number_without_an_upper_end_is_told_its_lower_one(ready):
    """What it must be, and what it was."""
    done = pulsetrainer(ready, "identify", "run.h5", *OUT, "--seed", "-1")
    assert done.code == 2
    assert "--seed must be a whole number, 0 or more, got -1" in " ".join(done.err.split())
    page = ["evaluate", "played.h5", "-o", "x.h5", "--html", "./x.h5", "--overwrite"]
    refused(ready, page, 2, "two outputs", file="x.h5")
    assert (
        pulsetrainer(ready, "identify", "run.h5", "--levels", "12", "-o", "model.h5", "--overwrite").code == 0
    )


@pytest.mark.parametrize(
    ("text", "name", "names"),
    [
        ("t_s,current_A\n0,0\n1,0.1\n", "no such column", {}),
        (
            "t_s,current_A,force_N\n0,0,0\n1,nan,1\n2,1,2\n",
            "not finite",
            {"value": "'nan'", "column": "current_A", "line": 3},
        ),
        ("t_s,current_A,force_N\n0,0,0\n2,1,1\n1,2,2\n", "time goes back", {}),
        ("t_s,current_A,force_N\n0,0,0\n1,abc,1\n", "not a number", {}),
        ("", "empty", {}),
    ],
    ids=["missing column", "NaN", "time goes back", "text", "empty"],
)
def test_import_names_file_and_column(run, tmp_path, text, name, names):
    """A table that cannot be used."""
    (tmp_path / "bad.csv").write_text(text)
    words = ["import", "bad.csv", "--input", "current_A", "--output", "force_N", "-o", "run.h5"]
    refused(tmp_path, words, 3, name, file="bad.csv", **names)


def test_a_waveform_beyond_the_force_range_names_the_range(ready):
    """And a range that would do."""
    words = ["invert", "normal", "--model", "model.h5", "--force-max", "40", "-o", "x.h5"]
    refused(ready, words, 3, "force out of reach")


def test_a_damaged_file_is_named(ready, tmp_path):
    """Truncated, no HDF5 at all, HDF5 of somebody else, a folder."""
    whole = (ready / "run.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.h5").write_text("not HDF5")
    (tmp_path / "folder.h5").mkdir()
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = np.arange(3)
    for stem, name in (
        ("cut", "truncated"),
        ("text", "not HDF5"),
        ("folder", "a folder"),
        ("other", "another program's"),
    ):
        words = ["identify", f"{stem}.h5", "-o", "x.h5"]
        refused(tmp_path, words, 3, name, file=f"{stem}.h5", bytes=len(whole) // 2)


def test_an_absent_port_is_exit_4(ready):
    """Named, with the next step."""
    for words in (["capture", "identification"], ["play", "drive.h5"]):
        port = "/dev/ttyNONE"
        refused(ready, [*words, "--port", port, "-o", "x.h5"], 4, "no such port", port=port)


def test_an_unknown_bench_parameter_offers_the_nearest(ready):
    """bench:?crep is a typing error, not a device."""
    words = ["capture", "identification", "--port", "bench:?crep=0.1", "-o", "x.h5"]
    refused(ready, words, 2, "no such bench parameter", asked="--port")


def test_no_compiler_names_both_remedies(ready, tmp_path):
    """Without cc and without ziglang the bench cannot be built: exit 4."""
    env = {"PATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache"), "CC": ""}
    refused(ready, ["capture", "identification", "-o", "x.h5"], 4, "no compiler", env=env)


@pytest.mark.parametrize(
    ("option", "value", "name", "got"),
    [
        ("--rate", "1e-308", "no such rate", "1e-308"),
        ("--rate", "1e308", "no such rate", "1e+308"),
        ("--speed", "1e-300", "too slow", "7.35e+304"),
        ("--speed", "1e300", "too fast", ""),
        ("--current-max", "1e308", "too slow", "inf"),
    ],
)
def test_numbers_no_device_can_follow_are_refused_before_anything_moves(tmp_path, option, value, name, got):
    """The smallest and the largest number of the machine: in words, also in a dry run."""
    for signal_ in ("identification", "diagnostic") if option != "--speed" else ("identification",):
        words = ["capture", signal_, option, value, "--dry-run", "-o", "never.h5"]
        if (signal_, option) == ("diagnostic", "--current-max"):  # it takes the same time for any range
            refused(tmp_path, words, 3, "beyond the limit", limit="1.5", got=value.replace("e", "e+"))
        else:
            refused(tmp_path, words, 3, name, got=got)


@pytest.mark.parametrize(
    ("rows", "name", "names"),
    [
        ("0,0\n,0.5\n0.2,1\n", "not finite", {"value": "a blank cell", "column": "t_s", "line": 3}),
        ("0,0\n0.1,\n0.2,1\n", "not finite", {"value": "a blank cell", "line": 3}),
        ("0,0\n0.1,inf\n0.2,1\n", "not finite", {"value": "inf", "line": 3}),
        ("0,0\n0.1,1\n0.1,0.5\n", "time repeats", {}),
        ("nan,0\nnan,1\nnan,0.5\n", "no numbers", {}),
    ],
)
@pytest.mark.parametrize(
    ("words", "value"),
    [(("capture", "x.csv", "--dry-run"), "current_A"), (("invert", "x.csv", "--model", "model.h5"), "p")],
)
def test_tables_of_signals_and_pulses_are_refused_by_line(ready, words, value, rows, name, names):
    """Missing, infinite or repeated: whatever reads a time and a value names the line."""
    (ready / "x.csv").write_text(f"t_s,{value}\n{rows}")
    refused(ready, [*words, "-o", "never.h5"], 3, name, **{"file": "x.csv", "column": value, **names})


@pytest.mark.parametrize(
    ("time", "top", "name", "names"),
    [
        ("1e308", "1", "beyond all numbers", {"column": "t_s"}),
        ("3", "1e308", "beyond all numbers", {"column": "p"}),
        ("1e90", "1", "longer than the device plays", {"got": "4e+90", "next": "in seconds"}),
    ],
)
def test_pulses_beyond_all_numbers_are_refused_in_words(ready, time, top, name, names):
    """What no quantity reaches, and a period that no memory holds."""
    first = f"-{time}" if time == "1e308" else "0"
    (ready / "x.csv").write_text(f"t_s,p\n{first},-{top}\n1,0\n2,{top}\n{time},0.5\n")
    words = ["invert", "x.csv", "--model", "model.h5", "-o", "never.h5"]
    refused(ready, words, 3, name, file="x.csv", **names)


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
        refused(ready, [command, name, *more, *out], 3, "name too long")


def test_a_signal_in_milliseconds_is_one(ready):
    """The unit in the heading counts, as it does for import."""
    (ready / "ms.csv").write_text("t_ms,current_A\n0,0\n500,1\n1000,0\n")
    plan = pulsetrainer(ready, "capture", "ms.csv", "--dry-run", "--json", "-o", "never.h5").json
    assert plan["samples"] == 1001
    assert plan["seconds"] - plan["conditioning_s"] == pytest.approx(1.001)


@pytest.mark.parametrize(
    ("words", "samples", "most"),
    [
        (("capture", "identification", "--repeats", "1000000"), "98001", "1,000,000,000"),
        (("play", "drive.h5", "--repeats", "1000000"), "", "100,000,000"),
    ],
)
def test_more_than_memory_and_days_can_hold_is_refused_at_once(ready, words, samples, most):
    """The count of samples is told before they are made."""
    names = {"times": "1000000", "samples": samples, "most": most}
    refused(ready, [*words, "-o", "never.h5"], 3, "too many samples", **names)


def test_usage_errors_are_exit_2_in_words(run, tmp_path):
    """A missing option, an unknown command, an unknown signal."""
    refused(tmp_path, ["identify", "run.h5"], 2, "option missing")
    refused(tmp_path, ["frobnicate"], 2, "no such command")
    refused(tmp_path, ["capture", "noise", "-o", "x.h5"], 2, "no such signal")


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


@pytest.mark.realtime
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
    until_recorded(tmp_path, 100_000, process)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    refusal(Ran(process.returncode, out, err), 130, "interrupted")
    with h5py.File(tmp_path / "run.h5") as file:
        assert not file.attrs["complete"]
        kept = file["output"].shape[0]
    assert kept > 500
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    shown = pulsetrainer(tmp_path, "show", "run.h5", "--json")
    assert shown.json["facts"]["samples"] == kept
    assert shown.json["facts"]["complete"] is False


def test_a_hint_names_the_files_that_were_given(ready):
    """None that stands for one, where the command line names it or there is but one of its kind."""
    shutil.rmtree(ready / "plain")
    for path in ready.iterdir():
        if path.name != "run.h5":
            path.unlink()
    shutil.copy(KEPT / "diagnosis.h5", ready / "why not.h5")
    for words, hint in (
        (("invert", "normal", "--model", "mine.h5", "-o", "x.h5"), "identify run.h5 -o mine.h5"),
        (("capture", "identification", "-o", "x.h5", "--levels=many"), "pulsetrainer capture --help"),
        (("correct", "absent.h5", "--diagnosis", "why not.h5", "-o", "x.h5"), "run.h5"),
    ):
        assert hint in pulsetrainer(ready, *words, "--json").json["error"]["hint"]
    (ready / "run.h5").unlink()
    assert "show 'why not.h5'" in pulsetrainer(ready, *words, "--json").json["error"]["hint"]


@pytest.mark.parametrize("words", [["identify", "run.h5"], ["correct", "run.h5", "--diagnosis", "why.h5"]])
def test_what_was_measured_is_never_the_output(ready, words):
    """Not even with --overwrite: nobody could measure it again."""
    shutil.copy(KEPT / "diagnosis.h5", ready / "why.h5")
    before = (ready / "run.h5").read_bytes()
    told = pulsetrainer(ready, *words, "-o", "./run.h5", "--overwrite", "--json")
    assert (told.code, "would be lost" in told.json["error"]["message"]) == (2, True)
    assert (ready / "run.h5").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (["identify", "run.h5", "-o", "run.h5"], 2, "name another file"),
        (
            ["capture", "identification", "--speed", "1e6", *OUT],
            3,
            "a lower --speed (0.75 is usual)",
        ),
        (["capture", "identification", "--port", "socket://localhost", *OUT], 4, "socket://localhost:5000"),
        (["invert", "normal", "-m", "model.h5", *OUT], 2, "--model"),
        (["session", "--model", "model.h5", "--pulses", "normal", "bifid", *OUT], 2, "--pulses normal,bifid"),
        (["tune", "drive.h5"], 2, "--drive drive.h5"),
        (["ports", "COM3"], 2, "doctor --port COM3"),
        (["help", "identify"], 2, "pulsetrainer identify --help"),
        (["--settings", "mine.json", "ports"], 2, "TOML"),
        (["--settings", "mine.toml", "ports"], 2, "current_A = 1.5 under [limits]"),
        (["diagnose", "played.h5", "--model", "model.h5", *OUT], 3, "evaluate played.h5"),
        (["play", "normal", *OUT], 3, "make a drive of it: pulsetrainer invert normal"),
        (["play", "absent.h5", *OUT], 3, "drive files here: drive.h5"),
        (["show", "normal"], 3, "pulsetrainer files here: "),
        (["identify", "run.h5", "--levels", "many", *OUT], 2, "leave it out, or see pulsetrainer identify"),
        (["capture", "identification", "--levels", "many", *OUT], 2, "leave it out for the usual 48"),
        (["invert", "normal", "--model", "model.h5"], 2, "pulsetrainer invert normal --model model.h5 -o"),
    ],
)
def test_the_next_step_is_one_that_helps(ready, words, code, hint):
    """It names what to type, not only where to read."""
    (ready / "mine.json").write_text("{}")
    (ready / "mine.toml").write_text('[limits]\ncurrent_A = "x"\n')
    told = pulsetrainer(ready, *words, "--json")
    assert (told.code, hint in told.json["error"]["hint"]) == (code, True), told
    assert "Example:" not in told.json["error"]["hint"]


def test_a_drive_longer_than_the_device_plays_is_refused_at_once(ready):
    """Instead of a minute's work for a file that no device takes; as many as it says are accepted."""
    model = pt.load(KEPT / "model.h5")
    pt.save(replace(model, captured=True), ready / "ours.h5")
    words = ["invert", "normal", "--model", "ours.h5", "--json", "-o"]
    told = pulsetrainer(ready, *words, "x.h5", "--periods", 100_000).json["error"]
    assert (told["kind"], "80000 s" in told["message"]) == ("argument", True)
    most = int(re.search(r"--periods at most (\d+)", told["hint"])[1])
    assert pulsetrainer(ready, *words, "y.h5", "--periods", most).code == 0
    played = pulsetrainer(ready, "play", "y.h5", "-o", "z.h5", "--repeats", 1, "--dry-run")
    assert "stays on" not in played.err


def test_a_run_of_another_device_is_told(ready):
    """Errors of a model on it are those of two devices; both files hold their serial numbers."""
    words = (*EXCITATION, "-o", "other.h5", "--port", "bench:?seed=3")
    assert pulsetrainer(ready, *words).code == 0
    done = pulsetrainer(ready, "evaluate", "other.h5", "--model", "model.h5")
    assert "model.h5 is of BENCH-0, but other.h5 was recorded on BENCH-3" in done.err
    assert "was recorded on" not in pulsetrainer(ready, "evaluate", "run.h5", "--model", "model.h5").err


def test_what_is_hardly_felt_or_never_moves_is_told(ready):
    """An amplitude of a table that is a share, and an output that is constant."""
    (ready / "share.csv").write_text("t_s,amplitude\n1,0.8\n")
    words = ("session", "--model", "model.h5", "-o", "x.h5", "--beats", "2", "--changes", "share.csv")
    assert "an amplitude of 0.8 % is hardly felt" in pulsetrainer(ready, *words, "--dry-run").err
    (ready / "late.csv").write_text("t_s,rate\n400,90\n")
    words = ("session", "--model", "model.h5", "-o", "x.h5", "--minutes", "0.1", "--changes", "late.csv")
    said = pulsetrainer(ready, *words, "--ectopic", "0.1", "--variability", "0.04", "--dry-run").err
    tells(said, "a share in the place of %")
    tells(said, "changes after the end")
    (ready / "still.csv").write_text("t_s,current_A,force_N\n0,0,1\n1,1,1\n2,0.5,1\n")
    words = ("import", "still.csv", "--input", "current_A", "--output", "force_N", "-o", "still.h5")
    assert "the output of still.csv never moves: it is 1 N throughout" in pulsetrainer(ready, *words).err


def test_runs_of_two_units_are_no_matter_of_words(ready):
    """To import them again in the same units was advised, and is wrong of another device."""
    (ready / "piezo.csv").write_text("t_s,u_V,y_um\n0,0,1\n1,1,2\n2,0.5,1\n")
    words = ("import", "piezo.csv", "--input", "u_V", "--output", "y_um", "-o", "piezo.h5")
    assert pulsetrainer(ready, *words).code == 0
    done = pulsetrainer(ready, "identify", "run.h5", "piezo.h5", "-o", "x.h5")
    assert done.code == 3
    assert "try: identify runs of different devices one by one" in done.err


def test_what_is_advised_for_a_damaged_run_can_be_done(ready):
    """The file is there: without --overwrite the advised command would be refused."""
    with h5py.File(ready / "run.h5", "r+") as file:
        del file["output"]
    done = pulsetrainer(ready, "identify", "run.h5", "-o", "x.h5")
    assert "pulsetrainer capture identification -o run.h5 --overwrite" in done.err
