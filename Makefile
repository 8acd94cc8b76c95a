# make run    set up what is needed, then run a scene from geometry to figures
# make report the same as make run, and one page about it: out/<scene>/report.html
# make test   set up what is needed, then format, lint, types and tests
# make test-fast  format, lint, types, and the tests of tests/fast.txt, whose every test answers at once: for daily work
# make test-long  the hard cases of make test, ten minutes: every key and pair of features, losses of workers and disks, whole benchmarks, the first half hour
# make test-lowest, make test-newest  tests of every library's use, with the lowest and the newest versions that pyproject.toml allows
# make test-generic  the tests with BLAS of a processor of 2008, kernels compiled for any x86_64 and time integration disturbed
#             by 1e-13: nothing may rest on the last bit; CORETYPE=Haswell DISTURBED=2 another BLAS, another disturbance
# make lock   requirements.lock, the exact versions of make setup with hashes of their files, as the newest allowed ones
# make bench  run time against error of every stage, and run times before and after, into out/bench; make bench-docs puts it into docs
# make bench-times  every row of the table of run times, half an hour; ROWS="fresh auto" those of cases whose names begin so
# make bench-peers  beside pyHarm (installed into an environment of its own) and CalculiX (where ccx is)
# make docs   the documentation site, into out/docs/index.html; make tutorials runs the tutorials and renews their output and pictures
# make pictures  the pictures of README and pages that are old, made again from the scenes; a test fails where one is old
# make stress the test matrix: hard cases solved, every one recorded, into out/stress
#
# SCENE=scenes/x.toml chooses the scene, OUT=folder the output (out/<scene name> by default), JOBS=n the processes
# (by default as many as there are cores, where the work is worth it);
# STRESS="--full --seed 5" more or other cases (docs/developers/hard_cases.md), BENCH="--only mesh" one study of the bench.

SCENE ?= scenes/dummy.toml
OUT ?=
JOBS ?=
STRESS ?=
BENCH ?=
PYTHON ?= python3
VENV := .venv
VERSION_EXTRAS := cholmod,uff,meshes,matrices,distributed,tables,explore,dev
EXTRAS := $(VERSION_EXTRAS),docs
BIN := $(VENV)/bin
SHROUD = $(BIN)/shroud run $(SCENE) $(if $(OUT),--out $(OUT)) $(if $(JOBS),--jobs $(JOBS))

.DEFAULT_GOAL := run
.PHONY: setup run mesh assemble reduce respond study stresses render figures report test test-fast test-long test-generic test-lowest test-newest lock docs tutorials pictures stress bench bench-times bench-peers bench-docs clean

setup: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml requirements.lock
	@$(PYTHON) pipeline/bootstrap.py
	@echo "installing into $(VENV), once (about 2 minutes): packages, then kernels are compiled"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install -qq --disable-pip-version-check --no-input --no-compile --require-hashes -r requirements.lock
	@$(BIN)/pip install -qq --disable-pip-version-check --no-input --no-compile --no-deps --no-build-isolation -e .
	-@$(BIN)/shroud warm-up --quiet
	@touch $@

run: setup
	@$(SHROUD)

mesh assemble reduce respond study stresses render figures report: setup
	@$(SHROUD) --until $@

# Small matrices: more BLAS threads than one for each test process only get in each other's way.
test test-fast test-long: export OPENBLAS_NUM_THREADS = 1
test-fast: CHOSEN_TESTS = @tests/fast.txt
test test-fast: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest -n 2 --dist loadgroup $(CHOSEN_TESTS)

test-long: setup
	$(BIN)/pytest -n 2 --dist loadgroup -m long

# Each test here is of a library's use or of a result that it could change: mesh, matrices, reduction, contact, files, pictures.
VERSION_TESTS = geometry/test_shape.py geometry/test_quality.py geometry/test_files.py rom/test_assembly.py \
	rom/test_craig_bampton.py rom/test_factorisation.py rom/test_ordering.py rom/test_receptance.py nonlinear/test_balance.py \
	nonlinear/test_contact_closed_forms.py nonlinear/test_contact_jacobian.py nonlinear/test_detached.py pipeline/test_cli.py \
	pipeline/test_explore_page.py pipeline/test_export.py pipeline/test_new_scene.py pipeline/test_outputs.py pipeline/test_pictures.py \
	pipeline/test_public_module.py pipeline/test_report.py pipeline/test_stages.py

