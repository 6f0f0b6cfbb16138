"""What a dry run promises, the device does: drawn command lines end the same with it and without.

DRY_RUNS=60 python -m pytest tests/link/test_dry_run.py draws so many of each command, 300 in all;
DRY_RUNS_FIRST=1000 draws others. What no dry run can know is left out: a device that is broken or another
than was delivered, and a force that is within a few tenths of its limit.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

import pulsetrainer as pt
from program import Ran, pulsetrainer

QUICK, COUNT = 4, int(os.environ.get("DRY_RUNS", "60"))
FIRST = int(os.environ.get("DRY_RUNS_FIRST", "0"))
KEPT = Path(__file__).parents[1] / "data/files-0.1"
GAINS = "pid_kp = {}\npid_ki = 3680\nfeed_resistance = 20423\nfeed_inductance = 3191\nfeed_offset = 374\n"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="the bench needs a pty")


@dataclass
class Line:
    """A command line that is drawn, with what it finds in its folder and surroundings."""

    words: list[object]
    settings: dict[str, float] = field(default_factory=dict)  # of the file
    tables: str = ""  # below them in the file
    env: dict[str, str] = field(default_factory=dict)


class Drawn:
    """Draws: mostly what can be played, now and then what cannot."""

    def __init__(self, *seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def one(self, among: Sequence[object]) -> object:
        """Any of these."""
        return among[int(self.rng.integers(len(among)))]

    def chance(self, share: float) -> bool:
        """True in so many of all draws."""
        return bool(self.rng.random() < share)

    def between(self, low: float, high: float) -> float:
        """A number of four places."""
        return round(float(self.rng.uniform(low, high)), 4)

    def mostly(self, good: Sequence[object], bad: Sequence[object], share: float = 0.07) -> object:
        """Any of the good ones, now and then a bad one."""
        return self.one(bad if self.chance(share) else good)

    def setting(self, line: Line, key: str, option: str, value: float) -> None:
        """Set something on the command line, in the environment or in the file."""
        way = self.one(("flag", "flag", "environment", "file"))
        if way == "flag":
            line.words += [option, value]
        elif way == "environment":
            line.env["PULSETRAINER_" + key.upper().replace(".", "_")] = str(value)
        else:
            line.settings[key] = value

    def surroundings(
        self,
        line: Line,
        peak_A: float,
        out: str,
        force_N: Callable[[float], Sequence[float]] = lambda _limit_A: (3.0, 14.9),
        *,
        tuned: bool = True,
    ) -> Line:
        """Add port, limits, an output that may exist, and gains that were tuned.

        ``force_N`` gives limits that are surely passed, or surely not, by the current limit in force.
        """
        limit_A = 1.5
        if self.chance(0.5):
            good = ("?ideal", "?noise=0.002", "?ambient=10", "?seed=7", "?supply=13")
            bad = ("?nonsense=1", "?noise=5", "?break=it", "?speed=slow", "here")
            line.words += ["--port", f"bench:{self.mostly(good, bad)}"]
        if self.chance(0.5):
            around = (self.between(0.3, 0.97), self.between(1.01, 1.3), 1.5 / peak_A)
            limit_A = float(self.mostly([round(peak_A * one, 4) for one in around], (0.0, -1.0, 1.6, 0.02)))
            self.setting(line, "limits.current_A", "--limit-current", limit_A)
        if self.chance(0.3):
            limit_N = self.mostly(force_N(limit_A), (0.0, 16.0))
            self.setting(line, "limits.force_N", "--limit-force", float(limit_N))
        if self.chance(0.2):
            line.env["OUTPUT"] = "there"
            if self.chance(0.5):
                line.words.append("--overwrite")
        if self.chance(0.05):
            out = f"absent/{out}"
        if tuned and self.chance(0.15):
            line.tables = '[tuned."BENCH-0"]\n' + GAINS.format(self.mostly((7680,), (99999, '"x"'), 0.4))
        line.words += ["-o", out]
        return line


def capture(drawn: Drawn) -> Line:
    """Signals of both names and of one's own, at rates that the device has and has not."""
    line = Line(["capture", drawn.mostly(("identification", "own.csv"), ("diagnostik", "absent.csv"), 0.06)])
    top = float(drawn.mostly((drawn.between(0.3, 1.45), 1.5), (drawn.between(1.51, 1.7), 12.0)))
    if line.words[1] == "identification":
        drawn.setting(line, "current_max_A", "--current-max", top)
        drawn.setting(line, "speed_A_per_s", "--speed", float(drawn.mostly((3.0, 10.0, 40.0), (0.0, 1e-9))))
        drawn.setting(line, "levels", "--levels", int(drawn.mostly((2, 6, 9), (0, 1))))
    rate = float(drawn.mostly((100.0, 1000.0, 2000.0, 5000.0), (300.0, 7.0, 0.5, 20_000.0)))
    drawn.setting(line, "rate_Hz", "--rate", rate)
    if drawn.chance(0.3):
        line.words.append("--no-condition")
    if drawn.chance(0.4):
        line.words += ["--repeats", drawn.mostly((2, 3), (0, 10**12))]
    top = 1.0 if line.words[1] != "identification" else top
    return drawn.surroundings(line, top, "out.h5", lambda _limit_A: _forces(top))


