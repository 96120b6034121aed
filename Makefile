# Everything runs in an environment of its own: `make demo` and `make test` need python3 with venv, nothing else.
VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
ARGS ?=
# Processes that test at once. With three on two cores, robots that must keep pace with the clock fall behind.
TESTERS ?= 2

SMALL_SET := localize_home localize_hotel go_narrow go_hall drive_workshop deliver_hotel explore_home

.PHONY: demo test test-fast test-long lint docs prove scoreboard chaos bench fuzz fuzz-firmware fuzz-host clean

demo: $(VENV)/.demo
	$(BIN)/chefbot demo $(ARGS)

test: $(VENV)/.dev lint
	$(BIN)/pytest -q -n $(TESTERS) --dist worksteal $(ARGS)

test-fast: $(VENV)/.dev
	$(BIN)/pytest -q -n $(TESTERS) --dist worksteal -m "not slow and not long" $(ARGS)

# On a machine without other work: what needs minutes each, limits in seconds, and new examples for every property.
# An example that it finds is kept in its test as `@example`.
ROUNDS ?= 5
test-long: $(VENV)/.dev
	CHEFBOT_QUIET_MACHINE=1 $(BIN)/pytest -q -s -m "long or timed" $(ARGS)
	for round in $$(seq $(ROUNDS)); do HYPOTHESIS_PROFILE=search \
	    $(BIN)/pytest -q -n $(TESTERS) --dist worksteal -m "hypothesis and not long" $(ARGS) || exit 1; done

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The site in docs/_build; its reference is generated from the code. Warnings and broken links are errors.
docs: $(VENV)/.dev
	PYTHONPATH=src $(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build
	$(BIN)/python -m tests.support.links docs/_build

# The small set of scenarios; `make scoreboard ARGS="--minutes 60"` goes on with the runs that are not done yet.
prove: $(VENV)/.dev
	$(BIN)/chefbot prove $(SMALL_SET) --seeds 1..3 --out runs/prove $(ARGS)

scoreboard: $(VENV)/.dev
	$(BIN)/chefbot prove --scoreboard docs/scoreboard.md --out runs/scoreboard $(ARGS)

# The reliability matrix R1 to R38; writes docs/reliability.md. `make chaos ARGS="--minutes 20 --rows R10 R21"`
chaos: $(VENV)/.dev
	$(BIN)/python -m tests.chaos.matrix $(ARGS)

bench: $(VENV)/.dev
	$(BIN)/python bench/run_all.py $(ARGS)

# Both ends of the board's line at once: the firmware under sanitizers, and the driver. `make fuzz SECONDS=3600`
SECONDS ?= 60
SEED ?= $(shell date +%s)
fuzz: $(VENV)/.dev
	@$(MAKE) --no-print-directory -j2 fuzz-firmware fuzz-host SECONDS=$(SECONDS) SEED=$(SEED)

fuzz-firmware:
	@$(MAKE) --no-print-directory -s -C firmware fuzz SECONDS=$(SECONDS) SEED=$(SEED)

fuzz-host:
	@$(BIN)/python -m tests.devices.host_fuzz $(SECONDS) $(SEED)

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
	rm -rf $(VENV) runs build dist docs/_build docs/reference/generated .mypy_cache .ruff_cache .pytest_cache