test-lowest test-newest: export OPENBLAS_NUM_THREADS = 1
test-lowest: setup
	@mkdir -p out/lowest && $(BIN)/python .ci/lowest_versions.py > out/lowest/constraints.txt
	@$(PYTHON) -m venv out/lowest/venv
	@out/lowest/venv/bin/pip install --quiet --disable-pip-version-check -c out/lowest/constraints.txt -e '.[$(VERSION_EXTRAS)]'
	out/lowest/venv/bin/python -m pytest -n 2 --dist loadgroup $(addprefix tests/,$(VERSION_TESTS))

test-generic: export OPENBLAS_NUM_THREADS = 1
CORETYPE ?= Nehalem
DISTURBED ?= 1
test-generic: export OPENBLAS_CORETYPE = $(CORETYPE)
test-generic: export DISTURBED
test-generic: export NUMBA_CPU_NAME = generic
test-generic: export NUMBA_CPU_FEATURES =
test-generic: setup
	$(BIN)/pytest -n 2 --dist loadgroup

out/newest/venv: pyproject.toml
	@$(PYTHON) -m venv $@
	@$@/bin/pip install --quiet --disable-pip-version-check --upgrade -e '.[$(EXTRAS)]'
	@touch $@

test-newest: out/newest/venv
	out/newest/venv/bin/python -m pytest -n 2 --dist loadgroup $(addprefix tests/,$(VERSION_TESTS))

# For the lowest Python that is allowed; hashes of all files of a version, so of every Python and processor.
lock:
	@$(PYTHON) -m venv out/lock && out/lock/bin/pip install --quiet --disable-pip-version-check uv
	@out/lock/bin/uv pip compile --quiet --upgrade --all-extras --generate-hashes --no-annotate --python-version 3.11 \
		--universal --custom-compile-command "make lock" pyproject.toml -o requirements.lock
	@echo requirements.lock

# A warning is an error. The pages need no network.
docs: setup
	@$(BIN)/sphinx-build --fail-on-warning --quiet --fresh-env docs out/docs -d out/.doctrees
	@echo out/docs/index.html

tutorials: export OPENBLAS_NUM_THREADS = 1
tutorials: setup
	@$(BIN)/python docs/execute.py --update
	@$(BIN)/python docs/make_pictures.py --record first_blade_shrouds first_blade_response

pictures: export OPENBLAS_NUM_THREADS = 1
pictures: setup
	@$(BIN)/python docs/make_pictures.py

stress: setup
	@$(BIN)/python benchmarks/stress.py $(if $(JOBS),--jobs $(JOBS)) $(STRESS)

# Times of one thread each, as the pipeline itself asks for.
bench bench-times bench-peers bench-docs: export OPENBLAS_NUM_THREADS = 1
bench: setup
	@$(BIN)/python benchmarks/bench.py $(BENCH)
ifeq ($(BENCH),)
	@$(BIN)/python benchmarks/run_times.py
	@$(BIN)/python benchmarks/family.py
	@$(BIN)/python benchmarks/reduction.py
	@$(BIN)/python benchmarks/own_mesh.py --full
	@$(BIN)/python benchmarks/parallel.py
endif

bench-times: setup
	@$(BIN)/python benchmarks/run_times.py $(if $(ROWS),--only $(ROWS),--dear)

bench-peers: setup
	@$(BIN)/python benchmarks/peers.py
	@$(BIN)/python benchmarks/peers_linear.py

bench-docs: setup
	@$(BIN)/python benchmarks/bench.py --docs
	@$(BIN)/python docs/make_pictures.py $(addprefix bench_,whole mesh modes harmonics integration continuation)

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
