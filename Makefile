# Every target sets itself up from the registries; nothing but Rust and Python is needed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out

.PHONY: demo test test-slow bench lint experiments experiments-full thesis wheel clean

# Build the wheel, install it as a user would, and run the main job on the simulated room.
demo: $(VENV)/installed-wheel
	$(BIN)/sphereflow demo --out $(OUT)/demo --rrd $(OUT)/demo/demo.rrd --overwrite

# All tests, Rust and Python. Tests on recordings read SPHEREFLOW_DATA and skip where it is unset.
test: $(VENV)/installed-dev
	cargo test -q
	$(BIN)/python -m pytest

# What takes minutes, each with its reason beside it: `#[ignore = "slow: ..."]` and `mark.slow`.
test-slow: $(VENV)/installed-dev
	cargo test -q -- --ignored
	$(BIN)/python -m pytest -m slow

bench:
	cargo bench

# Formatting, lints, types, and the documents that must be true.
lint: $(VENV)/installed-dev
	cargo fmt --all --check
	cargo clippy --workspace --all-targets -q -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps -q
	@if cargo deny --version >/dev/null 2>&1; then cargo deny check bans licenses sources; \
	else echo "cargo-deny is not installed: bans, licences and sources are not checked"; fi
	$(PYTHON) tools/file_rules.py
	$(BIN)/ruff format --check python tests tools examples benches
	$(BIN)/ruff check python tests tools examples benches
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest sphereflow._native
	$(BIN)/python tools/thesis_map.py --check
	$(BIN)/python tools/thesis_pages.py

# Each figure is drawn by one script in benches/experiments, with its curves beside it: small ones to
# $(OUT)/experiments, those of docs/figures at the full size (an hour).
experiments: $(VENV)/installed-dev
	$(BIN)/python benches/experiments/run_all.py --out $(OUT)/experiments

experiments-full: $(VENV)/installed-dev
	$(BIN)/python benches/experiments/run_all.py --full --out docs/figures

thesis: $(VENV)/installed-dev
	$(BIN)/python tools/thesis_map.py

wheel: $(VENV)/created
	$(BIN)/pip install -q "maturin>=1.16,<2"
	$(BIN)/maturin build --release --out dist

RUST_SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
PYTHON_SOURCES := $(shell find python -name '*.py' -o -name '*.pyi')

$(VENV)/created:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --upgrade pip
	touch $@

# A real wheel with the extras that the demo shows.
$(VENV)/installed-wheel: $(VENV)/created pyproject.toml $(RUST_SOURCES) $(PYTHON_SOURCES)
	$(BIN)/pip install ".[viz,plot]"
	rm -f $(VENV)/installed-dev
	touch $@

# The same, editable, with what the tests need.
$(VENV)/installed-dev: $(VENV)/created pyproject.toml $(RUST_SOURCES)
	$(BIN)/pip install -e ".[dev]"
	rm -f $(VENV)/installed-wheel
	touch $@

clean:
	rm -rf $(VENV) target dist
