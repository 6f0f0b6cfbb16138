"""Tables: any dialect reads to the same numbers; what is wrong is named by line and column."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pulsetrainer.errors import AbsentError, ArgumentError, DataError, ExistsError, UsageError
from pulsetrainer.files.csv_dialect import detect
from pulsetrainer.files.csv_rows import PIECE, parse
from pulsetrainer.files.input_file import check_file
from pulsetrainer.files.run_from_table import _without_bad_rows, run_from_table
from pulsetrainer.files.table import read_table, write_table
from wording import raises, tells


def read_run(path, **columns):
    """Return the run in a table."""
    return run_from_table(path, **columns).run


DATA = Path(__file__).resolve().parents[1] / "data"
COLUMNS = {"input": "u", "output": "y"}


@pytest.fixture
def table(tmp_path):
    """Return a function that reads a text as a table."""

    def read(text, encoding="utf-8", keep=None):
        path = tmp_path / "t.csv"
        path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return read_table(path, keep)

    return read


def _numbers(read):
    """Return all columns side by side."""
    return np.column_stack(list(read.columns.values()))


def _refused(table, text, *words):
    """Assert that a text is no table, and that the message has these words."""
    with pytest.raises(DataError) as caught:
        table(text)
    for word in ("t.csv", *words):
        assert word in caught.value.message
    assert caught.value.hint
    assert caught.value.exit_code == 3


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_every_dialect_reads_to_the_same_numbers(data, tmp_path_factory):
    """Delimiter, decimal sign, header, comments, blank lines, line ends, encoding: the numbers are equal."""
    delimiter = data.draw(st.sampled_from([",", ";", "\t", " ", "  ", " ; "]))
    comma = delimiter.strip() != "," and data.draw(st.booleans())
    width = data.draw(st.integers(2, 4))
    overloads = (9.9e37, 9.91e37)  # read as missing
    number = st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: abs(x) not in overloads)
    rows = data.draw(st.lists(st.lists(number, min_size=width, max_size=width), min_size=1, max_size=8))
    names = data.draw(st.sampled_from([None, ["t_s", "current_A", "Kraft(N)", "B[T]"][:width]]))
    filler = st.lists(st.sampled_from(["", "   ", "# pause"]), max_size=2)
    written = [delimiter.join(map(repr, row)) for row in rows]
    if comma:
        written = [line.replace(".", ",") for line in written]
    lines = [delimiter.join(names)] if names else []
    for line in written:
        lines += [*data.draw(filler), line]
    lines += data.draw(filler)
    text = data.draw(st.sampled_from(["\n", "\r\n"])).join(lines) + data.draw(st.sampled_from(["", "\n"]))
    path = tmp_path_factory.mktemp("dialect") / "t.csv"
    path.write_bytes(text.encode(data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le"]))))
    read = read_table(path)
    np.testing.assert_array_equal(_numbers(read), rows)
    pieces = parse(path, detect(path), piece=data.draw(st.integers(1, 60)))
    np.testing.assert_array_equal(np.column_stack(pieces.columns), rows)
    assert pieces.shifts == read.shifts
    assert read.names == tuple(names or [f"column{k + 1}" for k in range(width)])
    for row, line in enumerate(written):
        assert text.splitlines()[read.line_of(row) - 1] == line


@settings(max_examples=60, deadline=None)
@given(
    values=st.lists(st.floats(), max_size=20),
    names=st.lists(st.text(st.characters(codec="utf-8"), max_size=8), min_size=2, max_size=3, unique=True),
)
def test_what_is_written_is_written(values, names, tmp_path_factory):
    """The file has the header, and every number to the last bit, NaN and infinities included."""
    path = tmp_path_factory.mktemp("write") / "t.csv"
    write_table(path, dict.fromkeys(names, values), comments=["source: here\nand there"])
    content = path.read_bytes()
    assert content.startswith(b"# source: here\n# and there\n")
    last = content.splitlines()[len(content.splitlines()) - len(values) :] if values else []
    np.testing.assert_array_equal([float(line.split(b",")[1]) for line in last], values)


def test_write_and_read(tmp_path):
    """What write_table writes, read_table reads, units and comments too."""
    columns = {"t_s": np.arange(20_000) / 1e3, "current (A)": np.random.default_rng(1).random(20_000)}
    write_table(tmp_path / "t.csv", columns, comments=["source: here"])
    read = read_table(tmp_path / "t.csv")
    for name, values in columns.items():
        np.testing.assert_array_equal(read.column(name), values)
    assert read.units == {"t_s": "s", "current (A)": "A"}
    assert read.comments == ("source: here",)
    with pytest.raises(ExistsError):
        write_table(tmp_path / "t.csv", columns)
    write_table(tmp_path / "t.csv", {"a": [1.0], "b": [2.0]}, overwrite=True)
    with raises(ArgumentError, "two lengths"):
        write_table(tmp_path / "x.csv", {"a": [1.0], "b": [2.0, 3.0]})
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("current_A", "current", "A"),
        ("Force (N)", "Force", "N"),
        ("time [ms]", "time", "ms"),
        ("Kraft / N", "Kraft", "N"),
        ("coil_current", "coil_current", ""),
        ("H_A/m", "H", "A/m"),
        ("H/A/m", "H", "A/m"),
        ("kA/m", "kA/m", "kA/m"),
        ("current_amps", "current", "A"),
        ("M / Nm", "M", "Nm"),
        ("Durchfluss l/h", "Durchfluss", "l/h"),
        ("Druck (mbar abs)", "Druck", "mbar"),
        ("PWM [-]", "PWM", "1"),
        ("H/V ratio", "H/V ratio", ""),
        ("A / B", "A / B", ""),
        ("N", "N", ""),
        ("min", "min", ""),
        ("force_uN", "force", "uN"),
        ("R_kOhm", "R", "kOhm"),
        ("timestamp_ns", "timestamp", "ns"),
        ("Moment (Am2)", "Moment", "Am2"),
        ("Strain (ppt)", "Strain", "ppt"),
        ("(N)", "(N)", ""),
        ("x", "x", ""),
        ("RH %", "RH", "%"),
        ("T °C", "T", "°C"),
        ("C_pF", "C", "pF"),
        ("Temperatur °C (°C)", "Temperatur °C", "°C"),
    ],
)
def test_units_in_headings(table, heading, name, unit):
    """A unit is read where a heading says one; the column answers to its name without it, in any case."""
    read = table(f"t;{heading}\n0;1\n1;2\n")
    assert read.unit(heading) == unit
    assert read.unit(name.upper()) == unit


@pytest.mark.parametrize("remark", ["", ",Remark"])
@pytest.mark.parametrize("rows", [2, 30])
def test_a_line_of_units_below_the_header(table, rows, remark):
    """Oscilloscopes put the units on a line of their own; a remark has none."""
    blank = remark and ","
    text = "".join(f"{k},{k % 7}{blank}\n" for k in range(rows))
    read = table(f"Time,Ch 1{remark}\n(ms),(V){blank}\n{text}")
    assert read.units == {"Time": "ms", "Ch 1": "V"}
    assert (read.line_of(0), read.rows) == (3, rows)


@pytest.mark.parametrize(
    ("header", "first", "other"),
    [
        ("t_s,u_V,y_N,note\n", "begin", ","),
        ("t_s,u_V,y_N,note\n", "begin", ",0"),
        ("t_s,u_V,y_N,note\n", "begin", ",ok"),
        ("t_s,u_V,y_N,note\n", "begin", ""),
        ("t_s,u_V,y_N,note,who\n", "begin,me", ",,"),
        ("rig 7,,,\nt_s,u_V,y_N,note\n", "begin", ","),
        ("", "begin", ","),
    ],
)
def test_a_remark_in_the_first_row_makes_no_heading_of_it(table, header, first, other):
    """The row counts, and so do the names above it; a remark may be all that is there of its column."""
    rows = "".join(f"{k / 100},{k % 7},{k % 5}{other}\n" for k in range(1, 30))
    read = table(f"{header}0.00,0.5,0.25,{first}\n{rows}", keep=lambda head: range(3))
    assert read.names[:2] == (("t_s", "u_V") if header else ("column1", "column2"))
    run = read_run(read.path, input=read.names[1], output=read.names[2])
    np.testing.assert_array_equal(run.time_s[:2], [0, 0.01])
    np.testing.assert_array_equal(run.input[:2], [0.5, 1])


@pytest.mark.parametrize(
    ("header", "first"),
    [
        *product(
            ["t_s,u_V,y_N\n", "t,u,y\ns,V,N\n"], ["0,OVER,0.1", "0,OVER,OVER", "0,,0.1", "0,1", "0,1,2,3"]
        ),
        *product(["rig 7\nt_s,u_V,y_N\n"], ["0,OVER,0.1", "0,OVER,OVER", "0,,0.1", ",,"]),
    ],
)
def test_a_bad_first_row_is_a_bad_row(table, header, first):
    """The names and the columns are those of the rows below; the row is named, or left out and counted."""
    rows = "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(1, 30))
    path = table(f"{header}{rows}").path
    path.write_text(f"{header}{first}\n{rows}")
    line = header.count("\n") + 1
    with pytest.raises(DataError) as caught:
        read_run(path, **COLUMNS)
    assert f"line {line}" in caught.value.message
    read = run_from_table(path, skip_bad_rows=True, **COLUMNS)
    assert read.notes == (f"1 of 30 rows of {path} lacks a number and was left out: line {line}",)
    assert (read.run.input_unit, read.run.output_unit) == ("V", "N")
    np.testing.assert_array_equal(read.run.time_s, np.arange(1, 30) / 100)


@pytest.mark.parametrize(
    "text",
    [
        "sep=;\nt;u\n0;1,5\n1;2,5\n",
        "# t;u\n0;1.5\n1;2.5\n",
        "t;u;\n0;1,5;\n1;2,5;\n",
        "t;u\n0;1.5;\n1;2.5;\n",
        '"t";"u"\n"0";"1,5"\n"1";"2,5"\n',
        "t u\n0 1,5\n1 2,5\n",
        "t\tu\n0\t1,5\n1\t2,5",
        "t, u\n0, 1.5\n1, 2.5\n",
        "t;u\n0;1,5\n# pause\n\n1;2,5\n",
    ],
)
def test_habits_of_programs(table, text):
    """A declared delimiter, a header in a comment, delimiters at line ends, quotes, blanks."""
    read = table(text)
    assert read.names == ("t", "u")
    np.testing.assert_array_equal(_numbers(read), [[0, 1.5], [1, 2.5]])


_ROWS = [(k / 100, k % 7 / 2, k % 5 / 4) for k in range(12)]
_POINT = "".join("%.2f,%.1f,%.2f\n" % row for row in _ROWS)  # noqa: UP031 - as an instrument does
_TABS = _POINT.replace(",", "\t").replace(".", ",")


@pytest.mark.parametrize(
    ("text", "names", "units"),
    [
        (
            "Model,MSO24\n\nSample Interval,0.01\nLabels,,\nTIME,CH1,CH2\n" + _POINT,
            ("TIME", "CH1", "CH2"),
            {},
        ),
        ("Time,A,B\n(s),(V),(mV)\n\n" + _POINT, ("Time", "A", "B"), {"Time": "s", "A": "V", "B": "mV"}),
        ("Measurement\t\nSign\t,\n***End***\t\n\t\nX\tU\tF\n" + _TABS, ("X", "U", "F"), {}),
        ("% t u y\n" + _POINT.replace(",", " "), ("t", "u", "y"), {}),
        ("// rig 7\n// by me\nt,u,y\n" + _POINT, ("t", "u", "y"), {}),
        ("; generator 0.5\n; 2 channels\nt,u,y\n" + _POINT, ("t", "u", "y"), {}),
        ("t|u|y\n" + _POINT.replace(",", "|"), ("t", "u", "y"), {}),
        ('t,u,y\n"0,00","0,0","0,00"\n' + '"0,01","0,5","0,25"\n', ("t", "u", "y"), {}),
        (
            "Model,MSO44\n\nHorizontal Units,s\nProbe,1,1\n,\nLabel,,\nTIME,CH1,CH2\n" + _POINT,
            ("TIME", "CH1", "CH2"),
            {},
        ),
        (
            "x-axis,1,2\nsecond,Volt,Volt\n" + _POINT,
            ("x-axis", "1", "2"),
            {"x-axis": "s", "1": "V", "2": "V"},
        ),
        (
            "LECROY,1,Wave\nSegments,1,Size,12\nSegment,Trig,Since\n#1,04-Mar-2024,0\nTime,U,F\n" + _POINT,
            ("Time", "U", "F"),
            {},
        ),
        (_POINT.replace(",", "D+00  ").replace("\n", "d0\n"), ("column1", "column2", "column3"), {}),
    ],
)
def test_habits_of_instruments(table, text, names, units):
    """Words above the table, remarks of any sign, bars, commas in quotes, the exponents of Fortran."""
    read = table(text)
    assert read.names == names
    assert read.units == units
    np.testing.assert_array_equal(_numbers(read), _ROWS[: read.rows])
    assert read.rows in (2, 12)
    assert text.splitlines()[read.line_of(read.rows - 1) - 1] == text.splitlines()[-1]


@pytest.mark.parametrize("heading", [[], ["t,u,y,state"]])
def test_no_row_above_a_bad_one_is_taken_for_a_comment(table, heading):
    """Of a table with a column of text only the rows behind the bad one were read, without a word."""
    rows = [f"{0.1 * k:.1f},{k % 5},{k % 3},ok" for k in range(60)]
    rows[40] += ",1"
    _refused(table, "\n".join([*heading, *rows]), f"5 columns in line {41 + len(heading)}")


@pytest.mark.parametrize("remark", ["", "\tbegin"])
def test_a_heading_of_remarks_may_have_no_cells(table, remark):
    """LabVIEW names a column of comments and ends its rows before it, most often all of them."""
    first, rest = _TABS.split("\n", 1)
    read = table(f"X\tU\tF\tComment\n{first}{remark}\n{rest}")
    assert read.text_names == {"Comment"}
    np.testing.assert_array_equal([read.column(name) for name in "XUF"], np.transpose(_ROWS))


@pytest.mark.parametrize("end", ["", ","])
def test_an_oscilloscope_that_writes_its_step_beside_the_names(table, end):
    """The rows are counted; the increment gives them their time."""
    rows = "".join(f"{k},{k % 7},{k % 5}{end}\n" for k in range(20))
    read = table(f"X,CH1,CH2,Start,Increment{end}\nSequence,Volt,Volt,-1.0,2.0e-3\n{rows}")
    assert read.names == ("X", "CH1", "CH2")
    assert read.unit("CH1") == "V"
    run = read_run(read.path, input="CH1", output="CH2")
    np.testing.assert_allclose(run.time_s, 2e-3 * np.arange(20), rtol=1e-12)


def test_an_oscilloscope_that_leaves_two_cells_blank_in_every_row(table):
    """Its settings have columns of their own, in which no row has anything."""
    rows = "".join(f"{k},{k % 7},{k % 5},,\n" for k in range(20))
    read = table(f"X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.0,2.0e-3\n{rows}")
    assert (read.names, read.rows, read.rate_Hz) == (("X", "CH1", "CH2"), 20, 500.0)


@pytest.mark.parametrize("words", ["run 7\tHall probe\tVSM", "float\tfloat\tfloat", "\tHall probe\t"])
def test_a_line_of_words_below_the_units(table, words):
    """Origin writes comments there, and others the kind of number: neither is a name or a unit."""
    read = table(f"Time\tField\tMoment\ns\tOe\temu\n{words}\n" + 2 * _TABS)
    assert read.names == ("Time", "Field", "Moment")
    assert read.units == {"Time": "s", "Field": "Oe", "Moment": "emu"}
    assert read.comments == (words.strip(),)


def test_the_minus_of_a_word_processor(table):
    """It is another letter than that of the keyboard."""
    read = table("u,y\n" + 12 * "\N{MINUS SIGN}0.5,\N{MINUS SIGN}2e-3\n")
    assert (read.column("u")[0], read.column("y")[11]) == (-0.5, -2e-3)


@pytest.mark.parametrize("cell", ["9.91E+37", "9.9E+37", "-9.900000e37"])
@pytest.mark.parametrize("remark", ["", "ok"])
def test_what_an_instrument_writes_for_no_reading_is_none(table, cell, remark):
    """An overload is not 1e38 volts: such a row is left out, or named."""
    path = table(f"t_s,u,y,Remark\n{_times(5, remark)}5,5,{cell},{remark}\n{_times(5, remark, 6)}").path
    with pytest.raises(
        DataError, match=rf"{re.escape(repr(cell))} \(an overload\) in column y, line 7 \(1 of 11 rows"
    ):
        read_run(path, **COLUMNS)
    assert read_run(path, **COLUMNS, skip_bad_rows=True).output.max() == 10.0


def _times(count, remark, first=0):
    """Return rows of a time, an input and an output that go on."""
    return "".join(f"{k},{k},{k},{remark}\n" for k in range(first, first + count))


def test_a_column_whose_name_differs_in_case_from_the_time(table):
    """``t`` and ``T`` are time and temperature."""
    read = table("t/s,T/\N{DEGREE SIGN}C,strain/%\n" + 2 * _POINT)
    assert (read.index("T"), read.index("t"), read.index("Strain")) == (1, 0, 2)


def test_text_in_the_first_cell_of_the_first_row_hides_no_heading(table):
    """It is a bad row, named with its line, and can be left out; the names above it are names."""
    text = "t,u,y\nbegin,0.0,0.0\n" + 2 * _POINT
    _refused(table, text, "'begin' in column t, line 2")


def test_a_line_of_text_above_numbers_is_a_comment(table):
    """One cell is no heading of two columns: they are numbered."""
    read = table("my instrument\n" + "".join(f"{k};{k / 8}\n" for k in range(14)))
    assert (read.names, read.rows, read.comments) == (("column1", "column2"), 14, ("my instrument",))


def test_a_header_of_another_count_is_still_an_error(table):
    """However many rows follow."""
    _refused(table, "t,u\n" + _POINT, "2 column names", "3 columns in line 2")
    _refused(table, "t,u,y\n" + 3 * "1,2\n" + _POINT, "2 columns in line 2", "expected 3")


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (("12:00:01", "12:00:02.25"), (43201, 43202.25)),
        (("2024-05-01T12:00:00", "2024-05-01 12:00:00.5"), (1714564800, 1714564800.5)),
        (("11:59:59 AM", "12:00:01 PM"), (43199, 43201)),
        (("2024/05/01 12:00:00", "2024/5/1 12:00:00.5"), (1714564800, 1714564800.5)),
        (("5/1/2024 11:59:59 AM", "5/1/2024 12:00:01 PM"), (1714564799, 1714564801)),
        (("31/12/2024 23:59", "01/01/2025 00:01"), (1735689540, 1735689660)),
        (("12/31/2024 23:59", "01/01/2025 00:01"), (1735689540, 1735689660)),
        (("11/02/2024 23:59", "12/02/2024 00:01"), (1707695940, 1707696060)),
        (("02/11/2024 23:59", "02/12/2024 00:01"), (1707695940, 1707696060)),
        (("01.05.2024 12:00:00", "1.5.2024 12:00:00,5"), (1714564800, 1714564800.5)),
        (("00:59.75", "01:00.25"), (59.75, 60.25)),
        (("2024-05-01T14:00:00+02:00", "2024-05-01T12:00:00,5Z"), (1714564800, 1714564800.5)),
    ],
)
def test_times_of_day_and_time_stamps_are_seconds(table, cells, seconds):
    """Loggers write them; a decimal comma elsewhere is no second decimal sign."""
    path = table(f"when (UTC);u;y\n{cells[0]};0,5;1\n{cells[1]};1,5;1\n").path
    np.testing.assert_array_equal(read_run(path, **COLUMNS).time_s, seconds)
    read = table("when;u;y\n2024-02-30T12:00:00;1;2\n25;1;2\n")
    assert read.text_names == {"when"}
    assert table("when;u;y\n25/25/2024 12:00;1;2\n25;1;2\n").text_names == {"when"}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize("days", ["11/02 12/02", "02/11 02/12"])
def test_the_last_rows_tell_the_order_of_a_date(table, days, encoding):
    """Both days may be either; midnight comes long after the first rows, and is a minute away."""
    before, after = (f"{day}/2024" for day in days.split())
    rows = [f"{before} 23:{k // 60:02}:{k % 60:02}" for k in range(3600)]
    rows += [f"{after} 00:00:{k:02}" for k in range(60)]
    text = "when;u;y\n" + "".join(f"{row};{k % 7};1\n" for k, row in enumerate(rows))
    run = read_run(table(text.encode(encoding)).path, **COLUMNS)
    np.testing.assert_array_equal(np.diff(run.time_s), np.ones(3659))


def test_times_of_day_go_on_after_midnight(table):
    """A day is added, and said; a step back that is no midnight is refused."""
    rows = [(86_390 + k) % 86_400 for k in range(30)]
    lines = [f"{s // 3600:02}:{s // 60 % 60:02}:{s % 60:02};{s % 7};1\n" for s in rows]
    read = run_from_table(table("when;u;y\n" + "".join(lines)).path, **COLUMNS)
    np.testing.assert_array_equal(np.diff(read.run.time_s), np.ones(29))
    assert any("midnight" in note for note in read.notes)
    named = run_from_table(table("When [s];u;y\n" + "".join(lines)).path, **COLUMNS, time="when")
    np.testing.assert_array_equal(named.run.time_s, read.run.time_s)
    later = "".join([*lines[:5], *lines[2:]])
    with pytest.raises(DataError):
        read_run(table("when;u;y\n" + later).path, **COLUMNS)


def test_a_counter_of_32_bits_that_begins_again(table):
    """Microseconds of a microcontroller do so after 72 minutes."""
    rows = "".join(f"{(2**32 - 5000 + 1000 * k) % 2**32},{k % 3},{k}\n" for k in range(20))
    read = run_from_table(table("micros,u,y\n" + rows).path, **COLUMNS)
    np.testing.assert_allclose(np.diff(read.run.time_s), 1e-3, rtol=1e-9)
    assert any("begins again, as a counter of 32 bits does" in note for note in read.notes)


@pytest.mark.parametrize(
    ("heading", "first", "step", "step_s", "told"),
    [
        ("timestamp", 1_772_366_400_000, 10, 0.01, "ms since 1970"),
        ("time", 1_772_366_400_000_000, 1000, 1e-3, "us since 1970"),
        ("time_utc", 1_772_366_400_000_000_000, 1_000_000, 1e-3, "ns since 1970"),
        ("Date/Time", 46_082.5, 0.25, 21_600.0, "days of a spreadsheet"),
    ],
)
def test_counts_since_a_date_are_told_by_their_size(table, heading, first, step, step_s, told):
    """As seconds they would be thousands of years, or a second for a day; it is said."""
    rows = "".join(f"{first + k * step},{k % 3},{k}\n" for k in range(20))
    read = run_from_table(table(f"{heading},u,y\n" + rows).path, **COLUMNS)
    np.testing.assert_allclose(np.diff(read.run.time_s), step_s, rtol=1e-3)
    assert any(f"taken as {told}, by its size" in note for note in read.notes)


@pytest.mark.parametrize(("heading", "said"), [("Zeit", True), ("Zeit [s]", False), ("Zeit (ms)", False)])
def test_a_time_without_a_unit_in_slow_steps_may_be_in_ms(table, heading, said):
    """A recorder of 2 kHz was read as one of 2 Hz, and nothing but a summary showed it."""
    rows = "".join(f"{k / 2},{k % 7},{k % 5}\n" for k in range(200))
    read = run_from_table(table(f"{heading},u,y\n{rows}").path, **COLUMNS)
    assert any("if it is in ms, write the heading as 'Zeit [ms]'" in note for note in read.notes) is said


@pytest.mark.parametrize(
    ("heading", "first", "told"),
    [
        ("ts_ms", "1750000000000", "ms since 1970"),
        ("unix", "1750000000", "s since 1970"),
        ("time_utc", "1750000000", "s since 1970"),
        ("time (UTC)", "1750000000", "s since 1970"),
        ("t_us", "1750000000", ""),  # half an hour
        ("when", "2026-11-27 10:00:00", ""),  # nobody has to guess
    ],
)
def test_a_time_since_1970_is_told_whatever_the_heading_says_of_its_unit(table, heading, first, told):
    """The guide promises a note."""
    last = first[:-1] + "9"
    read = run_from_table(table(f"{heading},u,y\n{first},0,1\n{last},1,2\n").path, **COLUMNS)
    assert read.run.time_s is not None
    said = [note for note in read.notes if "1970" in note]
    assert len(said) == bool(told)
    assert all(f"{heading} of" in note and f"taken as {told}, by its size" in note for note in said)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["T_degC"], "T_degC"),
        (["a", "b", "c", "d", "e", "f"], "a, b, c, d and 2 more"),
        (["remark"], ""),
    ],
)
def test_columns_that_were_not_read_are_named(table, more, told):
    """One of them may be what the model misses; text is none, nor another time, nor a row's number."""
    cells = ",".join("x" if name == "remark" else "7" for name in more)
    rows = "".join(f"{k},{k / 10},{k % 3},{k},{k},{cells}\n" for k in range(20))
    path = table(f"n,t_s,u,y,timestamp,{','.join(more)}\n" + rows).path
    read = run_from_table(path, **COLUMNS, time="t_s")
    assert list(read.notes) == ([f"columns of {path} that were not read: {told}"] if told else [])


