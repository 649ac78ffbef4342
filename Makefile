# pkm_gym: `make study` runs the main job, `make test` the tests, `make benchmark` the benchmark
# (`make benchmark FULL=1`: the published tables); all set themselves up.

PYTHON ?= python3
VENV ?= .venv
MECHANISMS ?= diamond spr3 spr3_cylinder

BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
SOURCES := pyproject.toml constraints.txt

.PHONY: study test test-slow lint benchmark bench clean

study: $(VENV)/.studies
	@for name in $(MECHANISMS); do $(BIN)/pkm-gym study $$name || exit $$?; done

test: $(VENV)/.dev
	$(BIN)/python -m pytest -m "not slow" -n auto

test-slow: $(VENV)/.dev
	$(BIN)/python -m pytest -m slow

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# agents/ and studies/ are installed inside pkm_gym: show mypy the package as it is installed
	@rm -rf build/types && mkdir -p build/types/pkm_gym
	@ln -s $(CURDIR)/pkm_gym/* $(CURDIR)/agents $(CURDIR)/studies build/types/pkm_gym
	cd build/types && $(abspath $(BIN))/mypy --config-file ../../pyproject.toml

benchmark: $(VENV)/.benchmark
	@for name in $(MECHANISMS); do $(BIN)/pkm-gym benchmark $$name $(if $(FULL),--full) || exit $$?; done

bench: $(VENV)/.dev
	$(BIN)/python -m pytest tests/benchmarks -o python_files="bench_*.py" --benchmark-only

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "pkm_gym needs Python 3.11 or newer: set PYTHON=python3.x")'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.studies: $(BIN)/python $(SOURCES)
	@echo "pkm_gym: installing into $(VENV) (once) ..."
	$(INSTALL) -e ".[studies]"
	@touch $@

$(VENV)/.benchmark: $(BIN)/python $(SOURCES)
	@echo "pkm_gym: installing what the benchmark needs into $(VENV) (once) ..."
	$(INSTALL) -e ".[studies,agents]"
	@touch $@ $(VENV)/.studies

$(VENV)/.dev: $(BIN)/python $(SOURCES)
	@echo "pkm_gym: installing everything that the tests need into $(VENV) (once) ..."
	$(INSTALL) -e ".[studies,agents,movies,dev]"
	@touch $@ $(VENV)/.studies $(VENV)/.benchmark
