# make demo   a rectangle in a corridor: CSV, picture and check, in out/
# make test   all tests (examples, doctests and the documentation's build among them), warnings as errors
# JOBS=2      with a target that tests: in 2 processes
# make test-python  the tests of plans once more, by the Python core
# make test-interpreter PYTHON=python3.10  a part of the tests with another interpreter
# make lint   ruff and mypy
# make docs   the documentation, in docs/_build/html
# make figures  the pictures of the documentation, from the examples
# make bench  the benchmarks
# make clang  the native core's tests with a core compiled by clang
# make mutate  the tests of polynomials, corridors, limits and certificates, on changed code; goes on where it was ended. MUTANTS='minsnap.limits.compliance*': a part
# make sanitize  the native core's tests under the address and undefined-behaviour sanitizers

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OTHER := build/interpreter
PARALLEL := $(if $(JOBS),-n $(JOBS))
# Versions are pinned for Python 3.11 and newer; for 3.10, which they have left behind, pip chooses the last that there are.
PINS := $(shell $(PYTHON) -c 'import sys; print("--constraint constraints.txt" * (sys.version_info >= (3, 11)))')
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet $(PINS)

# Where a C++ compiler exists the native core is wanted: a failing one must not pass as an installation in pure Python.
COMPILER := $(shell command -v $(firstword $(if $(filter-out default,$(origin CXX)),$(CXX),c++)) || command -v g++ || command -v clang++)
ifneq ($(COMPILER),)
export MINSNAP_REQUIRE_NATIVE ?= 1
endif

.PHONY: demo test test-python test-interpreter lint docs figures bench clang mutate sanitize clean

demo: $(VENV)/installed
	mkdir -p out
	$(BIN)/minsnap rect --corridor 0.3 -o out/rectangle.csv --plot out/rectangle.png
	$(BIN)/minsnap check out/rectangle.csv

test: $(VENV)/developing
	MINSNAP_CXXFLAGS=-Werror $(BIN)/python -m minsnap.native.build
	MINSNAP_REQUIRE_NATIVE=1 MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -W error $(PARALLEL)

test-python: $(VENV)/developing
	MINSNAP_CORE=python MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -W error $(PARALLEL) tests/optimisation tests/trajectory \
		tests/test_planner.py tests/many/test_many.py tests/test_reference_values.py

clang: $(VENV)/developing
	CXX=clang++ MINSNAP_CXXFLAGS=-Werror $(BIN)/python -m minsnap.native.build --output build/clang/_core.bin
	MINSNAP_CORE=native MINSNAP_LIBRARY=build/clang/_core.bin $(BIN)/python -m pytest -W error $(PARALLEL) -p no:cacheprovider tests/native \
		--ignore tests/native/test_build.py --ignore tests/native/test_wheel.py -m "not slow"

# The installed package and its core with another interpreter, in an environment of its own.
test-interpreter:
	@rm -rf $(OTHER) && $(PYTHON) -m venv $(OTHER)
	$(OTHER)/bin/python -m pip --disable-pip-version-check install --quiet $(PINS) . pyyaml pytest pytest-xdist hypothesis
	cd $(OTHER) && MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 bin/python -m pytest -W error $(PARALLEL) -p no:cacheprovider -c $(CURDIR)/pyproject.toml --rootdir $(CURDIR) \
		$(addprefix $(CURDIR)/tests/,test_planner.py test_reference_values.py basics/test_cards.py paths/shapes optimisation/test_fallbacks.py cli/test_shape_commands.py)

sanitize: $(VENV)/developing
	MINSNAP_CXXFLAGS='-Werror -DMINSNAP_UNROLL= -DMINSNAP_INLINE=inline -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all' \
		$(BIN)/python -m minsnap.native.build --output build/sanitized/_core.bin
	LD_PRELOAD=$$($(COMPILER) -print-file-name=libasan.so) ASAN_OPTIONS=detect_leaks=0 MINSNAP_CORE=native \
		MINSNAP_LIBRARY=build/sanitized/_core.bin $(BIN)/python -m pytest -W error -p no:cacheprovider tests/native \
		--ignore tests/native/test_build.py --ignore tests/native/test_wheel.py -m "not slow"

mutate: $(VENV)/mutating
	MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 $(BIN)/mutmut run --max-children $(or $(JOBS),1) $(if $(MUTANTS),'$(MUTANTS)')
	$(BIN)/mutmut results | grep -v 'not checked'

lint: $(VENV)/developing
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/developing
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

figures: $(VENV)/developing
	$(BIN)/python docs/make_figures.py

bench: $(VENV)/benchmarking
	for script in benchmarks/bench_*.py; do echo "# $$script"; $(BIN)/python $$script || exit 1; done

clean:
	rm -rf $(VENV) out mutants docs/_build .mypy_cache .pytest_cache .ruff_cache .hypothesis

$(VENV)/made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo "minsnap needs Python 3.10 or newer; name one with 'make PYTHON=python3.12'" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo "This Python cannot make a virtual environment: on Debian or Ubuntu, 'apt-get install python3-venv' adds it" >&2; exit 1; }
	@touch $@

$(VENV)/installed: $(VENV)/made pyproject.toml constraints.txt
	$(PIP) --editable .
	@touch $@

$(VENV)/developing: $(VENV)/made pyproject.toml constraints.txt
	$(PIP) --editable '.[test]'
	@touch $@ $(VENV)/installed

$(VENV)/benchmarking: $(VENV)/developing
	$(PIP) --editable '.[bench]'
	@touch $@

$(VENV)/mutating: $(VENV)/developing
	$(PIP) --editable '.[mutation]'
	@touch $@