def test_stamps_of_more_digits_than_a_number_holds_are_told(table):
    """In 1 us of 1.8e18 ns a quarter is lost: the steps are uneven by so much."""
    rows = "".join(f"{1_772_366_400_000_000_000 + 1000 * k},{k % 3},{k}\n" for k in range(20))
    read = run_from_table(table("timestamp_ns,u,y\n" + rows).path, **COLUMNS)
    assert any("have more digits than a number holds" in note for note in read.notes)


@pytest.mark.parametrize(
    ("comment", "rate_Hz"),
    [
        ("Sample rate: 500 Hz", 500.0),
        ("Sampling Rate (kHz) = 2,5", 2500.0),
        ("sample interval, 4e-3 s", 250.0),
        ("Sampling period: 5 min", 1.0 / 300.0),
        ("Sampling period: 5 weeks", None),
        ("resampled by 3", None),
    ],
)
def test_a_rate_in_the_comments_is_that_of_a_table_without_time(table, comment, rate_Hz):
    """It is said; a table that has a time keeps it, and rows that were left out cannot be counted."""
    rows = "".join(f"{k % 3},{k}\n" for k in range(20))
    read = run_from_table(table(f"# {comment}\nu,y\n" + rows).path, **COLUMNS)
    if rate_Hz is None:
        assert read.run.time_s is None
    else:
        np.testing.assert_allclose(read.run.time_s, np.arange(20) / rate_Hz, rtol=1e-12)
        assert comment in read.notes[0]
    gap = table(f"# {comment}\nu,y\n" + rows + "nan,1\n").path
    assert run_from_table(gap, **COLUMNS, skip_bad_rows=True).run.time_s is None


