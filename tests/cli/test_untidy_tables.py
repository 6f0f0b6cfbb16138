"""Tables that are not quite right: blank cells, parts, one column twice, times that make no sense."""

from __future__ import annotations

import re

import numpy as np
import pytest

from program import pulsetrainer
from pulsetrainer.artefacts import Run
from pulsetrainer.files import store
from wording import refusal, tells

TRIANGLE = np.abs((np.arange(300) % 100) - 50.0)
COLUMNS = ("--input", "u", "--output", "y")


def _written(path, rows, header="t_s,u (kOhm),y (mm)") -> None:
    lines = [",".join("" if value is None else repr(float(value)) for value in row) for row in rows]
    path.write_text("\n".join([header, *lines, ""]))


def _rows(step: float = 2e-8):
    return [[k * step, u, u + k % 3] for k, u in enumerate(TRIANGLE)]


def test_rows_with_a_blank_cell_are_left_out_when_asked_and_counted(tmp_path):
    """Not by themselves: the line is named, and the option that leaves them out."""
    rows = _rows()
    for k in (5, 6, 200):
        rows[k][2] = None
    _written(tmp_path / "a.csv", rows)
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    assert done.code == 3
    assert "--skip-bad-rows" in done.err
    assert "a blank cell in column y (mm), line 7 (3 of 300 rows" in done.err
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "--skip-bad-rows", "-o", "a.h5")
    assert done.code == 0, done
    assert "3 of 300 rows" in done.err
    run = store.read(tmp_path / "a.h5", Run)
    np.testing.assert_array_equal(run.time_s, np.delete([row[0] for row in rows], [5, 6, 200]))
    shown = pulsetrainer(tmp_path, "show", "a.h5").out.splitlines()
    assert [line.split()[-1] for line in shown if "rows left out by import" in line] == ["3"]
    # where rows are counted to tell the time, none may go
    words = ("--rate", "1000", "--skip-bad-rows")
    assert pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, *words, "-o", "b.h5").code == 2


def _with_bad_rows(path, bad: dict[int, str]) -> None:
    """Write the table with these rows instead of its own; row 0 is line 2."""
    _written(path, _rows())
    lines = path.read_text().split("\n")
    for row, text in bad.items():
        lines[row + 1] = text
    path.write_text("\n".join(lines))


def test_text_and_rows_of_the_wrong_length_are_left_out_when_asked(tmp_path):
    """The count and the first five lines are named, with the option and without."""
    bad = {
        5: "1e-7,ERR,1",
        6: "1.2e-7,2",
        9: "1.8e-7,1,2,3",
        100: "2e-6,1,",
        200: "4e-6,over,over",
        299: "6e-6",
    }
    _with_bad_rows(tmp_path / "a.csv", bad)
    where = "6 of 300 rows are bad: lines 7, 8, 11, 102, 202, ..."
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    refusal(done, 3, "bad rows", file="a.csv", place="'ERR' in column u (kOhm), line 7", where=where)
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "--skip-bad-rows", "-o", "a.h5")
    assert done.code == 0, done
    assert where.removeprefix("6 of 300 rows are bad: ") in done.err
    run = store.read(tmp_path / "a.h5", Run)
    np.testing.assert_array_equal(run.output, np.delete([row[2] for row in _rows()], list(bad)))
    _with_bad_rows(tmp_path / "b.csv", {7: "1,ERR,1"})
    done = pulsetrainer(tmp_path, "import", "a.csv", "b.csv", *COLUMNS, "--skip-bad-rows", "-o", "ab.h5")
    assert done.code == 0, done
    assert store.read(tmp_path / "ab.h5", Run).left_out_rows == len(bad) + 1


def test_a_table_of_bad_rows_is_refused_with_the_option_too(tmp_path):
    """Nobody is told to leave out nearly all there is."""
    _with_bad_rows(tmp_path / "a.csv", dict.fromkeys(range(2, 300), "1,ERR,1"))
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    assert done.code == 3
    assert "--skip-bad-rows" not in done.err
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "--skip-bad-rows", "-o", "a.h5")
    refusal(done, 3, "too many bad rows", file="a.csv", count="298 of 300 rows", where="4, 5, 6, 7, 8, ...")
    assert not (tmp_path / "a.h5").exists()


