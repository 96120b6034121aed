# Everything runs in an environment of its own: `make demo` and `make test` need python3 with venv, nothing else.
VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
ARGS ?=

.PHONY: demo test test-fast lint bench clean

demo: $(VENV)/.demo
	$(BIN)/chefbot demo $(ARGS)

test: $(VENV)/.dev lint
	$(BIN)/pytest -q -n 2 --dist worksteal $(ARGS)

test-fast: $(VENV)/.dev
	$(BIN)/pytest -q -n 2 --dist worksteal -m "not slow" $(ARGS)

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.dev
	$(BIN)/python bench/run_all.py $(ARGS)

$(VENV)/.demo: pyproject.toml requirements.lock
	@echo "Setting up $(VENV): a minute or two, once."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps -e .
	touch $@

$(VENV)/.dev: $(VENV)/.demo requirements-dev.lock
	$(BIN)/pip install --quiet --disable-pip-version-check -r requirements-dev.lock
	touch $@

clean:
	rm -rf $(VENV) runs build dist .mypy_cache .ruff_cache .pytest_cache
