"""A session in its journal: whatever is cut off, the rest reads as the session that it is."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import store_examples as examples

from pulsetrainer.artefacts import Beats, Quiz, Run, Session
from pulsetrainer.errors import DamagedFileError, WrongKindError
from pulsetrainer.files import journal
from pulsetrainer.files.encode import values_of
from pulsetrainer.files.recorder import interrupted
from pulsetrainer.files.session_recorder import SessionRecorder
from pulsetrainer.files.store import read, read_any

BEATS, SAMPLES = 4, 20  # and samples a beat
SAMPLED = ("time_s", "target", "reference", "input", "output")


def _whole() -> Session:
    rng = np.random.default_rng(1)
    time_s = np.arange(BEATS * SAMPLES) / 1000
    columns = {name: rng.normal(size=time_s.size) for name in SAMPLED[1:]}
    rows = rng.normal(size=(6, BEATS))
    beats = Beats(time_s[::SAMPLES], rows[0] ** 2, np.arange(BEATS) % 2, *rows[1:])
    choices = ("normal", "bifid")
    quiz = Quiz(choices, choices, ("bifid", "bifid"), np.array([1.5, np.nan]), "anna")
    warm = {"temperature_s": np.arange(3.0), "temperature_K": np.array([0.1, 0.4, 0.6])}
    return replace(examples.session(), time_s=time_s, **columns, beats=beats, quiz=quiz, **warm)


def _so_far(whole: Session, beats: int) -> dict:
    """Fields of a session after some of its beats: one question is answered by two of them."""
    fields = {name: value for name, value in values_of(whole).items() if name not in SAMPLED}
    columns = values_of(whole.beats)
    cut = {name: v[:beats] for name, v in columns.items() if isinstance(v, np.ndarray)}
    answered, windows = beats // 2, max(beats - 1, 0)
    quiz = replace(
        whole.quiz,
        asked=whole.quiz.asked[:answered],
        answered=whole.quiz.answered[:answered],
        response_s=whole.quiz.response_s[:answered],
    )
    warm = {name: getattr(whole, name)[:windows] for name in ("temperature_s", "temperature_K")}
    return fields | {"beats": replace(whole.beats, **cut), "quiz": quiz if answered else None} | warm


@pytest.fixture
def pressed(tmp_path):
    """A session, its recorder under way with all of it, and what the journal says after each beat."""
    whole = _whole()
    with SessionRecorder(tmp_path / "s.h5", examples.header(), signal="session") as recorder:
        recorder.judge(_so_far(whole, 0))
        for beat in range(BEATS):
            part = slice(beat * SAMPLES, (beat + 1) * SAMPLES)
            recorder.append(*(getattr(whole, name)[part] for name in SAMPLED))
            recorder.judge(_so_far(whole, beat + 1))
        yield whole, recorder
        recorder.keep(_so_far(whole, BEATS), examples.header())


def test_cut_at_any_byte_it_is_a_session_as_far_as_it_went(pressed, tmp_path):
    """Samples, targets, beats, answers and temperatures up to the cut; none is made up, and it says so."""
    whole, recorder = pressed
    content = recorder.partial.read_bytes()
    begun = [block.end for block in journal.blocks(recorder.partial)][1]  # the first block of beats
    cut = tmp_path / "cut.h5.partial"
    seen = set()
    for end in (*range(begun, len(content), 7), len(content)):
        cut.write_bytes(content[:end])
        kept = read(cut, Session)
        beats, samples = kept.beats.start_s.size, kept.time_s.size
        assert not kept.complete
        assert kept.fault
        assert 0 <= samples - beats * SAMPLES <= SAMPLES
        for name in SAMPLED:
            np.testing.assert_array_equal(getattr(kept, name), getattr(whole, name)[:samples])
        for name, values in values_of(kept.beats).items():
            if isinstance(values, np.ndarray):
                np.testing.assert_array_equal(values, getattr(whole.beats, name)[:beats])
        answered = 0 if kept.quiz is None else len(kept.quiz.answered)
        assert answered == beats // 2
        if kept.quiz is not None:
            assert kept.quiz.asked == whole.quiz.asked[:answered]
        told = 0 if kept.temperature_K is None else kept.temperature_K.size
        assert told == max(beats - 1, 0)
        seen.add((beats, answered))
    assert seen == {(0, 0), (1, 0), (2, 1), (3, 1), (4, 2)}


def test_a_session_that_is_cut_off_is_no_run(pressed):
    """Who asks for a run is told what it is."""
    _, recorder = pressed
    assert isinstance(read_any(recorder.partial), Session)
    with pytest.raises(WrongKindError) as refused:
        read(recorder.partial, Run)
    assert refused.value.found == "session"


def test_a_killed_session_is_no_capture_to_be_resumed(pressed, tmp_path):
    """It is told as what it is, and stays where it is."""
    _, recorder = pressed
    left = tmp_path / "other.h5.partial"
    left.write_bytes(recorder.partial.read_bytes())
    assert interrupted(tmp_path / "other.h5") == []
    assert interrupted(tmp_path / "other.h5", Session) == [(left, BEATS * SAMPLES)]


@pytest.mark.parametrize("content", [b"{}", b"[1]", b'{"beats": [[1]], "windows": [], "quiz": null}', b"no"])
def test_a_block_of_beats_that_is_none_is_damage(pressed, content):
    """Whole to its checksum, but not what the recorder writes."""
    _, recorder = pressed
    recorder._add(journal.BEAT, content)
    with pytest.raises(DamagedFileError) as found:
        read_any(recorder.partial)
    assert found.value.artefact == "session"


def test_an_exception_keeps_the_session_as_far_as_it_went(tmp_path):
    """The file under the final name holds the beats that were over, and is not complete."""
    whole = _whole()
    recorder = SessionRecorder(tmp_path / "s.h5", examples.header(), signal="session")
    with pytest.raises(KeyboardInterrupt), recorder:
        _begin_and_stop(recorder, whole)
    kept = read(tmp_path / "s.h5", Session)
    assert (kept.complete, kept.beats.start_s.size, kept.time_s.size) == (False, 1, SAMPLES)
    assert kept.fault
    assert not recorder.partial.exists()


def _begin_and_stop(recorder: SessionRecorder, whole: Session) -> None:
    recorder.judge(_so_far(whole, 0))
    recorder.append(*(getattr(whole, name)[:SAMPLES] for name in SAMPLED))
    recorder.judge(_so_far(whole, 1))
    raise KeyboardInterrupt


def test_the_end_of_a_long_session_takes_no_more_memory_than_that_of_a_short_one(tmp_path):
    """Written piece by piece: the peak is that of a piece, at ten times the length too."""
    peaks = []
    for minutes in (2, 20):
        recorder = SessionRecorder(tmp_path / f"{minutes}.h5", examples.header(), signal="session")
        with recorder:
            recorder.judge(_so_far(_whole(), 0))
            for second in range(60 * minutes):
                time_s = second + np.arange(1000) / 1000
                recorder.append(time_s, *(np.cos(time_s + k) for k in range(4)))
            tracemalloc.start()
            try:
                recorder.finish()
                peaks.append(tracemalloc.get_traced_memory()[1])
            finally:
                tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1e6
