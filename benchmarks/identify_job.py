"""The API's identify and the core's own work on one run, in turns, in a process that may use all threads."""

from __future__ import annotations

import json
import sys

import core_jobs
import numpy as np
from measuring import taking_turns
from threadpoolctl import threadpool_limits

import pulsetrainer as pt
from pulsetrainer.core import input_noise
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.fit import Fitted, fit

ROUNDS = 9


def main() -> None:
    """Print the medians and their ratio, after a check that both find the same weights."""
    job = core_jobs.job(20_000)
    run = pt.Run(time_s=np.arange(job.input.size) / 1000.0, input=job.input, output=job.output)

    def core() -> Fitted:
        with threadpool_limits(1, user_api="blas"):
            clean = input_noise.clean(job.input).input
            fitted = fit([(clean, job.output)], float(clean.min()), float(clean.max()), 48)
            coverage(fitted.identified.operator.plane, [clean])
            return fitted

    assert np.array_equal(pt.identify(run).weights, core().identified.operator.weights)
    took = taking_turns(core, lambda: pt.identify(run), ROUNDS)
    json.dump({"core_s": took.ours, "api_s": took.baseline, "ratio": took.ratio}, sys.stdout)


if __name__ == "__main__":
    main()
