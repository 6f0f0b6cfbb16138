"""PROTOCOL.md says what the tables say."""

from __future__ import annotations

import re

import pytest

from protocol_header import upper
from pulsetrainer.device import codes
from pulsetrainer.device import messages as m
from pulsetrainer.device.exchange import TIMEOUTS_S
from pulsetrainer.device.transport import BAUD
from pulsetrainer.resources import firmware_dir

TEXT = (firmware_dir() / "PROTOCOL.md").read_text(encoding="utf-8")


def rows(first: str) -> list[list[str]]:
    """Return the cells of the table whose head begins with a word."""
    table = re.search(rf"^\| {first} \|.*\n\|[-|]+\|\n((?:\|.*\n)+)", TEXT, re.MULTILINE)
    assert table is not None, first
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table[1].splitlines()]


def test_every_command_is_there_with_its_answer():
    """No more, no fewer, in the order of their ids."""
    table = rows("command")
    assert [row[0] for row in table] == [upper(c.__name__) for c in m.COMMANDS]
    for row, command in zip(table, m.COMMANDS, strict=True):
        kind = row[2].split()[0].rstrip(":")
        (answer,) = (r for r in m.REPLIES if upper(r.__name__) == kind)
        assert answer is m._ANSWERS.get(command, m.Ack), row[0]


@pytest.mark.parametrize("command", m.COMMANDS, ids=lambda c: c.__name__)
def test_payloads_are_described_field_by_field(command):
    """As many things as the payload has fields; arrays and their count are told apart."""
    (row,) = (r for r in rows("command") if r[0] == upper(command.__name__))
    fields = [name for name, _ in command.wire_fields()] + (["items"] if command.ITEM else [])
    told = [part for part in row[1].replace("protocol major, minor", "major, minor").split(", ") if part]
    assert len(told) == len(fields), (told, fields)


def test_every_fault_is_there():
    """Every fault but none, each once."""
    names = [name for row in rows("fault") for name in row[0].split(", ")]
    assert sorted(names) == sorted(f.name for f in codes.Fault if f)


def test_every_state_is_there():
    """Every state is in the diagram."""
    diagram = TEXT.partition("## States")[2].partition("|")[0]
    assert set(re.findall(r"\b[A-Z]{4,}\b", diagram)) >= {s.name for s in codes.State}


def test_limits_are_the_compiled_ones():
    """Name, unit and largest value of every limit."""
    limits = {p.name: p for p in codes.PARAMETERS}
    table = rows("parameter")
    assert [row[0] for row in table] == list(limits)[: len(table)]
    for name, unit, value in table:
        assert unit == limits[name].unit
        assert int(re.match(r"\d+", value)[0]) == limits[name].maximum
    assert all(p.name.startswith(("pid_", "feed_")) for p in codes.PARAMETERS[len(table) :])  # the gains


@pytest.mark.parametrize(
    "said",
    [
        f"Protocol {codes.PROTOCOL_MAJOR}.{codes.PROTOCOL_MINOR}.",
        f"({BAUD} baud, 8N1",
        f"payload 0..{codes.MAX_PAYLOAD} bytes",
        f"The buffer holds {codes.WAVE_BUFFER_SAMPLES}.",
        f"at {m.Telemetry.MAX_ITEMS} samples or every 50 ms",
        f"at most {m.TelemetryDuty.MAX_ITEMS} samples of",
        f"duty u16 [1/{codes.DUTY_FULL}]",
        f"at `ticks per sample` ticks of {1e6 / codes.TICK_RATE_HZ:.0f} us",
        f"no sign of life for {codes.HEARTBEAT_MAX_MS} ms",
        f"one sample above {codes.PARAMETERS[1].maximum * codes.CURRENT_UNIT_A:g} A",
        f"three samples above {codes.PARAMETERS[2].maximum * codes.FORCE_UNIT_N:g} N",
        f"a run longer than {codes.PARAMETERS[4].maximum} s",
        f"Flag {codes.FLAG_LAST} marks the last block",
        f"flag {codes.FLAG_SLEW} says that the limit was at work",
        f"(STATUS_REPLY's flag {codes.STATUS_OUTPUT_NOT_OFF}) is the gravest",
        f"allows (STATUS_REPLY's flag {codes.STATUS_HEAT_ASSUMED})",
        f"times exp(-t / {codes.HEAT_TAU_S:.2f} s)",
        f"within\n{1000 * TIMEOUTS_S[0]:.0f} ms, it sends the same frame again, five times",
    ],
)
def test_numbers_in_the_prose(said):
    """Each as the code has it."""
    assert said in TEXT


