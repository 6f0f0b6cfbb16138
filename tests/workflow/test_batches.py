"""Batches: Snakemake and make run the same commands, and what comes out is what the commands make by hand."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from program import program_on_path, pulsetrainer

SLOW = pytest.mark.slow  # each starts the engine anew

ROOT = Path(__file__).parents[2]
SNAKEFILE = ROOT / "workflow" / "Snakefile"
# a short record, one repeat: the point is which commands run, not how good the model is
SHORT = {"capture": "--levels 12 --speed 3", "identify": "--levels 12", "play": "--repeats 1"}
DEVICES = "name\tport\nleft\tbench:?seed=3\nright\tbench:?seed=4\n"


def program() -> str:
    """Return the program as a command of a shell."""
    return str(program_on_path() / "pulsetrainer")


def snakemake(folder: Path, *words: object, **config: object) -> subprocess.CompletedProcess[str]:
    """Run the Snakefile in ``folder`` with a configuration of its own."""
    (folder / "my.json").write_text(json.dumps({"out": "out", "program": program(), **config}))
    command = [sys.executable, "-m", "snakemake", "--snakefile", SNAKEFILE, "--configfile", "my.json", *words]
    done = subprocess.run(
        list(map(str, command)), cwd=folder, capture_output=True, text=True, check=False, timeout=240
    )
    done.said = done.stdout + done.stderr
    return done


def by_hand(folder: Path, *lines: str) -> None:
    """Run commands as a person types them."""
    for line in lines:
        done = pulsetrainer(folder, *line.split())
        assert done.code == 0, (line, done)


def figures(path: Path) -> dict[str, np.ndarray]:
    """Return everything that an evaluation holds, but for the time and the words of its making."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        )
    return found


def same(one: Path, other: Path) -> bool:
    """Whether two evaluations hold the same values to the last bit."""
    a, b = figures(one), figures(other)
    return a.keys() == b.keys() and all(
        np.array_equal(a[k], b[k], equal_nan=a[k].dtype.kind == "f") for k in a
    )


@pytest.fixture(scope="module")
def hand(made_once) -> Path:
    """The right device by hand."""
    lines = (
        f"capture identification --port bench:?seed=4 {SHORT['capture']} -o run.h5",
        f"identify run.h5 {SHORT['identify']} -o model.h5",
        "invert normal --model model.h5 -o drive.h5",
        f"play drive.h5 --port bench:?seed=4 {SHORT['play']} -o played.h5",
        "evaluate played.h5 -o evaluation.h5",
    )
    return made_once("hand", lambda folder: by_hand(folder, *lines))


@pytest.fixture(scope="module")
def batch(made_once) -> Path:
    """Both devices by Snakemake, on two cores."""

    def fill(folder: Path) -> None:
        (folder / "two.tsv").write_text(DEVICES)
        done = snakemake(folder, "--cores", 2, devices="two.tsv", pulses=["normal"], **SHORT)
        assert done.returncode == 0, done.said

    return made_once("batch", fill)


@pytest.mark.slow
def test_snakemake_makes_what_the_commands_make(batch, hand):
    """Each number of the evaluation is that of the commands by hand; another device has other numbers."""
    assert same(batch / "out/right/evaluation.h5", hand / "evaluation.h5")
    assert not same(batch / "out/left/evaluation.h5", hand / "evaluation.h5")
    assert "<svg" in (batch / "out/left/report.html").read_text()


