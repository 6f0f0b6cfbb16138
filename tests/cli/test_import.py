"""Tables from other benches: real records, any units, rising and falling loops, no time at all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import pulsetrainer as pt
from wording import refusal

DATA = Path(__file__).resolve().parents[1] / "data"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bh_ferrite_mnzn_1", "bh_steel_m130_27s_1"])
def test_a_magnetic_loop_without_time_fits_within_a_third_of_a_percent(run, name):
    """Field in A/m, flux density in T: nothing depends on the unit's size."""
    words = ["--input", "u", "--output", "y", "--input-unit", "A/m", "--output-unit", "T", "--time", "t_s"]
    assert run("import", DATA / f"{name}.csv", *words, "-o", "run.h5").code == 0
    done = run("identify", "run.h5", "-o", "model.h5", "--json")
    assert done.code == 0, done
    assert done.json["fit_rms_percent"] <= 0.3
    assert done.json["polarity"] == 1


@pytest.mark.slow
def test_a_falling_loop_is_found_said_and_fitted(run):
    """The surgical tool's jaw closes when the spindle turns up; another speed is predicted within 2 %."""
    for speed, samples in (("f0p1", 10000), ("f0p3", 9987)):
        done = run(
            "import", DATA / f"davinci_{speed}_torque10.csv", "--input", "u", "--output", "y",
            "--input-unit", "deg", "--output-unit", "deg", "-o", f"{speed}.h5", "--json",
        )  # fmt: skip
        assert done.code == 0, done
        assert done.json["facts"]["samples"] == samples
        assert done.json["facts"]["rate_Hz"] == pytest.approx(500.0)
    done = run("identify", "f0p1.h5", "-o", "model.h5", "--json")
    assert done.json["polarity"] == -1
    assert done.json["fit_rms_percent"] <= 0.3
    assert "falls when the input rises" in done.err
    held_out = run("evaluate", "f0p3.h5", "--model", "model.h5", "--json")
    assert held_out.json["models"][0]["rms_percent"] <= 2.0


def test_units_come_from_the_header_and_milliseconds_become_seconds(run, tmp_path):
    """Semicolons, decimal commas, bracketed units."""
    rows = "\n".join(f"{k};{k / 10:.2f};{2 * k / 10:.2f}".replace(".", ",") for k in range(20))
    (tmp_path / "scope.csv").write_text(f"# from the scope\ntime [ms];coil current (A);Force (N)\n{rows}\n")
    words = ["--time", "time", "--input", "coil current", "--output", "Force", "-o", "run.h5"]
    done = run("import", "scope.csv", *words)
    assert done.code == 0, done
    with h5py.File(tmp_path / "run.h5") as file:
        assert (file["input"].attrs["units"], file["output"].attrs["units"]) == ("A", "N")
        np.testing.assert_allclose(file["time"][:3], [0.0, 0.001, 0.002])
        np.testing.assert_allclose(file["output"][:3], [0.0, 0.2, 0.4])


def test_a_unit_that_is_not_that_of_the_heading_is_said(run, tmp_path):
    """The unit that is given counts, and the numbers are not converted; one letter for micro is another."""
    (tmp_path / "scope.csv").write_text("t [s];u [V];y [um]\n" + "".join(f"{k};{k};{k}\n" for k in range(9)))
    words = ["--input", "u", "--output", "y", "--input-unit", "A", "--output-unit", "\N{MICRO SIGN}m"]
    done = run("import", "scope.csv", *words, "-o", "run.h5")
    assert done.code == 0, done
    assert "note: the heading 'u [V]' of scope.csv says V, and --input-unit A" in " ".join(done.err.split())
    assert "y [um]" not in done.err


def test_a_rate_replaces_the_time_column(run, tmp_path):
    """Without time stamps --rate gives them."""
    (tmp_path / "bare.csv").write_text("\n".join(f"{k % 7},{k % 5}" for k in range(30)))
    words = ["--input", "column1", "--output", "column2", "--rate", "200", "-o", "run.h5", "--json"]
    done = run("import", "bare.csv", *words)
    assert done.code == 0, done
    assert done.json["facts"]["rate_Hz"] == pytest.approx(200.0)


