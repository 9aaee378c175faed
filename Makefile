# Every target sets up .venv by itself; it needs python3.11 or newer with pip, and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: help reproduce test lint bench lock clean

help:
	@echo "make reproduce   compute and draw the paper into results/"
	@echo "make test        lint, type-check and run every test"
	@echo "make bench       measure speed against other integrators, side by side"
	@echo "make lint        ruff and mypy only"
	@echo "make lock        renew requirements.lock from pyproject.toml"

reproduce: $(READY)
	$(BIN)/saltus reproduce

test: lint
	$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(READY)
	$(BIN)/python benchmarks/run.py

# Debian splits ensurepip off into python3-venv; pip can fill a bare environment from outside.
$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "saltus needs Python 3.11 or newer; try: make PYTHON=python3.12 ..." >&2; exit 2; }
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || $(PYTHON) -m venv --clear --without-pip $(VENV)
	$(PYTHON) -m pip --python $(BIN)/python install --quiet --require-hashes -r requirements.lock
	$(PYTHON) -m pip --python $(BIN)/python install --quiet --no-deps --no-build-isolation -e .
	@touch $@

lock:
	$(PYTHON) -m venv $(VENV)/lock && $(VENV)/lock/bin/pip install --quiet uv
	$(VENV)/lock/bin/uv export --quiet --all-extras --no-emit-project --no-header --format requirements.txt -o requirements.lock
	rm -rf $(VENV)/lock uv.lock

clean:
	rm -rf $(VENV) results