def make(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the Makefile in ``folder``."""
    command = ["make", "-f", str(ROOT / "workflow" / "Makefile"), f"PT={program()}", "OUT=out", *words]
    quiet = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    return subprocess.run(command, cwd=folder, env=quiet, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "line",
    [
        *("right  bench:?seed=4", "left\tbench:?seed=5"),
        *(pytest.param(one, marks=pytest.mark.slow) for one in ("bench 3\tbench:?seed=3", "right\t")),
    ],
)
def test_a_device_without_name_or_port_is_no_other_device(tmp_path, line):
    """A blank in a name, or blanks for the tab, left the port empty: the default device was played."""
    (tmp_path / "bad.tsv").write_text(f"name\tport\nleft\tbench:?seed=3\n{line}\n")
    done = make(tmp_path, "--dry-run", "DEVICES=bad.tsv")
    assert done.returncode == 2
    assert "bad.tsv, line 3" in done.stderr
    assert "capture" not in done.stdout
    done = snakemake(tmp_path, "--cores", 1, "--dry-run", devices="bad.tsv", pulses=["normal"])
    assert done.returncode != 0
    assert "bad.tsv" in done.said


def test_a_pulse_that_is_added_is_played(tmp_path):
    """Make took its drive for an intermediate file, and found nothing to be done."""
    (tmp_path / "one.tsv").write_text("name\tport\r\nleft\tbench:?seed=3\r\n")
    (tmp_path / "out/left").mkdir(parents=True)
    for name in ("run.h5", "model.h5", "drive-normal.h5", "played-normal.h5", "evaluation.h5", "report.html"):
        (tmp_path / "out/left" / name).touch()
    done = make(tmp_path, "--dry-run", "DEVICES=one.tsv", "PULSES=normal")
    assert "Nothing to be done" in done.stdout
    done = make(tmp_path, "--dry-run", "DEVICES=one.tsv", "PULSES=normal bifid")
    assert "drive-bifid.h5 --port 'bench:?seed=3'" in done.stdout
    assert "capture" not in done.stdout


@pytest.mark.slow
def test_make_makes_what_the_commands_make(tmp_path, hand):
    """The same commands by pattern rules, side by side."""
    (tmp_path / "two.tsv").write_text(DEVICES)
    options = [f"{name.upper()}={words}" for name, words in SHORT.items()]
    done = make(tmp_path, "-j2", "DEVICES=two.tsv", "PULSES=normal", *options, "out/right/report.html")
    assert done.returncode == 0, done.stderr
    assert same(tmp_path / "out/right/evaluation.h5", hand / "evaluation.h5")
    assert not (tmp_path / "out/left").exists()


@pytest.mark.parametrize("engine", ["make", pytest.param("snakemake", marks=SLOW)])
def test_what_a_broken_off_recording_kept_is_there(tmp_path, engine):
    """Both engines delete what a failed command made; what the message names is kept, and is no target."""
    (tmp_path / "one.tsv").write_text("name\tport\nleft\tbench:?break=force-high@2\n")
    if engine == "make":
        done = make(tmp_path, "DEVICES=one.tsv", f"CAPTURE={SHORT['capture']}")
    else:
        done = snakemake(tmp_path, "--cores", 1, devices="one.tsv", **SHORT)
    assert done.returncode != 0
    (kept,) = re.findall(r"kept in (\S+) \(complete=false\)", done.stdout + done.stderr)
    assert (tmp_path / kept).exists()
    assert not (tmp_path / "out/left/run.h5").exists()


@pytest.mark.parametrize("rules", ["Makefile", "workflow/Makefile", "workflow/Snakefile"])
def test_whatever_is_recorded_gets_its_name_at_the_end(rules):
    """Of captures and playbacks alike, since both say that they keep what they have."""
    lines = re.findall(
        r"^\s.*(?: capture | play ).*--port.*(?:\n.* mv .*)?", (ROOT / rules).read_text(), re.MULTILINE
    )
    assert len(lines) >= 2
    for line in lines:
        assert re.search(r"-o \S*recording\S* .*mv \S*recording\S* ", line, re.DOTALL | re.IGNORECASE), line


@pytest.mark.slow
def test_summary_is_a_table_of_all_devices(batch):
    """One row a device, with the numbers of its file."""
    with (batch / "out/summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for device in ("left", "right"):
        stored = figures(batch / "out" / device / "evaluation.h5")
        row = next(row for row in rows if device in row["file"])
        for name in ("mean_error_reduction_percent", "compensated.max_abs_error_percent"):
            assert float(row[f"normal.{name}"]) == stored["waveforms/0000/" + name.replace(".", "/")]


@pytest.mark.slow
def test_what_is_there_is_not_made_again(batch):
    """A second start finds nothing to do; a device that is lost is made again alone."""
    (batch / "two.tsv").write_text(DEVICES)
    done = snakemake(batch, "--cores", 2, "--dry-run", devices="two.tsv", pulses=["normal"], **SHORT)
    assert "Nothing to be done" in done.said
    forced = snakemake(
        batch, "--dry-run", "--cores", 1, "--forcerun", "out/left/run.h5",
        devices="two.tsv", pulses=["normal"], **SHORT,
    )  # fmt: skip
    assert _jobs(forced.said)["capture"] == 1


def _jobs(text: str) -> dict[str, int]:
    """Return how many jobs of each rule a dry run announces."""
    return {rule: int(n) for rule, n in re.findall(r"^(\w+) +(\d+)$", text, flags=re.MULTILINE)}


@pytest.mark.slow
def test_twenty_benches_are_planned(tmp_path):
    """The table that comes with the project: twenty devices, two pulses each."""
    table = ROOT / "workflow" / "devices.tsv"
    done = snakemake(tmp_path, "--cores", 2, "--dry-run", devices=str(table), pulses=["normal", "bifid"])
    assert done.returncode == 0, done.said
    expected = {"capture": 20, "identify": 20, "invert": 40, "play": 40, "evaluate": 20, "summary": 1}
    assert _jobs(done.said).items() >= expected.items()


def test_the_slurm_profile_is_one(tmp_path):
    """Read by Snakemake with the executor plugin that it names."""
    pytest.importorskip(
        "snakemake_executor_plugin_slurm", reason="snakemake-executor-plugin-slurm is not installed"
    )
    (tmp_path / "two.tsv").write_text(DEVICES)
    profile = ROOT / "workflow" / "profiles" / "slurm"
    done = snakemake(tmp_path, "--dry-run", "--profile", profile, devices="two.tsv", pulses=["normal"])
    assert done.returncode == 0, done.said
    assert "runtime=10" in done.said


def test_the_local_profile_is_one(tmp_path):
    """Read by Snakemake."""
    (tmp_path / "two.tsv").write_text(DEVICES)
    profile = ROOT / "workflow" / "profiles" / "local"
    done = snakemake(tmp_path, "--dry-run", "--profile", profile, devices="two.tsv", pulses=["normal"])
    assert done.returncode == 0, done.said


@pytest.mark.slow
def test_a_folder_of_records(tmp_path, hand):
    """Runs as they are, tables imported first; each gets a model, and a diagnosis when asked for."""
    records = tmp_path / "records"
    records.mkdir()
    (records / "bench.h5").write_bytes((hand / "run.h5").read_bytes())
    with h5py.File(hand / "run.h5") as file:
        columns = np.column_stack([file[name][::4] for name in ("time", "input", "output")])
    np.savetxt(records / "scope.csv", columns, delimiter=",", header="t_s,i_A,f_N", comments="")
    config = {"devices": "", "runs": "records", "import": "--time t_s --input i_A --output f_N"}
    done = snakemake(tmp_path, "--cores", 2, **config, identify=SHORT["identify"])
    assert done.returncode == 0, done.said
    assert same(tmp_path / "out/runs/bench/model.h5", hand / "model.h5")
    assert (tmp_path / "out/runs/scope/model.h5").exists()
    planned = snakemake(tmp_path, "--cores", 1, "--dry-run", **config, diagnose="full")
    assert _jobs(planned.said)["diagnose_record"] == 2


@pytest.mark.parametrize(
    ("config", "words"),
    [
        pytest.param({"devices": "", "runs": ""}, "nothing to do: set `devices` or `runs`", marks=SLOW),
        pytest.param({"devices": "", "runs": "nowhere"}, "nowhere: no such folder", marks=SLOW),
        ({"devices": "twice.tsv"}, "stands there twice"),
    ],
)
def test_a_wrong_configuration_is_said(tmp_path, config, words):
    """Before anything is run."""
    (tmp_path / "twice.tsv").write_text("name\tport\na\tbench:\nb\tbench:\n")
    done = snakemake(tmp_path, "--cores", 1, **config)
    assert done.returncode != 0
    assert words in done.said
