"""The full blind grid, in parallel: ``python tests/blind/run.py --cases 40 --controls 400 -o blind.h5``.

Every case is drawn by its seed, hidden in the bench's data, diagnosed, and only then compared. Writes one
row per case to an HDF5 file and the table of docs/blind.md to standard output.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import h5py
import hidden
import judge
import numpy as np
from scipy import stats


def _job(job):
    try:
        return judge.judge(*job).row()
    except Exception as error:  # a crash is a wrong answer, not a reason to stop
        return {"kind": job[0], "seed": job[1], "crash": f"{type(error).__name__}: {error}"}


def bound(count: int, of: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a share (Clopper and Pearson 1934)."""
    low = stats.beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = stats.beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return float(low), float(high)


def _share(rows, test) -> str:
    count = sum(bool(test(r)) for r in rows)
    if not rows:
        return "none run"
    low, high = bound(count, len(rows))
    return f"{count}/{len(rows)} = {count / len(rows):.3f} ({low:.3f} to {high:.3f})"


def table(rows) -> str:
    """Return the figures in words, with 95 % confidence bounds."""
    crashed = [r for r in rows if "crash" in r]
    rows = [r for r in rows if "crash" not in r]
    kinds = {name: [r for r in rows if r["kind"].partition(":")[0] == name] for name in _KINDS}
    singles = kinds["single"]
    errors = np.asarray([e for r in singles for e in r["errors"].values()])
    cover = [c for r in singles for c in r["covered"].values()]
    gains = np.asarray([r["held_out"] for r in singles if r["right"] and np.isfinite(r["held_out"])])
    lines = [
        "| figure | value |",
        "|---|---|",
        f"| false alarms on controls | {_share(kinds['control'], lambda r: not r['right'])} |",
        f"| single causes: right name first | {_share(singles, lambda r: r['right'])} |",
        f"| single causes: right class | {_share(singles, lambda r: r['in_class'])} |",
        f"| single causes: wrong unique name | {_share(singles, lambda r: r['unique'] and not r['right'])} |",
        f"| single causes: another one besides | {_share(singles, lambda r: len(r['found']) > 1)} |",
        f"| outside the library: unknown | {_share(kinds['unknown'], lambda r: r['right'])} |",
        f"| pairs: exactly both | {_share(kinds['pair'], lambda r: r['right'])} |",
        f"| pairs: both classes | {_share(kinds['pair'], lambda r: r['in_class'])} |",
        f"| parameter error, median | {100 * np.median(errors):.1f} % |" if errors.size else "",
        f"| truth within the 95 % interval | {sum(cover)}/{len(cover)} |",
        f"| held-out gain of the reducible part, median | {np.median(gains):.0f} % |" if gains.size else "",
        f"| seconds per diagnosis, median | {np.median([r['seconds'] for r in rows]):.0f} |" if rows else "",
        f"| crashes | {len(crashed)} |",
        "",
        "| cause | right | found as |",
        "|---|---|---|",
    ]
    for name in hidden.LIBRARY:
        own = [r for r in singles if r["causes"] == (name,)]
        other = ", ".join(sorted({r["verdict"] for r in own if not r["right"]}))
        lines.append(f"| {name} | {sum(r['right'] for r in own)}/{len(own)} | {other} |")
    return "\n".join(line for line in lines if line or line == "")


_KINDS = ("control", "single", "unknown", "pair")


def main() -> None:
    """Run the grid."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", default="blind.h5")
    parser.add_argument("--controls", type=int, default=400)
    parser.add_argument("--each", type=int, default=10, help="cases per cause")
    parser.add_argument("--unknowns", type=int, default=30)
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    first = options.first
    jobs = [(f"single:{name}", first + k) for k in range(options.each) for name in hidden.LIBRARY]
    jobs += [("unknown", first + k) for k in range(options.unknowns)]
    jobs += [("pair", first + k) for k in range(options.pairs)]
    jobs += [("control", first + k) for k in range(options.controls)]
    begun = time.perf_counter()
    rows = []
    with multiprocessing.Pool(options.processes) as pool:
        for row in pool.imap_unordered(_job, jobs):
            rows.append(row)
            sys.stderr.write(f"\r{len(rows)}/{len(jobs)}, {time.perf_counter() - begun:.0f} s")
            with Path(f"{options.out}.jsonl").open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(row, default=float) + "\n")
    with h5py.File(options.out, "w") as file:
        file.attrs["command"] = " ".join(sys.argv)
        text = h5py.string_dtype()
        file.create_dataset("rows", data=[json.dumps(r, default=float) for r in rows], dtype=text)
    sys.stdout.write(f"\n{table(rows)}\n")


if __name__ == "__main__":
    main()
