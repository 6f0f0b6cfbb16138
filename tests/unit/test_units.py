"""Units: what a header or an option says must be one, in the eyes of pint too."""

from __future__ import annotations

import numpy as np
import pint
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import pulsetrainer as pt
from pulsetrainer.artefacts.units import (
    SECONDS,
    check_unit,
    counted,
    in_units,
    is_unit,
    more_easily,
    same_units,
    shown,
    split_unit,
    symbol_of,
    unit_of,
    with_seconds,
)
from pulsetrainer.errors import DataError
from wording import raises

SI = ["A", "mA", "N", "kN", "A/m", "T", "mT", "nm", "V", "Pa", "bar", "mbar", "N*m", "m/s", "m/s^2", "nA*m^2"]
SI += [
    "1/s",
    "Hz",
    "deg",
    "rad",
    "K",
    "ms",
    "kg",
    "J/kg",
    "rad/s",
    "ohm",
    "eV",
    "N·m",
    "m/s²",
    "s^-1",
    "kohm",
    "MΩ",
    "N*mm",
    "Wh",
]
REGISTRY = pint.UnitRegistry()  # half a second to make
OTHER = [
    "kOhm",
    "MOhm",
    "1",
    "%",
    "°C",
    "mmHg",
    "a.u.",
    "LSB",
    "counts",
    "µm",
    "emu",
    "Oe",
    "psi",
    "Nm",
    "mVs",
]
NONE = ["measured", "Newtons per mm", "xyz", "", "??", "m//s", "3", "N N N x", "A/", "force"]


QUANTITIES = [
    "t",
    "Zeit",
    "I",
    "B",
    "H",
    "F",
    "s",
    "T",
    "u",
    "dT",
    "Strom",
    "force_2",
    "x/y",
    "A/B",
    "coil I",
]


def test_one_thing_is_told_in_the_singular():
    """With its verb; none and several are not."""
    assert [counted(n, "sample", "was", "were") for n in (0, 1, 2)] == [
        "0 samples were",
        "1 sample was",
        "2 samples were",
    ]
    assert [counted(n, "row") for n in (1, 3)] == ["1 row", "3 rows"]


@pytest.mark.parametrize("text", SI + OTHER)
def test_units(text):
    """Symbols with prefixes, products, quotients and powers."""
    assert is_unit(text)


@pytest.mark.parametrize("text", SI)
def test_pint_knows_them_too(text):
    """An independent reader of units agrees."""
    plain = text.replace("·", "*").replace("²", "^2").replace("nA m", "nA*m").replace("A m", "A*m")
    REGISTRY.Unit(plain.removeprefix("1/") if plain.startswith("1/") else plain)


@settings(max_examples=300, deadline=None)
@given(
    name=st.sampled_from(QUANTITIES),
    written=st.sampled_from(
        ["{}/{}", "{} / {}", "{}/({})", "{} / ({})", "{} [{}]", "{}({})", "{} in {}", "{}, {}", "{},{}"]
    ),
    unit=st.sampled_from(SI + OTHER + ["min", "h", "minutes", "Volt"]) | st.sampled_from(NONE),
)
def test_a_heading_is_a_quantity_and_a_unit_however_they_are_parted(name, written, unit):
    """Only brackets make a unit of what is none: behind anything else the heading is a name."""
    assume((name, written) != ("I", "{}({})"))  # a current of an element
    heading = written.format(name, unit)
    if (is_unit(symbol_of(unit)) and unit != "1") or written[-1] in ")]":
        assert split_unit(heading) == (name, unit)
    else:
        assert split_unit(heading) == (heading, "")


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("H_kA_m", "H", "kA/m"),
        ("tip_speed_mm_s", "tip_speed", "mm/s"),
        ("H_A_per_m", "H", "A/m"),
        ("U_V_per_s", "U", "V/s"),
        ("torque_N_m", "torque", "Nm"),
        ("flux_V_s", "flux_V", "s"),
        ("kA_m", "kA", "m"),
        ("Tip_Angle_[deg]", "Tip_Angle", "deg"),
        ("E_kV/mm", "E", "kV/mm"),
        ("pressure_kN/m2", "pressure", "kN/m2"),
        ("Q_mAh", "Q", "mAh"),
        ("time_days", "time", "days"),
        ("v_d", "v_d", ""),
        ("ratio_A/B", "ratio_A/B", ""),
    ],
)
def test_a_name_of_a_program_says_a_unit_without_a_slash(heading, name, unit):
    """``H_kA_m`` and ``E_kV/mm`` were lengths; of V and s nobody can tell whether they are multiplied."""
    assert split_unit(heading) == (name, unit)


