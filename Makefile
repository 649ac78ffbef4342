# pkm_gym: `make study` runs the main job, `make test` the tests, `make benchmark` the benchmark
# (`make benchmark FULL=1`: the published tables), `make docs` the pages and the API reference;
# all set themselves up.

PYTHON ?= python3
VENV ?= .venv
MECHANISMS ?= diamond spr3 spr3_cylinder stroke_leg stroke_leg_gait pus6 pus6_layout pss5_upu pss5_upu_skew
BENCHMARKS ?= diamond spr3 spr3_cylinder stroke_leg stroke_leg_gait pus6_layout pss5_upu_skew

BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
SOURCES := pyproject.toml constraints.txt

.PHONY: study test test-slow wheel lint types docs benchmark bench clean

study: $(VENV)/.studies
	@for name in $(MECHANISMS); do $(BIN)/pkm-gym study $$name || exit $$?; done

test: $(VENV)/.dev
	$(BIN)/python -m pytest -m "not slow" -n auto --dist loadscope

test-slow: $(VENV)/.dev
	$(BIN)/python -m pytest -m slow

wheel: $(VENV)/.dev
	$(BIN)/python -m pytest -m slow tests/test_wheel.py

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(MAKE) --no-print-directory types

types: $(VENV)/.dev build/package
	cd build/package && $(abspath $(BIN))/mypy --config-file ../../pyproject.toml --cache-dir ../../.mypy_cache

docs: $(VENV)/.docs build/package
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --clean >build/docs.log 2>&1 || { grep -v INFO build/docs.log; exit 1; }
	@echo "pkm_gym: the pages are in build/docs/index.html"

# agents/ and studies/ are installed inside pkm_gym: the package as it is installed
.PHONY: build/package
build/package:
	@rm -rf $@ && mkdir -p $@
	@cp -Rp pkm_gym $@ && cp -Rp agents studies $@/pkm_gym

benchmark: $(VENV)/.benchmark
	@for name in $(BENCHMARKS); do $(BIN)/pkm-gym benchmark $$name --split test $(if $(FULL),--full) || exit $$?; done

bench: $(VENV)/.dev
	$(BIN)/python -m pytest tests/benchmarks -o python_files="bench_*.py" --benchmark-only

clean:
	rm -rf $(VENV) .nox build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
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

$(VENV)/.docs: $(BIN)/python $(SOURCES)
	@echo "pkm_gym: installing what the pages need into $(VENV) (once) ..."
	$(INSTALL) -e ".[docs]"
	@touch $@

$(VENV)/.dev: $(BIN)/python $(SOURCES)
	@echo "pkm_gym: installing everything that the tests need into $(VENV) (once) ..."
	$(INSTALL) -e ".[studies,agents,movies,docs,dev]"
	@touch $@ $(VENV)/.studies $(VENV)/.benchmark $(VENV)/.docs