def test_a_rate_that_contradicts_the_file_is_said(run, tmp_path):
    """The rate that is given counts; a time that is damaged is not missed."""
    rows = [f"{2 * k};{k % 7};{k % 5}\n" for k in range(30)]
    (tmp_path / "scope.csv").write_text("Zeit [ms];u;y\n" + "".join(rows))
    (tmp_path / "damaged.csv").write_text("Zeit [ms];u;y\n" + "".join(rows) + "none;1;2\n")

    (tmp_path / "counted.csv").write_text("n;u;y\n" + "".join(rows))

    def said(name, rate):
        words = ("--input", "u", "--output", "y", "--rate", rate, "-o", "r.h5", "--overwrite")
        done = run("import", name, *words)
        assert done.code == 0, done
        return " ".join(done.err.split())

    told = "note: the column 'Zeit [ms]' of scope.csv says 500 Hz, and --rate 50: taken as 50 Hz"
    assert told in said("scope.csv", 50)
    assert "says" not in said("scope.csv", 500)
    assert "says" not in said("damaged.csv", 50)
    assert "says" not in said("counted.csv", 50)  # no unit: it may be anything


def test_a_column_that_is_not_there_offers_the_nearest(run, tmp_path):
    """Exit 3, and the names that are there."""
    (tmp_path / "a.csv").write_text("t_s,current_A,force_N\n0,0,0\n1,1,1\n")
    done = run("import", "a.csv", "--input", "curent_A", "--output", "force_N", "-o", "run.h5")
    assert done.code == 3
    assert "did you mean 'current_A'" in done.err
    assert not (tmp_path / "run.h5").exists()
    done = run("import", "a.csv", "--input", "CURR", "--output", "force_N", "-o", "run.h5")
    assert "did you mean 'current_A'" in done.err
    (tmp_path / "b.csv").write_text("t_s,current_A,temp (degC)\n0,0,0\n1,1,1\n")
    done = run("import", "b.csv", "--input", "current_A", "--output", "tmp", "-o", "run.h5")
    assert "'temp (degC)'?" in done.err  # a short name is not like a heading with a unit


def test_columns_may_be_given_by_their_numbers(run, tmp_path):
    """The first is the time; what was taken for what is said by the headings."""
    (tmp_path / "a.csv").write_text("Zeit;Strom [A];Kraft [N]\n0;0;0\n1;1;1\n2;0;1\n")
    done = run("import", "a.csv", "--input", "2", "--output", "3", "-o", "run.h5")
    assert done.code == 0, done
    assert "time from Zeit (no unit: taken as s), input from Strom [A], output from Kraft [N]" in done.out


def test_a_column_like_none_gets_no_suggestion(run, tmp_path):
    """Exit 3; the columns that are there are listed once."""
    (tmp_path / "a.csv").write_text("Zeit;Spannung;Weg\n0;0;0\n1;1;1\n")
    done = run("import", "a.csv", "--input", "Spannung", "--output", "Kraft", "-o", "run.h5")
    assert done.code == 3
    assert "did you mean" not in done.err
    assert done.err.count("Zeit") == 1


# --- what is read, said and refused, on real records ----------------------------------------------------


def _words(name, *more):
    return ["import", DATA / f"{name}.csv", "--input", "u", "--output", "y", *more]


@pytest.fixture
def columns():
    """Time, input and output of a real record, 7833 uneven samples with 107 gaps."""
    return np.loadtxt(DATA / "pneu_oring_3bar.csv", delimiter=",", skiprows=1).T


