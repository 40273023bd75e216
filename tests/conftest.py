"""Whole runs that several test files look at: each takes seconds and is done once."""

from __future__ import annotations

import pytest
from run_cases import FAILING, SMALL, SMALL_ALL, VERIFIED, Run, suture


@pytest.fixture(scope="session")
def verified_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run whose result is verified, with ``--json``."""
    return suture(VERIFIED, tmp_path_factory.mktemp("verified"), "--json")


@pytest.fixture(scope="session")
def failing_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run whose result is not."""
    return suture(FAILING, tmp_path_factory.mktemp("failing"))


@pytest.fixture(scope="session")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The cheapest run: one process, congruent cusps solved once."""
    return suture(SMALL, tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="session")
def small_run_of_all(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same, every cusp solved."""
    return suture(SMALL_ALL, tmp_path_factory.mktemp("small_all"))


@pytest.fixture(scope="session")
def small_run_of_ranks(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same in three processes, one cusp each."""
    return suture(SMALL, tmp_path_factory.mktemp("small_ranks"), "--json", ranks=3)
