"""The table: every benchmark adds rows, and they are printed together when all have run."""

from __future__ import annotations

import os
import platform

import pytest
from measuring import Table

# One thread for every library of linear algebra: the ratios are of algorithms, not of cores. Nothing
# above imports them.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

TABLE = Table()


@pytest.fixture
def table() -> Table:
    """Return the table that is printed at the end."""
    return TABLE


def pytest_terminal_summary(terminalreporter):
    """Print what was measured, and on what."""
    import numpy as np  # noqa: PLC0415
    import scipy  # noqa: PLC0415

    if not TABLE.rows:
        return
    terminalreporter.section("benchmarks")
    for line in TABLE.lines():
        terminalreporter.write_line(line)
    terminalreporter.write_line(
        f"\n{platform.machine()}, {os.cpu_count()} cores, one thread, Python {platform.python_version()}, "
        f"numpy {np.__version__}, scipy {scipy.__version__}"
    )