@pytest.mark.parametrize(
    ("end", "left_out"), [("0.05,1.0", True), ("0.05,1.0000", False), ("0.05,1", True), ("0.05,1.", True)]
)
def test_a_file_that_was_cut_within_a_number_loses_that_row(tmp_path, end, left_out):
    """A row without a line end is whole where it has as many decimals as all others."""
    rows = "".join(f"{k / 100:.2f},{k % 7 / 3:.4f}\n" for k in range(30))
    (tmp_path / "a.csv").write_text(f"u,y\n{rows}{end}")
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    assert done.code == 0, done
    assert ("a.csv ends within line 32" in done.err) == left_out
    assert store.read(tmp_path / "a.h5", Run).input.size == 31 - left_out


def test_thousands_are_never_left_out(tmp_path):
    """Every large value has the separator: without these rows it would be another record."""
    _with_bad_rows(tmp_path / "a.csv", {50: '1e-6,"1,021.5",1'})
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "--skip-bad-rows", "-o", "a.h5")
    refusal(done, 3, "separator of thousands", cell="1,021.5", column="u (kOhm)", line=52)


def test_a_line_is_still_named_when_rows_were_left_out(tmp_path):
    """The time that does not increase stands behind a blank row and a comment."""
    rows = _rows()
    rows[3][1] = None
    rows[20][0] = rows[19][0]
    _written(tmp_path / "a.csv", rows)
    text = (tmp_path / "a.csv").read_text().split("\n")
    (tmp_path / "a.csv").write_text("\n".join([*text[:10], "# a remark", *text[10:]]))
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "--skip-bad-rows", "-o", "a.h5")
    assert done.code == 3
    assert "line 23" in done.err


def test_parts_have_their_own_gaps_and_no_other(tmp_path):
    """Two files with a pause between them, one with two missing rows: one gap, two parts."""
    _written(tmp_path / "a.csv", _rows())
    _written(tmp_path / "b.csv", [row for k, row in enumerate(_rows()) if k not in (70, 71)])
    done = pulsetrainer(tmp_path, "import", "a.csv", "b.csv", *COLUMNS, "-o", "r.h5", "--json")
    assert done.code == 0, done
    report = done.json["runs"][0]["report"]
    assert report["gaps"] == 1
    assert report["longest_gap_s"] == pytest.approx(6e-8)
    assert done.json["facts"]["gaps"] == 1
    assert done.json["facts"]["parts"] == 2
    assert pulsetrainer(tmp_path, "show", "r.h5", "--json").json["facts"]["gaps"] == 1


@pytest.mark.parametrize(
    "words", [("--input", "u", "--output", "u"), ("--input", "y", "--output", "y", "--no-time"),
              (*COLUMNS, "--time", "plain"), (*COLUMNS, "--reference", "y")],
)  # fmt: skip
def test_one_column_has_one_meaning(tmp_path, words):
    """The same column twice is a mistake of the command line."""
    names = "t_s,u (kOhm),y (mm)" if "plain" not in words else "t_s,plain,y (mm)"
    words = tuple("plain" if word == "u" and "plain" in words else word for word in words)
    _written(tmp_path / "a.csv", [[row[0], k, row[2]] for k, row in enumerate(_rows())], names)
    done = pulsetrainer(tmp_path, "import", "a.csv", *words, "-o", "r.h5", "--json")
    assert done.code == 2
    assert done.json["error"]["kind"] == "usage"
    assert not (tmp_path / "r.h5").exists()


def test_one_loop_is_said_to_be_one_loop(tmp_path):
    """It switches every cell and tells none apart."""
    _written(tmp_path / "a.csv", _rows())
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "r.h5", "--json")
    report = done.json["runs"][0]["report"]
    assert report["coverage_percent"] == 100.0
    assert report["minor_percent"] == 0.0
    assert report["input_unit"] == "kOhm"