def test_labview_without_a_column_of_time(table):
    """The column is there, and nothing in it; the header has the step."""
    head = "LabVIEW\t\nDelta_X\t0.005000\t0.005000\n***End_of_Header***\t\t\nX_Value\tu\ty\tComment\n"
    run = read_run(table(head + "".join(f"\t{k % 3}\t{k}\n" for k in range(20))).path, **COLUMNS)
    np.testing.assert_allclose(run.time_s, 0.005 * np.arange(20), rtol=1e-12)


def test_numbers_of_the_rows_before_the_time_are_no_time(table):
    """What `to_csv` of pandas writes: a column without a name that counts, then the time."""
    rows = "".join(f"{k},{k / 50},{k % 7},{k % 5}\n" for k in range(40))
    for heading in (",time,u,y\n", "index,t,u,y\n", "Sample,t (s),u,y\n"):
        run = read_run(table(heading + rows).path, input="u", output="y")
        np.testing.assert_allclose(np.diff(run.time_s), 0.02)


def test_a_time_behind_a_date_is_found(table):
    """A data logger writes both in columns of their own; a date alone is text."""
    rows = "".join(f"28.02.2024;23:59:{30 + k},500;{k % 7},5;{k % 5},0\n" for k in range(20))
    run = read_run(table(f"Date;Time;u;y\n{rows}").path, input="u", output="y")
    np.testing.assert_allclose(np.diff(run.time_s), 1.0)


