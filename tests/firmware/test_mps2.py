"""The Cortex-M4F image under the emulator: the same bits, what it costs, a watchdog that bites."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys

import pytest

from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation.build import DEBIAN_PACKAGES, find_compiler

FIRMWARE = firmware_dir()
INCLUDE = [f"-I{FIRMWARE / folder}" for folder in ("core", "hal", "plant")]
SOURCES = [
    FIRMWARE / "test" / "trace.c",
    FIRMWARE / "core" / "pid.c",
    FIRMWARE / "core" / "wave.c",
    *sorted(p for p in (FIRMWARE / "plant").glob("*.c") if p.name != "harness.c"),
]
ZIG = [sys.executable, "-m", "ziglang", "cc"]

pytestmark = [
    pytest.mark.skipif(
        not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
        reason=f"needs apt-get install -y --no-install-recommends {DEBIAN_PACKAGES}",
    ),
]


@pytest.fixture(scope="module")
def make(tmp_path_factory):
    """Make a target of firmware/Makefile in a folder of its own and return what it printed."""
    build = tmp_path_factory.mktemp("mps2")

    def run(target: str, *flags: str) -> str:
        words = ["make", "-s", *flags, "-C", str(FIRMWARE), target, f"BUILD={build}"]
        env = os.environ | {"MAKEFLAGS": ""}
        done = subprocess.run(words, capture_output=True, text=True, check=False, env=env)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def host_compilers() -> list[list[str]]:
    """Every C compiler of this computer for this computer."""
    found = [[name] for name in ("gcc", "clang") if shutil.which(name)] or [find_compiler()]
    return [*found, *([ZIG] if importlib.util.find_spec("ziglang") else [])]


def host_hash(compiler: list[str], real: str, folder) -> str:
    """Hash of 100 000 ticks with the plant in this precision."""
    program = folder / f"trace-{real}"
    flags = ["-std=c99", "-O2", "-ffp-contract=off", f"-DPLANT_REAL={real}", *INCLUDE]
    subprocess.run([*compiler, *flags, *map(str, SOURCES), "-o", str(program)], check=True)
    return subprocess.check_output([str(program)], text=True).strip()


def test_the_image_is_clean_under_strict_warnings(make):
    """-Wall -Wextra -Wconversion -Werror, no C library."""
    assert make("mps2") == ""


@pytest.mark.parametrize(
    "unit",
    ["pid", *(pytest.param(unit, marks=pytest.mark.slow) for unit in ("frame", "wave", "safety", "app"))],
)
def test_the_unit_tests_of_the_core_pass_on_this_processor(make, unit):
    """The same C tests as on the host, each limit and fault to the tick, on the Cortex-M4F."""
    told = make(f"mps2-test-{unit}")  # its exit status is the program's
    assert told.count("ok   ") == (FIRMWARE / "test" / f"test_{unit}.c").read_text(encoding="utf-8").count(
        "    RUN("
    )
    assert "FAIL" not in told


@pytest.mark.slow
def test_loop_and_plant_give_the_same_bits_on_the_emulated_device(make, tmp_path):
    """100 000 ticks of PID and plant: one hash on every host compiler and on the Cortex-M4F."""
    hashes = {compiler[-1]: host_hash(compiler, "float", tmp_path) for compiler in host_compilers()}
    hashes["cortex-m4f"] = make("mps2-trace").strip()
    print("plant in single precision:", hashes)
    assert len(set(hashes.values())) == 1, hashes
    doubles = {compiler[-1]: host_hash(compiler, "double", tmp_path) for compiler in host_compilers()}
    print("plant in double precision:", doubles)
    assert len(set(doubles.values())) == 1, doubles
    assert set(doubles.values()) != set(hashes.values()), "the hash does not see the plant's precision"


def test_the_control_interrupt_and_the_core_stay_within_the_real_device(make):
    """7000 cycles a tick, 8 KB of RAM, 64 KB of flash; twice the instructions of today is a failure too."""
    told = make("cost", "-w")  # as `make -C firmware cost` at a shell, which tells the folders too
    print(told)
    worst = {name: int(most) for name, _, most in re.findall(r"^  (\w+) +(\d+) +(\d+)$", told, re.MULTILINE)}
    assert set(worst) == {"idle", "armed", "running", "ramping", "fault"}
    assert max(worst.values()) == worst["running"]
    # Fourteen cycles of the 16-bit device for each instruction of this one would still fit.
    assert worst["running"] < 7000 / 14
    # of the core here, and of the whole register port by a 16-bit compiler
    flash = [int(one) for one in re.findall(r"flash: code and tables +(\d+)", told)]
    ram = [int(one) for one in re.findall(r"RAM +(\d+) +of 8192", told)]
    assert len(flash) == len(ram) == 2
    assert 4_000 < flash[0] < flash[1] < 65_536
    assert 4_000 < ram[0] < ram[1] < 8_192


def test_a_main_loop_that_hangs_is_restarted(make):
    """The watchdog resets the board, which says so and greets with another nonce; no tick was missed."""
    (first, second) = (line.split() for line in make("mps2-watchdog").splitlines())
    assert (first[0], second[0]) == ("0", "2")  # power, watchdog
    assert first[1] != second[1]
    assert (first[2], second[2]) == ("0", "0")
