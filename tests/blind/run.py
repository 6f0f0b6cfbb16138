"""The full blind grid, in parallel on all cores: ``make blind``.

Every case is drawn by its seed, hidden in the bench's data, diagnosed, and only then compared. A row per case
goes to a text file beside the result as it is made, so that a run that was stopped goes on where it was; at
the end all rows are written to an HDF5 file and the table of docs/blind.md to standard output.
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
import table


def _job(job):
    try:
        return judge.judge(*job, sized=True).row()
    except hidden.RefusedByTheDeviceError as error:  # nothing was measured that could be judged
        return {"kind": job[0], "seed": job[1], "refused": str(error)}
    except hidden.NothingHiddenError as error:
        return {"kind": job[0], "seed": job[1], "nothing": str(error)}
    except Exception as error:  # a crash is a wrong answer, not a reason to stop
        return {"kind": job[0], "seed": job[1], "crash": f"{type(error).__name__}: {error}"}


def jobs_of(options) -> list[tuple[str, int]]:
    """All cases, shuffled: what is done when a run is stopped is a fair sample; the weak ones last."""
    first = options.first
    jobs = [(f"single:{name}", first + k) for k in range(options.each) for name in hidden.LIBRARY]
    jobs += [("unknown", first + k) for k in range(options.unknowns)]
    jobs += [("pair", first + k) for k in range(options.pairs)]
    jobs += [("triple", first + k) for k in range(options.triples)]
    jobs += [("control", first + k) for k in range(options.controls)]
    jobs = [jobs[k] for k in np.random.default_rng(first).permutation(len(jobs))]
    return jobs + [(f"weak:{name}", first + k) for k in range(options.weak) for name in table.SWEPT]


def main() -> None:
    """Run the grid."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", type=Path, default=Path("build/blind.h5"))
    parser.add_argument("--controls", type=int, default=400)
    parser.add_argument("--each", type=int, default=20, help="cases per cause")
    parser.add_argument("--weak", type=int, default=12, help="weak cases per cause, for the detection limit")
    parser.add_argument("--unknowns", type=int, default=60)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--triples", type=int, default=0)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    log = options.out.with_suffix(".jsonl")
    rows = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    done = {(row["kind"], row["seed"]) for row in rows}
    jobs = [job for job in jobs_of(options) if job not in done]
    begun = time.perf_counter()
    with multiprocessing.Pool(options.processes) as pool, log.open("a", encoding="utf-8") as stream:
        for count, row in enumerate(pool.imap_unordered(_job, jobs), start=1):
            rows.append(row)
            stream.write(json.dumps(row, default=float) + "\n")
            stream.flush()
            if sys.stderr.isatty() or count % 50 == 0:
                sys.stderr.write(f"\r{count}/{len(jobs)}, {time.perf_counter() - begun:.0f} s")
    with h5py.File(options.out, "w") as file:
        file.attrs["command"] = " ".join(["python", *sys.argv])
        text = h5py.string_dtype()
        file.create_dataset("rows", data=[json.dumps(r, default=float) for r in rows], dtype=text)
    sys.stdout.write(f"\n{table.words(rows)}\n")


if __name__ == "__main__":
    main()