@pytest.mark.parametrize("cell", ["1e101", "-1e308"])
def test_what_no_quantity_reaches_is_refused(table, cell):
    """Its square is infinite: no figure and no fit would come of it."""
    path = table(f"when,u,y\n0,1,2\n1,{cell},3\n2,1,2\n").path
    with raises(DataError, "out of all bounds", place="t.csv, column u", first="line 3"):
        read_run(path, **COLUMNS)


def test_comments_are_those_above_the_first_row(table):
    """A remark between the rows is no header, and no comment on the record."""
    read = table("# source: here\n0,1\n# a,b\n1,2\n")
    assert read.comments == ("source: here",)
    assert read.names == ("column1", "column2")


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_the_mark_of_a_remark_may_name_the_column_of_numbers(table, delimiter):
    """A first column is often called ``#``: its line was taken for a comment, and no name was read."""
    rows = [["#", "t(s)", "phi(deg)"], *([str(k), str(0.1 * k), str(k * k)] for k in range(20))]
    read = table("# made by X500\n" + "\n".join(map(delimiter.join, rows)))
    assert read.names == ("#", "t(s)", "phi(deg)")


def test_letters_of_old_programs(table):
    """A header in the Western Windows encoding is read, with its signs."""
    assert table("Zeit;Weg (µm)\n0;1\n1;2\n".encode("cp1252")).units == {"Weg (µm)": "µm"}


