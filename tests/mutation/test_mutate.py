"""The faults of ``make mutate``: each kind is found, and what no test should notice is left alone."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from faults import faults_in

SOURCE = '''"""A docstring with 1 and < in it."""
LIMIT = 0.5  # 2
__slots__ = ("a" if 1 else "b",)


@dataclass(slots=True)
class Thing:
    size: Annotated[int, 3] = 4

    def reach(self, x: Literal[5] = 6) -> float:
        """Another one."""
        if x.size <= 7 and not self:
            raise ValueError(f"got {x + 8}", 9)
        note("more than %d" % 10)
        x -= np.minimum(x, y)
        return sum(a * b for a, b in zip(x, x, strict=True))
'''


def changes() -> set[str]:
    """All changes of the example."""
    return {fault.change for fault in faults_in("example.py", SOURCE.encode())}


@pytest.mark.parametrize(
    "change",
    [
        "0.5 -> 1.0",
        "4 -> 5",
        "4 -> (3)",
        "6 -> 7",
        "x.size <= 7 and not self -> ((x.size <= 7) or (not self))",
        "x.size <= 7 -> ((x.size) > (7))",
        "x.size <= 7 -> ((x.size) < (7))",
        "not self -> (self)",
        "x -= np.minimum(x, y) -> x += (np.minimum(x, y))",
        "np.minimum(x, y) -> np.maximum(x, y)",
        "a * b -> ((a) / (b))",
    ],
)
def test_each_kind_is_found(change):
    """Operators, constants and conditions, in functions and outside."""
    assert change in changes()


def test_nothing_else_is_touched():
    """Neither docstrings, messages and types nor decorators, ``__slots__`` and ``strict``."""
    assert len(changes()) == 14  # the eleven above, 6 down, 7 up and down
    assert not {change.split()[0] for change in changes()} & {"1", "3", "5", "8", "9", "10", "True"}


def test_every_fault_is_a_program():
    """A fault changes one line's text, is Python still, and knows whether it is outside of functions."""
    source = Path(__file__).with_name("faults.py").read_bytes()
    for fault in faults_in("faults.py", source):
        changed = fault.put_into(source)
        compile(changed, "faults.py", "exec")
        assert changed != source
        assert changed.count(b"\n") == source.count(b"\n")
    limit, *_, last = faults_in("example.py", SOURCE.encode())
    assert (limit.at_import, last.at_import) == (True, False)
    assert limit.text == "LIMIT = 0.5  # 2"


def test_the_faults_that_change_nothing_are_lines_of_the_code():
    """A line that was rewritten since is to be looked at again."""
    import mutate

    known = {(one["file"], one["line"]) for one in mutate._equivalent()}
    gone = [(file, line) for file, line in sorted(known) if line not in _lines(mutate.ROOT / file)]
    assert gone == []


def _lines(file: Path) -> list[str]:
    return [line.strip() for line in file.read_text().splitlines()] if file.exists() else []


def test_a_program_forked_off_a_warm_one_counts_for_the_test_that_started_it():
    """Its lines name the test that the warm program was made for as well."""
    import mutate

    (fault, *_) = faults_in("a.py", b"def f(x):\n    return x + 1\n")
    lines = {"2": ["t.py::warmed (setup)|t.py::asked (call)", "t.py::slow (call)"]}
    times = {"t.py::asked": 1.0, "t.py::slow": 9.0, "t.py::warmed": 1.0}
    assert mutate._order(fault, lines, times, 5.0) == ["t.py::asked"]
    assert mutate._order(fault, lines, times, 50.0) == ["t.py::asked", "t.py::slow"]