def test_the_report_of_a_real_record(run):
    """Samples, rate, gaps, ranges, units, polarity, reversals, coverage: on the screen and as JSON."""
    done = run(*_words("pneu_oring_3bar", "--output-unit", "N", "-o", "run.h5", "--json"))
    assert done.code == 0, done
    report = done.json["runs"][0]["report"]
    assert report["samples"] == 7833
    assert report["rate_Hz"] == pytest.approx(100.0)
    assert (report["even"], report["gaps"]) == (False, 107)
    assert report["longest_gap_s"] == pytest.approx(2.66)
    assert report["input_range"] == [-2.93, 36.858]
    assert report["output_unit"] == "N"
    assert report["polarity"] == "unclear"
    assert report["reversals"] == 132
    assert report["false_reversals"] == 102
    assert report["coverage_percent"] == pytest.approx(100.0, abs=0.2)
    assert "107 gaps" in done.err
    assert "uneven" in done.err
    shown = run(*_words("davinci_f0p1_torque10", "-o", "other.h5"))
    assert "falling (correlation -0.99)" in shown.out
    assert "10000" in shown.out


def test_time_stamps_stay_as_they_are_unless_asked(run, tmp_path, columns):
    """Uneven stamps are kept to the last bit, and evened out on request only."""
    assert run(*_words("pneu_oring_3bar", "-o", "run.h5")).code == 0
    done = run(*_words("pneu_oring_3bar", "--resample", "even", "-o", "even.h5", "--json"))
    assert "filled with straight lines" in done.err
    assert run(*_words("pneu_oring_3bar", "--resample", "50", "-o", "half.h5")).code == 0
    assert run(*_words("pneu_oring_3bar", "--resample", "often", "-o", "x.h5")).code == 2
    assert run(*_words("pneu_oring_3bar", "--resample", "1e308", "-o", "x.h5")).code == 2
    t, u, _ = columns
    with h5py.File(tmp_path / "run.h5") as file:
        np.testing.assert_array_equal(file["time"], t)
    for name, rate in (("even.h5", 100.0), ("half.h5", 50.0)):
        with h5py.File(tmp_path / name) as file:
            np.testing.assert_allclose(np.diff(file["time"]), 1.0 / rate, rtol=1e-9)
            np.testing.assert_array_equal(file["input"], np.interp(file["time"], t, u))


def test_every_format_gives_the_same_run(run, tmp_path, columns):
    """The same real record as CSV, decimal commas, .npz, .mat of both versions: equal numbers."""
    from scipy.io import savemat

    t, u, y = columns
    lines = [";".join(map(repr, row)).replace(".", ",") for row in columns.T.tolist()]
    (tmp_path / "comma.csv").write_text("t_s;u;y\n" + "\n".join(lines) + "\n")
    np.savez(tmp_path / "r.npz", t=t, u=u, y=y)
    savemat(tmp_path / "five.mat", {"t": t, "u": u, "y": y})
    with h5py.File(tmp_path / "seven.mat", "w", userblock_size=512) as file:
        for name, vector in (("t", t), ("u", u), ("y", y)):
            file[name] = vector[None, :]
    for name in ("comma.csv", "r.npz", "five.mat", "seven.mat"):
        done = run("import", name, "--input", "u", "--output", "y", "-o", f"{name}.h5")
        assert done.code == 0, done
        with h5py.File(tmp_path / f"{name}.h5") as file:
            for own, there in ((t, "time"), (u, "input"), (y, "output")):
                np.testing.assert_array_equal(file[there], own)


@pytest.mark.parametrize("resample", [None, "even", 50.0])
def test_the_function_gives_the_bits_of_the_command(run, tmp_path, resample):
    """``read_table`` and ``import``, of a real record with gaps and uneven time stamps."""
    more = [] if resample is None else ["--resample", str(resample)]
    assert run(*_words("pneu_oring_3bar", "--output-unit", "N", *more, "-o", "run.h5")).code == 0
    columns = {"input": "u", "output": "y", "output_unit": "N"}
    made = pt.read_table(DATA / "pneu_oring_3bar.csv", **columns, resample=resample)
    stored = pt.load(tmp_path / "run.h5")
    for name in ("time_s", "input", "output"):
        np.testing.assert_array_equal(getattr(made, name), getattr(stored, name))
    for name in ("input_unit", "output_unit", "input_quantity", "signal"):
        assert getattr(made, name) == getattr(stored, name)


