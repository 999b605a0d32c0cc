# make demo | test | check | slow | bench | docs | blender | addon      (the first two need nothing but Python 3.11+)

PYTHON ?= python3
BIN := .venv/bin
UV := .uv/bin/uv
UV_VERSION := 0.13.9
# four tests at a time at most: what they compile takes a gigabyte or two each
SPREAD := -n auto --maxprocesses 4 --dist loadfile

.DEFAULT_GOAL := help
.PHONY: help demo test check slow bench docs blender addon format lock clean

help:  ## what there is
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

$(UV):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "moldline needs Python 3.11 or later; this is $$($(PYTHON) --version). Set PYTHON=, e.g. make demo PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -m venv .uv || { echo "python3 cannot make virtual environments; on Debian: apt-get install python3-venv"; exit 1; }
	@.uv/bin/pip install --quiet --disable-pip-version-check uv==$(UV_VERSION)

.venv/ready: $(UV) pyproject.toml uv.lock
	@$(UV) sync --quiet --frozen --python $(PYTHON)
	@touch $@

.venv/ready-dev: .venv/ready
	@$(UV) sync --quiet --frozen --python $(PYTHON) --group dev
	@touch $@

demo: .venv/ready  ## deform a transport wing, write its sensitivities, draw pictures
	@$(BIN)/python examples/ex01_transport_wing.py

test: .venv/ready  ## the tests (no GPU, no Blender, no display)
	@$(BIN)/python -m pytest $(SPREAD) -m "not slow and not blender"

check: .venv/ready-dev  ## format, lint, types, layers, tests
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/python -m pytest -q $(SPREAD) -m "not slow and not blender"

slow: .venv/ready  ## everything at full size
	@$(BIN)/python -m pytest

bench: .venv/ready  ## the benchmark tables: the paper's beside Blender, deformation, embedding, cages, pilots, modelers, unions, programs, server, files
	@if [ -x .venv-blender/bin/python ]; then $(BIN)/python benchmarks/table1.py && $(BIN)/python benchmarks/blender_cells.py && .venv-blender/bin/python benchmarks/blender_live.py; else echo "no .venv-blender (\`make blender\` makes it): the paper's table beside Blender and how Blender follows a hand are left out"; fi
	@$(BIN)/python benchmarks/deform.py
	@$(BIN)/python benchmarks/embedding.py
	@$(BIN)/python benchmarks/cage.py
	@$(BIN)/python benchmarks/cage_errors.py
	@$(BIN)/python benchmarks/pilots.py
	@$(BIN)/python benchmarks/modelers.py
	@$(BIN)/python benchmarks/union.py
	@$(BIN)/python benchmarks/program.py
	@$(BIN)/python benchmarks/server.py
	@$(BIN)/python benchmarks/files.py

docs: .venv/ready-dev  ## the documentation, into site/
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

blender:  ## an environment with Blender as a module, for comparison and the add-on's tests
	@bash tools/blender_env.sh

addon: $(UV)  ## the Blender extension, dist/moldline-*.zip (needs a Blender: on PATH, as BLENDER=, or make blender)
	@$(PYTHON) tools/build_addon.py

format: .venv/ready-dev  ## put the code into shape
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

lock: $(UV)  ## renew uv.lock
	@$(UV) lock --upgrade

clean:  ## remove what was made
	@rm -rf .venv .uv out site build dist
