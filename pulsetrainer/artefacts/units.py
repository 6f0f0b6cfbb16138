"""Units: which texts are units, which prefixes they take, how a heading gives one, how one is printed.

    unit   = "1" | factor { ("*" | "." | "·" | " " | "/") factor }
    factor = [prefix] symbol [["^"] exponent] | "1"

``A/m``, ``nA m^2``, ``N·m``, ``1/s``, ``m/s²`` and ``mmHg`` are units; ``Newtons per mm`` is not.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pulsetrainer.errors import DataError

if TYPE_CHECKING:
    from pulsetrainer.artefacts import Model, Run, Waveform

_PREFIXES = ("da", *"YZEPTGMkhdcmunpfazyµμ")
_PREFIXED_SYMBOLS = """
    A V N T m g s Pa Hz W J K C F H S rad bar ohm Ohm Ω Wb L l eV Oe G emu gf cd mol Nm Nmm Vs Ah Wh VA Am
"""
_BARE_SYMBOLS = """
    1 % ‰ percent permille ppm ppb ppt ° °C degC degF deg mmHg cmH2O psi lbf lb in inch ft kgf min h d rpm rev
    U/min
    vol% wt% mol% at% µε με
    atm counts count ct LSB digit digits steps step samples sample px a.u. arb au norm dB
"""
# what may stand behind the last underscore of a heading, where most letters and short words are a name's, or,
# of two letters and more, may be all of it
_SUFFIXES = """
    s ms us µs ns min h A mA uA nA pA kA V mV uV kV N mN uN nN cN kN Nm mNm T mT m cm mm um µm nm Pa kPa MPa
    GPa bar mbar mmHg Oe kOe emu uC nC pF nF uF ohm Ohm kOhm Wb mWb uWb Vs mVs ppm m3/m3
    deg rad C °C degC K Hz kHz W g kg % percent permille vol% Vol% wt% µε Ah mAh Wh mWh kWh
    A/m kA/m m/s mm/s cm/s km/h rad/s deg/s N/A N/m N/mm kN/mm V/s A/s N/s mV/V
    l/h l/min l/s L/h L/min L/s ml/min m3/h m3/s U/min
