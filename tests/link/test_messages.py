"""Messages mirror themselves, and C agrees with Python about every byte."""

from __future__ import annotations

import re
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol_header import c_header
from pulsetrainer.device import messages as m
from pulsetrainer.resources import firmware_dir
from pulsetrainer.simulation.build import find_compiler

RANGES = {
    "B": (0, 0xFF),
    "H": (0, 0xFFFF),
    "h": (-0x8000, 0x7FFF),
    "I": (0, 2**32 - 1),
    "i": (-(2**31), 2**31 - 1),
}


@st.composite
def messages(draw):
    """Any message of any kind."""
    kind = draw(st.sampled_from([*m.COMMANDS, *m.REPLIES]))
    values = [
        draw(st.binary(min_size=16, max_size=16) if code == "16s" else st.integers(*RANGES[code]))
        for _, code in kind.wire_fields()
    ]
    if kind.ITEM:
        values[-1] = draw(st.integers(kind.MIN_ITEMS, kind.MAX_ITEMS))
        values.append(draw(st.binary(min_size=kind.ITEM * values[-1], max_size=kind.ITEM * values[-1])))
    return kind(*values)


@given(messages())
def test_parse_undoes_pack(message):
    """Every message comes back as it was and fits a frame."""
    payload = message.pack()
    assert type(message).parse(payload) == message
    assert len(payload) <= 128


@given(messages(), st.binary(min_size=1, max_size=4))
def test_only_the_exact_length_is_a_message(message, more):
    """A byte too many or too few is an error, never a guess."""
    payload = message.pack()
    for wrong in [payload + more, *([payload[:-1]] if payload else [])]:
        with pytest.raises(ValueError) as caught:  # noqa: PT011 - its message is looked at
            type(message).parse(wrong)
        assert type(message).__name__ in str(caught.value)


def test_type_ids_are_unique():
    """No two messages share an id."""
    assert len(m.BY_TYPE) == len(m.COMMANDS) + len(m.REPLIES)


def test_committed_header_is_the_one_the_tables_make():
    """firmware/core/protocol.h is up to date."""
    committed = (firmware_dir() / "core" / "protocol.h").read_text(encoding="utf-8")
    assert committed == c_header(), "run `make -C firmware header`"


def test_a_compiled_program_sees_the_same_numbers(tmp_path):
    """What a C compiler makes of the header equals the Python tables."""
    text = (firmware_dir() / "core" / "protocol.h").read_text(encoding="utf-8")
    names = re.findall(r"^#define (PT_\w+) ", text, re.MULTILINE)
    lines = "".join(f'    printf("{n} %lu\\n", (unsigned long)({n}));\n' for n in names)
    source = tmp_path / "print.c"
    source.write_text(
        f'#include <stdio.h>\n#include "protocol.h"\nint main(void)\n{{\n{lines}    return 0;\n}}\n'
    )
    program = tmp_path / "print"
    compiler = [*find_compiler(), "-std=c99", f"-I{firmware_dir() / 'core'}"]
    subprocess.run([*compiler, str(source), "-o", str(program)], check=True)
    printed = dict(line.split() for line in subprocess.check_output([str(program)], text=True).splitlines())
    for kind in (*m.COMMANDS, *m.REPLIES):
        name = "PT_" + re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).upper()
        assert int(printed[name]) == kind.TYPE
        assert int(printed[f"{name}_LEN"]) == kind.layout().size
        for field, _ in kind.wire_fields():
            assert int(printed[f"{name}_{field.upper()}"]) < kind.layout().size
