# What a person types. Needs GNU make and Python >= 3.11; everything else goes into .venv, inside this folder.
#
#   make PYTHON=/path/to/python3.12 test     choose the Python that .venv is made with
#   make WORKERS=8 test                      run tests in more processes (default: 2)

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?=
WORKERS ?= 2

# All dependencies have wheels for 3.11 to 3.13, so those are looked for first; then anything newer is tried.
CANDIDATES := $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python3.14 python)
PIP_INSTALL := $(BIN)/python -m pip install -qq --disable-pip-version-check --no-input \
	--progress-bar off --constraint constraints.txt
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist worksteal

.DEFAULT_GOAL := help
.PHONY: help demo table test check coverage bench mutants fuzz stress clean

help: ## List these targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/demo-installed ## Robots cross an intersection, filter off and on: a table, and pictures in out/demo/
	$(BIN)/python -m policies.demo

table: $(VENV)/demo-installed ## Table I with the weights that there are, into out/table/; goes on where it was stopped
	$(BIN)/python -m policies.evaluate --all

test: check ## Everything that must pass: check, proofs, all tests
	$(BIN)/python -m proofs
	$(PYTEST)

check: $(VENV)/dev-installed ## Style, formatting, types, and who may import whom
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy
	$(BIN)/lint-imports

# numba hides compiled lines from coverage, so they are interpreted here: heavy tests stay out, and the others draw
# fewer examples.
coverage: $(VENV)/dev-installed ## Branch coverage of safefilter, at least 95 %
	NUMBA_DISABLE_JIT=1 HYPOTHESIS_PROFILE=coverage $(PYTEST) -m 'not stress' --cov --cov-report=term \
		tests/safefilter tests/integration

bench: $(VENV)/bench-installed ## Time the filter against RVO2 and against other solvers
	$(BIN)/python -m benchmarks

# Hours; it goes on where it was stopped.
mutants: $(VENV)/dev-installed ## Make every small mistake in geometry, programs and cap, and see whether a test fails
	$(BIN)/python -m assurance.mutation

# atheris leads the search where it is installed; Hypothesis alone draws as many examples everywhere.
SECONDS ?= 600
fuzz: $(VENV)/fuzz-installed ## Damaged files and malformed arguments, for SECONDS (default: 600) and as many again
	$(BIN)/python -m assurance.fuzz --seconds $(SECONDS)
	HYPOTHESIS_PROFILE=fuzz $(PYTEST) tests/integration/test_damaged_files.py tests/integration/test_malformed_input.py

# A quarter of an hour of one idle core; killed at any moment, it goes on where it was.
stress: $(VENV)/dev-installed ## 10^8 robot-steps of every kind without a collision, into out/stress/
	$(BIN)/python -m assurance.stress

clean: ## Remove everything that these targets made, .venv too
	rm -rf $(VENV) out build dist .coverage .coverage.* .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Installing happens once, and again when pyproject.toml or constraints.txt change.
$(VENV)/demo-installed: pyproject.toml constraints.txt | $(VENV)/created
	@echo "safefilter: installing the filter, its solvers and what the demo draws with (a minute or two) ..."
	@$(PIP_INSTALL) --editable '.[demo]'
	@touch $@

$(VENV)/dev-installed: $(VENV)/demo-installed
	@echo "safefilter: installing PyTorch, test tools and what the filter is compared with (a few minutes) ..."
	@$(PIP_INSTALL) --editable '.[dev]'
	@touch $@

$(VENV)/fuzz-installed: $(VENV)/dev-installed
	@echo "safefilter: installing atheris ..."
	@$(PIP_INSTALL) --editable '.[fuzz]'
	@touch $@

$(VENV)/bench-installed: $(VENV)/dev-installed
	@echo "safefilter: installing the simulators that ours is compared with (a minute) ..."
	@$(PIP_INSTALL) --editable '.[bench]'
	@touch $@

$(VENV)/created:
	@for limit in '(3, 14)' '(4,)'; do for python in $(CANDIDATES); do \
		if "$$python" -c "import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info < $$limit)" 2>/dev/null; then \
			echo "safefilter: making $(VENV) with $$("$$python" --version) ($$(command -v "$$python")) ..."; \
			"$$python" -m venv --clear $(VENV) && touch $@ && exit 0; \
			exit 1; \
		fi; \
	done; done; \
	echo "safefilter needs Python >= 3.11 with its venv and ensurepip modules. Tried:" >&2; \
	for python in $(CANDIDATES); do \
		if ! version=$$("$$python" --version 2>/dev/null); then version="not found"; \
		elif ! "$$python" -c 'import ensurepip, venv' 2>/dev/null; then version="$$version, without venv or ensurepip"; fi; \
		echo "  $$python: $$version" >&2; \
	done; \
	echo "Install one (Debian, Ubuntu: apt-get install python3 python3-venv), or name one: make PYTHON=/path/to/python" >&2; \
	exit 1
