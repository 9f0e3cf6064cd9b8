# The two commands of the README: `make demo` and `make test`. `make help` lists the rest.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: help demo test check env env-dev body web lock
help:
	@grep -hE '^## ' $(MAKEFILE_LIST) | sed 's/## //'

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# A stamp is newer than its lock file, so an environment is brought up to date exactly when a lock changes.
$(VENV)/.runtime: requirements.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@
$(VENV)/.dev: requirements-dev.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-dev.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@ $(VENV)/.runtime

LOCK := uv pip compile --universal --python-version 3.10 --generate-hashes --no-header --no-emit-index-url --quiet
## make lock     rewrite the lock files from pyproject.toml (needs uv)
lock:
	$(LOCK) --extra dev --extra build pyproject.toml -o requirements-dev.lock
	$(LOCK) --extra build pyproject.toml -c requirements-dev.lock -o requirements.lock
