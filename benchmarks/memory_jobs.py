"""Identification in a process of its own, so that its peak of memory is its own: ``memory_jobs.py JOB``."""

from __future__ import annotations

import json
import sys
import threading
import time
from pathlib import Path

import core_jobs
import numpy as np

import oracle
from pulsetrainer.core.identification import identify
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record

SEED = 20_000


def _resident_MB() -> float:
    """Resident memory now; the kernel's own peak would also count what start-up took."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


class _Watch(threading.Thread):
    """Looks at the resident memory every millisecond."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.peak = _resident_MB()
        self.done = threading.Event()

    def run(self) -> None:
        while not self.done.wait(0.001):
            self.peak = max(self.peak, _resident_MB())


def objective(job, operator) -> float:
    """Sum of squares of a fitted operator on the data it was fitted to."""
    return float(np.sum((job.output - operator(job.input)) ** 2))


def ours(job, plane, **options):
    """Identify; return the objective and what else is known."""
    found = identify([Record(job.input, job.output)], plane, **options)
    return lambda: {
        "objective": objective(job, found.operator),
        "iterations": float(found.iterations),
        "kkt": found.kkt,
        "validated": job.percent(found.operator(job.unseen_input)),
    }


def dense(job, plane):
    """Run the naive fit: a row of relay states for every sample, scipy's nnls."""
    edges = plane.edges.tolist()
    states = oracle.relay_states(*oracle.relays(edges), job.input)
    masses, offset = oracle.dense_fit(states, job.output)
    return lambda: {"objective": oracle.sum_of_squares(states, job.output, masses, offset)}


JOBS = {
    "small": (20_000, 48, lambda job, plane: ours(job, plane, reading="relay")),
    "small-dense": (20_000, 48, dense),
    "small-continuous": (20_000, 48, ours),
    "small-smoothed": (20_000, 48, lambda job, plane: ours(job, plane, smoothing="auto")),
    "long": (1_000_000, 48, ours),
    "large": (100_000, 200, ours),
}


def main(name: str) -> None:
    """Run one job and print what it took."""
    n, n_h, run = JOBS[name]
    job = core_jobs.job(SEED, n=n)
    plane = Plane.uniform(-1.0, 1.0, n_h)
    # what is imported late belongs to the start
    tiny = core_jobs.job(SEED, n=500, levels=32)
    run(tiny, Plane.uniform(-1.0, 1.0, 8))
    start, watch = _resident_MB(), _Watch()
    watch.start()
    begun = time.perf_counter()
    result = run(job, plane)
    took = time.perf_counter() - begun
    watch.done.set()
    watch.join()
    out = {"seconds": took, "start_MB": start, "peak_MB": watch.peak, "result": result()}
    json.dump(out, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
