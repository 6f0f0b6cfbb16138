"""Static analysis of what goes onto the device, with the dsPIC's sizes of int, pointer and double."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from pulsetrainer.resources import firmware_dir

FIRMWARE = firmware_dir()

pytestmark = pytest.mark.skipif(
    not shutil.which("cppcheck"), reason="needs cppcheck: apt-get install --no-install-recommends cppcheck"
)


def test_cppcheck_finds_nothing():
    """Core and register port, clean."""
    words = ["make", "-s", "-C", str(FIRMWARE), "cppcheck"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_platform_file_is_in_force(tmp_path):
    """A shift that is fine in 32 bits is found to be none in 16: the analysis thinks like the dsPIC."""
    source = tmp_path / "wide.c"
    source.write_text("unsigned f(unsigned x) { return x << 20; }\n", encoding="utf-8")
    platform = FIRMWARE / "test" / "dspic33.platform.xml"
    words = ["cppcheck", f"--platform={platform}", "--enable=warning", "--error-exitcode=1", str(source)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "16-bit" in done.stderr
