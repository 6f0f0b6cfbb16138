"""One thread for the linear algebra of a verb: threads that wait for each other cost ten times the work.

The matrices are many and small. In two threads ``identify`` takes ten times the processor's time of one. To
use more threads, set OMP_NUM_THREADS or OPENBLAS_NUM_THREADS; then nothing is limited here.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread(verb: Callable[P, R]) -> Callable[P, R]:
    """Let the linear algebra work in one thread while ``verb`` runs."""

    @wraps(verb)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        if any(name in os.environ for name in _VARIABLES):
            return verb(*args, **kwargs)
        import scipy.linalg  # noqa: F401 - brings its own copy of BLAS, which must be there to be limited
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return verb(*args, **kwargs)

    return limited
