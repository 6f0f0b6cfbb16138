"""Captures longer than the device stays on, longer than the memory should hold, and cut off in the middle."""

from __future__ import annotations

import contextlib
import os
import random
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from program import PROGRAM, pulsetrainer
from pulsetrainer.artefacts import Run
from pulsetrainer.core import excitations
from pulsetrainer.core.course import Course
from pulsetrainer.errors import DataError
from pulsetrainer.files.recorder import RunRecorder
from pulsetrainer.files.store import read, read_header
from pulsetrainer.steps.recording import samples_played

SEED = 20260103
IDENTIFICATION = ("capture", "identification", "--levels", "16", "--speed", "3", "--repeats", "40")
STEP_A = 1.5e-4  # the device tells currents in steps of 0.1 mA


def reference_of(run: Run) -> np.ndarray:
    """The reference without what was led in again after each seam."""
    parts = run.parts()
    played = [parts[0].reference]
    for part in parts[1:]:
        whole = np.concatenate(played)
        signal_ = course()
        rest = signal_[whole.size :]
        k = part.reference.size - rest.size if part is parts[-1] else None
        if k is None:  # cut off itself: find the place where it follows the course again
            k = next(j for j in range(part.reference.size) if follows(part.reference[j:], rest))
        played.append(part.reference[k:])
    return np.concatenate(played)


def follows(played: np.ndarray, rest: np.ndarray) -> bool:
    """All of it, not a beginning: the way back to the course has strokes that are as steep as its own."""
    if np.any(np.abs(played[:400] - rest[:400][: played.size]) >= STEP_A):
        return False
    return bool(np.all(np.abs(played - rest[: played.size]) < STEP_A))


def course() -> np.ndarray:
    """The reference of ``IDENTIFICATION`` in full."""
    one = excitations.identification(0.0, 1.5, n_h=16, speed=3.0, rate_Hz=1000.0).value
    return np.tile(one, 40)