"""
_PREFIXED, _BARE = frozenset(_PREFIXED_SYMBOLS.split()), frozenset(_BARE_SYMBOLS.split())
_BEHIND_A_NAME = frozenset(_SUFFIXES.split())
_OFFERED = _PREFIXED | _BARE | {unit for unit in _BEHIND_A_NAME if "/" not in unit}


def _by_word(units: Mapping[str, str]) -> dict[str, str]:
    """Return the unit of each word, from the words of each unit."""
    return {word: unit for unit, words in units.items() for word in words.split()}


# as oscilloscopes and people spell them
_SPELLED = _by_word(
    {
        "s": "second seconds sec secs sekunde sekunden",
        "ms": "millisecond milliseconds msec millis",
        "us": "microsecond microseconds usec micros",
        "min": "min mins minute minutes minuten",
        "h": "hour hours hr hrs stunde stunden",
        "d": "day days tag tage",
        "V": "volt volts",
        "A": "amp amps ampere amperes",
        "N": "newton newtons",
        "T": "tesla",
        "m": "metre metres meter meters",
        "Pa": "pascal pascals",
        "ohm": "ohm ohms",
    }
)
_SPELLED |= {
    f"{word}{long}": prefix + short
    for word, prefix in {"mega": "M", "kilo": "k", "milli": "m", "micro": "u", "nano": "n"}.items()
    for long, short in _SPELLED.items()
    if short in _PREFIXED
}
_SHARES = _by_word(
    {
        "µε": "microstrain ustrain µstrain μstrain",
        "vol%": "vol% vol-% vol.% vol.-%",
        "%": "10^-2 10**-2 1e-2 10⁻²",
        "‰": "10^-3 10**-3 1e-3 10⁻³",
        "ppm": "10^-6 10**-6 1e-6 10⁻⁶",
    }
)
_SPELLED |= _SHARES
_SPELLED |= dict.fromkeys("-–—\N{MINUS SIGN}", "1")  # "none"
# how a quantity is measured, behind its unit: none changes the numbers of a record
_MANNER = re.compile(r"(?:[\s(]+(?:abs|rel|gauge|rms|eff|pp|pk|peak|ac|dc)\.?|rms|pp)\)?$", re.IGNORECASE)
_NO_UNIT_ALONE = frozenset(["min", "second"])  # the least, the next one
SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0, "ns": 1e-9}
SECONDS |= dict.fromkeys(["us", "µs", "μs"], 1e-6)

_OF_MICRO = "|".join(sorted(_PREFIXED, key=len, reverse=True))
_MICRO = re.compile(rf"(?<![A-Za-zΩµ])u(?=(?:{_OF_MICRO})(?![A-Za-zΩµ]))|\N{{GREEK SMALL LETTER MU}}")
_EXPONENT = re.compile(r"(?:\^|\*\*)?(?P<exponent>[-+]?\d)$|(?P<raised>[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹])$")
_SEPARATOR = re.compile(r"\s*[*·/×]\s*|\s+|(?<=[A-Za-zΩµ])\.(?=[A-Za-zΩµ])")
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*/?\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()\[\]]*)\))\s*$")
# as circuit simulators write a voltage of a node or between two, and a current of an element or its pin
_OF_A_PART = re.compile(r"(?P<what>[Vv]|i|I[bcdegsx]?)\((?!t\))(?P<part>[\w:.,]+)\)")
_NO_PART = 4  # letters of a unit: ``counts`` is hardly the name of a node, ``in`` and ``g`` are
# a quantity's symbol that looks like a unit, over a unit of that quantity (``Weg s/mm``), and words and
# numbers of channels: there the slash does not stand within a unit
_OF_A_SYMBOL = re.compile(
    r"d?[dhls]/.?m$|d?F/.?N$|d?T\w?/(?:K|°?C|degC)$|H/(?!m$)|m\d?/.?g$|d?V/(?:.?[lL]|.?m\^?[3³])$|L/.?H$|C/.?F$"
    r"|W/.?J$|P\w?/.?W$|M\w?/.?Nm$|p\w?/(?:.?Pa|m?bar)$|min/|in/(?!s$|min$)|1/(?!s$|min$|h$)"
)
# quantities behind which a single letter is their unit: "Force N", but not "coil A"
_OF_A_LETTER = {
    unit: [[word] for word in words.split()]
    for unit, words in {
        "N": "force kraft load last", "V": "voltage spannung", "A": "current strom",
        "K": "temperature temperatur", "s": "time zeit t", "h": "time zeit t",
        "m": "position displacement stroke weg hub", "W": "power leistung",
    }.items()
}  # fmt: skip
_MARK = re.compile(r"\s*[/,]\s*|\s+in\s+|\s+(?=[%‰°]\w?$)")
_WORD_BEHIND = re.compile(r"^(?P<name>.*\S)(?<! per)\s+(?P<unit>\S{2,})$")
_SUFFIXED = re.compile(r"^(?P<name>.+)_(?P<unit>[^_\s]{1,12})$")
# as a name without a slash says it, such as one of MATLAB: H_kA_m; V_s and the like may be a product
_COMPOUND = re.compile(r"^(?P<name>.+?)_(?P<top>[^_\s]+)_(?P<per>per_)?(?P<bottom>[^_\s]+)$")
_WITHOUT_PER = frozenset(["A/m", "kA/m", "m/s", "mm/s", "cm/s", "km/h", "rad/s", "deg/s", "mV/V"])
_POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def is_unit(text: str) -> bool:
    """Tell whether a text is a unit."""
    text = text.strip().replace("**", "^")
    if text in _BARE:
        return True
    bare = re.sub(r"[()](\^[-+]?\d)?", " ", text).strip()
    return bool(bare) and all(_is_factor(factor) for factor in _SEPARATOR.split(bare))


def _is_factor(text: str) -> bool:
    found = _EXPONENT.search(text)
    return _is_symbol(text) or (found is not None and _is_symbol(text[: found.start()]))


def _is_symbol(text: str) -> bool:
    if text in _PREFIXED or text in _BARE:
        return True
    return any(text.startswith(p) and text[len(p) :] in _PREFIXED for p in _PREFIXES)


def check_unit(text: str, what: str, where: str = "", remedy: str = "") -> str:
    """Return a unit as it is written; the two letters that look like a micro are one.

    DataError where it is none; ``what`` is the option for it, ``where`` what it was read from, if anything
    ("the heading 'Force (measured)' of scope.csv"), ``remedy`` what may be done but giving the unit.
    """
    text = _SHARES.get(text.strip().lower(), text)  # one that is spelled out is worth a hint
    if is_unit(text):
        return text.strip().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")  # they look the same
    known = [one for one in (symbol_of(text), *text.split()[:1]) if is_unit(one)]  # not bar for mbar
    known += [unit for unit in (*_SUFFIXES.split(), *_OFFERED) if unit.lower() == text.lower()]
    # a heading may have any word there
    near = known[:1] or ([] if where else difflib.get_close_matches(text, _OFFERED, n=2, cutoff=0.5))
    usual = "A" if "input" in what else "N"
    raise DataError(
        f"{text!r} in {where} is not a known unit" if where else f"{what} {text!r} is not a known unit",
        hint=f"did you mean {' or '.join(repr(n) for n in near)}? Write {what} {near[0]}"
        if near
        else f"{remedy}give a known unit, such as {what} {usual} or mm/s^2; 1 stands for a pure number, "
        "% and ‰ for its hundredths and thousandths",
    )


def same_units(ours: Sequence[str], theirs: Sequence[str]) -> bool:
    """Tell whether units are one by one the same; ``um`` is ``µm``."""
    return [_with_micro(one) for one in ours] == [_with_micro(one) for one in theirs]


def as_parameters(input_unit: str, output_unit: str) -> str:
    """Return units as they are given to what reads a table."""
    return f"`input_unit` {input_unit} `output_unit` {output_unit}"


def units_alike(name: str, one: Run | Model, other_name: str, other: Run | Model, apart: str) -> str:
    """Say how two come to the same units, where those of one alone are known; else empty.

    ``apart`` is what to do with two of different devices.
    """
    bare = [not set(map(shown, (each.input_unit, each.output_unit))) - {""} for each in (one, other)]
    if bare[0] == bare[1]:
        return ""
    known, lacks, noun = (other, name, one) if bare[0] else (one, other_name, other)
    anew = f"import the table of {lacks} again with {as_parameters(known.input_unit, known.output_unit)}"
    anew += ", and identify it again" * (noun.kind == "model")
    units = " and ".join(map(shown, (known.input_unit, known.output_unit)))
    return f"if both are of one device, and that table is in {units}: {anew}; otherwise {apart}"


def _with_micro(unit: str) -> str:
    return _MICRO.sub("\N{MICRO SIGN}", unit)


def quantity_in_words(quantity: str) -> str:
    """Return a quantity as it stands in a sentence: what a heading says is no English word, so in quotes."""
    return quantity if quantity in ("current", "force", "input", "output") else f"'{quantity}'"


def symbol_of(text: str) -> str:
    """Return the symbol of a unit that is spelled out or says how it is measured, any other text as it is.

    ``volts`` is V, ``mbar abs`` mbar; a dash is 1, no unit.
    """
    bare = _MANNER.sub("", text)
    symbol = _SPELLED.get(bare.lower(), bare)
    return symbol if is_unit(symbol) else text


def split_unit(heading: str) -> tuple[str, str]:
    """Return name and unit of a column heading; no unit where it says none.

    What stands in brackets at its end is a unit, known or not. Behind a slash, a comma or the word "in" it
    is one if it is known: ``B/T`` is, ``A/B`` and ``H/V ratio`` are names. Behind a blank it is a quotient of
    known units (``Flow l/h``, but ``Weg s/mm`` is a quantity by its unit) or a unit of several letters.
    ``V(in)`` is a voltage of a node.
    """
    if unit := _unit_of_a_part(heading):
        return heading, unit
    if (found := _BRACKETED.match(heading)) and found["name"]:
        return found["name"].rstrip("_ ").lstrip(), (found["square"] or found["round"] or "").strip()
    if parted := _compound(heading) or _suffixed(heading):
        return parted
    if len(heading) > 1 and heading.lower() not in _NO_UNIT_ALONE and _stands_alone(heading):
        return heading, heading
    return _behind_a_mark(heading) or (heading, "")


def _behind_a_mark(heading: str) -> tuple[str, str] | None:
    """Return name and unit where a slash, a comma, "in" or a blank stands before a known unit."""
    for mark in _MARK.finditer(heading):
        name, unit = heading[: mark.start()], heading[mark.end() :].strip()
        if name and name[-1] not in "/," and unit != "1" and is_unit(symbol_of(unit)):
            return _quotient(name, mark.group(), unit) or (name, unit)
    found = _WORD_BEHIND.match(heading)
    if found and found["unit"] in _BEHIND_A_NAME - _NO_UNIT_ALONE:
        return found["name"], found["unit"]
    name, _, letter = heading.rpartition(" ")
    return (name.rstrip(), letter) if name.lower().split()[-1:] in _OF_A_LETTER.get(letter, ()) else None


def _quotient(name: str, mark: str, below: str) -> tuple[str, str] | None:
    """Return name and unit where a slash stands within the unit: its top is the last word of the name.

    With blanks around the slash a single letter is a symbol: ``Kraft F / N``.
    """
    quantity, _, top = name.rpartition(" ")
    unit = top + mark + symbol_of(below)
    within = mark == "/" or (mark.strip() == "/" and len(top) > 1)
    if not quantity or not within or not is_unit(unit) or _OF_A_SYMBOL.match(f"{top}/{below}"):
        return None
    return quantity.rstrip(" :="), unit


def _suffixed(heading: str) -> tuple[str, str] | None:
    found = _SUFFIXED.match(heading)
    if found is None or found["unit"] == "second":
        return None
    top, slash, _ = found["unit"].partition("/")
    per = slash and top in _BEHIND_A_NAME and is_unit(found["unit"])
    return (found["name"], found["unit"]) if per or _stands_alone(found["unit"]) else None


def _compound(heading: str) -> tuple[str, str] | None:
    """Return name and unit where the last two words of a heading make one."""
    found = _COMPOUND.match(heading)
    if found is None:
        return None
    unit = f"{found['top']}/{found['bottom']}"
    if unit == "N/m" and not found["per"]:
        return found["name"], "Nm"  # a torque; a stiffness is not what a sensor reads
    return (found["name"], unit) if unit in (_BEHIND_A_NAME if found["per"] else _WITHOUT_PER) else None


def _unit_of_a_part(heading: str) -> str:
    """Return V or A of ``V(in)``, ``I(L1)`` or ``Ic(Q1)``; empty of ``V(mV)`` and all else."""
    found = _OF_A_PART.fullmatch(heading)
    if found is None:
        return ""
    unit, inner = ("A" if found["what"][0] in "Ii" else "V"), symbol_of(found["part"])
    return "" if is_unit(inner) and (inner.endswith(unit) or len(inner) >= _NO_PART) else unit


def _stands_alone(text: str) -> bool:
    return text in _BEHIND_A_NAME or (len(text) > 3 and _SPELLED.get(text.lower()) in (*_BEHIND_A_NAME, "d"))


def claimed_unit(heading: str) -> str:
    """Return what stands where a heading that says no known unit would say one, empty where nothing does."""
    mark = _MARK.search(heading.strip())
    return "" if mark is None else heading.strip()[mark.end() :]


def unit_of(template: str, input_unit: str, output_unit: str) -> str:
    """Return a unit with ``{u}`` and ``{y}`` filled in; behind a slash a compound one stands in brackets."""
    text = template
    for place, unit in (("{u}", input_unit), ("{y}", output_unit)):
        inner = f"({unit})" if _SEPARATOR.search(unit) else unit
        text = text.removeprefix(f"{place} ") if unit == "1" else text  # no factor
        text = text.replace(f"/{place}", f"/{inner}").replace(place, unit)
    return text


def plain(unit: str) -> str:
    """Return a unit without brackets around one word: ``N/(A)^2``, which formulas make, becomes N/A^2."""
    return re.sub(r"\((\w+)\)", r"\1", unit)


def shown(unit: str) -> str:
    """Return the unit as it is printed: ``N/A^2`` becomes N/A², ``percent`` %, ``1`` nothing."""
    if unit in ("1", "", "dimensionless"):
        return ""
    if unit == "percent":
        return "%"
    head, *powers = plain(unit).replace("**", "^").split("^")
    for power in powers:
        if "." in power:  # there is no raised point
            head += f"^{power}"
            continue
        digits = len(power) - len(power.lstrip("-0123456789"))
        head += power[:digits].translate(_POWERS) + power[digits:]
    printed = head.replace("*", "·").removesuffix("/1²")  # the square of a number without a unit
    return "" if printed == "1" else printed


_WHOLE = 100.0  # from here on no decimals
_EASY = (  # unit, its length, the shortest time told in it; s
    *(("d", 86400.0, 172800.0), ("h", 3600.0, 7200.0), ("min", 60.0, 600.0), ("s", 1.0, 1.0)),
    *((unit, one, one) for unit, one in (("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9), ("ps", 1e-12))),
)


def with_seconds(seconds: float) -> str:
    """Return a time in the unit in which it is easily read: ``2.5 ms``, ``20 ns``, ``173 s``, ``2.5 h``."""
    for unit, one, least in _EASY:
        if abs(seconds) >= least:
            size = seconds / one
            return f"{size:.0f} {unit}" if abs(size) >= _WHOLE else f"{size:.3g} {unit}"
    return f"{seconds:.3g} s"


_SLOW_Hz = 0.1  # a lower frequency is easier to read as a period
_SLOW = 1e-3  # a smaller figure of a rate is easier to read in minutes and longer ...
_READ = 0.01  # ... in which it is no smaller than this


def more_easily(value: float, unit: str) -> str:
    """Return a long time, a low frequency or a slow rate in other units, in which it is easily read.

    ``2.5 h``, ``once in 24.1 h``, ``0.095 %/d``; empty where its own unit will do.
    """
    if unit == "s":
        easy = with_seconds(value)
        return easy if easy.endswith((" min", " h", " d")) else ""
    if unit == "Hz" and 0.0 < value < _SLOW_Hz:
        return f"once in {with_seconds(1.0 / value)}"
    if unit.endswith("/s") and 0.0 < abs(value) < _SLOW:
        times = ("min", "h", "d")
        one = next((one for one in times if abs(value) * SECONDS[one] >= _READ), times[-1])
        return with_unit(f"{value * SECONDS[one]:.2g}", unit.removesuffix("s") + one)
    return ""


def unit_of_axis(seconds: float) -> tuple[str, float]:
    """Return the unit in which an axis of a time so long is easily read, s or more, and its length in s."""
    return next((unit, one) for unit, one, least in _EASY if seconds >= least or unit == "s")


def in_units(measured: Run | Model | Waveform) -> str:
    """Return what units an input and an output have, with a verb: ``is in A and N``, ``has no units``."""
    units = [shown(unit) for unit in (measured.input_unit, measured.output_unit)]
    return f"is in {' and '.join(unit or 'no unit' for unit in units)}" if any(units) else "has no units"


def counted(number: int, noun: str, one: str = "", more: str = "") -> str:
    """Return a number of things, of one in the singular: ``1 sample``, ``2 samples``.

    Behind it stands ``one``, such as a verb, or ``more``: ``1 sample was``, ``2 samples were``.
    """
    return f"{number} {noun} {one}".rstrip() if number == 1 else f"{number} {noun}s {more}".rstrip()


def with_unit(number: str, unit: str) -> str:
    """Return ``1.5 A``; a pure number, whose unit is 1, stays alone."""
    return f"{number} {shown(unit)}".rstrip()
