"""Damaged frames and wild commands under the sanitizers, briefly; `make -C firmware fuzz` takes longer."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from pulsetrainer.resources import firmware_dir

FIRMWARE = firmware_dir()
MILLION = (1_000_000, 15_000)  # damaged frames, wild sequences


def _built(what: str, folder: Path) -> str:
    words = ["make", "-s", "-C", str(FIRMWARE), f"{folder}/{what}", f"BUILD={folder}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return str(folder / what)


@pytest.mark.parametrize("share", [0.1, pytest.param(1.0, marks=pytest.mark.slow)], ids=["tenth", "million"])
def test_a_million_damaged_frames_and_wild_sequences(tmp_path, share):
    """No sanitizer speaks, no invariant breaks, no more damaged frames pass than 16 bits of checksum allow.

    With one to four hurts a frame one in 25 keeps a sound shape and length; of those 2^-16 may pass.
    """
    program = _built("fuzz", tmp_path)
    tried = tuple(round(share * count) for count in MILLION)
    words = [program, "1", *map(str, tried)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    counted = re.findall(r"frames (\d+) intact (\d+) shaped (\d+) wrong (\d+)", done.stdout)[0]
    frames, intact, shaped, wrong = map(int, counted)
    sequences, ran, faults = map(int, re.findall(r"(\d+)", done.stdout.splitlines()[1]))
    assert (frames, sequences) == tried
    assert intact > share * 10_000  # some hurts only add zeros between frames: the reader is not deaf
    assert share * 20_000 < shaped < share * 60_000  # what the checksum is there for
    assert wrong <= 6  # expected: shaped / 65536, which is 0.6; more than 6 once in a hundred thousand seeds
    assert ran > share * 500  # the wild commands do reach the deep states
    assert faults > share * 10


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("clang"), reason="needs clang: apt-get install clang libclang-rt-14-dev")
def test_libfuzzer_finds_nothing_in_seconds(tmp_path):
    """The same sequences led by coverage; skipped where clang has no fuzzer library."""
    probe = tmp_path / "probe.c"
    probe.write_text(
        "#include <stddef.h>\n#include <stdint.h>\n"
        "int LLVMFuzzerTestOneInput(const uint8_t *d, size_t n) { (void)d; (void)n; return 0; }\n",
        encoding="utf-8",
    )
    words = ["clang", "-fsanitize=fuzzer", str(probe), "-o", str(tmp_path / "probe")]
    if subprocess.run(words, capture_output=True, check=False).returncode != 0:
        pytest.skip("this clang has no fuzzer library: apt-get install libclang-rt-14-dev")
    program = _built("fuzz-clang", tmp_path)
    # no limit on resident memory: with huge pages the sanitizer's shadow alone is 1 GB
    limits = ["-malloc_limit_mb=64", "-rss_limit_mb=0"]
    words = [program, "-seed=1", "-max_len=1024", "-runs=20000", *limits]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
