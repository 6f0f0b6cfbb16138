"""How units and powers are spelled in letters, where a terminal or a pipe has no Unicode."""

from __future__ import annotations

import re

# as the importer reads units
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_IN_LETTERS = str.maketrans(
    {"µ": "u", "μ": "u", "Ω": "Ohm", "°": "deg", "·": "*", "×": "x", "±": "+-", "−": "-"}
)


def in_letters(error: UnicodeError) -> tuple[str | bytes, int]:
    """Spell what an encoding lacks: ``N^2`` for N², an escape where there is no spelling."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    spelled = re.sub(
        "[⁰¹²³⁴-⁹⁻⁺]+", lambda power: "^" + power[0].translate(_RAISED), lacking.translate(_IN_LETTERS)
    )
    return spelled.encode("ascii", "backslashreplace").decode("ascii"), error.end
