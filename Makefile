# Everything happens in .venv; `make run` and `make test` set it up themselves on a machine with Python >= 3.11.
VENV := .venv
BIN := $(VENV)/bin
CANDIDATES := python3 python3.14 python3.13 python3.12 python3.11 python
PYTHON ?= $(shell for p in $(CANDIDATES); do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: run smoke test lint format bench clean help

help:
	@echo "make run    set up, run the HexFlex study, say where the report is"
	@echo "make test   set up, run all tests"
	@echo "make lint   ruff and pyright"
	@echo "make bench  the benchmarks (minutes)"
	@echo "make clean  remove the environment and the caches; runs/ stays"

run: $(VENV)/.ready
	$(BIN)/flexdoce run configs/hexflex.toml

smoke: $(VENV)/.ready
	$(BIN)/flexdoce run configs/smoke.toml

test: $(VENV)/.ready-dev
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist loadfile

lint: $(VENV)/.ready-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

format: $(VENV)/.ready-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(VENV)/.ready-dev
	$(BIN)/python -m benchmarks

$(VENV)/bin/python:
	@test -n "$(PYTHON)" || { echo "flexdoce needs Python 3.11 or newer; none was found. Install one, or: make PYTHON=/path/to/python"; exit 2; }
	@echo "Setting up $(VENV) with $(PYTHON); this takes a minute, once."
	$(PYTHON) -m venv $(VENV)

$(VENV)/.ready: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) --editable .
	@touch $@

$(VENV)/.ready-dev: pyproject.toml constraints.txt | $(VENV)/bin/python
	$(PIP_INSTALL) --editable ".[test,lint]"
	@touch $@ $(VENV)/.ready

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache build dist
