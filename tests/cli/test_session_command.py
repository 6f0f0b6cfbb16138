"""``session`` from the command line: its figures, its keys, its quiz, and what happens when it is cut off."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import signal
import struct
import subprocess
import termios
import time
from pathlib import Path

import numpy as np
import pytest

from program import PROGRAM, pulsetrainer
from pulsetrainer.artefacts import Session
from pulsetrainer.files.store import read, read_any
from pulsetrainer.steps.invert import DEVICE_SLEW_A_PER_S
from wording import refusal

KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"
MODEL = str(KEPT / "model-extended.h5")
SHORT = ("session", "--model", MODEL, "-o", "s.h5")
KEYS = {
    "beats", "rate_cv_percent", "amplitude_cv_percent", "beat_timing_max_ms", "mean_abs_error_percent",
    "max_abs_error_percent", "nrmse", "augmentation_index_error_percent", "underruns",
}  # fmt: skip


def test_the_contract(run, tmp_path):
    """Every key of the contract; the file says the same; asked and pressed are in it sample by sample."""
    done = run(*SHORT, "--beats", 6, "--pulses", "normal,bifid", "--json", "--html", "s.html")
    assert done.code == 0, done.err
    assert set(done.json) >= KEYS
    assert "quiz" not in done.json
    kept = read(tmp_path / "s.h5", Session)
    assert kept.figures() == {name: pytest.approx(done.json[name]) for name in kept.figures()}
    assert (kept.complete, kept.underruns, kept.pulses) == (True, 0, ("normal", "bifid"))
    assert kept.beats.pulse.tolist() == [0, 0, 0, 1, 1, 1]
    np.testing.assert_allclose(np.diff(kept.time_s), 1e-3, atol=1e-9)
    assert np.isfinite(kept.target).all()
    page = (tmp_path / "s.html").read_text()
    for name in ("mean_abs_error_percent", "error_jnd"):
        assert float(re.search(rf'data-metric="{name}" data-value="([^"]+)"', page)[1]) == getattr(kept, name)
    assert run("show", "s.h5").code == 0
    assert run("plot", "s.h5", "-o", "s.png").code == 0
    assert "<svg" in page
    assert "normal: 3 beats, bifid: 3 beats" in page
    assert "vary by" not in page


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("--beats", 5, "--pulses", "normal,bifid", "--variability", 5, "--seed", 3),
        ("--minutes", 3, "--pulses", "hot.csv"),
        ("--pulses", "normal,bifid", "--quiz", 2, "--answers", "a.txt"),
    ],
    ids=["beats", "too hot to go on", "a quiz"],
)
def test_a_dry_run_tells_beats_length_current_and_pauses_as_they_come(run, tmp_path, words):
    """No port is opened: that it is absent does not matter; nothing is written."""
    level = [0.2, *[1.0] * 15]
    (tmp_path / "hot.csv").write_text("t_s,p\n" + "".join(f"{k / 20},{p}\n" for k, p in enumerate(level)))
    (tmp_path / "a.txt").write_text("normal\nbifid\n")
    before = sorted(tmp_path.iterdir())
    plan = run(*SHORT, *words, "--dry-run", "--json", "--port", "/dev/absent").json
    assert sorted(tmp_path.iterdir()) == before
    done = run(*SHORT, *words, "--json")
    assert done.code == 0, done.err
    kept = read(tmp_path / "s.h5", Session)
    count = np.bincount(kept.beats.pulse, minlength=len(kept.pulses)).tolist()
    assert (plan["dry_run"], plan["beats"], plan["parts"]) == (True, done.json["beats"], done.json["parts"])
    assert plan["pulses"] == dict(zip(kept.pulses, count, strict=True))
    assert plan["seconds"] == pytest.approx(kept.time_s[-1], abs=0.01)
    assert plan["peak_current_A"] == pytest.approx(kept.reference.max(), abs=2e-4)
    assert plan["rms_current_A"] == pytest.approx(np.sqrt(np.mean(kept.reference**2)), rel=1e-3)
    assert plan["peak_force_N"] == pytest.approx(kept.output.max(), rel=0.1)
    first_s = kept.beats.start_s[0]
    assert plan["pulse_force_N"] == pytest.approx(kept.output[kept.time_s > first_s].max(), rel=0.1)
    said = [f"a pause of {p['seconds']:.0f} s after {p['at_s']:.0f} s" for p in plan["pauses"]]
    assert [note.partition(",")[0] for note in kept.notes] == said
    assert bool(said) is ("hot.csv" in words)


def test_a_dry_run_tells_how_hard_low_pulses_press(run):
    """At 40 % it told the slow press at the beginning only."""
    plan = run(*SHORT, "--amplitude", 40, "--beats", 2, "--dry-run", "--json").json
    assert 0.35 < plan["pulse_force_N"] / plan["peak_force_N"] < 0.5


def test_a_dry_run_of_a_quiz_by_key_needs_the_keys_too(run):
    """Where there is no terminal, both are refused."""
    words = (*SHORT, "--pulses", "normal,bifid", "--quiz", 2)
    refusal(run(*words, "--dry-run", "--json"), 2, "a quiz without a terminal")


def test_a_session_in_a_file_has_its_sheet_made_again(run, tmp_path):
    """The same page as when it was pressed; models, bounds and an evaluation do not go with it."""
    done = run(*SHORT, "--beats", 3, "--variability", 4, "--html", "s.html")
    assert (done.code, done.out.splitlines()[-1]) == (0, "wrote s.html")
    assert "vary by 4 %" in (tmp_path / "s.html").read_text()
    assert f"of full force ({read(tmp_path / 's.h5', Session).full_force:.2f} N)" in done.out
    done = run("evaluate", "s.h5", "--html", "again.html", "--json")
    assert (done.code, done.json["beats"], done.json["complete"]) == (0, 3, True)
    assert (tmp_path / "again.html").read_text() == (tmp_path / "s.html").read_text()
    refused = run("evaluate", "s.h5", "-o", "e.h5")
    assert (refused.code, (tmp_path / "e.h5").exists()) == (2, False)


def test_a_session_that_fails_before_its_first_beat_leaves_no_file(run, tmp_path):
    """The next try needs no --overwrite; what was there before stays."""
    words = (*SHORT, "--beats", 3, "--port", "bench:?supply=6", "--json")
    refusal(run(*words), 4, "no beat was pressed", file="s.h5")
    assert not list(tmp_path.glob("s.h5*"))
    (tmp_path / "s.h5").write_text("mine")
    refusal(run(*words, "--overwrite"), 4, "no beat was pressed", file="s.h5")
    assert (tmp_path / "s.h5").read_text() == "mine"


@pytest.mark.parametrize(
    ("option", "text", "name", "named"),
    [
        ("--changes", "t_s,rate\n5,80\n6,500\n", "not such a row", ("line 3: rate", "20 to 240", "500")),
        ("--changes", "# a\nt_s,rate\n\n# b\n6,9\n", "not such a row", ("line 5: rate", "20 to 240", "9")),
        (
            "--changes",
            "t_s,rate\n5,80\n3,90\n",
            "not such a row",
            ("line 3: t_s", "times that rise", "3 after 5"),
        ),
        ("--changes", "t_s,amplitude\n5,0\n", "not such a row", ("line 2: amplitude", "more than 0", "is 0")),
        (
            "--changes",
            "t_s,pulse\n5,bifd\n",
            "not such a row",
            ("line 2: pulse", "one of normal, bifid", "'bifd'"),
        ),
        ("--answers", "normal\n\nfoo\n", "not such a row", ("line 3", "one of normal, bifid", "'foo'")),
        ("--answers", "normal\n", "too few answers", ("", "2 questions", "1 answer to")),
    ],
)
def test_a_bad_row_is_named_with_its_file(run, tmp_path, option, text, name, named):
    """Exit 3 before anything moves: the file, the line, what was expected and what was got."""
    (tmp_path / "rows.txt").write_text(text)
    quiz = ("--quiz", 2) if option == "--answers" else ("--beats", 3)
    done = run(*SHORT, "--pulses", "normal,bifid", *quiz, option, "rows.txt", "--json")
    row, expected, got = named
    refusal(done, 3, name, file="rows.txt", row=row, expected=expected, got=got)
    assert not list(tmp_path.glob("s.h5*"))


def test_one_beat_has_no_spread(run):
    """What one beat does not tell is a dash."""
    done = run(*SHORT, "--beats", 1)
    assert done.code == 0, done.err
    assert "nan" not in done.out


def test_changes_of_a_script_come_at_the_next_beat(run, tmp_path):
    """Rate, amplitude and pulse; the current moves no faster than the slew limit, and the force follows."""
    (tmp_path / "changes.csv").write_text("t_s,rate,amplitude,pulse\n3,100,,\n5,,50,bifid\n")
    done = run(*SHORT, "--pulses", "normal,bifid", "--rate", 60, "--beats", 9, "--changes", "changes.csv")
    assert done.code == 0, done.err
    kept = read(tmp_path / "s.h5", Session)
    beats = kept.beats
    later = beats.start_s >= 5
    np.testing.assert_allclose(beats.interval_s[beats.start_s < 3], 1.0)
    np.testing.assert_allclose(beats.interval_s[beats.start_s >= 3], 0.6)
    np.testing.assert_allclose(beats.amplitude, np.where(later, 50, 100))
    assert (beats.pulse[later] == 1).all()
    assert np.abs(np.diff(kept.reference)).max() <= DEVICE_SLEW_A_PER_S / 1000 + 2e-4


def test_the_rhythm_comes_from_the_seed(run, tmp_path):
    """Twice the same, and another one."""
    intervals = []
    for seed in (1, 1, 2):
        words = ("--variability", 8, "--ectopic", 20, "--respiration", 5, "--beats", 5, "--seed", seed)
        assert run(*SHORT, *words, "--overwrite").code == 0
        intervals.append(read(tmp_path / "s.h5", Session).beats.interval_s)
    np.testing.assert_array_equal(intervals[0], intervals[1])
    assert np.abs(intervals[0] - intervals[2]).max() > 0.01


def test_a_quiz_by_file(run, tmp_path):
    """Score and confusion fit what the file holds; right are those that are right."""
    (tmp_path / "a.txt").write_text("normal\nbifid\nnormal\nbifid\n")
    words = ("--pulses", "normal,bifid", "--quiz", 4, "--answers", "a.txt", "--seed", 3, "--html", "q.html")
    done = run(*SHORT, *words, "--beats", 2, "--json")
    assert done.code == 0, done.err
    assert "--beats not used" in done.err
    quiz = done.json["quiz"]
    kept = read(tmp_path / "s.h5", Session).quiz
    assert kept.answered == ("normal", "bifid", "normal", "bifid")
    assert sorted(kept.asked) == ["bifid", "bifid", "normal", "normal"]
    assert (quiz["asked"], quiz["right"], quiz["confusion"]) == (4, kept.right, kept.confusion)
    assert 0 <= quiz["interval"][0] <= kept.right / 4 <= quiz["interval"][1] <= 1
    assert kept.learner == "s"
    page = (tmp_path / "q.html").read_text()
    assert "Confusion matrix" in page
    assert "no value" not in page  # answers from a file have no time, and that is said once
    assert page.count("which has no times") == 1


def test_what_a_person_writes_down_is_read(run, tmp_path):
    """Answers with capitals, and changes as a spreadsheet with decimal commas saves them."""
    (tmp_path / "a.txt").write_text("Normal\nBIFID\n")
    words = ("--pulses", "normal,bifid", "--quiz", 2, "--answers", "a.txt")
    assert run(*SHORT, *words, "--dry-run").code == 0
    (tmp_path / "c.csv").write_text("t_s;rate;amplitude\n0,5;100;62,5\n")
    done = run(*SHORT, "--beats", 4, "--changes", "c.csv")
    assert done.code == 0, done.err
    assert read(tmp_path / "s.h5", Session).beats.amplitude[-1] == pytest.approx(62.5)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--pulses", "normla"), 2, "normal"),
        (("--pulses", "normal,normal"), 2, "once"),
        (("--pulses", "normal,normal", "--quiz", "4", "--answers", "right.txt"), 2, "once"),
        (("--pulses", "normal;bifid"), 2, "commas between the names: normal,bifid"),
        (("--rate", "10"), 2, "20 to 240"),
        (("--rate", "241"), 2, "20 to 240"),
        (("--amplitude", "120"), 2, "100 %"),
        (("--beats", "0"), 2, "--beats must be 1 or more and at most 345600, got 0"),
        (("--beats", "345601"), 2, "at most 345600, got 345601"),
        (("--minutes", "1441"), 2, "at most 1440 (a day), got 1441"),
        (("--minutes", "-1"), 2, "--minutes must be"),
        (("--beats", "5", "--minutes", "1"), 2, "one of the two"),
        (("--variability", "60"), 2, "--variability must be a number from 0 to 25, got 60"),
        (("--ectopic", "-1"), 2, "--ectopic"),
        (("--answers", "right.txt"), 2, "leave --answers out"),
        (("--answers", "wrong.txt"), 2, "leave --answers out"),
        (("--quiz", "4"), 2, "two pulses"),
        (("--quiz", "4", "--pulses", "normal,bifid"), 2, "terminal"),
        (("--quiz", "4", "--pulses", "normal,bifid", "--answers", "short.txt"), 3, "4 questions"),
        (("--quiz", "2", "--pulses", "normal,bifid", "--answers", "wrong.txt"), 3, "stiff"),
        (("--changes", "bad.csv"), 3, "line 2"),
        (("--changes", "other.csv"), 3, "columns"),
        (("--changes", "unknown.csv"), 3, "bifd"),
        (("--changes", "absent.csv"), 3, "absent.csv"),
    ],
)
def test_what_makes_no_sense_is_told_before_anything_moves(run, tmp_path, words, code, said):
    """Exit code, what is wrong, and nothing written."""
    (tmp_path / "short.txt").write_text("normal\n")
    (tmp_path / "right.txt").write_text("normal\nnormal\n")
    (tmp_path / "wrong.txt").write_text("normal\nstiff\n")
    (tmp_path / "bad.csv").write_text("t_s,rate\nsoon,80\n")
    (tmp_path / "other.csv").write_text("time,bpm\n1,80\n")
    (tmp_path / "unknown.csv").write_text("t_s,pulse\n1,bifd\n")
    done = run(*SHORT, *words, env={"PULSETRAINER_PORT": "/dev/no-such-port"})
    assert (done.code, said in done.err) == (code, True), done.err
    assert not list(tmp_path.glob("s.h5*"))


def test_a_model_of_another_device_is_refused(run, tmp_path):
    """Before the device is touched."""
    rows = "\n".join(f"{k / 100},{np.sin(k / 30)},{2 * np.sin(k / 30)}" for k in range(600))
    (tmp_path / "t.csv").write_text(f"t_s,u,y\n{rows}\n")
    words = ("--input", "u", "--output", "y", "--input-unit", "V", "--output-unit", "T", "-o", "t.h5")
    assert run("import", "t.csv", *words).code == 0
    assert run("identify", "t.h5", "--levels", 6, "-o", "m.h5").code == 0
    done = run("session", "--model", "m.h5", "-o", "s.h5", "--port", "/dev/no-such-port")
    assert done.code == 3
    assert "V" in done.err


def test_heat_cannot_be_tracked_with_a_model_that_does_not_know_its_coil(run, tmp_path):
    """A static model from before captures told the duty: exit 3, what to do, nothing pressed and no file."""
    static = str(KEPT / "model.h5")
    done = run("session", "--model", static, "-o", "s.h5", "--beats", 2, "--track-heat", "--json")
    assert (done.code, done.json["error"]["kind"]) == (3, "data")
    assert "coil" in done.json["error"]["message"]
    assert "capture" in done.json["error"]["hint"]
    assert not list(tmp_path.glob("s.h5*"))


def _started(folder: Path, *words: object, port: str = "bench:?speed=real") -> subprocess.Popen[bytes]:
    env = {**os.environ, "PULSETRAINER_PORT": port}
    return subprocess.Popen(
        [*PROGRAM, *map(str, words)], cwd=folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def _until(there, seconds: float = 40.0) -> None:
    deadline = time.monotonic() + seconds
    while not there():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _recorded(folder: Path) -> int:
    with contextlib.suppress(Exception):
        return read_any(folder / "s.h5.partial").input.size
    return 0


@contextlib.contextmanager
def _sessions(*folders: Path):
    """Sessions of five minutes, one in each folder, at the same time."""
    processes = []
    try:
        for folder in folders:
            folder.mkdir()
            processes.append(_started(folder, *SHORT, "--minutes", 5))
        yield processes
    finally:
        for process in processes:
            process.kill()
            process.communicate()


@pytest.mark.slow
@pytest.mark.realtime
def test_killed_at_any_moment_the_file_is_readable(tmp_path):
    """It is a session that was cut off: its beats, what was asked and measured; and it has a score sheet."""
    killed = {tmp_path / "at once": 200, tmp_path / "later": 2500}
    with _sessions(*killed) as processes:
        for process, (folder, after) in zip(processes, killed.items(), strict=True):
            _until(lambda folder=folder, after=after: _recorded(folder) >= after)
            process.kill()
    for folder, after in killed.items():
        _check_cut_off(folder, after)


def _check_cut_off(tmp_path: Path, after: int) -> None:
    kept = read_any(tmp_path / "s.h5.partial")
    assert isinstance(kept, Session)
    assert kept.input.size >= after
    assert not kept.complete
    assert kept.pulses == ("normal",)
    last_s = kept.time_s[-1]
    over = kept.beats.start_s + kept.beats.interval_s
    assert kept.beats.start_s.size == 0 or over[-1] <= last_s + 0.01
    assert kept.beats.start_s.size >= (last_s - 3.0) // 0.8 - 1  # but for the way up, and the one under way
    shown = pulsetrainer(tmp_path, "show", "s.h5.partial", "--json")
    assert (shown.json["kind"], shown.json["facts"]["complete"]) == ("session", False)
    absent = pulsetrainer(tmp_path, "evaluate", "s.h5")
    assert "try: it was cut off: s.h5.partial holds" in absent.err
    done = pulsetrainer(tmp_path, "evaluate", "s.h5.partial", "--html", "s.html", "--json")
    if not kept.beats.start_s.size:
        refusal(done, 3, "no beat of a session", file="s.h5.partial")
        return
    assert done.json["beats"] == kept.beats.start_s.size
    assert kept.fault in (tmp_path / "s.html").read_text()


@pytest.mark.realtime
def test_stopped_by_a_signal_nothing_is_lost(tmp_path):
    """The file is whole, holds the beats so far, and the exit code says who stopped it."""
    stopped = {tmp_path / number.name: number for number in (signal.SIGINT, signal.SIGTERM)}
    with _sessions(*stopped) as processes:
        for process, (folder, number) in zip(processes, stopped.items(), strict=True):
            _until(lambda folder=folder: _recorded(folder) >= 4000)
            process.send_signal(number)
            _, err = process.communicate(timeout=60)
            assert process.returncode == 130, err
            assert b"try: `pulsetrainer evaluate s.h5 --html sheet.html`" in err
    for folder in stopped:
        kept = read(folder / "s.h5", Session)
        assert not kept.complete
        assert kept.beats.start_s.size >= 2
        assert not list(folder.glob("*.partial"))


def test_a_lost_port_keeps_what_was_pressed(tmp_path):
    """The device goes away in the middle: exit 4, the beats so far are there."""
    done = pulsetrainer(tmp_path, *SHORT, "--minutes", 1, "--port", "bench:?break=reset@6")
    assert done.code == 4
    kept = read(tmp_path / "s.h5", Session)
    assert kept.fault
    assert not kept.complete
    assert kept.beats.start_s.size >= 3


FAST = "bench:?speed=max"  # also where keys are pressed


class Terminal:
    """The program on a terminal of its own."""

    def __init__(self, folder: Path, *words: object, port: str = "bench:?speed=real", size=(24, 80)) -> None:
        self.seen = b""
        self.pid, self.handle = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.environ["PULSETRAINER_PORT"] = port
            os.environ["TERM"] = "xterm"
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
            os.execv(PROGRAM[0], [*PROGRAM, *map(str, words)])

    def read(self) -> bool:
        """Take in what is on the screen; False at the end."""
        try:
            piece = os.read(self.handle, 65536)
        except OSError:
            return False
        self.seen += piece
        return bool(piece)

    def until(self, there, seconds: float = 60.0) -> None:
        """Read until something is true."""
        deadline = time.monotonic() + seconds
        while not there():
            assert time.monotonic() < deadline, self.seen[-2000:]
            assert self.read(), self.seen[-2000:]

    def press(self, key: str) -> None:
        """Press a key."""
        os.write(self.handle, key.encode())

    def end(self) -> int:
        """Read to the end and return the exit code."""
        while self.read():
            pass
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


@pytest.mark.slow
@pytest.mark.realtime
def test_keys_change_the_beats_and_stop(tmp_path):
    """Faster, weaker, another pulse, a pause, on, stop: each is in the beats that follow."""
    terminal = Terminal(tmp_path, *SHORT, "--pulses", "normal,bifid", "--rate", 100, "--minutes", 5)
    terminal.until(lambda: b"normal  100/min" in terminal.seen)
    terminal.until(lambda: b"space pause" in terminal.seen)  # a picture may come in pieces
    terminal.press("+")
    terminal.until(lambda: b"105/min" in terminal.seen)
    terminal.press("<")
    terminal.until(lambda: b"90 %" in terminal.seen)
    terminal.press("p")
    terminal.until(lambda: b"bifid" in terminal.seen)
    mark = len(terminal.seen)
    terminal.press(" ")
    terminal.until(lambda: b"at rest" in terminal.seen[mark:])
    terminal.press(" ")
    mark = len(terminal.seen)
    terminal.until(lambda: b"bifid" in terminal.seen[mark:] and b"at rest" not in terminal.seen[-2000:])
    terminal.press("q")
    assert terminal.end() == 0
    beats = read(tmp_path / "s.h5", Session).beats
    assert 60 / beats.interval_s[0] == pytest.approx(100)
    assert 60 / beats.interval_s[-1] == pytest.approx(105)
    assert beats.amplitude[-1] == pytest.approx(90)
    assert (beats.pulse[0], beats.pulse[-1]) == (0, 1)
    assert np.diff(beats.start_s).max() > 1.2  # the pause


@pytest.mark.slow
def test_the_screen_of_a_session_is_all_there_is(tmp_path):
    """How much is over, in beats too, stands in it: a bar beside it drew into it, and never moved."""
    terminal = Terminal(tmp_path, *SHORT, "--beats", 30, port=FAST)
    assert terminal.end() == 0
    shares = [int(share) for share in re.findall(rb" (\d+) % +[\d.]+ s ", terminal.seen)]
    assert shares[0] < 20
    assert shares[-1] > 80
    assert "━".encode() not in terminal.seen


@pytest.mark.slow
def test_the_screen_says_when_no_finger_may_be_there(tmp_path):
    """The first stroke once, then each beat from its first one on, then rest: what a teacher goes by."""
    terminal = Terminal(tmp_path, *SHORT, "--beats", 4)
    assert terminal.end() == 0
    lines = re.findall(rb" s +-?[\d.]+ N +-?[\d.]+ A  ([^\r\n\x1b]*)", terminal.seen)
    said = [re.sub(r" .*/min.*", "", line.decode()) for line in lines]
    changes = [one for one, before in zip(said, [None, *said], strict=False) if one != before]
    assert changes == ["first stroke: no finger yet", "normal", "at rest"]


@pytest.mark.slow
def test_a_terminal_without_unicode_gets_bars_of_its_letters(tmp_path, monkeypatch):
    """Each block became an escape of six letters, and the lines ran over."""
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    terminal = Terminal(tmp_path, *SHORT, "--beats", 2, port=FAST)
    assert terminal.end() == 0
    assert b"####" in terminal.seen
    assert b"\\u" not in terminal.seen


@pytest.mark.slow
def test_a_key_that_was_taken_is_shown_and_goes_again(tmp_path):
    """Nothing said so until its beat came, and it was pressed again; 'x' stayed to the end."""
    words = ("--pulses", "normal,bifid", "--rate", 100, "--minutes", 10)
    terminal = Terminal(tmp_path, *SHORT, *words, port=FAST)
    terminal.until(lambda: b"/min" in terminal.seen)
    for key, answer in {"p": b"next: bifid", "<": b"next: bifid  90 %", "x": b"'x' is not"}.items():
        terminal.press(key)
        terminal.until(lambda answer=answer: answer in terminal.seen)

    def time_s() -> float:
        return float(re.findall(rb"([\d.]+) s ", terminal.seen)[-1])

    pressed_s = time_s()
    terminal.until(lambda: time_s() > pressed_s + 4.0)
    mark = len(terminal.seen)
    terminal.until(lambda: time_s() > pressed_s + 5.0)
    assert b"'x'" not in terminal.seen[mark:]
    terminal.press("q")
    assert terminal.end() == 0


@pytest.mark.slow
def test_a_pause_does_not_eat_the_session(tmp_path):
    """As many beats as without, never more than 100 %; a key that changes nothing is answered."""
    terminal = Terminal(tmp_path, *SHORT, "--minutes", 0.5, port=FAST)
    terminal.until(lambda: b"/min" in terminal.seen)
    terminal.press(" ")
    for key, answer in {"x": b"paused; 'x'", ">": b"paused; already 100 %"}.items():
        terminal.press(key)
        terminal.until(lambda answer=answer: answer in terminal.seen)
    terminal.until(lambda: float(re.findall(rb"([\d.]+) s ", terminal.seen)[-1]) > 45.0)
    terminal.press(" ")
    assert terminal.end() == 0
    assert max(map(int, re.findall(rb" (\d+) % +[\d.]+ s ", terminal.seen))) <= 100
    kept = read(tmp_path / "s.h5", Session)
    assert kept.time_s[-1] > 60.0
    assert kept.beats.interval_s.sum() == pytest.approx(30.0, abs=4.0)


@pytest.mark.realtime
@pytest.mark.parametrize(
    "words",
    [("--minutes", 5), pytest.param(("--pulses", "normal,bifid", "--quiz", 2), marks=pytest.mark.slow)],
)
def test_a_bench_keeps_pace_with_a_person(tmp_path, words):
    """Where keys are pressed no second of the session is shorter than one of the clock."""
    begun = time.monotonic()
    terminal = Terminal(tmp_path, *SHORT, *words, port="bench:")
    terminal.until(lambda: b"stop" in terminal.seen)
    shown = time.monotonic()
    terminal.until(lambda: time.monotonic() > shown + 3.0)
    terminal.press("Q" if "--quiz" in words else "q")
    assert terminal.end() == 0
    kept = read(tmp_path / "s.h5", Session)
    assert kept.time_s[-1] < time.monotonic() - begun
    assert kept.stopped_by_key
    assert kept.ended_early == kept.stopped_by_key


def test_a_bench_is_as_fast_as_it_can_where_a_file_answers(tmp_path):
    """On a terminal too: nobody presses anything."""
    (tmp_path / "a.txt").write_text("normal\nbifid\n")
    begun = time.monotonic()
    words = ("--pulses", "normal,bifid", "--quiz", 2, "--answers", "a.txt")
    assert Terminal(tmp_path, *SHORT, *words, port="bench:").end() == 0
    assert time.monotonic() - begun < read(tmp_path / "s.h5", Session).time_s[-1]


def test_a_quiz_in_a_small_window_says_what_to_do(tmp_path):
    """The window is the trouble: it is a terminal already."""
    words = ("--pulses", "normal,bifid", "--quiz", 2)
    terminal = Terminal(tmp_path, *SHORT, *words, port=FAST, size=(24, 40))
    assert terminal.end() == 2
    assert "make the window larger" in " ".join(terminal.seen.decode().split())


def test_nothing_gives_a_question_away(tmp_path):
    """Blind: neither screen, nor file names, nor the files, nor the time tell what is asked."""
    words = ("--pulses", "bifid,parvus-et-tardus", "--quiz", 2, "--seed", 7)
    terminal = Terminal(tmp_path, *SHORT, *words, port=FAST)
    terminal.until(lambda: b"question 1 of 2" in terminal.seen)
    terminal.until(lambda: b"Q stop" in terminal.seen)  # before a wrong key, too
    shown = [terminal.seen.count(name) for name in (b"bifid", b"parvus-et-tardus")]
    terminal.until(lambda: terminal.seen.count(b"bifid") > shown[0] + 5)
    # both names stand in the list of choices and nowhere else: as often
    assert abs(terminal.seen.count(b"bifid") - terminal.seen.count(b"parvus-et-tardus")) <= 1
    assert not re.search(rb"/min| N  | A  ", terminal.seen)
    files = {path.name for path in tmp_path.iterdir()}
    assert not any("bifid" in name or "parvus" in name for name in files)
    journal = (tmp_path / "s.h5.partial").read_bytes()
    assert journal.count(b'"asked"') == journal.count(b'"pulse"') == 0
    under_way = read(tmp_path / "s.h5.partial", Session)
    assert (under_way.quiz, under_way.beats.start_s.size) == (None, 0)
    terminal.press("x")
    terminal.until(lambda: b"a to b answer" in terminal.seen)
    # an answer for each question, whenever it is its turn
    terminal.press("a")
    terminal.until(lambda: b"question 2 of 2" in terminal.seen)
    terminal.press("b")
    assert terminal.end() == 0
    kept = read(tmp_path / "s.h5", Session)
    assert kept.quiz.answered == ("bifid", "parvus-et-tardus")
    assert np.isfinite(kept.quiz.response_s).all()


@pytest.mark.slow
def test_a_quiz_that_was_stopped_says_so(tmp_path, run):
    """On the screen, in the file, on the sheet: one answer of six is not all that was asked."""
    words = ("--pulses", "normal,bifid", "--quiz", 6, "--html", "s.html")
    terminal = Terminal(tmp_path, *SHORT, *words, port=FAST)
    terminal.until(lambda: b"question 1 of 6" in terminal.seen)
    terminal.press("a")
    terminal.until(lambda: b"question 2 of 6" in terminal.seen)
    terminal.press("Q")
    assert terminal.end() == 0
    said = "stopped by key in question 2 of 6"
    assert f"note: {said}" in terminal.seen.decode()
    assert said in (tmp_path / "s.html").read_text()
    assert said in run("show", "s.h5").out
    assert run("evaluate", "s.h5", "--json").json["ended_early"] == said


@pytest.mark.slow
def test_a_session_that_was_interrupted_names_its_sheet(tmp_path):
    """It is written all the same."""
    terminal = Terminal(tmp_path, *SHORT, "--minutes", 5, "--html", "s.html", port=FAST, size=(24, 200))
    terminal.until(lambda: float((re.findall(rb"([\d.]+) s ", terminal.seen) or [b"0"])[-1]) > 10.0)
    terminal.press("\x03")
    assert terminal.end() == 130
    assert b"(complete=false), the score sheet in s.html" in terminal.seen
    assert "stopped early: interrupted" in (tmp_path / "s.html").read_text()


def test_a_terminal_that_is_too_small_has_no_view(tmp_path):
    """It is said, and the session goes on without."""
    terminal = Terminal(tmp_path, *SHORT, "--beats", 3, port="bench:", size=(5, 30))
    assert terminal.end() == 0
    assert b"too small" in terminal.seen.replace(b"\r\n", b" ")
    assert b"space pause" not in terminal.seen


def test_a_pipe_is_quiet(run):
    """No view, no key, no bar; the figures on stdout."""
    done = run(*SHORT, "--beats", 3)
    assert done.code == 0
    assert "\x1b" not in done.out + done.err
    assert "beats" in done.out
