# avneo_fem: each target does the set-up it needs first, and nothing twice.
# On a fresh Debian 12 machine (root or sudo): `make demo`, `make test`.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help

PYTHON := .venv/bin/python
PYTEST_ARGS ?=

# Other projects' modules and the user's own site-packages must not leak into ours.
unexport PYTHONPATH PYTHONHOME
export PYTHONNOUSERSITE := 1

.PHONY: help setup demo test test-slow verification lint clean distclean

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-13s %s\n", $$1, $$2 }' Makefile

setup: ## Debian packages and .venv, only what is missing
	@bash .ci/setup.sh

demo: setup ## Experiment 1 end to end, results in out/experiment-1/
	.venv/bin/avneo suture demos/experiment_1.toml -o out/experiment-1

test: setup ## the test suite on two cores (PYTEST_ARGS="-k scene" selects)
	$(PYTHON) -m pytest -n 2 --dist loadfile $(PYTEST_ARGS)

test-slow: setup ## the tests that take longer than a few seconds each
	$(PYTHON) -m pytest -m slow $(PYTEST_ARGS)

verification: setup ## textbook benchmarks of the shells, table and plots in out/verification/
	$(PYTHON) demos/verification

lint: setup ## ruff check, ruff format --check, mypy
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	$(PYTHON) -m mypy

clean: ## remove results, logs and caches (keeps .venv)
	rm -rf out build jit_cache .pytest_cache .mypy_cache .ruff_cache .hypothesis *.egg-info
	find . -path ./.venv -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## remove .venv too
	rm -rf .venv