def test_a_recording_of_sound_needs_no_time_column(run, tmp_path):
    """Two channels of a sound card: the rate is in the file."""
    from scipy.io import wavfile

    t = np.arange(4000) / 8000.0
    both = np.stack([np.sin(50 * t), np.sin(50 * t) ** 3], axis=1).astype(np.float32)
    wavfile.write(tmp_path / "r.wav", 8000, both)
    done = run("import", "r.wav", "--input", "channel1", "--output", "channel2", "-o", "run.h5", "--json")
    assert done.json["runs"][0]["report"]["rate_Hz"] == pytest.approx(8000.0)
    done = run("import", "r.wav", "--input", "channel1", "--output", "channel2", "-o", "r.h5", "--rate", 100)
    assert "r.wav itself says 8000 Hz, and --rate 100" in done.err


def test_several_files_are_parts_of_one_run_or_runs_of_their_own(run, tmp_path, columns):
    """A record cut in three: joined it is whole again; with {name} each becomes a run."""
    t, u, y = columns
    parts = np.array_split(np.arange(t.size), 3)
    for k, part in enumerate(parts):
        # the second part goes on with the clock of the first; the third has a clock that starts anew
        start = t[part[0]] if k == 2 else 0.0
        rows = np.stack((t[part] - start, u[part], y[part]), axis=1)
        np.savetxt(
            tmp_path / f"p{k}.csv", rows, fmt="%.17g", delimiter=",", header="t_s,u_mm,y_N", comments=""
        )
    files = [f"p{k}.csv" for k in range(3)]
    done = run("import", *files, "--input", "u", "--output", "y", "-o", "run.h5", "--json")
    assert done.code == 0, done
    assert "starts again in p2.csv" in done.err
    assert done.json["facts"]["samples"] == t.size
    with h5py.File(tmp_path / "run.h5") as file:
        np.testing.assert_array_equal(file["input"], u)
        np.testing.assert_array_equal(file["time"][: parts[2][0]], t[: parts[2][0]])
        assert np.all(np.diff(file["time"]) > 0)
    done = run("import", *files, "--input", "u", "--output", "y", "-o", "{name}.h5", "--json")
    assert [one["output"] for one in done.json["runs"]] == ["p0.h5", "p1.h5", "p2.h5"]
    assert [one["report"]["samples"] for one in done.json["runs"]] == [part.size for part in parts]


@pytest.mark.parametrize(
    ("heading", "rate_Hz"),
    [("t/ms", 1000.0), ("time [us]", 1e6), ("t (min)", 1 / 60), ("time [s]", 1.0), ("Zeit in Sekunden", 1.0)],
)
def test_a_time_of_whole_steps_in_another_unit_is_no_count(run, tmp_path, heading, rate_Hz):
    """A sample each millisecond counts 0, 1, 2 as rows do; its heading says what it is."""
    t = np.arange(400)
    u = 1.0 + np.sin(t / 30.0)
    rows = np.stack((t, u, u**2), axis=1)
    np.savetxt(
        tmp_path / "r.csv", rows, fmt="%.6g", delimiter=",", header=f"{heading},u [A],y [N]", comments=""
    )
    done = run("import", "r.csv", "--input", "u", "--output", "y", "-o", "run.h5", "--json")
    assert "counts the rows" not in done.err
    assert done.json["facts"]["rate_Hz"] == pytest.approx(rate_Hz)