def test_what_the_safety_unit_counts_is_what_is_told():
    """Debounce and plausibility: from firmware/core/safety.h into the fault table."""
    core = firmware_dir() / "core"
    header = "".join((core / name).read_text(encoding="utf-8") for name in ("safety.h", "heat.h"))
    number = {
        name: int(value) for name, value in re.findall(r"#define (?:SAFETY_)?(\w+) \(?-?(\d+)[uL]*\b", header)
    }
    told = {name: row[1] for row in rows("fault") for name in row[0].split(", ")}

    def amperes(name: str) -> str:
        return f"{number[name] * codes.CURRENT_UNIT_A:g} A"

    def milli(name: str, unit: str) -> str:
        return f"{number[name] * 0.1:g} {unit}"

    assert number["RAIL_DEBOUNCE"] * number["FORCE_UP"] == number["FORCE_FULL"] == 6  # three in a row
    assert told["OVER_FORCE"].startswith("three")
    assert told["FORCE_RAIL"].startswith("three")
    turns = number["TURNS"]
    for fault, words in {
        "CURRENT_FROZEN": [
            milli("FROZEN_REFERENCE_100UA", "mA"),
            milli("FROZEN_TICKS", "ms"),
            f"{number['FROZEN_DUTY_COUNTS']} counts",
        ],
        "FORCE_FROZEN": [
            amperes("FROZEN_FORCE_BASE_100UA"),
            f"{number['FROZEN_FORCE_PER_5_MN'] * 200 * codes.CURRENT_UNIT_A:g} A more",
        ],
        "NO_CURRENT": [
            milli("NO_CURRENT_100UA", "mA"),
            milli("NO_CURRENT_TICKS", "ms"),
            milli("WEAK_TICKS", "ms"),
        ],
        "CURRENT_IMPLAUSIBLE": [
            f"{turns * 2 ** number['VOLTAGE_SHIFT'] / 10:g} ms",
            f"{number['VOLTAGE_HIGH_20THS'] / 20:g} or",
            f"{number['VOLTAGE_LOW_20THS'] / 20:g} times",
            f"{number['VOLTAGE_SPAN_COUNTS']} counts",
        ],
        "NO_FORCE": [
            f"{turns * number['PLAUSIBLE_FULL'] / number['PLAUSIBLE_UP'] / 10:g} ms",
            f"{number['NO_FORCE_MN'] / 1000:g} N",
            f"a {number['FLOOR_MARGIN_PER_TRIP']}th",
            f"{number['CEILING_MARGIN_MN'] / 1000:g} N",
        ],
        "FORCE_ZERO": [f"-{number['ZERO_LOW_MN'] / 1000:g} to {number['ZERO_HIGH_MN'] / 1000:g} N"],
        "STRAY_CURRENT": [milli("STRAY_100UA", "mA"), milli("STRAY_TICKS", "ms")],
        "OUTPUT_NOT_OFF": [milli("STRAY_100UA", "mA"), milli("OFF_TICKS", "ms")],
        "COIL_HEAT": [f"({(number['HEAT_LIMIT'] ** 0.5) * codes.CURRENT_UNIT_A:g} A)^2"],
    }.items():
        for word in words:
            assert word in told[fault], (fault, word)
    assert number["COMPARATOR_TICKS"] == 3
    assert told["COMPARATOR"].endswith("three ticks in a row")
