"""The fault table: every fault, how often it was tried, what it cost. All counts after the tries must be 0.

    python tests/faults/run.py --tries 400 --seed 1

``--tries`` is the number of kills; the other faults get their share of it. The same seed tries the same
things; only when exactly a kill lands depends on the machine.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # no threads before the forks
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.pop("PULSETRAINER_PORT", None)
_HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(_HERE), str(_HERE.parent), str(_HERE.parent / "unit")]

import fuzz  # noqa: E402
import kinds_of_fault as faults  # noqa: E402
import ready  # noqa: E402
from kinds_of_fault import Tally, World  # noqa: E402


def main() -> int:
    """Try all faults, print the table, return 1 where a count is not zero."""
    options = _options()
    scratch = Path(tempfile.mkdtemp(prefix="faults-"))
    try:
        begun = time.monotonic()
        seconds = ready.prepare(scratch / "ready")
        world = World(scratch / "ready", seconds, scratch, random.Random(options.seed))
        rows = list(_rows(world, options))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    if options.json:
        Path(options.json).write_text(json.dumps([asdict(row) for row in rows], indent=1))
    print(_table(rows))
    print(f"\nseed {options.seed}, {sum(r.tries for r in rows)} tries, {time.monotonic() - begun:.0f} s")
    for row in rows:
        for complaint in row.complaints[:5]:
            print(f"\n{row.fault}: {complaint}")
    return 0 if all(row.clean for row in rows) else 1


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tries", type=int, default=400, help="kills; other faults get their share")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", help="faults whose name holds this; may be repeated")
    parser.add_argument("--sample", action="store_true", help="a few tries of each fault, for the test suite")
    parser.add_argument("--json", default="", help="file for the table as JSON")
    return parser.parse_args()


def _rows(world: World, options: argparse.Namespace) -> Iterator[Tally]:
    """Yield one row after the other, and say on stderr where we are."""
    each = max(1, options.tries // (2 * len(ready.WRITERS)))
    share = max(len(ready.WRITERS), options.tries // 5)
    kills = [(writer, older) for writer in ready.WRITERS for older in (False, True)]
    if options.sample:
        each, share, kills = 1, 3, world.rng.sample(kills, 10)
    jobs = [
        (
            f"kill -9 {writer.name}",
            lambda writer=writer, older=older: faults.kill(world, each, writer, older=older),
        )
        for writer, older in kills
    ]
    root = os.geteuid() == 0
    jobs += [("full disk", lambda: faults.full_disk(world, share))] if root else []
    jobs += [
        ("full quota", lambda: faults.quota(world, share)),
        ("read-only", lambda: faults.read_only(world, share)),
        ("truncated", lambda: faults.truncated(world, share)),
        ("bit-flipped", lambda: faults.flipped(world, share)),
        ("unsealed", lambda: faults.unsealed(world, share)),
        ("together", lambda: faults.together(world, share)),
        ("locked", lambda: faults.locked(world, share)),
        ("fuzzed arguments", lambda: fuzz.arguments(world, 2 * share)),
        ("fuzzed tables", lambda: fuzz.tables(world, share)),
        ("fuzzed artefacts", lambda: fuzz.artefacts(world, share)),
    ]
    for name, job in jobs:
        if options.only and not any(part in name for part in options.only):
            continue
        begun = time.monotonic()
        row = job()
        row.seconds = time.monotonic() - begun
        sys.stderr.write(
            f"{row.fault}: {row.tries} tries, {row.seconds:.1f} s{'' if row.clean else ' FAILED'}\n"
        )
        yield row
    if not root:
        sys.stderr.write("full disk: only root can mount a small one; the quota stands for it\n")


def _table(rows: list[Tally]) -> str:
    head = ("fault", "tries", "artefacts lost", "half-written", "hangs", "wrong exits")
    lines = [(r.fault, r.tries, r.lost, r.half_written, r.hangs, r.wrong_exits) for r in rows]
    total = ("all", *(sum(line[k] for line in lines) for k in range(1, len(head))))
    widths = [max(len(str(line[k])) for line in (head, *lines, total)) for k in range(len(head))]

    def text(line: tuple) -> str:
        first = f"{line[0]:<{widths[0]}}"
        return "  ".join([first, *(f"{cell!s:>{w}}" for cell, w in zip(line[1:], widths[1:], strict=True))])

    rule = "-" * (sum(widths) + 2 * (len(widths) - 1))
    return "\n".join([text(head), rule, *map(text, lines), rule, text(total)])


if __name__ == "__main__":
    sys.exit(main())
