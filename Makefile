# Everything happens in .venv; nothing outside this folder changes. `make help` lists the targets.

PYTHON ?= python3
VENV := .venv
# Versions that are known to work; `make newest` goes without.
CONSTRAINTS := constraints.txt
# Extras with versions in it. Not apt, which has ROS's own NumPy, and not bench: Basilisk holds others back.
CONSTRAINED := campaign dask dist docs ground gym mpc mutation notebooks parquet ros test view xacro
PACKAGES := space_robot space_robot_control space_robot_model space_robot_msgs_py space_robot_sim
# A file's tests run in one process; tests/conftest.py has the files in an order that fills all.
# Two processes more than there are cores: graphs of nodes wait for one another.
WORKERS := $(shell echo $$(($$(getconf _NPROCESSORS_ONLN) + 2)))
PYTEST := $(VENV)/bin/python -m pytest --numprocesses $(WORKERS) --maxprocesses 4 --dist loadfile --no-loadscope-reorder
CHOSEN := $(if $(DOCS),,-m "not docs")
# Tests of kernels that are short enough without a compiler.
INTERPRETED := $(addprefix tests/,model/dynamics sim/environment model/robot sim/sensors sim/faults \
  control/laws control/controller/test_controller.py)
PIP := $(VENV)/bin/python -m pip install -qq --disable-pip-version-check
PIP_INSTALL := $(PIP) $(foreach file,$(CONSTRAINTS),--constraint $(file) --build-constraint $(file))

# A ROS sourced in this terminal must not mix with the one in .venv.
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONHOME PYTHONPATH
unexport RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
# A flight starts five processes: none of them should compile Python sources anew.
unexport PYTHONDONTWRITEBYTECODE
export PYTHONPYCACHEPREFIX := $(CURDIR)/$(VENV)/pycache
# Discovery stays on this machine; no shared memory that a killed process could leave behind.
export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
export FASTDDS_BUILTIN_TRANSPORTS ?= UDPv4

# Kernels compile in less time, and are as fast, with the same bits.
export NUMBA_OPT ?= 1

.PHONY: help setup fly test test-docs check quick coverage hooks lint kernels docs dist ground bench validation mutation \
  notebooks newest constraints clean

help:
	@echo "make setup               .venv with the package and ROS 2 Jazzy"
	@echo "make fly [ARGS=...]      fly case 1 under TDE-STC, e.g. make fly ARGS='--controller ctc'"
	@echo "make test [ARGS=...]     the tests; ARGS go to pytest; DOCS=1: and test-docs"
	@echo "make test-docs           pages, notebooks, examples, site and wheel: what they show is run"
	@echo "make check [ARGS=...]    style, types and the tests: what a change must pass"
	@echo "make quick [ARGS=...]    the tests that start no ROS and take little time"
	@echo "make coverage            which lines the tests run; twice as long as make test"
	@echo "make hooks               from then on a commit passes style, types and the quick tests"
	@echo "make lint                style and types only"
	@echo "make kernels             compile the dynamics and the laws, once"
	@echo "make docs                docs/ as a site in site/, to be read without a network"
	@echo "make dist                a wheel and a source distribution in dist/"
	@echo "make ground              the ground display: its libraries, and Open MCT by npm"
	@echo "make bench [ARGS=...]    how fast it is, e.g. make bench ARGS='plant laws'; --help tells more"
	@echo "make validation          physics and decisions beside independent programs, for docs/validation.md"
	@echo "make mutation [ARGS=...] small faults put in, one at a time: do the tests notice?"
	@echo "make notebooks           run docs/notebooks and keep what they show"
	@echo "make newest [ARGS=...]   make check with the newest versions of everything, in .venv-newest"
	@echo "make constraints         write constraints.txt anew: the newest versions that fit together"
	@echo "make clean               delete .venv and what was built or cached here"
	@echo "PYTHON=python3.12 chooses the Python (3.10 to 3.13) of a new .venv."

setup: $(VENV)/.flies

fly: $(VENV)/.flies
	@$(VENV)/bin/space-robot fly --controller tde_stc --case 1 $(ARGS)

test:
	@$(MAKE) --no-print-directory --jobs 2 kernels $(VENV)/.collected
	$(PYTEST) $(CHOSEN) $(ARGS)

test-docs:
	@$(MAKE) --no-print-directory --jobs 2 kernels $(VENV)/.collected
	$(PYTEST) -m docs $(ARGS)

check:
	@$(MAKE) --no-print-directory --jobs 2 lint kernels $(VENV)/.collected
	$(PYTEST) $(CHOSEN) $(ARGS)

quick: $(VENV)/.tests
	$(PYTEST) -m "not ros and not slow and not docs" $(ARGS)

