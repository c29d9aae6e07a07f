# SPDX-License-Identifier: GPL-3.0-or-later
# From a fresh clone: `make bake` lights the Cornell box, `make test` runs the tests. `make help` lists the rest.

# Which Python and which Blender. 3.13 runs bpy 5.2, 3.11 runs 5.0 and 4.2; .ci/make_venv finds one and holds the versions.
#   make test PYTHON_SERIES=3.11 BPY=4.2.23 VENV=.venv-4.2
PYTHON_SERIES ?=
BPY ?=
VENV ?= .venv

# What `make bake` takes and where it leaves the results.
BLEND ?= example_blends/cornell_box.blend
QUALITY ?= medium
BUILD ?= build
NAME = $(basename $(notdir $(BLEND)))

PYTHON = $(VENV)/bin/python
# Blender's own extension tool, which comes with bpy.
EXTENSION_TOOL = $(PYTHON) -c "import sys, bpy, bl_pkg; sys.exit(bl_pkg.cli_extension(sys.argv[1:]))"

.DEFAULT_GOAL := help
.PHONY: help venv bake test fuzz coverage lint build examples pictures table benchmark profile clean

help:                ## this list
	@sed -n 's/^\([a-z]*\):.*## */  make \1 — /p' $(MAKEFILE_LIST)

# Always asked; does nothing when the folder is as wanted.
venv:
	@.ci/make_venv "$(VENV)" "$(PYTHON_SERIES)" "$(BPY)"

bake: venv       ## light BLEND at QUALITY; leaves build/NAME.{blend,glb,png,json}
	@mkdir -p "$(BUILD)"
	@$(PYTHON) example_blends/bake.py "$(BLEND)" --quality "$(QUALITY)" --output "$(BUILD)/$(NAME).blend" \
	  --gltf "$(BUILD)/$(NAME).glb" --render "$(BUILD)/$(NAME).png" --report "$(BUILD)/$(NAME).json"

test: venv       ## the whole test suite
	$(PYTHON) -m pytest $(ARGS)

fuzz: venv       ## thousands of scenes, files and texts that nobody would make on purpose
	FUZZ_SCENES=$(or $(SCENES),2000) FUZZ_TEXTS=$(or $(TEXTS),100000) FUZZ_FILES=$(or $(FILES),500) \
	  $(PYTHON) -m pytest tests/unit/test_fuzz.py tests/blender/test_fuzz_scenes.py $(ARGS)

coverage: venv   ## the test suite, and which lines of core it never ran
	$(PYTHON) -m pytest --cov=core --cov-report=term-missing:skip-covered --cov-fail-under=95 $(ARGS)

lint: venv       ## ruff on everything, mypy --strict on core
	$(PYTHON) -m ruff check .
	$(PYTHON) -m mypy --strict core

build: venv      ## the extension's zip in dist/, checked by Blender's own tool
	@mkdir -p dist && rm -f dist/radiosity-*.zip
	$(EXTENSION_TOOL) build --source-dir . --output-dir dist
	$(EXTENSION_TOOL) validate dist/radiosity-*.zip

# By the oldest Blender supported, which cannot open what a newer one saves.
examples: BPY = 4.2.23
examples: VENV = .venv-4.2
examples: venv       ## make example_blends/*.blend anew
	$(PYTHON) example_blends/make_examples.py

pictures: venv       ## bake the examples and draw example_blends/pictures/
	$(PYTHON) example_blends/make_pictures.py

table: venv          ## the thesis's table, our times beside its own
	$(PYTHON) -m tests.benchmarks.thesis_table

benchmark: venv      ## error against time, ours and Cycles'; another one with ARGS=growth or ARGS=race
	$(PYTHON) -m tests.benchmarks $(or $(ARGS),cycles)

profile: venv        ## where the time of a bake of BLEND at QUALITY goes, by stage and by function
	$(PYTHON) -m tests.benchmarks.profiling "$(BLEND)" --quality "$(QUALITY)" --output "$(BUILD)/$(NAME).prof"

clean:               ## remove what was made, the virtual environments included
	rm -rf build dist .venv .venv-*
