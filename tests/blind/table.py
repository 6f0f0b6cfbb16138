"""The figures of a blind grid as tables: ``python tests/blind/table.py build/blind.jsonl``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import hidden
import numpy as np
from scipy import optimize, stats

LEAST_PERCENT = 0.5  # size of an effect from which on the targets hold
# causes whose strength can be made as small as one likes
SWEPT = tuple(
    name
    for name in hidden.LIBRARY
    if name
    not in ("saturation", "outliers", "current-tracking", "out-of-range", "clipped-input", "resonance")
)


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


def words(rows) -> str:
    """Return the figures in words, with 95 % confidence bounds."""
    crashed = [r for r in rows if "crash" in r]
    refused = [r for r in rows if "refused" in r]
    nothing = [r for r in rows if "nothing" in r]
    rows = [r for r in rows if not {"crash", "refused", "nothing"} & set(r)]
    kinds = {}
    for row in rows:
        kinds.setdefault(row["kind"].partition(":")[0], []).append(row)
    drawn = kinds.get("single", [])
    # the gates' causes have no size in per cent of the span that would mean the same
    singles = [r for r in drawn if r["size_percent"] >= LEAST_PERCENT or r["causes"][0] in _GATED]
    named = [r for r in singles if r["right"]]
    errors = np.asarray([e for r in named for e in r["errors"].values()])
    cover = [c for r in named for c in r["covered"].values()]
    oracle = np.asarray([r["oracle_share"] for r in named])
    oracle = oracle[np.isfinite(oracle)]
    gains = np.asarray([r["held_out"] for r in named])
    gains = gains[np.isfinite(gains)]
    seconds = [r["seconds"] for r in rows]
    controls, unknowns, pairs, triples = (kinds.get(k, []) for k in ("control", "unknown", "pair", "triple"))
    lines = [
        "| figure | measured (95 % confidence) | target |",
        "|---|---|---|",
        f"| false alarms on controls | {_share(controls, lambda r: not r['right'])} | <= 0.05 |",
        f"| right name first | {_share(singles, lambda r: r['right'])} | >= 0.90 |",
        f"| right class | {_share(singles, lambda r: r['in_class'])} | >= 0.95 |",
        f"| wrong unique name | {_share(singles, lambda r: r['unique'] and not r['right'])} | <= 0.05 |",
        f"| another cause besides | {_share(singles, lambda r: len(r['found']) > 1)} | |",
        f"| outside the library: unknown | {_share(unknowns, lambda r: r['right'])} | >= 0.90 |",
        f"| pairs: exactly both | {_share(pairs, lambda r: r['right'])} | >= 0.85 |",
        f"| pairs: both classes | {_share(pairs, lambda r: r['in_class'])} | |",
        f"| triples: exactly all three | {_share(triples, lambda r: r['right'])} | |",
        f"| parameter error, median | {_median(100 * errors)} % | <= 5 % |",
        f"| truth within the 95 % interval | {sum(cover)}/{len(cover)} | |",
        f"| held-out gain of the reducible part, median | {_median(gains)} % | |",
        f"| held-out gain over that of the true cause, median | {_median(100 * oracle)} % | >= 80 % |",
        f"| ... cases with 80 % of it | {_share(oracle.tolist(), lambda x: x >= 0.8)} | |",
        f"| seconds of processor time, median and largest | {_median(seconds)}, {max(seconds):.0f} | |",
        f"| crashes | {len(crashed)} | 0 |",
        f"| cases that the device itself refuses to play | {len(refused)} | |",
        f"| cases in which nothing of the effect is there | {len(nothing)} | |",
        "",
        "| cause | size [%] | right | class | parameter error [%] | covered | gain/oracle [%] | otherwise |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [_row(name, [r for r in singles if r["causes"][0] == name]) for name in hidden.LIBRARY]
    lines += ["", "| cause | found at 90 % power from [% of span] | cases |", "|---|---|---|"]
    for name in SWEPT:
        own = [r for r in (*drawn, *kinds.get("weak", [])) if r["causes"][0] == name]
        lines.append(f"| {name} | {limit(own, name)} | {len(own)} |")
    lines += [f"\ncrash: {r['kind']} {r['seed']} {r['crash']}" for r in crashed]
    lines += [f"\nrefused: {r['kind']} {r['seed']} {r['refused']}" for r in refused]
    lines += [f"\nnothing hidden: {r['kind']} {r['seed']} {r['nothing']}" for r in nothing]
    return "\n".join(lines)


_GATED = (
    "saturation",
    "quantisation",
    "outliers",
    "stick-slip",
    "current-tracking",
    "out-of-range",
    "clipped-input",
    "frozen",
)


def _median(values) -> str:
    return f"{np.median(values):.1f}" if len(values) else "-"


def _row(name, own) -> str:
    errors = [100 * e for r in own if r["right"] for e in r["errors"].values()]
    cover = [c for r in own if r["right"] for c in r["covered"].values()]
    oracle = [100 * r["oracle_share"] for r in own if r["right"] and np.isfinite(r["oracle_share"])]
    sizes = [r["size_percent"] for r in own]
    other = ", ".join(sorted({r["verdict"] for r in own if not r["right"]}))
    span = f"{min(sizes):.2g} to {max(sizes):.2g}" if sizes else "-"
    right, inside = sum(r["right"] for r in own), sum(r["in_class"] for r in own)
    return (
        f"| {name} | {span} | {right}/{len(own)} | {inside}/{len(own)} | {_median(errors)} "
        f"| {sum(cover)}/{len(cover)} | {_median(oracle)} | {other} |"
    )


def limit(rows, name) -> str:
    """Return the size at which nine of ten are named, by a logistic fit against the logarithm of the size."""
    size = np.log([r["size_percent"] for r in rows]) if rows else np.empty(0)
    found = np.asarray([name in r["found"] for r in rows], dtype=float)
    if found.all() or not found.any():
        return "-" if not found.any() else f"below {np.exp(size.min()):.2g}"

    def loss(p):
        z = np.exp(p[1]) * (size - p[0])
        return float(np.sum(np.logaddexp(0.0, z) - found * z)) + 0.5 * (p[1] - 1.5) ** 2

    middle, steep = optimize.minimize(loss, [float(np.median(size)), 1.5], method="Nelder-Mead").x
    return f"{np.exp(middle + np.log(9.0) / np.exp(steep)):.2g}"


if __name__ == "__main__":
    sys.stdout.write(words([json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]) + "\n")
