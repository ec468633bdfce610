# Two commands do everything: `make demo` and `make test`.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

.PHONY: demo test lint types profiles figures cost bench fuzz clean

# The environment is remade when the dependencies change.
$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@

demo: $(VENV)/installed
	$(BIN)/iccbrdf demo -o demo --force

# Where Python may not keep what it compiles, each worker and each command that a test starts does it anew.
test: lint types
	env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest

lint: $(VENV)/installed
	$(BIN)/ruff check .

types: $(VENV)/installed
	$(BIN)/mypy

# What is made of other files in the repository and lies in it all the same.
profiles: $(VENV)/installed
	$(BIN)/python tools/make_profiles.py

figures: demo
	$(BIN)/python tools/make_figures.py
	$(BIN)/python tools/report_colour_mid.py

# Ratios only: absolute times are those of the machine.  Minutes, and 8 GB of disk for a while.
bench: $(VENV)/installed
	$(BIN)/python tools/bench.py
	$(BIN)/python tools/bench_fit.py

cost: $(VENV)/installed
	$(BIN)/python tools/make_cost.py

# Hours, if one likes.
fuzz: $(VENV)/installed
	$(BIN)/python tools/hard_cases.py
	PYTHONPATH=tests $(BIN)/python -m fuzz --summary docs/fuzz.md

clean:
	rm -rf $(VENV) demo build *.egg-info .mypy_cache .ruff_cache .pytest_cache
