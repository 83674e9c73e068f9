# `make` or `make help` lists what can be made. Tests run on all processors, with two processes more: some tests only wait; JOBS=1 takes one.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OTHER := build/interpreter
JOBS ?= $(shell expr $$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2) + 2)
PARALLEL := $(if $(filter-out 1,$(JOBS)),-n $(JOBS) --dist worksteal)
PYTEST := $(BIN)/python -m pytest -W error
QUIET := MPLBACKEND=agg OPENBLAS_NUM_THREADS=1
CORE := MINSNAP_CXXFLAGS=-Werror $(BIN)/python -m minsnap.native.build
# Versions are pinned for Python 3.11 and newer; for 3.10, which they have left behind, pip chooses the last that there are.
PINS := $(shell $(PYTHON) -c 'import sys; print("--constraint constraints.txt" * (sys.version_info >= (3, 11)))')
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet $(PINS)

unexport PYTHONDONTWRITEBYTECODE # without compiled files every process of a test would compile the library anew

.PHONY: help demo page embedded cpp test check test-library test-python test-kernels test-interpreter test-install lint docs figures wheels bench clang mutate sanitize clean

help: ## these lines
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | while IFS="$$(printf '\t')" read -r name text; do printf '%-21s %s\n' "make $$name" "$$text"; done

demo: $(VENV)/installed ## plan a rectangle in a corridor into out/: CSV, picture, check
	mkdir -p out
	$(BIN)/minsnap --version
	$(BIN)/minsnap rect --corridor 0.3 -o out/rectangle.csv --plot out/rectangle.png
	$(BIN)/minsnap check out/rectangle.csv
	@echo; echo "Look at out/rectangle.png. Next: $(BIN)/minsnap studio, $(BIN)/minsnap --help, docs/tour.rst"

test: $(VENV)/developing ## every test, example and page of documentation, warnings as errors
	$(CORE)
	$(QUIET) $(PYTEST) $(PARALLEL)

check: $(VENV)/developing ## the fast part of the tests, within a minute
	$(CORE)
	$(QUIET) $(PYTEST) $(PARALLEL) -m "not slow"

# The rooms above `plot` in docs/architecture.rst, without the applications below and without what only these need.
LIBRARY := basics polynomials native trajectory vehicle corridors limits bounds optimisation refusals durations planning replanning files paths fleet \
	test_certificate.py test_last_look.py test_vehicle_tube.py test_import_order.py
test-library: $(VENV)/developing ## the quick tests of the library, with all applications hidden
	PYTHONPATH=tests/helpers $(QUIET) $(PYTEST) $(PARALLEL) -p library_alone -m "not slow" $(addprefix tests/,$(LIBRARY))

test-python: $(VENV)/developing ## the tests of plans once more, by the Python core
	MINSNAP_CORE=python $(QUIET) $(PYTEST) $(PARALLEL) tests/optimisation tests/trajectory \
		tests/planning/test_planner.py tests/planning/test_many.py tests/test_reference_values.py

# Of the oldest processor, without NumPy's faster loops, and of a newer one: what a test asserts must not depend on them.
LOOPS := from numpy._core._multiarray_umath import __cpu_dispatch__ as known; print(*known)
test-kernels: $(VENV)/developing ## the tests of plans under two other kernels of BLAS and NumPy
	for kernel in Prescott Haswell; do \
		OPENBLAS_CORETYPE=$$kernel NPY_DISABLE_CPU_FEATURES="$$([ $$kernel = Haswell ] || $(BIN)/python -c '$(LOOPS)')" $(QUIET) $(PYTEST) $(PARALLEL) \
			tests/planning/test_planner.py tests/test_reference_values.py tests/optimisation tests/corridors tests/limits tests/polynomials || exit 1; done

clang: $(VENV)/developing ## the native core's tests with a core compiled by clang
	CXX=clang++ MINSNAP_CXXFLAGS=-Werror $(BIN)/python -m minsnap.native.build --output build/clang/_core.bin
	MINSNAP_CORE=native MINSNAP_LIBRARY=build/clang/_core.bin $(BIN)/python -m pytest -W error $(PARALLEL) -p no:cacheprovider tests/native \
		--ignore tests/native/test_build.py --ignore tests/native/test_wheel.py -m "not slow"

# The installed package and its core with another interpreter, in an environment of its own; that of the oldest has the
# oldest packages that pyproject.toml allows, whose warnings of one another are no errors.
test-interpreter: ## a part of the tests with another interpreter: PYTHON=python3.10
	@rm -rf $(OTHER) && $(PYTHON) -m venv $(OTHER)
	sed -n 's/^    "\([A-Za-z_]*\)>=\([0-9.]*\).*/\1==\2/p' pyproject.toml > $(OTHER)/oldest.txt
	MINSNAP_CXXFLAGS=-Werror $(OTHER)/bin/python -m pip --disable-pip-version-check install --quiet $(or $(PINS),--constraint $(OTHER)/oldest.txt) \
		'.[solvers]' pytest pytest-xdist hypothesis
	cd $(OTHER) && MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 bin/python -m pytest $(if $(PINS),-W error,-o filterwarnings=default) $(PARALLEL) -p no:cacheprovider -c $(CURDIR)/pyproject.toml --rootdir $(CURDIR) \
		$(addprefix $(CURDIR)/tests/,planning/test_planner.py test_reference_values.py basics/test_cards.py paths/shapes optimisation/test_reference.py cli/test_shape_commands.py)