def killed(folder: Path, words: tuple[str, ...], after_samples: int) -> None:
    """Start a capture and kill it once it has recorded so many samples."""
    process = subprocess.Popen([*PROGRAM, *words], cwd=folder, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while True:
        fresh = [path for path in folder.iterdir() if ".partial" in path.name]
        with contextlib.suppress(DataError):  # just made
            if fresh and read(fresh[0], Run).input.size > after_samples:
                break
        assert process.poll() is None, "ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()


@pytest.mark.slow
def test_resumed_after_two_kills_it_is_the_whole_course(tmp_path):
    """Every sample of the course once and in order, seams where it was cut, no file left over."""
    rng = random.Random(SEED)
    print("seed", SEED)
    words = (*IDENTIFICATION, "-o", "run.h5")
    killed(tmp_path, words, rng.randrange(20_000, 150_000))
    first = read(tmp_path / "run.h5.partial", Run)
    assert not first.complete
    killed(tmp_path, (*words, "--resume"), first.input.size + rng.randrange(20_000, 100_000))
    planned = pulsetrainer(tmp_path, *words, "--resume", "--dry-run", "--json").json
    kept = read(tmp_path / "run.h5.partial", Run).input.size
    done = pulsetrainer(tmp_path, *words, "--resume", "--json")
    assert done.code == 0, done
    assert done.json["samples"] - kept == planned["samples"]
    assert done.json["parts"] == 3
    assert done.json["complete"] is True
    assert "continuing run.h5.partial" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    run = read(tmp_path / "run.h5", Run)
    assert np.array_equal(run.output[: first.output.size], first.output)
    assert np.flatnonzero(run.seam)[0] == first.output.size
    np.testing.assert_allclose(reference_of(run), course(), atol=STEP_A)
    assert sum("--resume" in line for line in read_header(tmp_path / "run.h5").history) == 2
    for part in run.parts():
        assert part.reference[0] <= STEP_A  # each begins at zero, with a known memory

    # what is made of it: as of a run that was never cut
    assert pulsetrainer(tmp_path, "identify", "run.h5", "--levels", "16", "-o", "cut.h5").code == 0
    assert pulsetrainer(tmp_path, *IDENTIFICATION, "-o", "whole.h5").code == 0
    assert pulsetrainer(tmp_path, "identify", "whole.h5", "--levels", "16", "-o", "uncut.h5").code == 0
    models = ("--model", "uncut.h5", "--model", "cut.h5")
    uncut, cut = pulsetrainer(tmp_path, "evaluate", "whole.h5", *models, "--json").json["models"]
    assert cut["rms"] < 1.02 * uncut["rms"]


def test_a_capture_that_a_fault_ended_is_resumed(tmp_path):
    """What a device's fault cut off goes on under its own name, without --force; the way down is kept."""
    words = ("capture", "identification", "--levels", "12", "--speed", "3", "-o", "run.h5")
    done = pulsetrainer(tmp_path, *words, "--port", "bench:?break=current-zero@4")
    assert done.code == 4, done
    assert not read(tmp_path / "run.h5", Run).complete
    cut = read(tmp_path / "run.h5", Run).output
    refused = pulsetrainer(tmp_path, *words)
    assert refused.code == 2
    assert "--resume" in refused.err.partition("try: ")[2]  # not only how to replace it
    done = pulsetrainer(tmp_path, *words, "--resume")
    assert done.code == 0, done
    assert re.search(r"reversals +\d+ of the signal itself", done.out)
    assert "pauses between its parts included" in done.out
    run = read(tmp_path / "run.h5", Run)
    assert run.complete
    assert np.array_equal(run.output[: cut.size], cut)
    assert len(run.parts()) == 2
    last = run.parts()[1].reference
    one = excitations.identification(0.0, 1.5, n_h=12, speed=3.0, rate_Hz=1000.0)
    np.testing.assert_allclose(last[-500:], one.value[-500:], atol=STEP_A)
    for samples in (1, 1000):  # of a recording that stopped with no way down
        cut_off = run.parts()[0].cut(slice(samples))
        assert samples_played(cut_off, Course(one, 1)) == samples
    away = np.where(np.arange(1000) < 700, 0.0, 0.01)  # and of one with it
    cut_off = replace(cut_off, reference=cut_off.reference - away)
    assert samples_played(cut_off, Course(one, 1)) == 700
    rest = one.value[:20]  # behind the end of the course it looks like its begin, and is no more of it
    longer = replace(
        run,
        time_s=np.append(run.time_s, run.time_s[-1] + np.arange(1, 21) / 1000.0),
        reference=np.append(run.reference, rest),
        seam=np.append(run.seam, np.zeros(20, bool)),
        input=np.append(run.input, rest),
        output=np.append(run.output, rest),
    )
    assert samples_played(longer, Course(one, 1)) == samples_played(run, Course(one, 1)) == one.value.size


def test_a_dry_run_names_the_port_as_it_was_typed(tmp_path):
    """In real time a capture takes as long as it says; a script gets what files keep of the port."""
    words = ("capture", "identification", "--port", "bench:?speed=real&creep=0.05", "--dry-run", "-o", "x.h5")
    said = pulsetrainer(tmp_path, *words).out
    assert "would play identification on bench:?speed=real&creep=0.05 and write x.h5" in said
    assert pulsetrainer(tmp_path, *words, "--json").json["port"] == "bench:"


@pytest.mark.realtime
def test_what_cannot_be_resumed_says_why(tmp_path):
    """Nothing there, complete, other options, another signal's recording, still being written."""
    words = ("capture", "identification", "--levels", "12", "--speed", "12", "-o", "run.h5")
    cases = [((), "nothing to resume: neither run.h5 nor run.h5.partial", "leave --resume out")]

    def refused(extra, said, hint):
        done = pulsetrainer(tmp_path, *words, "--resume", *extra)
        assert done.code == 2, done
        assert said in done.err
        assert hint in done.err

    refused(*cases[0])
    slow = ("capture", "identification", "--levels", "12", "--speed", "0.75", "-o", "run.h5")
    killed(tmp_path, (*slow, "--port", "bench:?speed=real"), 200)
    before = (tmp_path / "run.h5.partial").read_bytes()
    refused((), "other options: --speed was 0.75, now it is 12", "same options")
    noted = pulsetrainer(tmp_path, *words)
    assert noted.code == 0, noted
    assert "run.h5.partial holds" in noted.err
    assert "--resume" in noted.err
    refused(("--speed", "0.75"), "run.h5 (-o) already exists", "--overwrite")
    (tmp_path / "run.h5.partial").unlink()
    refused((), "nothing to resume: run.h5 is complete", "leave --resume out")
    (tmp_path / "run.h5").unlink()
    (tmp_path / "run.h5.partial").write_bytes(before)
    with RunRecorder(tmp_path / "other.h5", read_header(tmp_path / "run.h5.partial")) as recorder:
        recorder.append([0.0, 0.001], [0.5, 0.5], [0.5, 0.5], [1.0, 1.0])
        (tmp_path / "run.h5.partial").unlink()
        os.link(tmp_path / "other.h5.partial", tmp_path / "run.h5.partial")
        refused(("--speed", "0.75"), "run.h5.partial is being written by another program", "wait")
    done = pulsetrainer(tmp_path, *words, "--speed", "0.75", "--resume")
    assert done.code == 3
    assert "not that of this signal" in done.err


@pytest.mark.realtime
def test_it_can_be_read_while_it_grows(tmp_path):
    """Another process shows the capture that is under way, and sees it grow."""
    words = ["capture", "diagnostic", "--port", "bench:?speed=real", "-o", "run.h5"]
    process = subprocess.Popen([*PROGRAM, *words], cwd=tmp_path, stdout=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 60
        while not (tmp_path / "run.h5.partial").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        counts = []
        while not counts or counts[-1] == counts[0]:  # two looks may fall between two blocks
            done = pulsetrainer(tmp_path, "show", "run.h5.partial", "--json")
            if done.code == 0 and done.json["facts"]["samples"]:
                counts.append(done.json["facts"]["samples"])
                assert done.json["facts"]["complete"] is False
            assert time.monotonic() < deadline
    finally:
        process.kill()
        process.wait()
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


_PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.mark.slow
def test_memory_does_not_grow_with_the_length(tmp_path):
    """Two hours take no more memory than half of one: the most that is held is one part."""

    def peak_MB(repeats: int) -> float:
        words = ["capture", "diagnostic", "--repeats", str(repeats), "--overwrite", "-o", "run.h5"]
        # a small process in between: a child is charged with the memory of who starts it
        done = subprocess.run(
            [sys.executable, "-c", _PEAK, *PROGRAM, *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        return int(done.stdout.splitlines()[-1]) / 1024

    short, long = peak_MB(20), peak_MB(80)  # a part is full after about twenty
    samples = read(tmp_path / "run.h5", Run).input.size
    print(f"{short:.1f} MB for 32 min, {long:.1f} MB for {samples / 60e3:.0f} min")
    assert samples > 7_200_000
    more_MB = 0.75 * 32 * samples / 1e6  # four columns of what the longer has more, if they were held
    # what waits to be written, and holes in the heap, depend on how busy the machine is
    assert long - short < 0.2 * more_MB