@pytest.mark.parametrize(
    ("heading", "said"), [("Zeit", True), ("Zeit [-]", True), ("Zeit [s]", False), ("Zeit in ms", False)]
)
def test_a_slow_record_without_a_unit_of_time_may_be_one_in_milliseconds(run, tmp_path, heading, said):
    """It is taken as seconds, which is said, and how to say otherwise."""
    t = 10.0 * np.arange(300)
    u = 1.0 + np.sin(t / 100.0)
    rows = np.stack((t, u, u**2), axis=1)
    np.savetxt(
        tmp_path / "r.csv", rows, fmt="%.6g", delimiter=",", header=f"{heading},u [A],y [N]", comments=""
    )
    done = run("import", "r.csv", "--input", "u", "--output", "y", "-o", "run.h5")
    assert done.code == 0
    assert ("no unit: taken as s" in done.out, "10 s apart" in done.err) == (said, said)
    assert ("'Zeit [ms]'" in done.err) is said


def test_rows_that_are_merely_counted_are_no_time(run, tmp_path):
    """A magnetic loop is indexed 0, 1, 2: that is said, and only its order counts, unless --time insists."""
    done = run(*_words("bh_steel_m130_27s_1", "-o", "run.h5", "--json"))
    assert "only counts the rows" in done.err
    assert done.json["facts"]["rate_Hz"] is None
    with h5py.File(tmp_path / "run.h5") as file:
        assert "time" not in file
    assert run(*_words("bh_steel_m130_27s_1", "--time", "t_s", "-o", "timed.h5")).code == 0
    assert run(*_words("davinci_f0p1_torque10", "--no-time", "-o", "bare.h5")).code == 0
    for name, timed in (("timed.h5", True), ("bare.h5", False)):
        with h5py.File(tmp_path / name) as file:
            assert ("time" in file) == timed


ROWS = "".join(f"{k / 10},{k % 7},{k % 5}\n" for k in range(40))
GOOD = f"t_s,current_A,force_N\n{ROWS}"


def test_units_far_from_one(run, tmp_path):
    """Picoamperes and a small swing about a large offset: the fit is the same, and the swing can be read."""
    angle = np.arange(600) / 40
    for name, u_scale, y_scale, y_offset in (
        ("a", 1.0, 1.0, 0.0),
        ("b", 1e-12, 1e-15, 0.0),
        ("c", 1e12, 1e3, 1e9),
    ):
        rows = zip(angle, u_scale * np.sin(angle), y_offset + y_scale * np.sin(angle) ** 3, strict=True)
        lines = "".join(f"{t!r},{u!r},{y!r}\n" for t, u, y in (map(float, row) for row in rows))
        (tmp_path / f"{name}.csv").write_text(f"t_s,u_V,y_nm\n{lines}")
    words = ["--input", "u", "--output", "y", "-o", "{name}.h5"]
    done = run("import", "a.csv", "b.csv", "c.csv", *words)
    assert done.code == 0, done.err
    assert "999999000 .. 1.000001e+09 nm" in done.out
    fits = [
        run("identify", f"{n}.h5", "--levels", "12", "-o", f"{n}-model.h5", "--json").json["fit_rms_percent"]
        for n in "abc"
    ]
    assert fits[1:] == pytest.approx(2 * [fits[0]], rel=0.05)


