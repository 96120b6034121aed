# Everything runs in an environment of its own: `make demo` and `make test` need python3 with venv, nothing else.
VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
TOOLS := $(VENV)/tools
ARGS ?=
# Processes that test at once: about half of a test's time is waiting, so that four keep two cores busy.
TESTERS ?= 4

SMALL_SET := localize_home localize_hotel go_narrow go_hall drive_workshop deliver_hotel explore_home

COMPILE_KERNELS := from rich.console import Console; from chefbot.kernels.precompile import compile_kernels; \
    compile_kernels(Console())

.PHONY: demo test test-fast test-long test-modules lint kernels docs prove scoreboard chaos safety-gate safety-mutants bench bench-slam fuzz fuzz-firmware fuzz-host lock check-lock audit sbom axe clean

demo: $(VENV)/.demo
	$(BIN)/chefbot demo $(ARGS)

# The testers keep all cores busy: threads of BLAS would only wait for each other.
test test-fast test-long: export OPENBLAS_NUM_THREADS = 1

# Of tests marked `rotated` it runs one case each, with another commit another one. Kernels are compiled once, before
# several processes of the tests need them at the same time.
test: $(VENV)/.dev
	@$(MAKE) --no-print-directory -j2 lint kernels test-modules
	CHEFBOT_ROTATE=1 $(BIN)/pytest -q -n $(TESTERS) --dist worksteal $(ARGS)

test-fast: $(VENV)/.dev kernels test-modules
	$(BIN)/pytest -q -n $(TESTERS) --dist worksteal -m "not slow and not long" $(ARGS)

# On a machine without other work: what needs minutes each, limits in seconds, and new examples for every property.
# An example that it finds is kept in its test as `@example`.
ROUNDS ?= 5
test-long: $(VENV)/.dev kernels test-modules
	$(BIN)/pytest -q -n $(TESTERS) --dist worksteal -m rotated $(ARGS)
	CHEFBOT_QUIET_MACHINE=1 $(BIN)/pytest -q -s -m "long or timed" $(ARGS)
	for round in $$(seq $(ROUNDS)); do HYPOTHESIS_PROFILE=search \
	    $(BIN)/pytest -q -n $(TESTERS) --dist worksteal -m "hypothesis and not long" $(ARGS) || exit 1; done

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# All testers would compile the modules of the tests at once.
test-modules: $(VENV)/.dev
	@$(BIN)/pytest -q --collect-only -p no:xdist > /dev/null || true  # errors are reported by the run itself

kernels: $(VENV)/.demo
	@$(BIN)/python -c '$(COMPILE_KERNELS)'

