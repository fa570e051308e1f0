# `make run` and `make test` are each enough by themselves: they set up what is missing.
PYTHON := .venv/bin/python
READY  := .venv/.ready
COMPILED := .venv/.compiled
KERNELS := $(shell grep -rl --include='*.py' -e njit -e tracker.kernels radar_console)
JOBS   ?= 2
ARGS   ?=

.DEFAULT_GOAL := help
.PHONY: help setup run test lint format bench pictures lock clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: $(COMPILED) ## Make .venv with everything from the lock; see to Qt's system libraries

$(READY): requirements-dev.lock pyproject.toml tools/setup.sh
	@sh tools/setup.sh
	@touch $@

# numba keeps what it compiled, but does not notice that a function called from another file has
# changed: after a change of any kernel, all are compiled anew.
$(COMPILED): $(READY) $(KERNELS)
	@echo "compiling the numerical kernels, a minute or two" >&2
	@find radar_console -name '*.nb[ic]' -delete
	@$(PYTHON) -m radar_console warm-up
	@touch $@

run: $(COMPILED) ## Open the console; ARGS="--help", ARGS="recording.pcap"
	@$(PYTHON) -m radar_console $(ARGS)

# Linting and compiling wait for nobody: side by side they are done sooner.
test: $(READY) ## Lint, then every test; ARGS="tests/core -k wrap" for a part
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target lint $(COMPILED)
	@QT_QPA_PLATFORM=offscreen $(PYTHON) -m pytest -n $(JOBS) --dist loadfile $(ARGS)

lint: $(READY) ## Style, strict types and import contracts
	@$(PYTHON) -m ruff check .
	@$(PYTHON) -m ruff format --check .
	@$(PYTHON) -m mypy
	@.venv/bin/lint-imports

format: $(READY) ## Rewrite the code in the house's format
	@$(PYTHON) -m ruff check --fix .
	@$(PYTHON) -m ruff format .

# The rest of benchmarks/ is what these share.
BENCHMARKS = $(filter-out __init__ acceptance report scenes stone_soup tracking peers manoeuvres, \
             $(basename $(notdir $(wildcard benchmarks/*.py))))

bench: $(COMPILED) ## Measure everything; ours beside others where those are installed
	@set -e; export QT_QPA_PLATFORM=offscreen; \
	for name in $(BENCHMARKS); do echo "== benchmarks/$$name.py"; $(PYTHON) -m benchmarks.$$name; done; \
	for name in tracking peers manoeuvres; do \
	    echo "== benchmarks/$$name.py"; $(PYTHON) -m benchmarks.$$name --markdown docs/performance.md; done; \
	echo "== benchmarks/acceptance.py scenario twenty-five"; \
	$(PYTHON) -m benchmarks.acceptance scenario twenty-five

pictures: $(COMPILED) ## Make the pictures that README and docs show; the studies' take an hour
	@mkdir -p docs/pictures
	@$(PYTHON) -m radar_console twenty-five --screenshot docs/pictures/twenty-five.png --after 120
	@set -e; for name in $$($(PYTHON) -m radar_console study --list | cut -d ' ' -f 1); do \
	    $(PYTHON) -m radar_console study $$name; done
	@for file in out/*/*.png; do \
	    if [ -e docs/pictures/$${file##*/} ]; then cp $$file docs/pictures/; fi; done

# One version of each package for all systems and Pythons, with the hashes of its files. Pins stay
# as they are unless they must move: UPGRADE=--upgrade moves all, UPGRADE="-P numpy" one.
LOCK = $(PYTHON) -m uv --no-config pip compile pyproject.toml --quiet --universal --python-version 3.11 \
       --fork-strategy fewest --generate-hashes --no-annotate --no-header $(UPGRADE)

lock: $(READY) ## Bring the lock files up to pyproject.toml
	@$(LOCK) -o requirements.lock
	@$(LOCK) --group dev -o requirements-dev.lock
	@$(LOCK) --extra bench --constraints requirements.lock -o requirements-bench.lock

clean: ## Remove .venv and all caches
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