def test_a_single_column(table):
    """One column is a table too, with or without a name."""
    assert table("u\n1\n2\n").names == ("u",)
    np.testing.assert_array_equal(_numbers(table("1.5\n2.5\n")), [[1.5], [2.5]])


def test_columns_of_text_are_passed_over(table):
    """A column of words does not spoil the others; asking for it says what it is."""
    read = table("when,u,y\nnoon,1,2\nlater,,4\n")
    np.testing.assert_array_equal(read.column("y"), [2, 4])
    np.testing.assert_array_equal(read.column("u"), [1, np.nan])
    with raises(DataError, "column of text", place="column when: 'noon' in line 2"):
        read.column("when")


def test_columns_of_one_heading_are_numbered(table):
    """Oscilloscopes name every channel Volt: each can be asked for, none is guessed."""
    read = table("t,Volt (V),Volt (V),u\n0,1,2,3\n1,2,4,6\n")
    assert read.names == ("t", "Volt#1 (V)", "Volt#2 (V)", "u")
    np.testing.assert_array_equal(read.column("Volt#2"), [2, 4])
    assert read.unit("Volt#1") == "V"
    for near in ("Volt#1 (V)", "Volt#2 (V)"):
        with raises(DataError, "several columns", asked="Volt", has="Volt#1 (V)", near=near):
            read.column("Volt")


@pytest.mark.parametrize("missing", ["", "NaN", "n/a", "-", "NULL"])
def test_missing_values_are_nan_until_they_are_needed(table, missing):
    """A missing value is no error by itself; a column that must be whole names line, column and how many."""
    read = table(f"# c\nt,u,y\n0,1,2\n\n1,{missing},3\n2,3,4\n")
    assert np.isnan(read.column("u")[1])
    stands = repr(missing) if missing else "a blank cell"
    with raises(DataError, "not finite", file="t.csv", value=stands, column="u", line="5 (1 of 3 rows"):
        read.check_finite("u")
    with raises(DataError, "names it", named="line 5"):
        read_run(read.path, **COLUMNS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["is empty"]),
        ("\n  \n# only a comment\n", ["is empty"]),
        ("t,u\n", ["no rows below its header"]),
        ("t,u,y\n0,1,2\n1,abc,3\n", ["'abc'", "column u", "line 3", "not a number"]),
        ("t,u,y\n0,1,2\n\n# x\n1,2,1_000\n", ["'1_000'", "column y", "line 5"]),
        ("t,u,y\n0,1,2\n1,2\n", ["2 columns in line 3", "expected 3"]),
        ("t,u\n0,1\n1,2,3\n", ["3 columns in line 3", "expected 2"]),
        ("t,u\n0,1,2\n1,2,3\n", ["2 column names", "3 columns in line 2"]),
        ("t,u\n0,1\n1,2\n3\n", ["1 column in line 4", "1 of 3 rows is bad"]),
        (
            "t;u\n0;1,5\n1;2.5\n",
            ["mixes decimal signs", "'2.5' in column u, line 3", "'1,5' in column u, line 2"],
        ),
        ("t;u\n0;1.5\n1;2,5\n", ["mixes decimal signs", "line 2", "line 3"]),
        ("dear reader\nthis is\nno table\n", ["no rows of numbers", "line"]),
        ("Messung;P-621\nDatum;21.11.2026\n\nt [s];u [V]\n", ["no rows of numbers", "line"]),
        (b"\x89HDF\r\n\x1a\n\0\0", ["is not a text file"]),
        (b"\x00\x01\x02", ["is not a text file"]),
        (b"\xff\xfe1", ["is not a text file"]),
    ],
)
def test_what_is_wrong_is_named(table, text, words):
    """Text among numbers, ragged rows, two decimal signs, no table at all: line, column, next step."""
    _refused(table, text, *words)


