# The two commands of the README: `make demo` and `make test`. `make help` lists the rest.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: help demo test check env env-dev body web lock
help:
	@grep -hE '^## ' $(MAKEFILE_LIST) | sed 's/## //'
