"""The C side of the message tables: the text of ``firmware/core/protocol.h``."""

from __future__ import annotations

import re
import struct
from enum import IntEnum
from typing import TYPE_CHECKING

from pulsetrainer.device import codes
from pulsetrainer.device import messages as m

if TYPE_CHECKING:
    from collections.abc import Iterator

_TOP = """\
/* Ids, payload layouts and limits of the wire protocol.
 * Made from pulsetrainer/device/codes.py and messages.py by `make -C firmware header` (tested). */
#ifndef PULSETRAINER_PROTOCOL_H
#define PULSETRAINER_PROTOCOL_H

#include <stdint.h>

"""
_VERSIONS = ("PROTOCOL_MAJOR", "PROTOCOL_MINOR", "FIRMWARE_MAJOR", "FIRMWARE_MINOR", "FIRMWARE_PATCH")

_CONSTANTS = (
    "MAX_PAYLOAD",
    "TICK_RATE_HZ",
    "WAVE_BUFFER_SAMPLES",
    "MAX_TICKS_PER_SAMPLE",
    "MAX_DECIMATION",
    "HEARTBEAT_MAX_MS",
    "DUTY_FULL",
    "DUTY_SINCE_MINOR",
    "FLAG_LAST",
    "FLAG_SLEW",
    "STATUS_OUTPUT_NOT_OFF",
    "STATUS_HEAT_ASSUMED",
)


def upper(name: str) -> str:
    """Return a name of ours as C says it."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper()


def _enum(prefix: str, members: type[IntEnum]) -> Iterator[str]:
    for item in members:
        yield f"#define PT_{prefix}_{item.name} {item.value}u"


def _message(message: type[m.Message]) -> Iterator[str]:
    name = upper(message.__name__)
    yield f"\n#define PT_{name} 0x{message.TYPE:02X}u"
    offset = 0
    for field, code in message.wire_fields():
        yield f"#define PT_{name}_{field.upper()} {offset}u"
        offset += struct.calcsize("<" + code)
    yield f"#define PT_{name}_LEN {offset}u"
    if message.ITEM:
        yield f"#define PT_{name}_ITEM {message.ITEM}u"
        yield f"#define PT_{name}_MAX_ITEMS {message.MAX_ITEMS}u"


def c_header() -> str:
    """Return the text of ``protocol.h``."""
    lines = [_TOP]
    for name in _VERSIONS:  # a test may build another one
        lines += [f"#ifndef PT_{name}", f"#define PT_{name} {getattr(codes, name)}u", "#endif"]
    lines.append("")
    lines.append(f"#define PT_MAGIC 0x{codes.MAGIC:08X}uL")
    lines.append(f"#define PT_WAVE_OPEN 0x{codes.WAVE_OPEN:08X}uL")
    lines += [f"#define PT_{name} {getattr(codes, name)}u" for name in _CONSTANTS]
    for title, prefix, members in (
        ("what the device is doing", "STATE", codes.State),
        ("first cause of a latched fault", "FAULT", codes.Fault),
        ("why a command was refused", "NAK_CODE", codes.NakCode),
        ("why the device last started", "RESET", codes.ResetCause),
    ):
        lines += ["", f"/* {title} */", *_enum(prefix, members)]
    lines += ["", "/* parameters: X(NAME, id, minimum, default, absolute maximum) */"]
    rows = [
        f"    X({p.name.upper()}, {p.id}, {p.minimum}, {p.default}, {p.maximum})" for p in codes.PARAMETERS
    ]
    lines += ["#define PT_PARAMETERS(X) \\", " \\\n".join(rows)]
    lines += [f"#define PT_PARAM_{p.name.upper()} {p.id}u" for p in codes.PARAMETERS]
    lines += [f"#define PT_DEFAULT_{p.name.upper()} {p.default}" for p in codes.PARAMETERS]
    lines.append(f"#define PT_PARAM_COUNT {len(codes.PARAMETERS)}u")
    lines += ["", "/* messages: type id, offset of each field, length of the fixed part */"]
    for message in (*m.COMMANDS, *m.REPLIES):
        lines += _message(message)
    lines += ["", "/* commands: X(NAME, bytes of one item of the counted tail or 0) */"]
    rows = [f"    X({upper(c.__name__)}, {c.ITEM})" for c in m.COMMANDS]
    lines += ["#define PT_COMMANDS(X) \\", " \\\n".join(rows)]
    lines += ["", "#endif", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    print(c_header(), end="")