@pytest.mark.parametrize(
    ("text", "more", "said"),
    [
        (GOOD.replace("0.9,2,4", "0.9,2,oops"), [], ["'oops'", "column force_N", "line 11"]),
        (GOOD.replace(",", ";").replace("0.9;2", "0,9;2"), [], ["mixes decimal signs", "line 11"]),
        (GOOD.replace("0.9,2,4", "0.8,2,4"), [], ["does not increase", "line 11", "there twice"]),
        (GOOD.replace("0.9,2,4", "0.3,2,4"), [], ["does not increase", "line 11", "sort"]),
        ("t_s,current_A,force_N\n0,1,nan\n0.2,2,\n0.3,3,NaN\n", [], ["no numbers", "force_N", "all 3"]),
        ("", [], ["empty"]),
        ("t_s,current_A,force_N\n", [], ["no rows below its header"]),
        (GOOD.replace("force_N", "forse_N"), [], ["no column 'force_N'", "did you mean 'forse_N'"]),
        (GOOD, ["--output-unit", "Newtonss"], ["'Newtonss'", "not a known unit", "--output-unit"]),
        (GOOD, ["--time", "current_A"], ["in 'A'", "expected s, ms"]),
        (GOOD.replace("force_N", "force (as measured)"), ["--output", "force"],
         ["'as measured'", "not a known unit"]),
    ],
    ids=["text", "decimals", "duplicate", "backward", "all NaN", "empty", "header only", "column", "unit",
         "time unit", "unit in header"],
)  # fmt: skip
def test_bad_input_is_exit_3_in_words_and_writes_nothing(run, tmp_path, text, more, said):
    """File, line and column are named, with a next step; no output appears."""
    (tmp_path / "bad.csv").write_text(text)
    output = () if "--output" in more else ("--output", "force_N")
    done = run("import", "bad.csv", "--input", "current_A", *output, *more, "-o", "run.h5")
    assert done.code == 3, done
    for word in ("bad.csv" if "--output-unit" not in more else "--output-unit", "try:", *said):
        assert word in done.err, done.err
    assert [path.name for path in tmp_path.iterdir()] == ["bad.csv"]


def test_one_bad_file_of_many_writes_none(run, tmp_path):
    """All files are read before the first run is written."""
    (tmp_path / "a.csv").write_text(GOOD)
    (tmp_path / "b.csv").write_text(GOOD.replace("0.9,2,4", "0.9,2,oops"))
    done = run("import", "a.csv", "b.csv", "--input", "current_A", "--output", "force_N", "-o", "{name}.h5")
    assert done.code == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.csv"]


@pytest.mark.slow
def test_a_large_file_is_streamed(tmp_path):
    """Memory grows by the numbers kept, 24 bytes of each row of 28, and a fifth: there is no second copy."""

    def peak(rows: int) -> tuple[int, int]:
        path = tmp_path / f"{rows}.csv"
        with path.open("w") as out:
            out.write("t_s,current_A,force_N\n")
            out.writelines(
                f"{k / 1e4:.4f},{k % 20011 / 2e4:.7f},{k % 19997 / 5e3:.7f}\n" for k in range(rows)
            )
        words = ["import", str(path), "--input", "current_A", "--output", "force_N", "-o", f"{rows}.h5"]
        # a small process in between: a child is charged with the memory of who starts it
        program = (
            "import resource, subprocess, sys\n"
            "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)\n"
            "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)\n"
        )
        command = [sys.executable, "-c", program, sys.executable, "-m", "pulsetrainer", *words]
        # left alone, glibc takes arrays of up to 32 MB from a heap with holes, by chance 15 MB more
        env = {**os.environ, "MALLOC_MMAP_THRESHOLD_": str(2**18)}
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=True)
        return path.stat().st_size, int(done.stdout.splitlines()[-1])

    # the report looks at a million samples at most, here at as many of both
    (small, low), (large, high) = peak(1_000_000), peak(4_000_000)
    growth = (high - low) / (large - small)
    print(
        f"peak memory {low / 1e6:.0f} MB at {small / 1e6:.0f} MB, {high / 1e6:.0f} MB at {large / 1e6:.0f} MB"
    )
    assert growth < 1.2 * 24 / 28


def test_a_column_that_is_not_named_is_offered(run, tmp_path):
    """The headings of the table stand in the error, and how two of them are named."""
    (tmp_path / "piezo.csv").write_text("Time (ms);Drive (V);Stroke (um)\n0;0,1;0,2\n1;0,3;0,4\n")
    refusal(run("import", "piezo.csv", "-o", "p.h5"), 2, "column not named", has="Drive (V), Stroke (um)")
    np.savez(tmp_path / "steel.npz", t=np.arange(9.0), H_kA_m=np.arange(9.0), B_mT=np.arange(9.0))
    done = run("import", "steel.npz", "-o", "p.h5")
    assert done.code == 2
    assert "steel.npz has t, H_kA_m, B_mT" in done.err
    assert "--input H_kA_m --output B_mT" in done.err
