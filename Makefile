# `make demo` and `make test` set everything up by themselves, in .venv; a second call does no set-up again.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

.PHONY: demo test lint bench docs setup clean

demo: $(READY)
	@$(BIN)/fieldcal run five_position --virtual="--base-tilt=1,-1" --speed 20

test: $(READY)
	$(BIN)/python -m pytest -q

lint: $(READY)
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

$(READY): pyproject.toml constraints.txt Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "fieldcal needs Python 3.11 or newer; $(PYTHON) is older. Name another: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

# what users would pick instead, to be measured beside
.venv/.peers: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	@touch $@

.venv/.docs: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	@touch $@

clean:
	rm -rf docs/made docs/_site .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis build *.egg-info
