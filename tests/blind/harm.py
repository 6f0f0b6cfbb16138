"""Does an extension or a correction ever make a model worse? Cases of the grid, each with an unseen run.

    python tests/blind/harm.py --first 1200000 --each 2 --unknowns 6 --pairs 8 --triples 4 --controls 6

Each case of ``hidden`` is played twice: the diagnostic signal, and a drawn one with other turns at other
rates. ``identify``, ``diagnose``, ``extend`` and ``correct`` see the first alone. Then the plain and the
other model predict the second, as sound instruments show it, and an extended one also with the faults of the
first: what a sensor cuts off there, a plain model has learned. A line a case, and all harm counted.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import hidden
import numpy as np
from foreign import HARM

import pulsetrainer as pt
from pulsetrainer.core import excitations
from pulsetrainer.core.record import Record
from pulsetrainer.device.opening import open_device
from pulsetrainer.errors import DataError

SECONDS = 25.0
OF_THE_MEASUREMENT = (
    "offset-drift",
    "step",
    "periodic",
    "saturation",
    "quantisation",
    "outliers",
    "clock-skew",
    "leak",
    "frozen",
    "late-input",
    "input-lag",
    "gain-drift",
)
# two records, or no effect on the device
NOT_JUDGED = ("condition-change", "current-tracking", "out-of-range", "clipped-input")


def drive(high: float, rng: np.random.Generator) -> np.ndarray:
    """Draw turns between 0 and ``high`` at rates from 0.5 to 8 ranges a second, with rests (n,)."""
    parts, at = [np.zeros(1)], 0.0
    while sum(part.size for part in parts) < SECONDS * hidden.RATE_HZ:
        speed = float(np.exp(rng.uniform(np.log(0.5), np.log(8.0)))) * high
        turns = [at, *(high * rng.uniform(0, 1, int(rng.integers(4, 12)))), high, 0.0]
        parts.append(excitations.through(turns, speed, hidden.RATE_HZ)[1:])
        parts.append(np.zeros(round(rng.uniform(0, 1.0) * hidden.RATE_HZ)))
    return np.concatenate(parts)


def played(case: hidden.Case, high: float, value: np.ndarray) -> Record:
    """What a device reports of a drive (n,), with what the bench itself cannot hide."""
    with open_device(case.port) as device:
        lead = excitations.conditioning(0.0, high, speed=3.0, rate_Hz=hidden.RATE_HZ, rest_s=0.2)
        assert not device.play(lead, hidden.RATE_HZ).fault
        got = device.play(value, hidden.RATE_HZ)
    assert not got.fault, got.fault
    return hidden._spoilt(case, Record(got.current_A, got.force_N, dt_s=hidden.DT_S))


def run_of(record: Record) -> pt.Run:
    """A record as a user has it."""
    t = np.arange(record.input.size) * hidden.DT_S
    return pt.Run(time_s=t, input=record.input, output=record.output, input_unit="A", output_unit="N")


def without_the_measurement(case: hidden.Case) -> hidden.Case:
    """The same device, measured by sound instruments."""
    gone = tuple(name for name in case.causes if name in OF_THE_MEASUREMENT)
    kept = {
        key: value
        for key, value in case.settings.items()
        if not key.startswith((*gone, "outlier-size") if gone else "outlier-size")
    }
    return replace(case, causes=tuple(n for n in case.causes if n not in gone), settings=kept, outside="")


def judge(job: tuple[str, int]) -> tuple[str, int, str, str, dict[str, float]]:
    """Ratio of the errors on the unseen run, by what was done: extended, corrected."""
    kind, seed = job
    case = hidden.draw(kind, seed)
    data = hidden.measure(case)
    value = drive(data.played, np.random.default_rng([seed, 5]))
    seen = run_of(data.records[0])
    plain = pt.identify(seen)
    found = pt.diagnose(seen, plain)
    sound = without_the_measurement(case)
    unseen = {True: run_of(played(case, data.played, value))}
    unseen[False] = unseen[True] if sound == case else run_of(played(sound, data.played, value))
    ratios = {}
    for what, make, faults in (
        ("extended", lambda: pt.extend(plain, found), False),
        ("extended, same faults", lambda: pt.extend(plain, found), True),
        ("corrected", lambda: pt.identify(pt.correct(seen, found)), False),
    ):
        if faults and sound == case:
            continue
        try:
            other = make()
        except DataError:
            continue
        before, after = (one.rms for one in pt.evaluate(unseen[faults], [plain, other]).models)
        ratios[what] = after / before
    names = ",".join(one.cause for one in found.causes if one.found)
    return kind, seed, "+".join(case.causes) or case.outside or "-", f"{found.verdict} ({names})", ratios


def _job(job: tuple[str, int]) -> tuple[str, int, str, str, dict[str, float]]:
    try:
        return judge(job)
    except Exception as error:  # a crash is told, not a reason to stop
        return *job, "", f"crash: {type(error).__name__}: {error}", {}


def main() -> None:
    """Print a line a case, and the harm of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    for name, count in (("each", 1), ("unknowns", 4), ("pairs", 6), ("triples", 3), ("controls", 4)):
        parser.add_argument(f"--{name}", type=int, default=count)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    kinds = {f"single:{name}": asked.each for name in hidden.LIBRARY if name not in NOT_JUDGED}
    kinds |= {
        "unknown": asked.unknowns,
        "pair": asked.pairs,
        "triple": asked.triples,
        "control": asked.controls,
    }
    jobs = [(kind, asked.first + k) for kind, count in kinds.items() for k in range(count)]
    jobs = [jobs[k] for k in np.random.default_rng(asked.first).permutation(len(jobs))]
    all_of: dict[str, list[float]] = defaultdict(list)
    with multiprocessing.Pool(asked.processes) as pool:
        for kind, seed, hid, said, ratios in pool.imap_unordered(_job, jobs):
            told = ", ".join(f"{what} {ratio:.2f}" for what, ratio in ratios.items()) or "left as it is"
            worse = "  HARM" if any(ratio > HARM for ratio in ratios.values()) else ""
            sys.stdout.write(f"{kind} {seed}: {hid}; {said}; {told}{worse}\n")
            sys.stdout.flush()
            for what, ratio in ratios.items():
                all_of[what].append(ratio)
    for what, found in all_of.items():
        worse = sum(ratio > HARM for ratio in found)
        middle = f"median {np.median(found):.2f}, at most {max(found):.2f}" if found else "none"
        sys.stdout.write(f"{what}: {worse} of {len(found)} more than 5 % worse, {middle}\n")


if __name__ == "__main__":
    main()
