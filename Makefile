# make run    set up what is needed, then run a scene from geometry to figures
# make report the same as make run, and one page about it: out/<scene>/report.html
# make test   set up what is needed, then format, lint, types and tests
# make stress the stability matrix: hard cases solved, every one written down, into out/stress
#
# SCENE=scenes/x.toml chooses the scene, OUT=folder the output (out/<scene name> by default), JOBS=n the processes;
# STRESS="--full --seed 5" more or other cases (docs/stability.md).

SCENE ?= scenes/dummy.toml
OUT ?=
JOBS ?= 1
STRESS ?=
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SHROUD = $(BIN)/shroud run $(SCENE) $(if $(OUT),--out $(OUT)) --jobs $(JOBS)

.DEFAULT_GOAL := run
.PHONY: setup run mesh assemble reduce respond render figures report test stress clean

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml
	@$(PYTHON) pipeline/bootstrap.py
	@echo "setting up $(VENV), once"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --disable-pip-version-check -e '.[cholmod,uff,dev]'
	@touch $@

run: setup
	@$(SHROUD)

mesh assemble reduce respond render figures report: setup
	@$(SHROUD) --until $@

# Small matrices: more BLAS threads than one for each test process only get in each other's way.
test: export OPENBLAS_NUM_THREADS = 1
test: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest -n 2 --dist loadgroup

stress: setup
	@$(BIN)/python benchmarks/stress.py --jobs $(JOBS) $(STRESS)

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