@pytest.mark.parametrize("rows", [2, 30])
@pytest.mark.parametrize("cell", ["1.021,0", "1,021.0", "-12.345.678", "1'021.5", "1\u00a0021,5"])
@pytest.mark.parametrize("place", [0, 1])
def test_separators_of_thousands_are_told_as_such(table, cell, rows, place):
    """From the first row on, or later: none of them makes a heading or a column of text."""
    text = "".join(f"{k};{cell if k >= place else 7};{cell if k >= place else 9}\n" for k in range(rows))
    with raises(DataError, "separator of thousands", cell=cell, column="u", line=str(place + 2)):
        table(f"t;u;y\n{text}")


def test_thousands_beside_decimal_commas_are_told_as_such(table):
    """Split at its commas such a table would have more numbers than at its semicolons."""
    rows = "".join(f"{k},0000;-4.{k:03},0000;1.120,{k}\n" for k in range(20))
    with raises(DataError, "separator of thousands", cell="-4.000,0000", column="u", line="2"):
        table(f"t;u;y\n{rows}")


def test_a_late_decimal_comma_is_found(table):
    """A file that starts with a thousand whole numbers and only then shows its decimal sign."""
    whole = "".join(f"{k};{k}\n" for k in range(1000))
    read = table(f"t;u\n{whole}1000;0,5\n")
    assert read.column("u")[-1] == 0.5
    _refused(table, f"t;u\n{whole}1000;0,5\n1001;0.5\n", "mixes decimal signs", "line 1003")


def test_files_that_are_not_there(tmp_path):
    """An absent file and a folder."""
    for path in (tmp_path / "absent.csv", tmp_path):
        with raises(DataError, "cannot be read", file=path.name):
            read_table(path)


def test_a_column_that_does_not_exist_offers_the_nearest(table):
    """A typing error in a column's name."""
    with raises(
        DataError, "nearest column", asked="curent", has="t_s, current_A, force_N", near="'current_A'"
    ):
        table("t_s,current_A,force_N\n0,1,2\n").column("curent")


def test_a_column_has_a_number_where_no_heading_is_one(table):
    """From one on, as headings that are missing are numbered; a heading that is a number comes first."""
    read = table("Zeit;Strom [A];Kraft [N]\n0;1;2\n1;3;4\n")
    assert [read.index(name) for name in ("1", "2", "3")] == [0, 1, 2]
    for name in ("0", "4", "-1", "2.0", "9" * 5000):
        with raises(DataError, "nearest column", asked=name, has="Zeit, Strom [A], Kraft [N]", near=""):
            read.index(name)
    headed = replace(read, names=("t", "3", "2"), columns={}, units={})
    assert (headed.index("2"), headed.index("3"), headed.index("1")) == (2, 1, 0)


def test_a_time_that_is_asked_for_as_input_or_output_is_told(table):
    """By its name, where it only rises: the table was said to have no time."""
    rows = "".join(f"{k};{k % 5};{k % 3}\n" for k in range(20))
    read = table(f"Zeit;Strom;T\n{rows}")

    def told(**columns):
        return [note for note in run_from_table(read.path, **columns).notes if "looks like the time" in note]

    assert [said.partition("but")[2] for said in told(input="Zeit", output="T")] == [
        " was given as the input"
    ]
    assert ["'Zeit'" in said for said in told(input="Strom", output="Zeit", rate_Hz=10.0)] == [True]
    assert told(input="Strom", output="T") == []  # a torque that rises and falls is no time
    notes = run_from_table(read.path, input="Zeit", output="T").notes
    assert any("no other time column" in note for note in notes)


@settings(max_examples=300, deadline=None)
@given(
    lines=st.lists(
        st.text(st.sampled_from('0123456789.,;\t "#-eENaNst()µ\x00\u2028_'), max_size=20), max_size=8
    ),
    raw=st.binary(max_size=4),
)
def test_whatever_the_bytes_it_is_a_table_or_a_data_error(lines, raw, tmp_path_factory):
    """No bytes make the reader fail otherwise, and what it returns fits together."""
    path = tmp_path_factory.mktemp("any") / "t.csv"
    path.write_bytes("\n".join(lines).encode() + raw)
    try:
        read = read_table(path)
    except DataError as error:
        said = (str(path) in error.message, bool(error.hint))
    else:
        assert tuple(read.columns) == read.names
        said = (all(read.line_of(row) >= 1 for row in range(read.rows)),)
    assert all(said)


@settings(max_examples=300, deadline=None)
@given(
    cells=st.lists(
        st.tuples(st.sampled_from(["0", "1.5", "2,5", "7", "x", "", "1;2", "# c", " "]), st.integers(0, 9)),
        min_size=1,
        max_size=12,
    ),
    piece=st.integers(1, 40),
)
def test_pieces_change_nothing(cells, piece, tmp_path_factory):
    """Whatever the file and wherever it is cut: the same numbers and lines, or the same words of refusal."""
    path = tmp_path_factory.mktemp("pieces") / "t.csv"
    path.write_text("t;u\n0;1\n" + "".join(f"{k};{cell}\n" for cell, k in cells))

    def outcome(**size):
        try:
            rows = parse(path, detect(path), **size)
        except DataError as error:
            return error.message
        return [column.tolist() for column in rows.columns], rows.shifts

    assert repr(outcome(piece=piece)) == repr(outcome())