def _forces(peak_A: float) -> list[float]:
    """Limits that a device of ours surely passes where nothing foretells its force, or surely does not."""
    least, most = (np.interp(peak_A, (0.0, 0.5, 1.0, 1.5), ends) for ends in ((0, 0, 2, 3), (3, 10, 14, 15)))
    return [round(float(one), 3) for one in (least, most) if one > 1.0]


def play(drawn: Drawn) -> Line:
    """Drives of several heights, some beyond what any device plays; some long, hot or remade for the heat."""
    good, bad = ("drive", "low", "bifid", "relay", "hot"), ("high", "slow", "odd", "model", "absent")
    name = drawn.mostly(good, bad, 0.15)
    line = Line(["play", f"{name}.h5"])
    if drawn.chance(0.7):
        drawn.setting(line, "repeats", "--repeats", int(drawn.mostly((1, 2, 3), (0, -1, 10**9))))
    if drawn.chance(0.3):
        line.words.append(drawn.one(("--track-heat", "--no-track-heat")))
    return drawn.surroundings(line, 0.8 if name == "low" else 1.2, "out.h5")


def refine(drawn: Drawn) -> Line:
    """As for a play; a refined drive needs a model with an inverse, and a pass."""
    bad = ("low", "high", "slow", "odd", "relay", "model", "absent")
    name = drawn.mostly(("drive", "bifid"), bad, 0.3)
    line = Line(["refine", f"{name}.h5", "--passes", drawn.mostly((1, 2), (0, -1))])
    return drawn.surroundings(line, 0.8 if name == "low" else 1.2, "out.h5")


def session(drawn: Drawn) -> Line:
    """Rates, heights, rhythms, changes and quizzes, of models with and without causes."""
    model = drawn.mostly(("model", "model-extended"), ("relay-model", "drive", "absent"))
    line = Line(["session", "--model", f"{model}.h5"])
    pulses = drawn.mostly(
        ("normal", "bifid", "normal,bifid", "own-pulse.csv"), ("normla", "normal,normal", "")
    )
    line.words += ["--pulses", pulses]
    if drawn.chance(0.15):
        line.words += [
            "--quiz",
            drawn.one((2, 3)),
            *drawn.mostly((("--answers", "answers.txt"),), ((),), 0.3),
        ]
    else:
        line.words += ["--beats", drawn.mostly((1, 2, 3), (0, -3))]
        if drawn.chance(0.1):
            line.words += ["--minutes", drawn.one((0.1, 0.0))]
    for option, good, bad in (
        ("--rate", (20, 60, 90, 240), (19.9, 241, 0)),
        ("--amplitude", (100, 60, 5), (0, 100.5, -20)),
        ("--variability", (0, 5), (26, -1)),
        ("--respiration", (0, 10), (31,)),
        ("--ectopic", (0, 30), (51,)),
        ("--seed", (0, 5), (-1,)),
        ("--changes", ("changes.csv",), ("bad.csv", "absent.csv")),
    ):
        if drawn.chance(0.25):
            line.words += [option, drawn.mostly(good, bad)]
    if drawn.chance(0.15):
        line.words.append(drawn.one(("--track-heat", "--no-track-heat")))
    return drawn.surroundings(line, 1.5 if "extended" in str(model) else 1.2, "out.h5")


def tune(drawn: Drawn) -> Line:
    """With drives and without, into a file of settings that may have the device already."""
    line = Line(["tune"])
    if drawn.chance(0.5):
        name = drawn.mostly(("drive", "low", "bifid", "relay"), ("high", "slow", "model", "absent"), 0.25)
        line.words += ["--drive", f"{name}.h5"]
    if drawn.chance(0.3):
        line.words += ["--supply", drawn.mostly((12.0, 13.5), (0.0, -1.0))]
    return drawn.surroundings(line, 1.2, "tuned.toml", _forces, tuned=False)


COMMANDS = (capture, play, refine, session, tune)


