# Needs python3.11+, make and a C compiler; everything else goes into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: setup demo demo-stop test lint picture bench study-blind clean

setup: $(VENV)/.stamp

$(VENV)/.stamp: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Slipstick needs Python 3.11 or newer: set PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	@echo "Installing (a few minutes: one package is compiled)"
	$(BIN)/python -m pip install --quiet -e '.[test]'
	touch $@

demo: setup
	$(BIN)/python demo.py start

demo-stop:
	$(PYTHON) demo.py stop

# The picture of the README: needs `make demo` to have calibrated.
picture: setup
	$(BIN)/python docs/picture.py var/calibration.json docs/engagement.svg

# Minutes long, on an idle machine: rewrites the tables in benchmarks/.
bench: setup
	$(BIN)/python -m benchmarks

# About two hours: studies of recordings with hidden effects; killed, the same command goes on where it was.
study-blind: setup
	$(BIN)/python -m benchmarks.study_blind

lint: setup
	$(BIN)/ruff check .
	$(BIN)/mypy

# A process a core, so one thread of linear algebra in each.
test: lint
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist loadfile

clean:
	rm -rf $(VENV) var build .pytest_cache .mypy_cache .ruff_cache
