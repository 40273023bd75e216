"""Whole runs that several test files look at: each takes seconds and is done once."""

from __future__ import annotations

from typing import Any
from unittest import mock

import pytest

from avneo_fem import run as run_module
from avneo_fem.results.pictures import PictureError
from run_cases import FAILING, SMALL, SMALL_ALL, VERIFIED, Run, suture, suture_inside


@pytest.fixture(scope="session")
def verified_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run whose result is verified, in a process of its own, with ``--json``."""
    return suture(VERIFIED, tmp_path_factory.mktemp("verified"), "--json")


@pytest.fixture(scope="session")
def failing_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run whose result is not."""
    return suture_inside(FAILING, tmp_path_factory.mktemp("failing"))


@pytest.fixture(scope="session")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The cheapest run: one process, congruent cusps solved once."""
    return suture_inside(SMALL, tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="session")
def small_run_of_all(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same, every cusp solved; on a machine that cannot draw."""

    def cannot(*_arguments: Any) -> None:
        raise PictureError("valve.png: no [display] here")

    with mock.patch.object(run_module, "draw_results", cannot):
        return suture_inside(SMALL_ALL, tmp_path_factory.mktemp("small_all"))


@pytest.fixture(scope="session")
def small_run_of_ranks(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The same in three processes, one cusp each."""
    return suture(SMALL, tmp_path_factory.mktemp("small_ranks"), "--json", ranks=3)
