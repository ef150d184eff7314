# make run     set up, then run the closed loop once (ARGS="--law coupled-pd --motion 2" for another)
# make test    set up, then run the tests
# make lint    set up, then ruff, mypy and the layers
# PYTHON=python3.12 chooses the interpreter, VENV=elsewhere the place of the virtual environment.

PYTHON ?= python3
VENV ?= .venv
ARGS ?=
PIP = $(VENV)/bin/python -m pip --disable-pip-version-check --quiet

.PHONY: run test lint clean help

run: $(VENV)/ready-to-run
	@$(VENV)/bin/torquerig run $(ARGS)

test: $(VENV)/ready-to-develop
	@$(VENV)/bin/python -m pytest $(ARGS)

lint: $(VENV)/ready-to-develop
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports

help:
	@sed -n '1,4s/^# //p' Makefile

clean:
	rm -rf $(VENV) build *.egg-info .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis

# A stamp older than pyproject.toml is made anew; the environment itself only when it is missing.
$(VENV)/ready-to-run: pyproject.toml | $(VENV)/bin/pip
	@echo "Installing torquerig and what it needs into $(VENV) ..."
	@$(PIP) install --editable .
	@touch $@

$(VENV)/ready-to-develop: pyproject.toml | $(VENV)/bin/pip
	@echo "Installing torquerig and its development tools into $(VENV) ..."
	@$(PIP) install --editable '.[dev]'
	@touch $@ $(VENV)/ready-to-run

# Debian's python3 comes without ensurepip: then an outer pip (22.3 or later) fills the environment.
$(VENV)/bin/pip:
	@command -v $(PYTHON) >/dev/null || { echo "torquerig needs Python 3.11 or later, and $(PYTHON) was not found: install python3, or give make PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "torquerig needs Python 3.11 or later, but $(PYTHON) is $$($(PYTHON) -c 'import platform; print(platform.python_version())'): give make PYTHON=python3.11 or a later one." >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) >/dev/null 2>&1 \
	  || { $(PYTHON) -m venv --clear --without-pip $(VENV) && $(PYTHON) -m pip --python $(VENV)/bin/python --quiet install pip; } \
	  || { rm -rf $(VENV); echo "$(PYTHON) can make no virtual environment with pip: install python3-venv, or python3-pip 22.3 or later (on Debian: apt install python3-venv)." >&2; exit 1; }