# The site in docs/_build; its reference is generated from the code. Warnings and broken links are errors.
docs: $(VENV)/.dev
	PYTHONPATH=src $(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build
	$(BIN)/python -m tests.support.links docs/_build

# The small set of scenarios; `make scoreboard ARGS="--minutes 60"` makes the runs that are not done yet.
prove: $(VENV)/.dev
	$(BIN)/chefbot prove $(SMALL_SET) --seeds 1..3 --out runs/prove $(ARGS)

scoreboard: $(VENV)/.dev
	$(BIN)/chefbot prove --scoreboard docs/scoreboard.md --out runs/scoreboard $(ARGS)

# The reliability matrix R1 to R38; writes docs/reliability.md. `make chaos ARGS="--minutes 20 --rows R10 R21"`
chaos: $(VENV)/.dev
	$(BIN)/python -m tests.chaos.matrix $(ARGS)

# The tests of all that stands between a twist and the wheels: 100 % of lines and branches, and 95 % of the mutants;
# the mutants of all modules write docs/safety_gate.md. `make safety-mutants ARGS="chefbot.safety.monitor_polygons --jobs 4"`
safety-gate: $(VENV)/.dev
	$(BIN)/python -m tests.support.safety_gate coverage $(ARGS)

safety-mutants: $(VENV)/.dev
	$(BIN)/python -m tests.support.safety_gate mutants $(ARGS)

bench: $(VENV)/.dev
	$(BIN)/python bench/run_all.py $(ARGS)

# Both mapping algorithms on the recordings in $CHEFBOT_SHARED; writes bench/results/slam.md. `ARGS="--seeds 5"`
bench-slam: $(VENV)/.dev
	PYTHONPATH=src $(BIN)/python bench/bench_slam.py
	PYTHONPATH=src $(BIN)/python bench/slam_logs.py $(ARGS)

# Both ends of the board's line at once: the firmware under sanitizers, and the driver. `make fuzz SECONDS=3600`
SECONDS ?= 60
SEED ?= $(shell date +%s)
fuzz: $(VENV)/.dev
	@$(MAKE) --no-print-directory -j2 fuzz-firmware fuzz-host SECONDS=$(SECONDS) SEED=$(SEED)

fuzz-firmware:
	@$(MAKE) --no-print-directory -s -C firmware fuzz SECONDS=$(SECONDS) SEED=$(SEED)

fuzz-host:
	@$(BIN)/python -m tests.devices.host_fuzz $(SECONDS) $(SEED)

# The locks pin versions and the hashes of all files of the index: a file that was exchanged there is refused. Python
# compiles a module at its first import; most are never imported, and to compile all takes as long as to install them.
INSTALL := pip install --quiet --disable-pip-version-check --no-compile --require-hashes
HAS_COMPILER := import runpy, sys; sys.exit(runpy.run_path("firmware/ports/host/build.py")["compiler"]() is None)

$(VENV)/.demo: pyproject.toml requirements.lock requirements-build.lock requirements-compiler.lock
	@echo "Setting up $(VENV): a minute or two, once."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/$(INSTALL) -r requirements.lock
	$(BIN)/$(INSTALL) -r requirements-build.lock
	$(BIN)/python -c '$(HAS_COMPILER)' || $(BIN)/$(INSTALL) -r requirements-compiler.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

$(VENV)/.dev: $(VENV)/.demo requirements-dev.lock
	$(BIN)/$(INSTALL) -r requirements-dev.lock
	touch $@

$(VENV)/.tools: requirements-tools.lock
	$(PYTHON) -m venv $(TOOLS)
	$(TOOLS)/bin/$(INSTALL) -r requirements-tools.lock
	touch $@

# Writes the locks from pyproject.toml, for Python 3.11 and newer on all platforms. Pins stay as they are, as far as
# pyproject.toml permits; `make lock ARGS="--upgrade"`, or ARGS="--upgrade-package numpy", takes newer versions.
COMPILE = $(TOOLS)/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header \
    --no-annotate --no-sources $(ARGS)
lock: $(VENV)/.tools
	$(COMPILE) pyproject.toml -o requirements.lock
	$(COMPILE) pyproject.toml --constraints requirements.lock --extra docs --group dev -o requirements-dev.lock
	$(COMPILE) --constraints requirements-dev.lock --group build -o requirements-build.lock
	$(COMPILE) --group compiler -o requirements-compiler.lock
	$(COMPILE) --group tools -o requirements-tools.lock

# Whether each platform has a wheel of every package whose hash is pinned; resolves, but downloads nothing.
PLATFORMS := x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu aarch64-apple-darwin x86_64-pc-windows-msvc
check-lock: $(VENV)/.tools
	for lock in requirements.lock requirements-build.lock; do for platform in $(PLATFORMS); do \
	    $(TOOLS)/bin/uv pip install --quiet --dry-run --target $(VENV)/none --require-hashes --only-binary :all: \
	    --python $(TOOLS)/bin/python --python-platform $$platform -r $$lock || exit 1; done; done

# Known vulnerabilities of what is installed; needs the network.
audit: $(VENV)/.tools
	for lock in requirements.lock requirements-build.lock requirements-dev.lock requirements-tools.lock; do \
	    $(TOOLS)/bin/pip-audit --disable-pip --strict --require-hashes --progress-spinner off -r $$lock $(ARGS) || exit 1; done

# The software bill of materials of an installation, CycloneDX: every package of requirements.lock with its hashes.
sbom: $(VENV)/.tools
	mkdir -p dist
	$(TOOLS)/bin/cyclonedx-py requirements --pyproject pyproject.toml --mc-type application --output-reproducible \
	    --spec-version 1.6 -o dist/sbom.cdx.json requirements.lock

# The accessibility checker that tests/ui uses if it is there; needs npm.
axe:
	npm install --silent --no-audit --no-fund --prefix build axe-core@4.14.1

clean:
	rm -rf $(VENV) runs build dist docs/_build docs/reference/generated .mypy_cache .ruff_cache .pytest_cache
