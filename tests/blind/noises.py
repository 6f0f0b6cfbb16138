"""Nothing hidden under noises of eight kinds, and effects at multiples of the limit that is stated for them.

    python tests/blind/noises.py controls --first 3000 --each 25 [--noise ar0.9 ...]
    python tests/blind/noises.py effects --first 3000 --each 2 [--percent 1 5] [--effect creep] [--noise ...]
    python tests/blind/noises.py limits --first 3000 --each 2 [--noise white ...]

Plants and noises are those of ``drawn``. The first prints the verdicts by noise, the second what is found of
effects of some size (rms, per cent of the span). The third takes what
the diagnosis of the plant with nothing hidden says it would have seen (``detectable_from_percent``), hides
that effect in the same plant at 0.5, 1 and 2 times this size, and prints how often it is found, or tied.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import os
import sys
from collections import Counter, defaultdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import drawn
import numpy as np

from pulsetrainer.diagnosis.procedure import diagnose
from pulsetrainer.diagnosis.state import Question, State

TIMES = (0.5, 1.0, 2.0)  # of the stated limit
HIDDEN = (*drawn.EFFECTS, "offset-drift", "step", "accommodation")  # resonance: its size does not scale


def answered(case: drawn.Drawn, seed: int) -> State:
    """Diagnose a drawn case."""
    return diagnose(Question([case.record], 0.0, case.high, np.random.default_rng(seed)))


def names_of(state: State) -> list[str]:
    """The causes that were found, with those that they could not be told from."""
    found = [one for one in state.findings if one.found]
    return [name for one in found for name in (one.cause.id, *one.confounded_with)]


def control(job: tuple[str, int]) -> tuple[str, int, str, list[str]]:
    """Judge one plant with nothing hidden."""
    noise, seed = job
    state = answered(drawn.draw(noise, "", seed), seed)
    return noise, seed, state.verdict, names_of(state)


def effects(job: tuple[str, str, float, int]) -> tuple[str, float, int, str, list[str], bool]:
    """Judge one effect: what is found, in doubt or not, and whether nothing that matters is left."""
    noise, effect, percent, seed = job
    state = answered(drawn.draw(noise, effect, seed, percent=percent), seed)
    found = [f"{one.cause.id}{'?' * one.in_doubt}" for one in state.findings if one.found]
    return effect, percent, seed, state.verdict, found, state.is_whole(state.extended or state.current)


def limits(job: tuple[str, int]) -> list[tuple[str, int, str, float, float, bool, str]]:
    """Hide each effect in one plant at multiples of its own limit."""
    noise, seed = job
    rows = []
    for effect in HIDDEN:
        case = drawn.draw(noise, effect, seed, percent=0.0)  # the same plant and noise
        state = answered(case, seed)
        stated = 100.0 * state.detectable.get(effect, float("nan"))
        for times in TIMES if np.isfinite(stated) else ():
            state = answered(drawn.draw(noise, effect, seed, percent=times * stated), seed)
            rows.append((noise, seed, effect, stated, times, effect in names_of(state), state.verdict))
    return rows


def main() -> None:
    """Print one of the two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=("controls", "effects", "limits"))
    parser.add_argument("--first", type=int, default=3000, help="first seed")
    parser.add_argument("--each", type=int, default=25, help="plants of each noise")
    parser.add_argument("--noise", nargs="+", choices=drawn.NOISES, default=list(drawn.NOISES))
    every = (*drawn.EFFECTS, *drawn.MORE)
    parser.add_argument("--effect", nargs="+", choices=every, default=list(every))
    parser.add_argument("--percent", nargs="+", type=float, default=[1.0], help="size, rms of the span")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.each)
    jobs = [(noise, seed) for seed in seeds for noise in options.noise]
    with multiprocessing.Pool(options.processes) as pool:
        if options.what == "controls":
            verdicts: dict[str, Counter[str]] = defaultdict(Counter)
            for noise, seed, verdict, names in pool.imap_unordered(control, jobs):
                verdicts[noise][verdict] += 1
                if verdict != "none":
                    print(noise, seed, verdict, *names, flush=True)
            print("| noise | verdicts |\n|---|---|")
            for noise in options.noise:
                print(f"| {noise} | {', '.join(f'{n} {v}' for v, n in verdicts[noise].most_common())} |")
            return
        if options.what == "effects":
            hidden = itertools.product(options.noise, options.effect, options.percent, seeds)
            for effect, percent, seed, verdict, names, whole in pool.imap_unordered(effects, hidden):
                rest = "" if whole else ", more is left"
                print(f"{effect} {percent:g} % {seed}: {verdict}; {' '.join(names)}{rest}", flush=True)
            return
        found: dict[tuple[str, float], list[bool]] = defaultdict(list)
        for rows in pool.imap_unordered(limits, jobs):
            for noise, seed, effect, stated, times, is_found, verdict in rows:
                found[effect, times].append(is_found)
                found["all", times].append(is_found)
                print(noise, seed, effect, f"{times:g} times {stated:.3g} %:", verdict, flush=True)
    print("| effect | " + " | ".join(f"{times:g} times" for times in TIMES) + " |\n|---|---|---|---|")
    for effect in (*HIDDEN, "all"):
        counts = (found[effect, times] for times in TIMES)
        print(f"| {effect} | " + " | ".join(f"{sum(c)}/{len(c)}" for c in counts) + " |")


if __name__ == "__main__":
    main()
