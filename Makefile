# Needs Python 3.11 or newer and make; everything else goes into .venv. `make` alone lists the targets.
PYTHON ?= python3
BENCH ?= heavy
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
# Tests run in parallel themselves: threads that wait for each other would only slow them down.
ONE_THREAD := OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1
# Where it is set, every process of the tests compiles the modules again, which takes a tenth of the whole time.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup demo demo-stop test test-slow fuzz lint audit picture bench evidence clean
.DEFAULT_GOAL := help

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "make %-12s %s\n", $$1, $$2 }'

setup: $(VENV)/.stamp ## make the environment in .venv and install everything into it

$(VENV)/.stamp: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Slipstick needs Python 3.11 or newer: set PYTHON=/path/to/python3.11"; exit 1; }
	@echo "Creating the environment in $(VENV)"
	@$(PYTHON) -m venv $(VENV)
	@echo "Installing Slipstick and its dependencies (a few minutes)"
	@$(PIP) install --upgrade pip 2>&1 | sed '/^WARNING/d'
	@$(PIP) install -e '.[test]' > $(VENV)/install.log 2>&1 || { cat $(VENV)/install.log; exit 1; }
	@touch $@
	@echo "Installed; activate the environment with: . $(BIN)/activate"

demo: setup ## build tables, calibrate, fit, and study the shipped recordings; leaves service and worker running
	@$(BIN)/python -m worker demo --bench $(notdir $(basename $(BENCH)))

demo-stop: setup ## stop the service and the worker of the demo
	@$(BIN)/python -m worker demo --stop

# What tests share is compiled before, so that they do not compile it at the same time: kernels and modules.
$(VENV)/.compiled: $(VENV)/.stamp $(shell find slipstick worker -name '*.py')
	@$(BIN)/python -m worker.rehearsal clutch & $(BIN)/python -m worker.rehearsal machines & \
	  { $(BIN)/python -m pytest --collect-only --quiet > $(VENV)/collected.log || { tail -n 20 $(VENV)/collected.log; exit 1; }; } \
	  && wait
	@touch $@

test: setup ## ruff, mypy and the tests (five and a half minutes on two cores)
	@$(MAKE) --no-print-directory --jobs 2 lint $(VENV)/.compiled
	@$(ONE_THREAD) $(BIN)/python -m pytest --numprocesses auto --dist loadfile --durations=10

test-slow: setup ## the tests that `make test` leaves out (minutes)
	@$(ONE_THREAD) $(BIN)/python -m pytest -m slow --numprocesses auto --durations=10

fuzz: setup ## many generated requests to every operation of the service, alone and in sequences (minutes)
	@$(ONE_THREAD) $(BIN)/python -m pytest -m slow tests/service/test_schema.py

lint: setup ## ruff and mypy only
	@$(BIN)/ruff check .
	@$(BIN)/mypy

audit: setup ## known vulnerabilities of the dependencies (needs the network)
	@$(BIN)/python .ci/audit.py

picture: setup ## redraw the picture of the README, and execute the notebook of docs again
	@$(BIN)/python docs/picture.py
	@$(BIN)/jupyter-execute --inplace docs/quickstart.ipynb
	@cd docs && ../$(BIN)/jupyter-execute --inplace your_machine.ipynb && rm -f bench.py extended.py

bench: setup ## compare with other codes in one run: benchmarks/peers.csv (five minutes, on an idle machine)
	@$(PIP) install -e '.[bench]'
	@$(BIN)/python -m benchmarks

evidence: setup ## fixed cases of the study beside what is expected of them (a few minutes; evidence/README.md has more)
	@$(ONE_THREAD) $(BIN)/python -m evidence regression $(if $(DASK),--dask $(DASK))

clean: ## remove the environment, the results of the demo, and caches
	rm -rf $(VENV) var build .pytest_cache .mypy_cache .ruff_cache
