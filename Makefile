PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
WORKERS ?= 2

# a path, not an import hook: else a script beside the clone would take the folder for the package
PLAIN = --config-settings editable_mode=compat

.PHONY: demo test test-slow test-long test-newest fuzz lint types layers bench docs clean

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "stickslip needs Python 3.11 or newer: make PYTHON=python3.12 ..."; exit 1; }
	@echo "installing pinned versions into $(VENV), which takes some minutes the first time"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]' $(PLAIN)
	@touch $(STAMP)

demo: $(STAMP)
	$(BIN)/stickslip diagnose scenarios/hidden-effect/campaign.toml --out out/demo --force

test: lint types layers
	$(BIN)/python -m pytest -n $(WORKERS)

test-slow: $(STAMP)
	$(BIN)/python -m pytest -m "slow and not long" -n $(WORKERS)

test-long: $(STAMP)
	$(BIN)/python -m pytest -m long -n $(WORKERS)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

layers: $(STAMP)
	$(BIN)/lint-imports

bench: $(STAMP)
	$(BIN)/python -m tests.benchmark

test-newest:
	test -x .venv-newest/bin/python || $(PYTHON) -m venv .venv-newest
	.venv-newest/bin/python -m pip install --quiet --disable-pip-version-check --upgrade -e '.[test]' $(PLAIN)
	.venv-newest/bin/python -m pip list --disable-pip-version-check
	.venv-newest/bin/python -m pytest -n $(WORKERS) $(TESTS)

fuzz: $(STAMP)
	$(BIN)/python -m tests.robust.fuzz --number 100000 --commands

docs: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]' $(PLAIN)
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

clean:
	rm -rf $(VENV) .venv-newest out build docs/_build
