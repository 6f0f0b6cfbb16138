"""How units and powers are spelled in letters, where a terminal or a pipe has no Unicode."""

from __future__ import annotations

import codecs
import io
import re
import sys

# as the importer reads units
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_IN_LETTERS = str.maketrans(
    {"µ": "u", "μ": "u", "Ω": "Ohm", "°": "deg", "·": "*", "×": "x", "±": "+-", "−": "-"}
)


def _in_letters(error: UnicodeError) -> tuple[str | bytes, int]:
    """Spell what an encoding lacks: ``N^2`` for N², an escape where there is no spelling."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    spelled = re.sub(
        "[⁰¹²³⁴-⁹⁻⁺]+", lambda power: "^" + power[0].translate(_RAISED), lacking.translate(_IN_LETTERS)
    )
    return spelled.encode("ascii", "backslashreplace").decode("ascii"), error.end


def speak_any_encoding() -> None:
    """Let a terminal or pipe without Unicode show what it cannot spell in letters, instead of failing."""
    codecs.register_error("in letters", _in_letters)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            spelled = stream.encoding.lower().replace("-", "") == "utf8" and stream.errors != "strict"
            if not spelled:
                stream.reconfigure(errors="in letters")