@pytest.mark.parametrize(("rows", "little"), [(53, True), (300, False)])
def test_a_single_stroke_says_what_it_is_good_for(tmp_path, rows, little):
    """By import, and by the fit, which looks perfect."""
    _written(tmp_path / "a.csv", [[k * 0.02, u, u] for k, u in enumerate(np.roll(TRIANGLE, 50)[:rows] / 5)])
    for words in (("import", "a.csv", *COLUMNS, "-o", "a.h5"), ("identify", "a.h5", "-o", "m.h5")):
        done = pulsetrainer(tmp_path, *words)
        assert done.code == 0, done
        assert (
            "% of the cells are switched: a model of this record holds only for strokes like its own"
            in done.err
        ) is little


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda u: np.append(u[:151], u[200:]),
            "3.02 s after its first sample: if the device",
        ),  # a stroke is missing
        (lambda u: np.where(np.arange(u.size) == 150, 0.0, u), ""),  # a wild sample
        (lambda u: 50.0 * (u > 25.0), ""),  # a square wave
    ],
)
def test_an_input_that_jumps_once_is_told_with_the_place(tmp_path, change, said):
    """Wild samples, and what is driven by jumps, are not meant."""
    _written(tmp_path / "a.csv", [[k * 0.02, u, u] for k, u in enumerate(change(np.tile(TRIANGLE, 3)))])
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    assert done.code == 0, done
    assert ("jumps by" in done.err) is bool(said)
    assert said in done.err


def test_an_input_that_never_moves_is_said_to(tmp_path):
    """A column mixed up: nothing can be learnt from such a record, and the reader must know."""
    _written(tmp_path / "a.csv", [[row[0], 1.0, row[2]] for row in _rows()])
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "r.h5")
    assert done.code == 0
    assert "the input of a.csv never moves: it is 1 kOhm throughout" in done.err
    assert re.search(r"told apart by minor loops +none$", done.out, re.MULTILINE)


@pytest.mark.parametrize(
    "rows",
    [
        [[0.0, 1.0, 2.0]],
        [[0.0, k, k] for k in range(200)],
        [[-k, k, k] for k in range(200)],
        [[k if k < 100 else k - 50, k, k] for k in range(200)],
    ],
    ids=["one sample", "no time passes", "backwards", "back once"],
)
def test_a_time_that_makes_no_sense_is_refused(tmp_path, rows):
    """A clear error, and nothing written."""
    _written(tmp_path / "a.csv", rows)
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "r.h5", "--json")
    assert done.code == 3
    assert done.json["error"]["hint"]
    assert not (tmp_path / "r.h5").exists()


def test_a_record_of_a_circuit_simulator_is_in_volts_and_amperes(tmp_path):
    """``V(in)`` is no length in inches; a column that is there twice keeps its unit."""
    rows = [[k * 1e-3, u, u, u + k % 3] for k, u in enumerate(TRIANGLE)]
    _written(tmp_path / "a.csv", rows, header="time,V(in),V(in),I(L1)")
    words = ("--input", "V(in)#1", "--output", "I(L1)")
    assert pulsetrainer(tmp_path, "import", "a.csv", *words, "-o", "a.h5").code == 0
    run = store.read(tmp_path / "a.h5", Run)
    assert (run.input_unit, run.output_unit, run.output_quantity) == ("V", "A", "I(L1)")


def test_a_date_that_cannot_be_read_is_shown(tmp_path):
    """The table has a time, which only a person can read."""
    rows = [f"{k + 1} Nov 2026,{u},{u}" for k, u in enumerate(TRIANGLE[:20])]
    (tmp_path / "a.csv").write_text("\n".join(["date,u,y", *rows, ""]))
    done = pulsetrainer(tmp_path, "import", "a.csv", *COLUMNS, "-o", "a.h5")
    assert done.code == 0, done
    tells(done.err, "no time that can be read")