QUOTIENTS = "l/h m3/h L/min ml/min mm/s km/h m/s^2 m/s² K/min U/min rad/s A/m kA/m kV/mm N/mm2 kN/m2 mV/V"


@given(
    name=st.sampled_from(["Durchfluss", "x", "H", "T", "coil I", "Spannung U", "x/y", "A/B", "force_2"]),
    written=st.sampled_from(["{} [{}]", "{}({})", "{}_{}", "{}/{}", "{} / {}", "{} {}"]),
    unit=st.sampled_from([*QUOTIENTS.split(), "mbar", "kN", "mm", "ms", "degC"]),
)
def test_a_unit_is_read_back_behind_a_blank_too(name, written, unit):
    """``Durchfluss l/h`` was a ``Durchfluss l`` in hours."""
    assert split_unit(written.format(name, unit)) == (name, unit)


@pytest.mark.parametrize(
    "written",
    [
        *("s/mm", "F/kN", "T/°C", "H/A/m", "H/Oe", "dT/K", "V/ml", "Tm/K", "M/Nm"),
        *("F / N", "A / s", "I / A", "1/N", "min/N", "in/bar"),
    ],
)
def test_the_symbol_of_a_quantity_over_its_own_unit_is_no_unit(written):
    """``Weg s/mm`` is a path s in mm, although both are units."""
    symbol, unit = written.split("/", 1)
    assert split_unit(f"x {written}") == (f"x {symbol.strip()}", unit.strip())


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("x l/h", "x", "l/h"),
        ("x mm / s", "x", "mm / s"),
        ("x 1/min", "x", "1/min"),
        ("x V/V", "x", "V/V"),
        ("x H/m", "x", "H/m"),
        ("x: m/s", "x", "m/s"),
        ("x m3/hour", "x", "m3/h"),
        ("x N/mm2 abs", "x", "N/mm2"),
        ("force/current N/A", "force/current", "N/A"),
        ("Newtons per mm", "Newtons per mm", ""),
        ("Kraft min", "Kraft min", ""),
        ("coil A", "coil A", ""),
        ("Force N", "Force", "N"),
        ("supply voltage V", "supply voltage", "V"),
        ("t s", "t", "s"),
        ("Kanal V", "Kanal V", ""),
        (" N", " N", ""),
    ],
)
def test_the_reading_with_known_units_on_both_sides_of_the_slash_is_taken(heading, name, unit):
    """Behind a blank alone a single letter is rather a name."""
    assert split_unit(heading) == (name, unit)


@pytest.mark.parametrize("written", ["PWM [-]", "PWM (-)", "PWM [–]", "PWM [1]", "PWM []", "PWM / -"])
def test_a_dash_says_that_there_is_no_unit(written):
    """It was refused as an unknown one."""
    name, unit = split_unit(written)
    assert (name, symbol_of(unit) or "1") == ("PWM", "1")