# The kernels' lines are seen where they run as plain Python: tests/interpreted_kernels.py.
coverage: $(VENV)/.tests
	rm -f .coverage .coverage.*
	$(PYTEST) --cov --cov-report= $(ARGS)
	PYTHONPATH=tests $(PYTEST) --cov --cov-append --cov-report= -p interpreted_kernels \
	  -m "not ros and not docs" $(INTERPRETED)
	$(VENV)/bin/coverage report

hooks: $(VENV)/.tests
	$(VENV)/bin/pre-commit install

lint: $(VENV)/.tests
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy

# Else both test processes would begin with it. It begins while the tests' tools are installed.
kernels: $(VENV)/.flies
	$(VENV)/bin/python -c "from space_robot.flight.compilation import compile_all as c; c()"

docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/python -m mkdocs --quiet build --strict
	@echo "site/index.html"

# The wheel is built from the source distribution, so that nothing is in one of them alone.
dist: $(VENV)/.made
	@$(PIP_INSTALL) 'build>=1.2'
	rm -rf dist
	$(VENV)/bin/python -m build
	@ls dist/*

ground: $(VENV)/.made
	@$(PIP_INSTALL) --editable '.[ros,ground]'
	npm install --prefix $(VENV)/openmct --no-audit --no-fund --ignore-scripts openmct@4.2.0

bench: $(VENV)/.tests
	@$(VENV)/bin/python tools/benchmarks $(ARGS)

validation: $(VENV)/.tests
	@$(VENV)/bin/python docs/validation

# What is compiled here, no mutant compiles again.
mutation: kernels $(VENV)/.tests
	@$(PIP_INSTALL) --editable '.[ros,test,mutation]'
	$(VENV)/bin/python tools/mutation $(ARGS)

notebooks: $(VENV)/.tests
	$(VENV)/bin/python docs/notebooks/execute.py

# Of what failed with it, the versions that are listed first are the suspects.
newest:
	rm -rf .venv-newest
	@$(MAKE) --no-print-directory VENV=.venv-newest CONSTRAINTS= .venv-newest/.tests
	@echo "constraints.txt has other versions of:"
	@.venv-newest/bin/python -m pip install --disable-pip-version-check --dry-run \
	  --constraint constraints.txt --editable '.[ros,test]' | sed -n 's/^Would install //p'
	@$(MAKE) --no-print-directory VENV=.venv-newest CONSTRAINTS= check

constraints: $(VENV)/.made
	@$(PIP) uv
	printf 'pip\nsetuptools\n' | $(VENV)/bin/python -m uv pip compile --quiet --upgrade --universal \
	  --python-version 3.10 --no-annotate --no-emit-index-url \
	  --custom-compile-command 'make constraints' --output-file constraints.txt \
	  $(addprefix --extra ,$(CONSTRAINED)) setup.py -

clean:
	rm -rf $(VENV) .venv-newest build dist install log site *.egg-info .coverage .coverage.* .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find $(PACKAGES) tests -name __pycache__ -prune -exec rm -rf {} +

# Stamps: what is installed in .venv, renewed when the packaging changes.
$(VENV)/.flies: setup.py pyproject.toml $(CONSTRAINTS) | $(VENV)/.made
	@echo "installing space_robot and ROS 2 into $(VENV): a minute or two, once"
	@$(PIP_INSTALL) --no-compile --editable '.[ros,campaign,view]'  # most modules are never imported
	@touch $@

$(VENV)/.tests: setup.py pyproject.toml $(CONSTRAINTS) | $(VENV)/.flies
	@echo "installing the tests' tools into $(VENV): a minute, once"
	@$(PIP_INSTALL) --no-compile --editable '.[ros,test]'
	@touch $@

# Else all test processes would compile the same Python sources.
$(VENV)/.collected: | $(VENV)/.tests
	@NUMBA_DISABLE_JIT=1 $(VENV)/bin/python -m pytest --collect-only -qq > $@ 2>&1 || true

$(VENV)/.docs: setup.py $(CONSTRAINTS) | $(VENV)/.made
	@echo "installing space_robot and what makes its site into $(VENV): a minute, once"
	@$(PIP_INSTALL) --editable '.[docs,view,campaign]'
	@touch $@

$(VENV)/.made:
	@command -v $(PYTHON) >/dev/null || \
	  { echo "error: no $(PYTHON) here: install Python 3.10 to 3.13" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' || \
	  { echo "error: Python 3.10 to 3.13 is needed, $(PYTHON) is $$($(PYTHON) -V 2>&1):" \
	    "try make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "error: $(PYTHON) cannot make virtual environments:" \
	    "sudo apt install python3-venv" >&2; exit 1; }
	@$(PYTHON) -m venv --clear $(VENV)
	@$(PIP) --upgrade $(or $(shell grep -s '^pip==' $(CONSTRAINTS)),pip)  # 23.0 needs minutes to resolve [ros,test]
	@touch $@
