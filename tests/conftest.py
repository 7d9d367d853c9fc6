"""Fixtures and settings of all tests."""

from __future__ import annotations

import functools
import gc
import importlib
import math
import os
import sys

import pytest
from hypothesis import HealthCheck, settings
from matplotlib.mathtext import MathTextParser

from rsfstudy.execution import dask_clusters, provenance, worker_pool

settings.register_profile(
    "default", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("default")
os.environ.setdefault("MPLBACKEND", "agg")
# The console determines its width when it is created.
os.environ.pop("COLUMNS", None)
importlib.import_module("rsfstudy.cli.console_output")
# Without bytecode files, each of the hundred processes that the tests start would compile the
# package again, which takes a second per process.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


#: Slow modules, which are collected first so that the last process of a parallel run does not
#: work on one of them while the others are idle. Modules that read the results of named studies
#: come later, because they would otherwise wait for the studies to finish.
SLOW_MODULES = (
    "test_studies", "test_resume", "test_public_functions", "test_faults", "test_clusters",
    "test_altered_files",
    "test_report", "test_compiled", "test_scale", "test_figures", "test_fits_together",
    "test_notebook", "test_statuses", "test_cli", "test_readme", "test_extensions", "test_site",
    "test_two_states", "test_critical_step", "test_fit_command", "test_tables",
)  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the slow modules to the beginning of the test run."""
    order = {name: number for number, name in enumerate(SLOW_MODULES)}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def pytest_collection_finish() -> None:
    """Exclude collected tests and imported modules from garbage collection.

    Scanning these objects in every collection would take a sixth of the test time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """Disable worker timeouts, because slow machines start workers slowly."""
    monkeypatch.setattr(worker_pool, "WARN_AFTER_SECONDS_WITHOUT_WORKER", math.inf)
    monkeypatch.setattr(worker_pool, "GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER", math.inf)


@pytest.fixture(autouse=True, scope="session")
def the_checkout_stays():
    """Cache the Git state of the checkout.

    Otherwise, each run would query the state three times.
    """
    asked, checkout = provenance.read_git_commit_and_state, provenance._PACKAGE_DIRECTORY.parent
    known = functools.cache(asked)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            provenance,
            "read_git_commit_and_state",
            lambda root: (known if root == checkout else asked)(root),
        )
        yield


@pytest.fixture(autouse=True, scope="session")
def formulas_are_set_once():
    """Cache parsed formulas in figures.

    By default, Matplotlib caches 50 formulas only and parses each formula once per
    renderer.
    """
    cached = MathTextParser._parse_cached
    set_once = functools.cache(
        lambda form, *asked: cached.__wrapped__(MathTextParser(form), *asked)
    )
    forms = {"vector": "path", "raster": "agg"}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            MathTextParser,
            "_parse_cached",
            lambda parser, *asked: set_once(forms[parser._output_type], *asked),
        )
        yield


@pytest.fixture(scope="session")
def cluster(tmp_path_factory):
    """Yield a Dask client of a cluster with two worker processes."""
    log = tmp_path_factory.mktemp("cluster") / "workers.log"
    with dask_clusters.start_local_cluster(2, log) as client:
        yield client