@pytest.mark.parametrize(
    ("written", "unit"),
    [
        ("mbar abs", "mbar"),
        ("mbar(abs)", "mbar"),
        ("V rms", "V"),
        ("Vrms", "V"),
        ("A eff.", "A"),
        ("volts RMS", "V"),
        ("rms", "rms"),
        ("dac", "dac"),
        ("mbar foo", "mbar foo"),
    ],
)
def test_how_a_quantity_is_measured_is_no_part_of_its_unit(written, unit):
    """Of ``mbar abs`` the command said "did you mean 'bar'"."""
    assert symbol_of(written) == unit


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("Water content [vol%]", "vol%"), ("theta (Vol.-%)", "vol%"), ("Wassergehalt Vol%", "vol%"),
        ("S [10^-3]", "‰"), ("S (1e-3)", "‰"), ("S / 10⁻³", "‰"), ("S [10**-6]", "ppm"),
        ("strain_ustrain", "µε"), ("eps [microstrain]", "µε"), ("eps [µε]", "µε"),
        ("eps [\N{GREEK SMALL LETTER MU}ε]", "µε"),
    ],
)  # fmt: skip
def test_a_share_is_read_as_people_write_it(heading, unit):
    """Also as an option; of 10^-3 the hint was to write 1, without the factor."""
    written = split_unit(heading)[1]
    assert check_unit(symbol_of(written), "input unit") == check_unit(written, "--input-unit") == unit


@pytest.mark.parametrize(("wrong", "unit"), [("mbar foo", "mbar"), ("mBar", "mbar"), ("degrees", "deg")])
def test_the_unit_that_is_offered_first_has_the_same_prefix(wrong, unit):
    """Another one is off by a factor of a thousand."""
    with raises(DataError, "a unit like it", argument="output unit", wrong=wrong, unit=unit):
        check_unit(wrong, "output unit")


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [(one, one, "V") for one in ("V(in)", "V(n001)", "v(out)", "V(g)", "V(a,b)", "V(x1:m3)", "V(1)")]
    + [(one, one, "A") for one in ("I(L1)", "I(V1)", "i(l1)", "Ic(Q1)", "Ix(u1:IN)", "I(min)")]
    + [("V(mV)", "V", "mV"), ("V(V)", "V", "V"), ("I(A)", "I", "A"), ("I(kA)", "I", "kA"), ("T(K)", "T", "K")]
    + [("v(mm/s)", "v", "mm/s"), ("V(counts)", "V", "counts"), ("V(volts)", "V", "volts"), ("v(t)", "v", "t")]
    + [("u (V)", "u", "V"), ("V (in)", "V", "in"), ("V[in]", "V", "in"), ("force(N)", "force", "N")]
    + [("Voltage (mV)", "Voltage", "mV"), ("in(N)", "in", "N"), ("U(in)", "U", "in"), ("I(%)", "I", "%")],
)
def test_a_circuit_simulator_writes_a_voltage_of_a_node(heading, name, unit):
    """What stands in its brackets is a node or an element, unless it is a unit of voltage or current."""
    assert split_unit(heading) == (name, unit)


def test_units_of_time_are_as_long_as_pint_says():
    """Without a unit a time is in seconds."""
    told = {unit: REGISTRY.Quantity(1.0, unit).to("s").magnitude for unit in SECONDS if unit}
    assert told | {"": 1.0} == pytest.approx(SECONDS)


@pytest.mark.parametrize("text", NONE)
def test_no_units(text):
    """Words, and what does not parse."""
    assert not is_unit(text)
    with raises(DataError, "no such unit", argument="input unit", place="the heading 'x' of a.csv"):
        check_unit(text, "input unit", "the heading 'x' of a.csv")


def test_the_hint_for_an_unknown_share_keeps_its_factor():
    """Only 1 was named for numbers without a unit."""
    with raises(DataError, "no such share", place="the heading 'x' of a.csv"):
        check_unit("thousandths", "input unit", "the heading 'x' of a.csv")


@pytest.mark.parametrize(
    ("template", "u", "unit"),
    [("{y} s/{u}", "kA/m", "T s/(kA/m)"), ("{y} s/{u}", "A", "T s/A"), ("{u}/{y}", "N mm", "N mm/T"),
     ("1/({u})^2", "A/m", "1/(A/m)^2"), ("{u}/s", "kA/m", "kA/m/s")],
)  # fmt: skip
def test_a_unit_behind_a_slash_stands_in_brackets(template, u, unit):
    """One that is itself a quotient; what comes of it is a unit."""
    assert unit_of(template, u, "T") == unit
    assert is_unit(unit)


