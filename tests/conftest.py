"""How long the laws are tried: quickly by default, longer with ``HYPOTHESIS_PROFILE=ci``.

Runs are not derandomised, so every run looks at new examples; a failure prints the blob that replays it.
"""

from __future__ import annotations

import os

# as the program does: two workers with two threads each wait for each other
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import HealthCheck, settings

settings.register_profile(
    "quick", max_examples=50, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("ci", parent=settings.get_profile("quick"), max_examples=300)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "quick"))
