"""The register port, never compiled with the vendor's compiler: what can be checked of it all the same.

Behind a header of ours whose registers log every write: the order of the writes, the arithmetic, the core
running on it, what two compilers and a third with 16-bit integers say, and the memory it needs.
"""

from __future__ import annotations

import functools
import platform
import re
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

import pytest
from test_core import compilers

from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation.build import find_compiler

FIRMWARE = firmware_dir()
SOURCES = [*sorted((FIRMWARE / "core").glob("*.c")), *sorted((FIRMWARE / "port" / "dspic33").glob("*.c"))]
INCLUDE = [f"-I{FIRMWARE / folder}" for folder in ("core", "hal", "port/dspic33", "test/xc_shim")]
STRICT = ["-std=c99", "-Os", "-ffreestanding", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"]
RAM_BYTES = 8 * 1024
FLASH_BYTES = 64 * 1024
STACK_BYTES = 1024  # what the link reserves: --stack in firmware/Makefile


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    """The port's test program, built by the Makefile's own rule under the sanitizers."""
    build = tmp_path_factory.mktemp("dspic33")
    words = ["make", "-s", "-C", str(FIRMWARE), f"{build}/test_dspic33", f"BUILD={build}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return build / "test_dspic33"


def test_order_arithmetic_and_the_core_on_registers(program):
    """Off before everything; converters powered, ready, enabled, calibrated; a run and its faults."""
    done = subprocess.run([str(program)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("ok   ") == 22


def test_start_up_writes_these_registers_in_this_order(program):
    """The golden sequence: a change here wants a look into the data sheet first."""
    log = subprocess.check_output([str(program), "log"], text=True)
    assert log == Path(__file__).with_name("dspic33_start.txt").read_text(encoding="utf-8")


def test_a_converter_that_never_gets_ready_is_waited_for_with_the_output_off(program):
    """The wait has no end of its own: the watchdog, on from reset, ends it."""
    done = subprocess.run([str(program), "stuck"], capture_output=True, text=True, check=False)
    assert (done.returncode, "waits for ever" in done.stdout) == (3, True)
    assert _configured("WDTEN") == "ON"


def test_a_locked_pwm_is_never_started(program):
    """Its output could not be switched off: the start ends there, and the configuration says unlocked."""
    done = subprocess.run([str(program), "locked"], capture_output=True, text=True, check=False)
    assert (done.returncode, "waits for ever" in done.stdout) == (3, True)
    assert _configured("PWMLOCK") == "OFF"


def _configured(name: str) -> str:
    main = (FIRMWARE / "port" / "dspic33" / "main.c").read_text(encoding="utf-8")
    found = re.search(rf"#pragma config {name} = (\w+)", main)
    assert found is not None
    return found[1]


@pytest.mark.parametrize("compiler", compilers(), ids=lambda c: c[-1])
def test_the_port_is_clean_under_strict_warnings(compiler, tmp_path):
    """-Wall -Wextra -Wconversion -Werror by every compiler of this computer."""
    for source in SOURCES:
        words = [*compiler, *STRICT, *INCLUDE, "-c", str(source), "-o", str(tmp_path / "unit.o")]
        subprocess.run(words, check=True)


@pytest.mark.skipif(not shutil.which("avr-gcc"), reason="needs avr-gcc: apt-get install gcc-avr")
def test_core_and_port_mean_the_same_where_int_has_16_bits(tmp_path):
    """The dsPIC's int, pointer and double have 2, 2 and 4 bytes; so have those of avr-gcc, which warns."""
    for source in SOURCES:
        words = ["avr-gcc", "-mmcu=atmega2560", *STRICT, *INCLUDE, "-c", str(source)]
        subprocess.run([*words, "-o", str(tmp_path / "unit.o")], check=True)


@pytest.mark.parametrize("compiler", ["avr-gcc -mmcu=atmega2560", "clang --target=msp430"])
def test_the_memory_of_the_port_is_printed_as_an_estimate(compiler, tmp_path):
    """Two compilers with 16-bit integers and pointers: both within half of the flash, and within the RAM."""
    if not shutil.which(compiler.split()[0]):
        pytest.skip(f"needs {compiler.split()[0]}")
    words = ["make", "-s", "-C", str(FIRMWARE), "dspic33-size", f"BUILD={tmp_path}", f"SIZE_CC={compiler}"]
    printed = subprocess.check_output(words, text=True)
    assert "an estimate" in printed
    flash, ram = (int(found) for found in re.findall(r"(\d+) +of", printed))
    assert 8 * 1024 < flash < FLASH_BYTES // 2
    assert 4 * 1024 < ram < RAM_BYTES


@functools.cache
def _objects(folder: Path) -> tuple[Path, ...]:
    """Core and port compiled for a 32-bit machine, with their call graphs: never smaller than a dsPIC's."""
    words = ["-m32", "-fno-pic", "-fno-stack-protector", "-fno-asynchronous-unwind-tables", "-fno-common"]
    units = []
    for source in SOURCES:
        unit = folder / f"{source.parent.name}-{source.stem}.o"
        graph = ["-fcallgraph-info=su"] if _has_call_graph() else []
        command = [*find_compiler(), *STRICT, *words, *graph, *INCLUDE, "-c", str(source), "-o", str(unit)]
        subprocess.run(command, check=True)
        units.append(unit)
    return tuple(units)


@functools.cache
def _has_call_graph() -> bool:
    version = subprocess.run(
        [*find_compiler(), "--version"], capture_output=True, text=True, check=True
    ).stdout
    return "Free Software Foundation" in version


@pytest.fixture(scope="module")
def sizes(tmp_path_factory) -> tuple[int, int, tuple[Path, ...]]:
    """Bytes of flash and of static RAM, and the objects."""
    if platform.machine() not in {"x86_64", "AMD64"}:
        pytest.skip("-m32 is for x86-64 compilers")
    units = _objects(tmp_path_factory.mktemp("budget"))
    table = subprocess.check_output(["size", *map(str, units)], text=True).splitlines()[1:]
    text, data, bss = (sum(int(line.split()[k]) for line in table) for k in range(3))
    return text + data, data + bss, units


def test_memory_is_within_budget(sizes, capsys):
    """Static RAM and the stack fit in 8 KB; the code fits in half of 64 KB, as another instruction set's."""
    flash, ram, _ = sizes
    with capsys.disabled():
        print(f"\ndsPIC33 budget: flash {flash} of {FLASH_BYTES}, static RAM {ram} of {RAM_BYTES}")
    assert flash < FLASH_BYTES // 2
    assert ram + 2 * STACK_BYTES < RAM_BYTES


def test_the_deepest_calls_fit_the_stack(sizes, capsys):
    """Main loop, tick and both UART interrupts at their deepest, one on top of the other."""
    if not _has_call_graph():
        pytest.skip("needs gcc's -fcallgraph-info")
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = defaultdict(set)
    for unit in sizes[2]:
        for line in unit.with_suffix(".ci").read_text(encoding="utf-8").splitlines():
            if found := re.match(r'node: \{ title: "([^"]+)" label: ".*\\n(\d+) bytes', line):
                frames[found[1]] = int(found[2])
            elif found := re.match(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', line):
                calls[found[1]].add(found[2])

    def depth(name: str, above: tuple[str, ...] = ()) -> int:
        assert name not in above, f"recursion: {above}"
        deepest = max((depth(other, (*above, name)) for other in calls[name]), default=0)
        return frames.get(name, 0) + deepest

    parts = {
        name: depth(name)
        for name in ("main", "_ADCAN2Interrupt", "_U1RXInterrupt", "_U1TXInterrupt", "_T1Interrupt")
    }
    with capsys.disabled():
        print(f"\ndsPIC33 stack (32-bit build): {parts}, together {sum(parts.values())} of {STACK_BYTES}")
    assert sum(parts.values()) < STACK_BYTES
