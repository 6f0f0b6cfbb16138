"""Whether a text is a unit: products, quotients and powers of known symbols, with SI prefixes.

    unit   = "1" | factor { ("*" | "." | "·" | " " | "/") factor }
    factor = [prefix] symbol [["^"] exponent] | "1"

``A/m``, ``nA m^2``, ``N·m``, ``1/s``, ``m/s²`` and ``mmHg`` are units; ``measured`` and ``Newtons per mm``
are none.
"""

from __future__ import annotations

import difflib
import re

from pulsetrainer.errors import DataError

_PREFIXED = "A V N T m g s Pa Hz W J K C F H S rad bar ohm Ω Wb L l eV Oe G emu gf cd mol"
_BARE = """
    1 % percent ppm ° °C degC degF deg mmHg cmH2O psi lbf lb in inch ft kgf min h d rpm rev atm
    counts count ct LSB digit digits steps step px a.u. arb au norm dB
"""
_PREFIXES = ("da", *"YZEPTGMkhdcmunpfazyµμ")
_SYMBOLS = frozenset(_PREFIXED.split())
_WHOLE = frozenset(_BARE.split())
# as oscilloscopes spell them
_SPELLED = {
    **dict.fromkeys(["second", "seconds", "sec"], "s"),
    **dict.fromkeys(["volt", "volts"], "V"),
    **dict.fromkeys(["amp", "amps", "ampere", "amperes"], "A"),
    **dict.fromkeys(["newton", "newtons"], "N"),
}
_EXPONENT = re.compile(r"(?:\^|\*\*)?(?P<exponent>[-+]?\d)$|(?P<raised>[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹])$")
_SEPARATOR = re.compile(r"\s*[*·/×]\s*|\s+|(?<=[A-Za-zΩµ])\.(?=[A-Za-zΩµ])")


def is_unit(text: str) -> bool:
    """Tell whether a text is a unit."""
    text = text.strip().replace("**", "^")
    if text in _WHOLE:
        return True
    bare = text.replace("(", " ").replace(")", " ").strip()
    factors = _SEPARATOR.split(bare)
    return bool(bare) and all(_is_factor(factor) for factor in factors)


def symbol_of(text: str) -> str:
    """Return the symbol of a unit that is spelled out, any other text as it is."""
    return _SPELLED.get(text.lower(), text)


def _is_factor(text: str) -> bool:
    if text in _WHOLE or _is_symbol(text):
        return True
    found = _EXPONENT.search(text)
    return found is not None and _is_symbol(text[: found.start()])


def _is_symbol(text: str) -> bool:
    if text in _SYMBOLS or text in _WHOLE:
        return True
    return any(text.startswith(p) and text[len(p) :] in _SYMBOLS for p in _PREFIXES)


def check_unit(text: str, where: str, option: str) -> str:
    """Return a unit as it is written.

    Parameters
    ----------
    where
        What has it, for the message: "the heading 'Force (measured)' of scope.csv".
    option
        How the user can give another.

    Raises
    ------
    DataError
        It is no unit.
    """
    if is_unit(text):
        return text.strip()
    near = difflib.get_close_matches(text, [*_SYMBOLS, *_WHOLE], n=2, cutoff=0.5)
    meant = f"did you mean {' or '.join(repr(n) for n in near)}? " if near else ""
    raise DataError(
        f"{where} gives the unit {text!r}, which is none",
        hint=f"{meant}give one, such as {option} N, or {option} 1 where there is none",
    )
