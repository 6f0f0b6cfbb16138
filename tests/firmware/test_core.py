"""The portable core: its unit tests, what it may not use, and that every compiler means the same by it."""

from __future__ import annotations

import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys

import pytest

from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation.build import find_compiler

FIRMWARE = firmware_dir()
CORE = sorted((FIRMWARE / "core").glob("*.c"))
PLANT = sorted(p for p in (FIRMWARE / "plant").glob("*.c") if p.name != "harness.c")
INCLUDE = [f"-I{FIRMWARE / folder}" for folder in ("core", "hal", "plant")]


def compilers() -> list[list[str]]:
    """Every C compiler of this computer."""
    found = [[name] for name in ("gcc", "clang") if shutil.which(name)] or [find_compiler()]
    if importlib.util.find_spec("ziglang"):
        found.append([sys.executable, "-m", "ziglang", "cc"])
    return found


@pytest.mark.parametrize("unit", ["frame", "wave", "pid", "safety", "app"])
def test_unit(unit, tmp_path):
    """The C tests of this unit pass under the address and undefined-behaviour sanitizers."""
    words = ["make", "-s", "-C", str(FIRMWARE), f"test-{unit}", f"BUILD={tmp_path}"]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, env=os.environ | {"MAKEFLAGS": ""}
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("compiler", compilers(), ids=lambda c: c[-1])
def test_core_is_clean_under_strict_warnings(compiler, tmp_path):
    """-Wall -Wextra -Wconversion -Werror, with no hosted headers at hand."""
    flags = ["-std=c99", "-O2", "-ffreestanding", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"]
    for source in CORE:
        subprocess.run(
            [*compiler, *flags, *INCLUDE, "-c", str(source), "-o", str(tmp_path / "unit.o")], check=True
        )


@pytest.mark.skipif(os.name != "posix", reason="the host port is POSIX")
@pytest.mark.parametrize("compiler", compilers(), ids=lambda c: c[-1])
def test_plant_and_host_port_are_clean_under_strict_warnings(compiler, tmp_path):
    """The same for what surrounds the core on this computer."""
    flags = ["-std=c99", "-O2", "-D_XOPEN_SOURCE=700", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    port = FIRMWARE / "port" / "host"
    for source in [*PLANT, *sorted(port.glob("*.c"))]:
        words = [*compiler, *flags, *INCLUDE, f"-I{port}", "-c", str(source), "-o", str(tmp_path / "unit.o")]
        subprocess.run(words, check=True)


def test_core_has_no_floating_point(tmp_path):
    """The sources name no floating type, and none hides in a literal."""
    for path in [*CORE, *(FIRMWARE / "core").glob("*.h")]:
        code = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not re.search(r"\b(float|double)\b|\b\d+\.\d", code), path.name


def test_core_asks_nothing_of_the_world_but_the_hal(tmp_path):
    """No malloc, no libc beyond what a compiler itself may call."""
    defined, wanted = set(), set()
    for source in CORE:
        unit = tmp_path / f"{source.stem}.o"
        words = ["-std=c99", "-Os", "-ffreestanding", "-fno-stack-protector", "-fno-pic"]
        subprocess.run([*find_compiler(), *words, *INCLUDE, "-c", str(source), "-o", str(unit)], check=True)
        for line in subprocess.check_output(["nm", str(unit)], text=True).splitlines():
            *_, kind, name = line.split()
            (wanted if kind == "U" else defined).add(name)
    foreign = {name for name in wanted - defined if not name.startswith("hal_")}
    assert foreign <= {"memcpy", "memset"}, foreign


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="-m32 is for x86-64 compilers")
def test_core_divides_no_64_bit_number(tmp_path):
    """A 32-bit build would call a library for that; it does not."""
    for source in CORE:
        unit = tmp_path / f"{source.stem}.o"
        words = ["-m32", "-std=c99", "-Os", "-ffreestanding", "-fno-stack-protector", "-fno-pic"]
        subprocess.run([*find_compiler(), *words, *INCLUDE, "-c", str(source), "-o", str(unit)], check=True)
        symbols = subprocess.check_output(["nm", "-u", str(unit)], text=True)
        assert not re.search(r"__u?(div|mod)[dt]i", symbols), source.name


@pytest.mark.slow
def test_loop_and_plant_give_the_same_bits_however_compiled(tmp_path):
    """100 000 ticks of PID and plant: one hash for every compiler and optimisation."""
    hashes = {}
    for compiler in compilers():
        for level in ("-O0", "-O2", "-O3"):
            program = tmp_path / f"trace{level}"
            sources = [
                FIRMWARE / "test" / "trace.c",
                FIRMWARE / "core" / "pid.c",
                FIRMWARE / "core" / "wave.c",
                *PLANT,
            ]
            flags = ["-std=c99", level, "-ffp-contract=off", *INCLUDE]
            subprocess.run([*compiler, *flags, *map(str, sources), "-o", str(program)], check=True)
            hashes[(compiler[-1], level)] = subprocess.check_output([str(program)], text=True).strip()
    assert len(set(hashes.values())) == 1, hashes