def test_only_what_is_kept_stays(tmp_path):
    """Columns that nobody asked for are not kept, and may hold a remark; the others may not."""
    path = tmp_path / "t.csv"
    path.write_text("a,b,c\n1,2,3\n4,5,6\n")
    assert list(read_table(path, lambda head: {head.index("c"), 0}).columns) == ["a", "c"]
    path.write_text("a,b,c\n1,2,3\n4,x,6\n")
    np.testing.assert_array_equal(read_table(path, lambda _: {0}).column("a"), [1, 4])
    with raises(DataError, "names it", named="'x' in column b, line 3"):
        read_table(path, lambda _: {1})


# --- runs -------------------------------------------------------------------------------------------


def test_a_run_with_units_of_any_bench(table):
    """Names, units and quantities come from the header; time in ms becomes seconds."""
    run = read_run(
        table("time [ms],H (A/m),B (T),set (A/m)\n0,1,2,1.1\n2,3,4,3.1\n").path,
        input="H",
        output="B",
        reference="set",
    )
    np.testing.assert_array_equal(run.time_s, [0, 2e-3])
    np.testing.assert_array_equal(run.reference, [1.1, 3.1])
    assert (run.input_unit, run.input_quantity) == ("A/m", "H")
    assert (run.output_unit, run.output_quantity) == ("T", "B")
    assert run.signal == "t.csv"


@pytest.mark.parametrize(
    "heading",
    [
        "t/min",
        "Zeit/min",
        "t / min",
        "t in min",
        "Time, min",
        "min",
        "Minutes",
        "t(min)",
        "t_min",
        "t [mins]",
    ],
)
@pytest.mark.parametrize("named", [True, False])
def test_time_in_minutes_however_the_heading_says_it(table, heading, named):
    """Whether the column is named or is the first one."""
    text = f"{heading};u;y\n0;1;2\n2;3;4\n"
    found = run_from_table(table(text).path, **COLUMNS, time=heading if named else None)
    np.testing.assert_array_equal(found.run.time_s, [0, 120])
    assert not found.notes
    assert "[min" in found.read_as["columns"]


@pytest.mark.parametrize("heading", ["t_d", "t [d]", "time_days", "days", "Day", "t/d"])
def test_time_in_days_however_the_heading_says_it(table, heading):
    """Behind a name of the time alone a single ``d`` is a unit."""
    found = run_from_table(table(f"{heading};u;y\n0;1;2\n2;3;4\n").path, **COLUMNS)
    np.testing.assert_array_equal(found.run.time_s, [0, 2 * 86400])
    assert "[d" in found.read_as["columns"]


@pytest.mark.parametrize(
    ("heading", "told"), [("t/xyz", True), ("t_xyz", True), ("A/B", True), ("t", False), ("x", False)]
)
def test_a_time_of_an_unknown_unit_is_said_to_be_taken_as_seconds(table, heading, told):
    """A name alone says nothing else."""
    found = run_from_table(table(f"{heading};u;y\n0;1;2\n2;3;4\n").path, **COLUMNS)
    np.testing.assert_array_equal(found.run.time_s, [0, 2])
    assert bool(found.notes) == told
    for note in found.notes:
        tells(note, "taken as seconds")


def test_units_given_win(table):
    """What the user says about units is right; without any the unit is 1."""
    read = table("t,u_V,y\n0,1,2\n1,2,3\n")
    run = read_run(read.path, **COLUMNS, input_unit="mV")
    assert (run.input_unit, run.output_unit) == ("mV", "1")


def test_a_rate_instead_of_a_time(table):
    """Samples a second; both a rate and a time column are too much, a rate of nothing too little."""
    read = table("t,u,y\n9,1,2\n8,2,3\n")
    np.testing.assert_array_equal(read_run(read.path, **COLUMNS, rate_Hz=4).time_s, [0, 0.25])
    for bad in ({"rate_Hz": 4, "time": "t"}, {"rate_Hz": 0}, {"rate_Hz": np.nan}, {"rate_Hz": np.inf}):
        with raises(UsageError, "names it", named="rate"):
            read_run(read.path, **COLUMNS, **bad)


def test_without_time_only_the_order_counts(table):
    """Where the first column is the input there is no time; another column may be named."""
    read = table("u,y,t\n1,2,0\n2,3,1\n")
    assert read_run(read.path, **COLUMNS).time_s is None
    np.testing.assert_array_equal(read_run(read.path, **COLUMNS, time="t").time_s, [0, 1])


@pytest.mark.parametrize(("first", "counts"), [(0, True), (1, True), (2, False), (0.5, False)])
def test_a_column_that_just_counts_is_no_time(table, first, counts):
    """From 0 or 1 in steps of 1; one that begins elsewhere is time."""
    read = table("n,u,y\n" + "".join(f"{first + k},{k % 5},{k % 3}\n" for k in range(20)))
    assert (read_run(read.path, **COLUMNS).time_s is None) == counts


@pytest.mark.parametrize(("heading", "is_time"), [("time in s", True), ("t_s", False), ("n", False)])
def test_whole_seconds_under_the_heading_that_is_asked_for_are_time(table, heading, is_time):
    """A diagnosis asks for a table with the column ``time in s``: once a second is a rate, and no count."""
    read = table(f"{heading},u,y\n" + "".join(f"{k},{k % 5},{k % 3}\n" for k in range(20)))
    assert (read_run(read.path, **COLUMNS).time_s is not None) is is_time


def test_rows_that_count_are_no_time_where_some_are_left_out(table):
    """The numbers of the rows that stay have gaps, and are seconds no more than before."""
    rows = [f"{k},{k % 5},{k % 3}" for k in range(20)]
    read = table("\n".join(["n,u,y", *rows[:7], "7,,1", *rows[8:]]))
    assert read_run(read.path, **COLUMNS, skip_bad_rows=True).time_s is None


@settings(max_examples=40, deadline=None)
@given(st.lists(st.sampled_from(["row", "row", "row", "bad", "", "# remark"]), max_size=40))
def test_rows_that_stay_know_their_lines(tmp_path_factory, kinds):
    """Whatever lies between them: blank lines, remarks, rows that were left out. A row holds its line."""
    text = {"row": "{},1", "bad": "{},"}
    lines = [text.get(kind, kind).format(number) for number, kind in enumerate(["row", "row", *kinds], 2)]
    path = tmp_path_factory.getbasetemp() / "lines.csv"
    path.write_text("\n".join(["u,y", *lines, ""]))
    left, _ = _without_bad_rows(read_table(path), counted=False)
    assert [left.line_of(k) for k in range(left.rows)] == left.columns["u"].tolist()


