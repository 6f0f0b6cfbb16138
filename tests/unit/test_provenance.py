"""Provenance: what a header says, what it must never say, and that it survives JSON."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.files.provenance import (
    Device,
    Header,
    Provenance,
    clean,
    digests,
    library_versions,
    make_header,
    redact,
    sha256_of,
)
from wording import raises

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
SECRETS = ["creep", "0.05", "ideal", "speed"]


@pytest.mark.parametrize(
    "argv",
    [
        ["capture", "--port", "bench:?creep=0.05&ideal&speed=max"],
        ["capture", "--port=bench:?creep=0.05&ideal&speed=max"],
        ["capture", "-pbench:?creep=0.05 & ideal", "identification"],
        ["capture", "--port", "BENCH:?creep=0.05"],
        ["capture", "PULSETRAINER_PORT='bench:?creep=0.05\nspeed=max'"],
        ["capture", "--port", "bench://here?creep=0.05"],
    ],
)
def test_plant_parameters_are_cut_from_the_command(argv):
    """Whatever form the port takes on the command line, what follows its question mark is gone."""
    header = make_header("run", argv=argv, now=NOW)
    stored = " ".join((header.provenance.to_json(), *header.history))
    assert "bench:" in stored.lower()
    assert not [secret for secret in SECRETS if secret in stored]


def test_plant_parameters_are_cut_everywhere_else():
    """Title, parameters at any depth, keys, inputs, libraries, device, inherited history: all are cut."""
    url = "bench:?creep=0.05"
    ancestor = Header(f"from {url}", "2026-01-01T00:00:00Z", (f"2026 pulsetrainer capture --port {url}",))
    header = make_header(
        f"run on {url}",
        argv=["capture"],
        now=NOW,
        parameters={"port": url, "deep": [{"a": (url, {url})}, Path(url)], url: 1},
        inputs={url: "00"},
        ancestors=[ancestor],
        device=Device("s", "f", url),
        libraries={"x": url},
    )
    stored = json.dumps([header.title, header.provenance.to_json(), *header.history])
    assert stored.count("bench:") == 10
    assert "creep" not in stored


def test_redaction_leaves_other_text_alone():
    """A question mark elsewhere, and a port without parameters, are not touched."""
    for text in ("why? because", "bench:", "socket://host:1?x", "the bench: why, oh why?"):
        assert redact(text) == text


@pytest.mark.parametrize("scheme", ["bench:", "qemu:", "BENCH:"])
def test_the_seed_stays_and_what_is_hidden_goes(scheme):
    """Which device it was may be known, so that a command can be replayed; its effects may not."""
    assert redact(f"--port={scheme}?seed=3") == f"--port={scheme}?seed=3"
    assert redact(f"--port={scheme}?creep=0.05&seed=3&heat=1 and more") == f"--port={scheme}?seed=3"
    assert redact(f"capture x --port '{scheme}?seed=12' -o y.h5") == f"capture x --port '{scheme}?seed=12'"
    assert redact(f'--port "{scheme}?creep=1"') == f'--port "{scheme}"'
    assert redact(f"{scheme}?seed=4&creep=1&serial=3") == f"{scheme}?seed=4&serial=3"
    for nothing in ("seed=x", "seed=3x", "wire-seed=3", "noseed=3", "seed=", "creep=seed"):
        assert redact(f"{scheme}?{nothing}") == scheme


@given(st.text(), st.text())
def test_no_text_after_the_question_mark_survives(before, after):
    """For any text around it, cutting leaves what comes before the question mark, and a seed at most.

    And the quote that was opened right before it.
    """
    if not any(scheme in before.lower() for scheme in ("bench:", "qemu:")):
        left = redact(f"{before}bench:?{after}").removeprefix(f"{before}bench:")
        quote = before[-1:] if before[-1:] in ("'", '"') else ""
        assert re.fullmatch(rf"(\?(seed|serial)=\d{{1,9}}(&(seed|serial)=\d{{1,9}})*)?{quote}", left)


@given(st.text(st.characters(), max_size=40))
def test_cleaned_text_can_be_stored(text):
    """Any Python text, lone surrogates and NUL included, becomes valid UTF-8 without NUL; twice is once."""
    cleaned = clean(text)
    assert "\0" not in cleaned
    assert cleaned.encode("utf-8").decode("utf-8") == clean(cleaned)


def test_json_round_trip():
    """What goes into JSON comes out equal, numpy numbers and infinities as JSON can tell them."""
    provenance = Provenance(
        argv=("identify", "rün.h5"),
        parameters={
            "levels": np.int64(48),
            "tol": np.float64(1e-3),
            "limit": float("inf"),
            "grid": np.arange(2),
        },
        seed=7,
        inputs={"rün.h5": "ab"},
        libraries=library_versions(),
        device=Device("0042", "1.2", "/dev/ttyUSB0"),
    )
    assert Provenance.from_json(provenance.to_json()) == provenance
    assert provenance.parameters == {"levels": 48, "tol": 1e-3, "limit": "inf", "grid": [0, 1]}
    assert json.loads(provenance.to_json())["device"] == {
        "serial": "0042",
        "firmware": "1.2",
        "port": "/dev/ttyUSB0",
    }


@pytest.mark.parametrize(
    "text", ["", "[]", "3", '{"argv": 3}', '{"device": {"x": 1}}', "{", '{"device": "x"}']
)
def test_broken_json_is_a_data_error(text):
    """A provenance that is no JSON object of the right form is a DataError, not a traceback."""
    with raises(DataError, "provenance itself"):
        Provenance.from_json(text)


def test_unknown_json_fields_are_ignored():
    """A later version may say more; this one reads what it knows."""
    assert Provenance.from_json('{"version": "9", "moon": "full"}') == Provenance(version="9")


def test_created_is_utc_whatever_the_zone():
    """The time is written in UTC; a time without a zone is refused."""
    east = NOW.astimezone(timezone(timedelta(hours=5)))
    assert make_header("t", argv=[], now=east).created == "2026-01-02T03:04:05Z"
    with raises(ArgumentError, "no time zone"):
        make_header("t", argv=[], now=datetime(2026, 1, 2, 3, 4, 5))  # noqa: DTZ001 - that is the point


def test_history_tells_the_whole_ancestry_once_and_in_order():
    """Two inputs with a common ancestor: every command once, oldest first, the new one last."""
    capture = make_header("c", argv=["capture", "identification", "-o", "my run.h5"], now=NOW)
    later = NOW + timedelta(minutes=1)
    model = make_header("m", argv=["identify", "my run.h5"], now=later, ancestors=[capture])
    drive = make_header("d", argv=["aim", "normal"], now=later + timedelta(seconds=1), ancestors=[model])
    both = make_header("p", argv=["play", "a\nb"], now=later + timedelta(minutes=1), ancestors=[model, drive])
    assert both.history == (
        "2026-01-02T03:04:05Z pulsetrainer capture identification -o 'my run.h5'",
        "2026-01-02T03:05:05Z pulsetrainer identify 'my run.h5'",
        "2026-01-02T03:05:06Z pulsetrainer aim normal",
        "2026-01-02T03:06:05Z pulsetrainer play 'a\\x0ab'",
    )


def test_digests_keep_the_name_the_user_gave(tmp_path, monkeypatch):
    """A relative name stays relative: no path of this machine is added."""
    monkeypatch.chdir(tmp_path)
    Path("run.h5").write_bytes(b"abc")
    expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert digests([Path("run.h5")]) == {"run.h5": expected}
    with raises(DataError, "cannot be read", file="absent.h5"):
        sha256_of("absent.h5")
