# Each command sets up what it needs by itself, in .venv; a second call does no set-up again.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
DEV := .venv/.dev
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: demo test test-all lint bench docs setup clean

demo: $(READY)
	@$(BIN)/fieldcal run five_position --virtual="--base-tilt=1,-1" --speed 20

test: $(DEV)
	$(BIN)/python -m pytest -q -n 2

# the whole catalogue and every seed, before a release or where diagnosis was changed
test-all: $(DEV)
	$(BIN)/python -m pytest -q -n 2 --all

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

# what calibrates; modules are compiled when they are first imported, which most never are
$(READY): pyproject.toml constraints.txt Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "fieldcal needs Python 3.11 or newer; $(PYTHON) is older. Name another: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 2; }
	$(PYTHON) -m venv .venv
	$(PIP) --no-compile -e .
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

clean:
	rm -rf docs/made docs/_site .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis build *.egg-info
