# Every target sets up .venv by itself; it needs python3.11 or newer with pip, and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TEST_READY := $(VENV)/.ready-test
BENCH_READY := $(VENV)/.ready-bench
DOCS_READY := $(VENV)/.ready-docs
INSTALL := $(PYTHON) -m pip --python $(BIN)/python install --quiet --no-compile
# All cores compile to bytecode what pip would on one, without the packages' own tests, which are half of it.
COMPILE := $(BIN)/python -m compileall -qq -j 0 -x '[/\\]tests[/\\]' $(VENV)/lib src reproduction/src || true

.PHONY: help reproduce test thorough ci release-check lint bench docs dist lock clean

help:
	@echo "make reproduce   compute and draw the paper into results/"
	@echo "make test        lint, type-check and run the tests"
	@echo "make thorough    run the tests that take long: many structures, many random cases, whole figures, most examples of one thing"
	@echo "make ci          all that a user runs, by the clock, in at most 70 minutes: tests, paper, pages, wheel, site, browser, other processors"
	@echo "make release-check   compute the whole paper anew and judge every claim at full size"
	@echo "make bench       measure speed against other integrators, side by side"
	@echo "make docs        build the documentation as a site, docs/_build/html/index.html; needs no network once it is installed"
	@echo "make dist        build the wheel, and try it in empty environments with the newest and the lowest packages"
	@echo "make lint        ruff and mypy only"
	@echo "make lock        renew all locks from pyproject.toml"

reproduce: $(READY)
	$(BIN)/saltus reproduce

# Assertions that explain themselves take twelve seconds of each process to prepare: only what has failed is run again with them,
# in one process, as it ends where a file cannot be read instead of running all others again.
# On a new machine the compiler and the type checker, of one core each, work beside one another.
test: $(TEST_READY)
	@$(BIN)/python tests/compile_first.py & $(MAKE) --no-print-directory lint; passed=$$?; wait; exit $$passed
	$(BIN)/python -m pytest --assert=plain || { $(BIN)/python -m pytest -n 0 --last-failed --last-failed-no-failures none; exit 1; }

# THOROUGH names files: make thorough THOROUGH="tests/web tests/flow/test_roots.py"
thorough: $(TEST_READY)
	$(BIN)/python -m pytest -m thorough $(THOROUGH)

# STEPS passes options on: make ci STEPS="--only docs"
ci:
	$(PYTHON) release/ci.py $(STEPS)

release-check: $(TEST_READY)
	$(BIN)/python -m saltus_paper.release_check
	$(BIN)/python release/publication.py

lint: $(TEST_READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# BENCH passes options on: make bench BENCH="--quick --grid"
bench: $(BENCH_READY)
	$(BIN)/python benchmarks/run.py $(BENCH)

# Warnings are errors. The gallery runs an example again only where it has changed.
docs: $(DOCS_READY)
	$(BIN)/python -m sphinx -b html -W --keep-going docs docs/_build/html

# DIST passes options on: make dist DIST=--tests
dist: $(READY)
	$(INSTALL) uv
	$(BIN)/python release/try_wheel.py $(DIST)

# Debian splits ensurepip off into python3-venv; pip can fill a bare environment from outside.
$(READY): requirements.lock pyproject.toml reproduction/pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "saltus needs Python 3.11 or newer; try: make PYTHON=python3.12 ..." >&2; exit 2; }
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || $(PYTHON) -m venv --clear --without-pip $(VENV)
	$(INSTALL) --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation -e . -e ./reproduction
	@$(COMPILE)
	@touch $@

# What only the tests need.
$(TEST_READY): $(READY) requirements-test.lock
	$(INSTALL) --require-hashes -r requirements-test.lock
	@$(COMPILE)
	@touch $@

# What only the benchmarks need: the peers.
$(BENCH_READY): $(READY) requirements-bench.lock
	$(INSTALL) --require-hashes -r requirements-bench.lock
	@$(COMPILE)
	@{ test "$$(id -u)" = 0 && apt-get install -qq --no-install-recommends python3-siconos gcc >/dev/null; } 2>/dev/null || \
		echo "Siconos is not installed here (as root: apt-get install python3-siconos gcc); without it its comparison is left out"
	@touch $@

$(DOCS_READY): $(READY) requirements-docs.lock
	$(INSTALL) --require-hashes -r requirements-docs.lock
	@$(COMPILE)
	@touch $@

lock:
	$(PYTHON) -m venv $(VENV)/lock && $(VENV)/lock/bin/pip install --quiet uv
	for extra in editable test bench docs; do \
		$(VENV)/lock/bin/uv export --quiet --all-packages --extra $$extra --no-emit-workspace --no-header --format requirements.txt -o requirements-$$extra.lock || exit; \
	done
	mv requirements-editable.lock requirements.lock
	rm -rf $(VENV)/lock uv.lock

clean:
	rm -rf $(VENV) .venv-peers .venv-dist results docs/_build docs/gallery docs/reference/api
