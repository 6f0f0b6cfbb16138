"""The fault table: every fault, how often it was tried, what it cost. All counts after the tries must be 0.

    python tests/faults/run.py --tries 560 --seed 1

``--tries`` is the number of kills; the other faults get their share of it. The same seed tries the same
things; only when exactly a kill lands depends on the machine.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, replace
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

from command_lines import WRITERS  # noqa: E402


def main() -> int:
    """Try all faults, print the table, return 1 where a count is not zero."""
    options = _options()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that disks are unmounted and folders removed
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
    if busy := sum(row.busy for row in rows):
        print(f"\n{busy} times the device stopped by itself because this computer was too busy, and said so")
    print(f"\nseed {options.seed}, {sum(r.tries for r in rows)} tries, {time.monotonic() - begun:.0f} s")
    return 0 if all(row.clean for row in rows) else 1


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tries", type=int, default=560, help="kills; other faults get their share")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", help="faults whose name holds this; may be repeated")
    parser.add_argument("--sample", action="store_true", help="a few tries of each fault, for the test suite")
    parser.add_argument("--json", default="", help="file for the table as JSON")
    return parser.parse_args()


def _rows(world: World, options: argparse.Namespace) -> Iterator[Tally]:
    """Yield one row after the other, and say on stderr where we are."""
    each = max(1, options.tries // (2 * len(WRITERS)))
    share = max(len(WRITERS), options.tries // 5)
    kills = [(writer, older) for writer in WRITERS for older in (False, True)]
    if options.sample:
        each, share, kills = 1, 3, world.rng.sample(kills, 10)
    jobs = [
        (
            f"kill -9 {writer.name}{', older file there' if older else ''}",
            lambda world, writer=writer, older=older: faults.kill(world, each, writer, older=older),
        )
        for writer, older in kills
    ]
    root = os.geteuid() == 0
    jobs += [("full disk", lambda world: faults.full_disk(world, share))] if root else []
    jobs += [
        ("full quota", lambda world: faults.quota(world, share)),
        ("read-only", lambda world: faults.read_only(world, share)),
        ("truncated", lambda world: faults.truncated(world, share)),
        ("bit-flipped", lambda world: faults.flipped(world, share)),
        ("no checksum", lambda world: faults.without_checksum(world, share)),
        ("damaged recording", lambda world: faults.damaged_recording(world, share)),
        ("together", lambda world: faults.together(world, share)),
        ("locked", lambda world: faults.locked(world, share)),
        ("fuzzed arguments", lambda world: fuzz.arguments(world, 2 * share)),
        ("fuzzed values", lambda world: fuzz.values(world, 5 * share)),
        ("fuzzed tables", lambda world: fuzz.tables(world, share)),
        ("fuzzed artefacts", lambda world: fuzz.artefacts(world, share)),
    ]
    for name, job in jobs:
        if options.only and not any(part in name for part in options.only):
            continue
        begun = time.monotonic()
        row = job(replace(world, rng=random.Random(f"{options.seed} {name}")))
        row.seconds = time.monotonic() - begun
        sys.stderr.write(
            f"{row.fault}: {row.tries} tries, {row.seconds:.1f} s{'' if row.clean else ' FAILED'}\n"
        )
        for text in (*row.slow, *row.complaints[:5]):
            sys.stderr.write(f"  {text}\n")
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