def test_a_pure_number_is_no_factor_of_a_unit():
    """It was printed as ``1 (s/Oe)^0.5``; above a slash it stays."""
    assert unit_of("{y} (s/{u})^0.5", "Oe", "1") == "(s/Oe)^0.5"
    assert unit_of("{y} s/{u}", "Oe", "1") == "s/Oe"
    assert unit_of("{y}/{u}", "Oe", "1") == "1/Oe"


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (2e-8, "20 ns"), (0.0025, "2.5 ms"), (1.0, "1 s"), (173.0, "173 s"), (599.0, "599 s"),
        (600.0, "10 min"), (7199.0, "120 min"), (7200.0, "2 h"), (173_000.0, "2 d"), (-20.0, "-20 s"),
    ],
)  # fmt: skip
def test_a_time_is_told_in_the_unit_that_fits(seconds, said):
    """From nanoseconds to days."""
    assert with_seconds(seconds) == said


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (2.59e6, "s", "30 d"), (599.0, "s", ""), (1.155e-5, "Hz", "once in 24.1 h"), (0.1, "Hz", ""),
        (0.05, "Hz", "once in 20 s"), (0.0, "Hz", ""), (1.098e-6, "%/s", "0.095 %/d"),
        (-5e-4, "N/s", "-0.03 N/min"), (5e-6, "mm/m/s", "0.018 mm/m/h"), (1e-3, "N/s", ""), (0.0, "N/s", ""),
        (1e-9, "N/s", "8.6e-05 N/d"), (1e-6, "N", ""),
    ],
)  # fmt: skip
def test_what_is_slow_is_told_in_longer_times(value, unit, said):
    """A day is no 1.155e-05 Hz to anybody."""
    assert more_easily(value, unit) == said


@pytest.mark.parametrize(
    ("unit", "printed"), [("N/A^2", "N/A²"), ("(V s)^0.5", "(V s)^0.5"), ("Hz^-0.5", "Hz^-0.5")]
)
def test_a_power_is_raised_whole_or_not_at_all(unit, printed):
    """There is no raised point."""
    assert shown(unit) == printed


def test_the_two_letters_that_look_like_micro_are_one_unit():
    """A keyboard gives one, a character table the other."""
    assert check_unit("\N{GREEK SMALL LETTER MU}m", "input unit") == check_unit(
        "\N{MICRO SIGN}m", "input unit"
    )


@pytest.mark.parametrize(
    ("ours", "theirs", "same"),
    [
        ("um", "\N{MICRO SIGN}m", True),
        ("um", "\N{GREEK SMALL LETTER MU}m", True),
        ("uN/um", "\N{MICRO SIGN}N/\N{MICRO SIGN}m", True),
        ("um^2", "\N{MICRO SIGN}m^2", True),
        ("um", "mm", False),
        ("emu", "em\N{MICRO SIGN}", False),
        ("um", "m", False),
    ],
)
def test_micro_is_one_prefix_however_it_is_spelled(ours, theirs, same):
    """A record and a model in `um` and `µm` are of one device."""
    assert same_units(("A", ours), ("A", theirs)) is same


@pytest.mark.parametrize(
    ("units", "said"),
    [
        ("A N", "is in A and N"),
        ("1 1", "has no units"),
        ("V 1", "is in V and no unit"),
        ("A m^2", "is in A and m²"),
    ],
)
def test_the_units_of_a_run_in_words(units, said):
    """A table without units was told to be in 1 and 1."""
    of_input, of_output = units.split()
    run = pt.Run(None, np.zeros(2), np.zeros(2), input_unit=of_input, output_unit=of_output)
    assert in_units(run) == said
