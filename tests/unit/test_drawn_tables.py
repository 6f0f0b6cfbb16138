"""Tables drawn from the habits of many programs: read to the digits written, or refused in words.

Delimiter, decimal sign, quotes, headings, units, comments, encoding, line ends, kind of time, columns beside
the record and what is damaged are drawn together, since each alone is read in ``test_table``.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from pulsetrainer.errors import DataError
from pulsetrainer.files.run_from_table import run_from_table

BEGIN = datetime(2024, 5, 17, 23, 10, 5, tzinfo=UTC)
STAMPS = {
    "iso": "%Y-%m-%dT%H:%M:%S.{ms}",
    "points": "%d.%m.%Y %H:%M:%S{sign}{ms}",
    "slashes": "%d/%m/%Y %H:%M:%S{sign}{ms}",
    "clock": "%H:%M:%S{sign}{ms}",
}
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
HEADINGS = ("{name} [{unit}]", "{name} ({unit})", "{name}/{unit}", "{name}_{unit}", "below")
DAMAGE = ("none", "none", "blank", "text", "short", "long", "order")


@dataclass(frozen=True)
class Drawn:
    """What is written, and what must be read."""

    raw: bytes
    time_s: np.ndarray | None
    input: np.ndarray
    output: np.ndarray
    damage: str
    bad: list[int]


def _draw(seed: int) -> Drawn:
    rng = np.random.default_rng([31, seed])

    def one(choices):
        return choices[rng.integers(len(choices))]

    n, delimiter, comma = int(rng.integers(40, 120)), one([",", ";", "\t", "|", " "]), bool(rng.integers(2))
    kind, heading, damage = one([*UNITS, *STAMPS, "count"]), one(HEADINGS), one(DAMAGE)
    quotes = one(["none", "names", "all"])
    if (comma and delimiter == ",") or (delimiter == " " and kind in STAMPS):
        quotes = "all"
    if delimiter == " " and heading == "below":  # no unit would be no cell
        heading = HEADINGS[0]
    sign = "," if comma else "."
    ticks = np.arange(n) + one([0, 40]) * (np.arange(n) > n // 2)  # a gap, or none

    def number(value: float) -> tuple[str, float]:
        text = one(["{:.6g}", "{:+.4f}", "{:.5E}"]).format(value)
        return text.replace(".", sign), float(text)

    pairs = [
        [number(f(k)) for k in range(n)] for f in (lambda k: 5 * np.sin(k / 7), lambda k: 80 * np.cos(k / 7))
    ]
    if kind in STAMPS:
        told = STAMPS[kind].replace("{sign}", sign)
        moments = [BEGIN + timedelta(milliseconds=2 * int(k)) for k in ticks]
        times = [m.strftime(told).replace("{ms}", f"{m.microsecond // 1000:03}") for m in moments]
        seconds = np.asarray(ticks * 2e-3)
    else:
        size = UNITS.get(kind, 1.0)
        times = [repr(round(float(2e-3 * k / size), 9)).replace(".", sign) for k in ticks]
        seconds = np.asarray([float(text.replace(",", ".")) * size for text in times])
    if kind == "count":
        times = [str(k) for k in range(n)]
    columns = [times, *([text for text, _ in pair] for pair in pairs)]
    names, units = ["time", "current", "force"], [kind if kind in UNITS else "", "A", "mN"]
    if rng.integers(3) == 0:  # a state beside the record
        columns, names, units = (
            [*columns, [one(["ok", "run"]) for _ in range(n)]],
            [*names, "state"],
            [*units, ""],
        )
    if heading != "below":
        filled = [heading.format(name=a, unit=b).replace(" ", "") for a, b in zip(names, units, strict=True)]
        names = [whole if unit else name for whole, unit, name in zip(filled, units, names, strict=True)]
    bad = sorted({int(k) for k in rng.integers(12, n - 2, 2)})
    rows = [list(row) for row in zip(*columns, strict=True)]
    for k in bad:
        if damage in ("blank", "text"):
            rows[k][one([1, 2])] = (
                "" if damage == "blank" and (delimiter != " " or quotes == "all") else "ERR"
            )
        elif damage in ("short", "long"):
            rows[k] = rows[k][:-2] if damage == "short" else [*rows[k], "1"]
    if damage == "order":
        rows[bad[0]], rows[bad[0] + 1] = rows[bad[0] + 1], rows[bad[0]]

    def line(cells, quoted: bool) -> str:
        return delimiter.join(f'"{cell}"' if quoted else cell for cell in cells)

    lines = [f"{one(['#', '% ', '// '])} made by X500" for _ in range(rng.integers(3))]
    lines.append(line(names, quotes != "none"))
    if heading == "below":
        lines.append(line(units, quotes == "all"))
    lines += [line(row, quotes == "all") for row in rows]
    lines[-9:-9] = [one(["", "# a pause"])] * int(rng.integers(2))
    text = one(["\n", "\r\n"]).join(lines) + one(["", "\n"])
    raw = text.encode(one(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"]))
    values = [np.asarray([value for _, value in pair]) for pair in pairs]
    return Drawn(raw, None if kind == "count" else seconds, *values, damage, bad)


def _same(path, drawn: Drawn, kept: np.ndarray, *, skip: bool) -> None:
    run = run_from_table(path, input="current", output="force", skip_bad_rows=skip).run
    np.testing.assert_array_equal(run.input, drawn.input[kept])
    np.testing.assert_array_equal(run.output, drawn.output[kept])
    assert (run.input_unit, run.output_unit) == ("A", "mN")
    if drawn.time_s is None:
        assert run.time_s is None
    else:
        since = drawn.time_s[kept] - drawn.time_s[kept][0]
        np.testing.assert_allclose(run.time_s - run.time_s[0], since, atol=5e-7)


@pytest.mark.parametrize("seed", range(48))
def test_a_drawn_table_is_read_as_written_or_refused(seed, tmp_path):
    """No number is wrong, no row is lost without a word, and what is refused is named."""
    drawn = _draw(seed)
    path = tmp_path / "t.csv"
    path.write_bytes(drawn.raw)
    rows = np.arange(drawn.input.size)
    if drawn.damage == "none":
        return _same(path, drawn, rows, skip=False)
    if drawn.damage == "order" and drawn.time_s is None:  # what counts the rows is then a time
        return None
    with pytest.raises(DataError) as caught:
        run_from_table(path, input="current", output="force")
    assert "t.csv" in caught.value.message
    assert "line " in caught.value.message
    assert caught.value.hint
    if drawn.damage != "order":
        _same(path, drawn, np.delete(rows, drawn.bad), skip=True)
    return None
