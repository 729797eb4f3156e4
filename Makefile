.DEFAULT_GOAL := help
.PHONY: help setup jump docs dist test test-long test-engine test-readers test-socketcan check bench mutants models clean

# The first of these that is new enough; another one by make PYTHON=...
PYTHON ?= $(shell for name in python3 python3.14 python3.13 python3.12 python3.11; do \
  $$name -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$name && break; done)
BIN := .venv/bin
STAMP := .venv/.installed

help: ## show this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

$(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "needs Python 3.11 or later; or say make PYTHON=/path/to/it" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[viz,render,modes,dev]'
	@touch $@

setup: $(STAMP) ## make .venv with everything, pinned

jump: $(STAMP) ## the prototype jumps: table, recording, .rrd and phase plots in runs/
	@$(BIN)/python scripts/jump.py

typings/mujoco/__init__.pyi: $(STAMP)
	@$(BIN)/python scripts/stubs.py typings

docs: $(STAMP) ## the documentation's site in docs/_build/html, without a warning, every link in it checked
	@$(BIN)/python -c 'import furo, myst_parser, sphinx' 2>/dev/null || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[docs]'
	$(BIN)/python -m sphinx --quiet --nitpicky --fail-on-warning --keep-going -c docs . docs/_build/html
	$(BIN)/python scripts/docs_links.py docs/_build/html

dist: $(STAMP) ## wheel and sdist in dist/, installed and used in an empty folder
	$(BIN)/python scripts/dist.py

check: $(STAMP) typings/mujoco/__init__.pyi dist ## lint, format, types, layers, wheel
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyrefly check --threads 1
	$(BIN)/lint-imports

test: check ## check, then the tests, a folder a processor at a time
	$(BIN)/pytest -m 'not long' --numprocesses auto --dist loadfile

test-long: $(STAMP) ## the tests that `make test` leaves out, a notebook's kernel installed for them
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[notebook]'
	$(BIN)/python scripts/dist.py --fresh
	$(BIN)/pytest -m long --numprocesses auto --dist loadfile

test-engine: $(STAMP) ## the tests against Pinocchio, which is installed for them
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[pinocchio]'
	$(BIN)/pytest tests/analytic/test_against_pinocchio.py

.venv-readers/.installed:
	$(PYTHON) -m venv .venv-readers
	.venv-readers/bin/python -m pip install --quiet --disable-pip-version-check pandas pyarrow polars duckdb fastparquet
	@touch $@

test-readers: $(STAMP) .venv-readers/.installed ## pandas, polars, DuckDB and fastparquet read what is exported
	$(BIN)/python scripts/check_readers.py .venv-readers/bin/python

test-socketcan: $(STAMP) ## a run over vcan in a QEMU guest at 1 kHz, in virtual time; about 20 minutes
	$(BIN)/python scripts/socketcan/guest.py 'sh $(CURDIR)/scripts/socketcan/all.sh'

bench: $(STAMP) ## performance targets as ratios against a baseline in the same run
	$(BIN)/python scripts/bench.py
	$(BIN)/python scripts/bench_design.py
	$(BIN)/python scripts/bench_modes.py
	$(BIN)/python scripts/bench_explain.py
	$(BIN)/python scripts/bench_drives.py
	$(BIN)/python scripts/bench_campaign.py

mutants: $(STAMP) ## which of 40 small faults a file the tests notice; hours, or FILES='src/...'
	$(BIN)/python scripts/mutants/main.py $(FILES)

models: $(STAMP) ## rewrite the golden MJCF files of models/
	@set -e; for design in models/*.toml; do \
	  $(BIN)/legbench model --design "$$design" --out "$${design%.toml}.xml"; done

clean: ## remove .venv and generated stubs, keep runs/
	rm -rf .venv .venv-readers typings