@pytest.fixture(scope="module")
def ready(made_once) -> Path:
    """A folder with models, drives of all kinds, and tables."""

    def fill(folder: Path) -> None:
        for name in ("model", "model-extended"):
            (folder / f"{name}.h5").symlink_to(KEPT / f"{name}.h5")
        model = pt.load(KEPT / "model.h5")
        relay = replace(model, reading="relay")
        drive = pt.invert("normal", model, periods=1)
        top = np.full(60_000, 1.15)
        hot = {"time_s": np.arange(top.size) / 1000.0, "compensated": top, "scaled": top}
        hot |= {name: np.full(top.size, value) for name, value in (("target", 11.0), ("predicted", 11.0))}
        made = {
            "relay-model": relay,
            "drive": drive,
            "bifid": pt.invert("bifid", model, periods=2),
            "relay": pt.invert("normal", relay, periods=1),
            "low": scaled(drive, model, 0.6),
            "high": scaled(drive, model, 1.4),
            "slow": replace(drive, time_s=drive.time_s * 1000.0),
            "odd": replace(drive, time_s=drive.time_s * 1.01),
            "hot": replace(drive, **hot, scored=np.arange(top.size) > 100),
        }
        for name, noun in made.items():
            pt.save(noun, folder / f"{name}.h5")
        rows = "".join(f"{k / 100},{0.5 - 0.5 * np.cos(k / 16)}\n" for k in range(200))
        (folder / "own.csv").write_text("t_s,current_A\n" + rows)
        (folder / "own-pulse.csv").write_text("t_s,p\n" + rows[: rows.index("1.0,")])
        (folder / "changes.csv").write_text("t_s,rate,amplitude\n1.5,90,\n2,,50\n")
        (folder / "bad.csv").write_text("t_s,rate\n1,500\n")
        (folder / "answers.txt").write_text("normal\nbifid\nnormal\n")

    return made_once("dry-runs", fill)


def verdict(done: Ran) -> tuple[int, str]:
    """How a command ended: exit code, and kind of refusal."""
    return done.code, done.json["error"]["kind"] if done.code else ""


def scaled(drive: pt.Waveform, model: pt.Model, gain: float) -> pt.Waveform:
    """A drive whose currents are so many times as large."""
    foretold = np.asarray(model.predict(min(gain, 1.0) * drive.compensated, 1e-3))
    both = {name: gain * getattr(drive, name) for name in ("compensated", "scaled")}
    return replace(drive, **both, predicted=foretold)


def seeds() -> list[object]:
    """A quick share of each command, and all of them."""
    slow = pytest.mark.slow
    return [
        pytest.param(command, seed, id=f"{command.__name__}-{seed}", marks=[slow] * (seed >= QUICK))
        for command in COMMANDS
        for seed in range(FIRST, FIRST + COUNT)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "seed"), seeds())
def test_a_dry_run_ends_as_the_run_does(ready, tmp_path, command, seed):
    """The same exit code and kind of refusal; and it leaves the folder as it was."""
    line = command(Drawn(COMMANDS.index(command), seed))
    for path in ready.iterdir():
        (tmp_path / path.name).symlink_to(path)
    if line.env.pop("OUTPUT", ""):
        name = Path(str(line.words[-1])).name
        (tmp_path / name).write_text('[tuned."BENCH-0"]\n' + GAINS.format(7680) if "toml" in name else "mine")
    if line.settings or line.tables:
        keys = "".join(f"{key} = {value}\n" for key, value in line.settings.items())
        (tmp_path / "bench.toml").write_text(keys + line.tables)
        line.words[:0] = ["--settings", "bench.toml"]
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    dry = pulsetrainer(tmp_path, *line.words, "--dry-run", "--json", env=line.env)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    run = pulsetrainer(tmp_path, *line.words, "--json", env=line.env)
    print(command.__name__, seed, *line.words, line.settings, line.env, verdict(dry), verdict(run))
    assert verdict(dry) == verdict(run), (dry.err, run.err)


@pytest.mark.slow
@pytest.mark.parametrize("limit", ["--limit-force", "--limit-current"])
@pytest.mark.parametrize(
    "words",
    [("play", "drive.h5"), ("refine", "drive.h5"), ("session", "--model", "model.h5")],
    ids=lambda words: words[0],
)
def test_what_a_limit_hints_at_helps(ready, tmp_path, words, limit):
    """All of them begin with a stroke over the model's range, so that no lower pulse keeps below a limit."""
    value = "5" if limit == "--limit-force" else "0.7"
    limited = (limit, value, "-o", "out.h5")
    for path in ready.glob("*.h5"):
        (tmp_path / path.name).symlink_to(path)
    dry = pulsetrainer(tmp_path, *words, *limited, "--dry-run", "--json")
    run = pulsetrainer(tmp_path, *words, *limited, "--json")
    assert dry.code == run.code > 0
    said = [done.json["error"]["message"] for done in (dry, run)]
    assert said[1].startswith(said[0]), "refused before anything moves"
    hints = [done.json["error"]["hint"] for done in (dry, run)]
    assert all(limit in hint and "--current-max" in hint for hint in hints)
    top = re.search(r"--current-max at most ([\d.]+)", hints[0])[1]
    capture = ("capture", "identification", "--current-max", top, "--levels", "4", *limited)
    identify = ("identify", "out.h5", "-o", "low-model.h5", "--levels", "8")
    invert = ("invert", "normal", "--model", "low-model.h5", "-o", "low-drive.h5")
    instead = {"drive.h5": "low-drive.h5", "model.h5": "low-model.h5"}
    again = (*(instead.get(word, word) for word in words), *limited, "--overwrite", "--dry-run")
    for line in (capture, identify, invert, again):
        assert (done := pulsetrainer(tmp_path, *line)).code == 0, done.err