# As on a machine without a compiler, where pip gets one for the time of the build.
test-install: ## install with nothing but Python on the PATH, and plan by the native core
	@rm -rf build/bare && mkdir -p build/bare/bin && $(PYTHON) -m venv build/bare/venv
	cd build/bare && env -u CXX PATH=$(CURDIR)/build/bare/bin venv/bin/python -m pip --disable-pip-version-check install --quiet $(CURDIR)
	cd build/bare && MINSNAP_CORE=native PATH=$(CURDIR)/build/bare/bin venv/bin/minsnap rect --corridor 0.3 -o rectangle.csv
	cd build/bare && venv/bin/minsnap --version

wheels: $(VENV)/releasing ## wheels of all platforms into dist/, by cross-compilation, and what they need checked
	$(BIN)/python release/wheels.py

page: $(VENV)/releasing ## the core of the page docs/play, compiled to WebAssembly
	$(BIN)/python release/web_core.py

embedded: $(VENV)/releasing ## static programs for aarch64 and 32-bit ARM, and run by qemu where it is
	$(CORE)
	$(BIN)/python release/embedded.py

cpp: ## the library for C and C++ programs by CMake, in build/cpp, and its tests
	cmake -S minsnap/native -B build/cpp && cmake --build build/cpp --parallel $(JOBS) && ctest --test-dir build/cpp --output-on-failure

sanitize: $(VENV)/developing ## the native core's tests under the address and undefined-behaviour sanitizers
	MINSNAP_CXXFLAGS='-Werror -DMINSNAP_UNROLL= -DMINSNAP_INLINE=inline -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all' \
		$(BIN)/python -m minsnap.native.build --output build/sanitized/_core.bin
	LD_PRELOAD=$$($(CXX) -print-file-name=libasan.so) ASAN_OPTIONS=detect_leaks=0 MINSNAP_CORE=native \
		MINSNAP_LIBRARY=build/sanitized/_core.bin $(BIN)/python -m pytest -W error -p no:cacheprovider tests/native \
		--ignore tests/native/test_build.py --ignore tests/native/test_wheel.py -m "not slow"

mutate: $(VENV)/mutating ## the tests of polynomials, corridors, limits and certificates, on changed code; MUTANTS='minsnap.limits.*' is a part
	MPLBACKEND=agg OPENBLAS_NUM_THREADS=1 $(BIN)/mutmut run --max-children $(or $(JOBS),1) $(if $(MUTANTS),'$(MUTANTS)')
	$(BIN)/mutmut results | grep -v 'not checked'

lint: $(VENV)/developing ## ruff, mypy, clang-format, and clang's warnings where it is installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	git ls-files -z 'minsnap/native/src/*pp' 'ros/*.?pp' 'tests/cpp/ros/*' | xargs -0 $(BIN)/clang-format --dry-run -Werror
	command -v clang++ >/dev/null || exit 0; git ls-files -z 'minsnap/native/src/*.cpp' 'tests/cpp/*.cpp' ':!tests/cpp/ros' 'examples/cpp/*.cpp' | xargs -0 -n 1 clang++ \
		-std=c++17 -fsyntax-only -fno-exceptions -fno-rtti -Wall -Wextra -Wno-psabi -Werror -Iminsnap/native/src -Iminsnap/native/include

docs: $(VENV)/developing ## the documentation, in docs/_build/html
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

figures: $(VENV)/developing ## the pictures of the documentation, from the examples
	$(BIN)/python docs/make_figures.py

bench: $(VENV)/benchmarking ## the benchmarks
	for script in benchmarks/bench_*.py; do echo "# $$script"; $(BIN)/python $$script || exit 1; done

clean: ## remove what was made
	rm -rf $(VENV) out build dist mutants docs/_build .mypy_cache .pytest_cache .ruff_cache .hypothesis

$(VENV)/made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo "minsnap needs Python 3.10 or newer; name one with 'make PYTHON=python3.12'" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo "This Python cannot make a virtual environment: on Debian or Ubuntu, 'apt-get install python3-venv' adds it" >&2; exit 1; }
	@$(BIN)/python -m pip --disable-pip-version-check install --quiet 'pip>=21.3' # older ones install no checkout in place
	@touch $@

$(VENV)/installed: $(VENV)/made pyproject.toml constraints.txt
	@echo "installing minsnap; compiling its native core takes a few minutes"
	$(PIP) --editable .
	@touch $@

$(VENV)/developing: $(VENV)/made pyproject.toml constraints.txt
	MINSNAP_CXXFLAGS=-Werror $(PIP) --editable '.[test]'
	$(PIP) --no-deps cflib pyusb libusb-package importlib_resources # cflib asks for a packaging that others have left behind
	@touch $@ $(VENV)/installed

$(VENV)/benchmarking: $(VENV)/developing
	$(PIP) --editable '.[bench]'
	@touch $@

$(VENV)/releasing: $(VENV)/developing
	$(PIP) --editable '.[release]'
	@touch $@

$(VENV)/mutating: $(VENV)/developing
	$(PIP) --editable '.[mutation]'
	@touch $@
