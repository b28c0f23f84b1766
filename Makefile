# The commands of the study. Everything they need and make stays inside this folder.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory

PYTHON ?=
STUDY ?= reduced
FIRST ?= 48
OPTIONS ?=

VENV := .venv
BIN := $(VENV)/bin
ALL_TESTS = -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder $(TESTS)

# Nothing is read from or written to the home folder: caches of Snakemake, matplotlib and fontconfig lie in the checkout.
export XDG_CACHE_HOME := $(CURDIR)/.snakemake/cache
export MPLCONFIGDIR := $(CURDIR)/.snakemake/cache/matplotlib
export PATH := $(CURDIR)/$(BIN):$(PATH)
export PYTHONNOUSERSITE := 1
# Every job imports the same modules: Python keeps them compiled.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE

.PHONY: help
help:  ## show this list
	@echo "usage: make <target>"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1\t\2/p' $(MAKEFILE_LIST) | expand -t 26

.PHONY: study
study: environment  ## run the reduced study on all cores (STUDY=ci, full or reference for another)
	@$(BIN)/python -m knitstudy study $(STUDY) -- $(OPTIONS)

.PHONY: committed-tables
committed-tables: environment  ## make every out-of-date table in resources again (a night; resumes)
	@$(BIN)/python benchmarks/keep.py all

.PHONY: kept
kept: committed-tables

.PHONY: reference
reference: environment  ## make the values that models are compared with (hours); resources/reference/reference.csv
	@$(BIN)/python -m knitstudy study reference -- $(OPTIONS) results/tables/reference.csv results/tables/reference_convergence.csv
	@$(BIN)/python benchmarks/keep.py reference

.PHONY: verdicts
verdicts: environment  ## run the full study and keep its verdicts (hours); resources/verdicts.csv, docs/reference/results.md
	@$(BIN)/python -m knitstudy study full -- $(OPTIONS)
	@$(BIN)/python benchmarks/keep.py verdicts

.PHONY: trade
trade: environment  ## measure what accuracy costs on the FIRST=48 knits of a sample (hours); resources/trade.csv
	@OMP_NUM_THREADS=1 $(BIN)/python benchmarks/trade.py --first $(FIRST)

.PHONY: loops
loops: environment  ## draw loops of 210 course and wale spacings; resources/loops.csv, docs/notes/loops.webp
	@$(BIN)/python benchmarks/loops.py

.PHONY: mechanisms
mechanisms: environment  ## change one thing at a time in networks, for Fig. 11; resources/reference/mechanisms.csv
	@OMP_NUM_THREADS=1 $(BIN)/python benchmarks/mechanisms.py

.PHONY: predictions
predictions: environment  ## run the study of measured fabrics and keep its predictions; resources/predictions.csv
	@$(BIN)/python -m knitstudy study fabrics -- $(OPTIONS)
	@$(BIN)/python benchmarks/keep.py predictions

.PHONY: swatches
swatches: environment  ## predict the sizes of 28 swatches from one yarn; resources/swatches.csv
	@OMP_NUM_THREADS=1 $(BIN)/python benchmarks/swatches.py

.PHONY: test
test: environment  ## run the tests that show that an installation works, in two processes (some five minutes)
	@OMP_NUM_THREADS=1 $(BIN)/python $(ALL_TESTS) --quick

.PHONY: test-all
test-all: environment  ## run all tests, in two processes
	@OMP_NUM_THREADS=1 $(BIN)/python $(ALL_TESTS)

.PHONY: seconds
seconds: environment  ## run all tests, and list those that take long; tests/seconds.csv
	@OMP_NUM_THREADS=1 $(BIN)/python $(ALL_TESTS) --seconds

.PHONY: test-without-optional
test-without-optional: environment  ## run the unit tests without the packages `use` and `paper`, in run/bare
	@rm -rf run/bare && mkdir -p run/bare
	@git ls-files -z | tar --create --null --files-from - | tar --extract --directory run/bare
	@rm -r run/bare/src/knitstudy/use run/bare/src/knitstudy/paper
	@cd run/bare && PYTHONPATH=src OMP_NUM_THREADS=1 ../../$(BIN)/python -m pytest --quiet tests/unit

.PHONY: knots
knots: environment  ## solve the rod benchmarks, rods in contact with known answers; resources/benchmarks.csv
	@$(BIN)/python examples/knots

.PHONY: verify
verify: environment  ## verify at full resolution, and start every scene; resources/verification.csv
	@$(BIN)/python -m pytest tests/verification --full --cases --table resources/verification.csv
	@$(BIN)/python -m pytest tests/unit tests/workflow -m full --full
	@OMP_NUM_THREADS=1 $(BIN)/python -m pytest tests/verification/test_first_increments.py --full --numprocesses 2

.PHONY: bench
bench: environment  ## measure time and memory of scenes and solvers; results/tables/bench.csv
	@$(BIN)/python benchmarks/run.py

.PHONY: extremes
extremes: environment  ## run scenes at the bounds of all keys; resources/extremes.csv, docs/notes/extremes.webp
	@OMP_NUM_THREADS=1 $(BIN)/python benchmarks/extremes.py

.PHONY: interruptions
interruptions: environment  ## end runs at random moments; results/tables/interruptions.csv
	@$(BIN)/python benchmarks/interruptions.py

.PHONY: docs
docs: environment  ## build the pages as a site; site/index.html
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

.PHONY: lint
lint: environment  ## check code, rules and formatting
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/snakefmt --check Snakefile workflow/Snakefile workflow/rules
	@$(BIN)/lint-imports --no-logo
	@$(BIN)/mypy
	@$(BIN)/snakemake --lint

.PHONY: clean
clean:  ## delete results, logs and restart files; keep the environment
	@git clean -fdXq -- results logs run

.PHONY: lock
lock: uv  ## pin newest versions of all packages in requirements.lock (needs the package registry)
	@$(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --extra dev --extra docs \
	    --no-emit-index-url --custom-compile-command "make lock" --output-file requirements.lock pyproject.toml

.PHONY: lowest
lowest: uv  ## run all tests with the lowest versions that pyproject.toml allows, in .venv-lowest (needs the package registry)
	@$(BIN)/uv venv --quiet --seed --allow-existing --python $(BIN)/python .venv-lowest
	@$(BIN)/uv pip install --quiet --python .venv-lowest --resolution lowest-direct --editable ".[dev,docs]"
	@OMP_NUM_THREADS=1 .venv-lowest/bin/python $(ALL_TESTS)

# ---- environment --------------------------------------------------------------------------------------------------
# See workflow/environment.sh: installs only when the lock has changed, and goes on after an interruption.

.PHONY: uv
uv: environment
	@$(BIN)/python -m pip install --quiet uv

.PHONY: environment
environment:
	@PYTHON="$(PYTHON)" bash workflow/environment.sh "$(VENV)"