def test_time_that_does_not_increase_names_the_line(table):
    """A repeated and a backward time stamp, comments and blank lines counted."""
    for stamp in ("1", "0.5"):
        told = {"place": "t.csv, column t", "line": "6", "stamp": f"{stamp} s after 1 s"}
        with raises(DataError, "time stands", **told):
            read_run(table(f"# c\nt,u,y\n0,1,2\n1,1,2\n\n{stamp},1,2\n").path, **COLUMNS)


@pytest.mark.parametrize(
    ("rows", "after", "todo"),
    [
        ("0.1003,1,2\n0.1003,3,4\n", "0.1003 min after 0.1003 min", "more digits"),
        ("0.1003,1,2\n0.1003,1,2\n", "0.1003 min after 0.1003 min", "drop the repeated rows"),
        ("1714564800.25,1,2\n1714564800.125,3,4\n", "1714564800.125 min after 1714564800.25 min", "sort"),
    ],
)
def test_time_that_does_not_increase_is_told_as_the_file_has_it(table, rows, after, todo):
    """In its own unit and to its last digit, with what may be the reason."""
    path = table(f"t_min,u,y\n0,1,2\n{rows}").path
    with raises(DataError, "time stands", place="column t_min", line="4", stamp=after) as caught:
        read_run(path, **COLUMNS)
    assert todo in caught.value.hint


@pytest.mark.parametrize(
    ("minutes", "todo"),
    [
        ((100, 110, 120, 130, 140, 150, 160, 170, 120, 130), "winter time: add an hour"),
        ((100, 110, 120, 130, 140, 150, 120, 130), "offset from UTC"),  # two rows are missing
        ((0, 60, 120, 120, 180, 240), "winter time"),
        ((100, 110, 120, 130, 140, 150, 160, 170, 160, 180), "sort them"),
        ((100, 110, 120, 130, 130, 140), "more digits"),
        ((200, 210, 220, 230, 240, 250, 100, 110), "sort them"),
    ],
)
def test_a_clock_that_was_set_back_for_winter_time_is_no_table_to_sort(table, minutes, todo):
    """Sorted, the two hours would lie among each other."""
    rows = "".join(f"25.10.2026 {m // 60:02}:{m % 60:02}:00;{k};{k % 3}\n" for k, m in enumerate(minutes))
    with pytest.raises(DataError) as caught:
        read_run(table("when;u;y\n" + rows).path, **COLUMNS)
    assert todo in caught.value.hint


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("1e6;0,5;abc", "'abc' in column y, line {line}: not a number"),
        ("1e6;0,5", "2 columns in line {line}, expected 3"),
        ("1e6;0.5;1", "mixes decimal signs: '0.5' in column u, line {line}, but '0,5' in column u, line 2"),
        ("{last};0,5;1", "does not increase at line {line}"),
        ("3;0,5;1", "does not increase at line {line}"),
        ("1e6;;1", "a blank cell in column u, line {line}"),
        ("1e6;inf;1", "inf in column u, line {line}"),
    ],
)
def test_what_is_wrong_far_from_the_start_is_named(tmp_path, monkeypatch, row, said):
    """The same promises in a later piece, behind comments and blank lines."""
    piece = PIECE // 64  # so that the second one begins soon
    monkeypatch.setattr("pulsetrainer.files.table.parse", partial(parse, piece=piece))
    rows = piece // 8
    good = "".join(f"{k};0,5;1\n" for k in range(rows))
    assert len(good) > 1.2 * piece
    (tmp_path / "t.csv").write_text(
        f"t;u;y\n{good}\n# pause\n{row.format(last=rows - 1)}\n2e6;0,5;1\n", encoding="utf-8"
    )
    with pytest.raises(DataError) as caught:
        read_run(tmp_path / "t.csv", **COLUMNS)
    assert said.format(line=rows + 4) in caught.value.message


def test_time_in_an_unknown_unit(table):
    """Samples are no time."""
    with raises(DataError, "no unit of time", place="column t", unit="'samples'"):
        read_run(table("t (samples),u,y\n0,1,2\n1,2,3\n").path, **COLUMNS, time="t")


def test_one_row_is_no_run(table):
    """A run needs two samples."""
    with raises(DataError, "too few rows"):
        read_run(table("t,u,y\n0,1,2\n").path, **COLUMNS)


@pytest.mark.parametrize(("name", "rows"), [("bh_ferrite_mnzn_1.csv", 129), ("bh_steel_m130_27s_1.csv", 256)])
def test_measured_records(name, rows):
    """Real records read whole: their first and last rows are those of the file."""
    read, units = read_table(DATA / name), {"input_unit": "A/m", "output_unit": "T"}
    run = read_run(read.path, **COLUMNS, **units, time="t_s")
    lines = (DATA / name).read_text().splitlines()
    assert len(run.input) == rows == len(lines) - 1
    for k in (0, -1):
        expected = [float(cell) for cell in lines[1:][k].split(",")]
        np.testing.assert_array_equal([run.time_s[k], run.input[k], run.output[k]], expected)


def test_a_column_is_found_with_its_unit_written_otherwise(tmp_path):
    """``force_N`` is ``force [N]``; of another unit it is not that column."""
    path = tmp_path / "scope.csv"
    path.write_text("time [s],current [A],force [N]\n0,0,1\n1,1,2\n2,2,3\n")
    table = read_table(path)
    assert table.index("force_N") == 2
    with pytest.raises(DataError) as caught:
        table.index("force_mN")
    assert "force [N]" in caught.value.hint


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("zzzz.csv", "files in {}: a.csv"),
        ("zzzz", "check the name, or give the full path: no file in {} has a similar name"),
    ],
)
def test_an_absent_file_is_answered_with_those_of_its_ending(tmp_path, name, hint):
    """Where no name is alike: of a table the tables, of a name without an ending the artefacts."""
    for there in ("a.csv", "b.txt"):
        (tmp_path / there).write_text("t,u\n")
    with pytest.raises(AbsentError) as absent:
        check_file(tmp_path / name)
    assert absent.value.hint == hint.format(tmp_path)


@pytest.mark.parametrize(
    ("cell", "remedy"), [("0:0{}", "0:00:05, or in seconds"), ("2024-05-0{}", "a date with its time of day")]
)
def test_a_time_that_is_not_read_is_told_how_to_be_written(tmp_path, cell, remedy):
    """Not to be named as the time: it could not be read then either."""
    rows = "".join(f"{cell.format(k)},{k},{k % 2}\n" for k in range(1, 5))
    (tmp_path / "t.csv").write_text(f"t_s,u,y\n{rows}")
    note = run_from_table(tmp_path / "t.csv", **COLUMNS).notes[0]
    assert remedy in note
    assert "`time`" not in note
