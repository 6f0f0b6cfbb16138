"""The table of messages: each row is used, says what is wrong and what to do next, and can fail."""

from __future__ import annotations

import re
import string
from dataclasses import fields
from pathlib import Path

import pytest

from program import Ran
from wording import MESSAGES, NOTES, Message, refusal

TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize("name", [*MESSAGES, *NOTES])
def test_a_row_says_something_and_is_used(name):
    """Something of the message, and a test that provokes it."""
    row = MESSAGES.get(name)
    assert NOTES[name] if row is None else any(getattr(row, field.name) for field in fields(Message))
    named = re.compile(rf"""["']{re.escape(name)}["']""")
    users = [path.name for path in TESTS.rglob("test_*.py") if named.search(path.read_text(encoding="utf-8"))]
    assert users


def test_the_names_of_a_row_are_words():
    """What stands in braces is filled in by the test."""
    for row in MESSAGES.values():
        for field in fields(Message):
            for _, name, _, _ in string.Formatter().parse(getattr(row, field.name) or ""):
                assert name is None or name.isidentifier()


SAID = "error: the output m.h5 already exists\n  try: name another file, such as m-2.h5\n"


@pytest.mark.parametrize(
    ("code", "err"),
    [
        (3, SAID),
        (2, SAID.replace("m.h5", "n.h5")),
        (2, SAID.replace("exists", "is there")),
        (2, SAID.partition("\n")[0]),
        (2, f"Traceback\n{SAID}"),
    ],
    ids=["code", "where", "what", "next", "traceback"],
)
def test_a_message_that_lacks_something_is_found(code, err):
    """Another code, place or word; no next step; a traceback."""
    refusal(Ran(2, "", SAID), 2, "exists", file="m.h5")
    with pytest.raises(AssertionError):
        refusal(Ran(code, "", err), 2, "exists", file="m.h5")
