# Each command sets up what it needs by itself, in .venv; a second call does no set-up again.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
DEV := .venv/.dev
JOBS ?= 2
SEED ?= 1
# names of DRAW mutants; the first run, which finds none of that name, has made them all
DRAWN = $(CURDIR)/$(BIN)/mutmut results --all true | cut -d: -f1 | awk 'BEGIN {srand($(SEED))} {print rand(), $$1}' | sort | head -n $(DRAW) | cut -d' ' -f2
# a process that may not keep what it compiled compiles numpy anew each time: half a second
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: demo test test-all mutants lint bench docs setup clean

demo: $(READY)
	@$(BIN)/fieldcal run five_position --virtual="--base-tilt=1,-1" --speed 20

# a process that waits for devices, and two that calculate meanwhile
test: $(DEV)
	$(BIN)/python -m pytest -q -n 3

# the whole catalogue and every seed, before a release or where diagnosis was changed
test-all: $(DEV)
	$(BIN)/python -m pytest -q -n 3 --all

# faults put into the formulas one by one, and whether the tests of the same package notice;
# `make mutants-core` does one package; hours for all, so not in CI. DRAW=150 draws so many of
# a package at random instead of all, SEED=2 others
mutants: mutants-core mutants-windows mutants-model mutants-solve

mutants-%: .venv/.mutants
	@rm -rf mutants/$* && mkdir -p mutants/$*
	@ln -sfn $(foreach f,fieldcal benchmarks drivers procedures sim_device tests pyproject.toml,$(CURDIR)/$f) mutants/$*
	@sed 's/ROOM/$*/' tests/mutmut.cfg > mutants/$*/setup.cfg
	@cd mutants/$* && { test -z '$(DRAW)' || $(CURDIR)/$(BIN)/mutmut run none >/dev/null 2>&1 || true; }
	cd mutants/$* && OMP_NUM_THREADS=1 $(CURDIR)/$(BIN)/mutmut run --max-children $(JOBS) $(if $(DRAW),$$($(DRAWN)))
	@cd mutants/$* && $(CURDIR)/$(BIN)/mutmut results | grep -v 'not checked' || true
	@cd mutants/$* && $(CURDIR)/$(BIN)/mutmut results --all true | grep -v 'not checked' | awk -F '[.:]' \
	  'NF > 4 {n[$$3]++; killed[$$3] += /: (killed|timeout|segfault)/} \
	  END {for (m in n) print m, killed[m] "/" n[m] " killed"}' | sort

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/.peers
	$(BIN)/python -m benchmarks

docs: .venv/.docs
	$(BIN)/sphinx-build -q -E -W --keep-going -b html docs docs/_site
	@echo "docs/_site/index.html"

setup: $(READY)

# what calibrates; of the libraries only what `solve` and `diagnose` import is compiled
$(READY): pyproject.toml constraints.txt Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "fieldcal needs Python 3.11 or newer; $(PYTHON) is older. Name another: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 2; }
	$(PYTHON) -m venv .venv
	$(PIP) --no-compile -e .
	@$(BIN)/python -m compileall -q fieldcal drivers procedures sim_device
	@$(BIN)/python -c 'import fieldcal.diagnosis, fieldcal.solve, jsonschema, numpy.ma, pyarrow.parquet, rich.live, rich.table, serial'
	@touch $@

# what tests and linters need beside, and every format
$(DEV): $(READY)
	$(PIP) -e '.[dev]'
	@touch $@

# what users would pick instead, to be measured beside
.venv/.peers: $(DEV)
	$(PIP) -e '.[bench]'
	@touch $@

.venv/.docs: $(READY)
	$(PIP) -e '.[docs]'
	@touch $@

# what puts faults into formulas
.venv/.mutants: $(DEV)
	$(PIP) -e '.[mutants]'
	@touch $@

clean:
	rm -rf mutants docs/made docs/_site .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis build *.egg-info
