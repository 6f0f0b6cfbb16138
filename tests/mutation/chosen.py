"""A pytest plugin: says which tests run which lines, or runs chosen tests in a chosen order.

``MUTATION_TIMES``: a file for the seconds that each test took; contexts are switched for coverage.
``MUTATION_TESTS``: a file with the ids of the tests to run, the quickest first; failures are not shrunk.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

times: dict[str, float] = {}
failed: set[str] = set()


def pytest_configure() -> None:
    """Try the same examples each time, and leave a failing one as it is."""
    from hypothesis import Phase, settings

    phases = (Phase.explicit, Phase.generate)
    settings.register_profile("mutation", settings(), phases=phases, database=None, derandomize=True)
    settings.load_profile("mutation")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the chosen tests, in their order."""
    if "MUTATION_TESTS" in os.environ:
        order = {name: k for k, name in enumerate(json.loads(Path(os.environ["MUTATION_TESTS"]).read_text()))}
        config.hook.pytest_deselected(items=[one for one in items if one.nodeid not in order])
        items[:] = sorted((one for one in items if one.nodeid in order), key=lambda one: order[one.nodeid])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item):
    """What runs now is set up for this test, and may serve others of its file."""
    _switch(f"{item.nodeid} (setup)")
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item):
    """What runs now is run by this test."""
    _switch(f"{item.nodeid} (call)")
    return (yield)


def _switch(context: str) -> None:
    if "MUTATION_TIMES" in os.environ:
        import coverage

        coverage.Coverage.current().switch_context(context)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up what a test takes, and remember which do not pass."""
    if report.failed:
        failed.add(report.nodeid)
    times[report.nodeid] = times.get(report.nodeid, 0.0) + report.duration


def pytest_sessionfinish() -> None:
    """Write down what the tests took; one that fails under coverage answers for nothing."""
    if "MUTATION_TIMES" in os.environ:
        import coverage

        coverage.Coverage.current().save()
        Path(os.environ["MUTATION_TIMES"]).write_text(
            json.dumps({name: took for name, took in times.items() if name not in failed})
        )
