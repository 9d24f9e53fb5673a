# `make help` lists the targets. Each target first makes the environment in .venv, if it is missing or
# older than pyproject.toml or constraints.txt. The targets need Python >= 3.11 with pip, and the
# system libraries that README.md names.
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env demo test test-all imitate package check format bench soak study notebooks docs accept clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.stamp
DOCS_STAMP := $(VENV)/.docs
EXTRAS := all,dev,notebooks
ACCEPTANCE ?= ../shared/acceptance
PYTEST_ARGS ?=
SYSTEM ?= windows
BENCH_ARGS ?=
SCALE_ARGS ?=
SIDE_ARGS ?=
SOAK_ARGS ?=
FIELD_ARGS ?=
FAULT_ARGS ?= --page docs/results/faults.md
UNCERTAINTY_ARGS ?= --page docs/results/uncertainty.md
RUNS ?= 10
STUDY_ARGS ?=

help:  ## list the targets
	@grep -E '^[a-z-]+:.*  ## ' $(MAKEFILE_LIST) | awk -F ':.*  ## ' '{printf "%-12s%s\n", $$1, $$2}'

env: $(STAMP)  ## make or renew the environment in .venv

# Some systems ship Python without ensurepip: the system's pip then installs pip into .venv.
$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo "geounfold needs Python 3.11 or later: make PYTHON=python3.12 ..." >&2; exit 2; }
	@[ -x $(BIN)/python ] || $(PYTHON) -m venv $(VENV) >/dev/null 2>&1 || \
	    $(PYTHON) -m venv --clear --without-pip $(VENV)
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || \
	    $(PYTHON) -m pip --python $(BIN)/python install --quiet pip
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable '.[$(EXTRAS)]'
	@touch $@

demo: $(STAMP)  ## simulate a folded body, unfold it, write a report and say where
	@mkdir -p demo
	$(BIN)/geounfold simulate sim_case_1 -o demo/sim_case_1.csv --overwrite
	$(BIN)/geounfold unfold demo/sim_case_1.csv -o demo/unfolded.csv \
	    --summary demo/summary.json --map demo/map.npz --report demo/report.html --overwrite
	@echo "Report: $(CURDIR)/demo/report.html"

# One process a core, one thread each. PYTEST_ARGS="-n 0" runs one process, "--shuffle 1" shuffles.
TESTS = OMP_NUM_THREADS=$${OMP_NUM_THREADS:-1} $(BIN)/python -m pytest -n auto --dist loadfile

test: $(STAMP)  ## run the tests and the docstrings' examples, on all cores
	$(TESTS) -m 'not slow' $(PYTEST_ARGS)

test-all: $(STAMP)  ## run the tests, slow ones included
	$(TESTS) $(PYTEST_ARGS)

imitate: $(STAMP)  ## run the tests with what SYSTEM (windows or macos) lacks taken away
	GEOUNFOLD_IMITATE=$(SYSTEM) PYTHONPATH="$(CURDIR)/tests/imitation$${PYTHONPATH:+:$$PYTHONPATH}" \
	    $(TESTS) -m 'not slow' $(PYTEST_ARGS)

package:  ## build wheel and sdist, check them, try the wheel in an environment of its own
	$(PYTHON) tools/check_package.py

check: $(STAMP)  ## formatting, lint, types, import contract, notebooks equal to their scripts
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@for script in notebooks/*.py; do \
	    $(BIN)/jupytext --quiet --to py:percent --output - "$${script%.py}.ipynb" | \
	    diff --unified "$$script" - || \
	    { echo "$$script and its notebook differ: run make notebooks" >&2; exit 1; }; \
	done

format: $(STAMP)  ## put the code into the standard format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(STAMP)  ## time whole runs, one body of 21,600 to 10 M blocks, and others beside
	$(BIN)/python tests/benchmarks/bench.py $(BENCH_ARGS)
	$(BIN)/python tests/benchmarks/scale.py --page --profile $(SCALE_ARGS)
	$(BIN)/python tests/benchmarks/side_by_side.py --page --keep $(SIDE_ARGS)

soak: $(STAMP)  ## unfold 1,000 random bodies (30 minutes), the field suite (15), faulted ones (15), reliability (15)
	$(BIN)/python tests/soak/soak.py $(SOAK_ARGS)
	$(BIN)/python tests/soak/field.py $(FIELD_ARGS)
	$(BIN)/python tests/soak/faults.py $(FAULT_ARGS)
	$(BIN)/python tests/soak/uncertainty.py $(UNCERTAINTY_ARGS)

study: $(STAMP)  ## krige in folded, unfolded and true space, 15 minutes; continues a stopped run
	$(BIN)/python tests/study/study.py -o data/study.csv $(STUDY_ARGS)
	$(BIN)/python tests/study/tables.py data/study.csv -o docs/study.md \
	    --figures docs/assets --link assets

notebooks: $(STAMP)  ## make the notebooks from their scripts and run them; RUNS: timed runs each
	$(BIN)/jupytext --quiet --update --to ipynb notebooks/*.py
	GEOUNFOLD_RUNS=$(RUNS) $(BIN)/python -m pytest --nbmake -n 2 notebooks/*.ipynb $(PYTEST_ARGS)

$(DOCS_STAMP): $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --constraint constraints.txt --editable '.[$(EXTRAS),docs]'
	@touch $@

docs: $(DOCS_STAMP)  ## run the documentation's examples, then build it into site/
	$(BIN)/python -m pytest -q tests/whole/test_docs.py $(PYTEST_ARGS)
	NO_MKDOCS_2_WARNING=1 COLUMNS=100 $(BIN)/mkdocs build --strict --quiet
	@echo "Documentation: $(CURDIR)/site/index.html"

accept: $(STAMP)  ## score the acceptance bodies, if they are present
	@if [ -f $(ACCEPTANCE)/score.py ]; then $(BIN)/python $(ACCEPTANCE)/score.py; \
	else echo "no acceptance bodies at $(ACCEPTANCE): nothing scored"; fi

clean:  ## remove the environment, caches and outputs
	rm -rf $(VENV) demo site artefacts build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis \
	    .import_linter_cache .benchmarks
	find geounfold tests -name __pycache__ -type d -prune -exec rm -rf {} +
