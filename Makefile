# make trial    set up, run the throttle sweep on the virtual motorcycle, identify it
# make test     set up, then the whole check
# make vcan     set up, then whole rides on a real kernel's bus (minutes)
# make conformance  set up, then python-can's own tests on our virtual bus
# make paper    set up, then Corno and Savaresi's findings, claim by claim
# make prove    set up, then the proof on sealed cases: hours; goes on where it was stopped
# make mutants  set up, then coverage of the safety gate and mutants from there to the wire
# make fuzz     set up, then 2 000 random commands and files: no traceback, no hang
# make pythons  a fast part of the suite on each Python from 3.11 on that the machine has
# make million  set up, then a million random frame sequences through it (half an hour of processor)
# make faults   set up, then docs/fault_matrix.md, and the same on a real kernel's bus (minutes)
# make bench    set up, then every benchmark
# make accuracy write docs/accuracy.md from rides whose truth is known
# make peers    write docs/peers.md: identification beside other packages
# make thousand a thousand randomised rides under slip control (minutes)
# make controllers  design a controller of each kind and compare them: docs/controllers.md
# make real-recordings  explain recordings that others published (tens of minutes)
# make lock     choose the newest versions that pyproject.toml allows
# make clean    forget the environment and everything that was made, except runs/

.PHONY: help real-recordings trial test conformance figures test-mismatch paper prove prove-quick mutants million faults bench accuracy lock setup clean
.DEFAULT_GOAL := help

# The first interpreter that is new enough; the lock is tested with 3.11.
PYTHON ?= $(shell .ci/find-python)
ENVIRONMENT := .venv
IN := $(ENVIRONMENT)/bin
READY := $(ENVIRONMENT)/.ready
WORKERS ?= auto
# Libraries that start a thread per core on top of that only get in each other's way.
export OMP_NUM_THREADS ?= 1

help:
	@sed -n 's/^# make/make/p' $(firstword $(MAKEFILE_LIST))

trial: setup
	@run=$$($(IN)/slipbench trial examples/trials/throttle_sweep.toml) && $(IN)/slipbench identify "$$run"

test: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist loadscope $(TESTS)

# python-can's own tests, from its source distribution, judge our virtual bus.
conformance: setup
	$(IN)/python -m tests.conformance.judge

# The README's picture, from the recording of `make trial`.
figures: trial
	$(IN)/slipbench identify "$$(ls -d runs/throttle_sweep-* | tail -1)" --figures build/figures
	cp build/figures/response.png docs/figures/throttle_sweep_response.png
	cp build/figures/overview.png docs/figures/throttle_sweep_overview.png

# Recovery by the mismatch engine; it takes minutes and is not part of `make test`.
test-mismatch: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist load -o addopts=-ra tests/identification/mismatch

# Whole rides on a real kernel's bus.
.PHONY: vcan
vcan: setup
	$(IN)/python -m pytest -o addopts=-ra tests/socketcan/test_rides.py

paper: setup
	$(IN)/slipbench paper --out paper --runs paper/runs --document docs/paper.md

# Half of the cases miss nothing. CASES and SEED choose another study, for which PROOF is its folder.
CASES ?= 200
SEED ?= 2026
PROOF ?= proof/$(SEED)-$(CASES)
prove: setup
	$(IN)/slipbench prove --cases $(CASES) --seed $(SEED) --out $(PROOF) --page docs/blind_validation.md

# Six cases, to see that all of it works; their table means nothing.
prove-quick: setup
	$(IN)/slipbench prove --cases 6 --seed 1 --out build/prove-quick

# Sweeps of the demonstration motorcycle, a controller of each kind on them, and how they compare.
.PHONY: controllers
controllers: setup
	rm -rf build/controllers && mkdir -p build/controllers
	$(IN)/slipbench trial examples/trials/throttle_sweep.toml --out build/controllers/throttle_sweep
	$(IN)/slipbench trial examples/trials/spark_sweep.toml --out build/controllers/spark_sweep
	for actuator in throttle spark mixed; do \
	  $(IN)/slipbench design build/controllers/throttle_sweep build/controllers/spark_sweep \
	    --actuator $$actuator --out examples/controllers/$$actuator.toml \
	    --report build/controllers/$$actuator || exit 1; done
	for actuator in throttle spark; do \
	  $(IN)/slipbench design build/controllers/throttle_sweep build/controllers/spark_sweep \
	    --actuator $$actuator --law h_infinity \
	    --out examples/controllers/$${actuator}_h_infinity.toml \
	    --report build/controllers/$${actuator}_h_infinity || exit 1; done
	$(IN)/slipbench compare $(foreach name,throttle spark mixed throttle_h_infinity \
	  spark_h_infinity,examples/controllers/$(name).toml) --page docs/controllers.md

# Randomised rides under slip control, every command before the safety gate: about ten minutes.
.PHONY: thousand
thousand: setup
	$(IN)/python -m tests.identification.closed_loop_simulation.randomised 1000 1

mutants: setup
	$(IN)/python -m tests.mutants

million: setup
	$(IN)/python -m tests.bench.safety.sequences

# A grammar over every command and file; the seed is the second number.
.PHONY: fuzz
fuzz: setup
	$(IN)/python -m tests.hostile.fuzz 2000 1

# Environments below build/, one for each interpreter.
.PHONY: pythons
pythons:
	.ci/on-each-python

faults: setup
	$(IN)/python -m tests.faults.matrix
	$(IN)/python -m tests.faults.on_vcan

# docs/peers.md: what a user would take from PyPI for the step from samples to a model, beside ours.
.PHONY: peers
peers: setup build/peers/.ready
	PYTHONPATH=build/peers $(IN)/python benchmarks/peers.py 5 --out docs/peers.md

# docs/accuracy.md: 200 rides of every row, a quarter of an hour; goes on where it was stopped.
accuracy: setup
	$(IN)/python benchmarks/accuracy.py 200 --out docs/accuracy.md

bench: setup build/peers/.ready
	@for benchmark in benchmarks/*.py; do \
	  echo "== $$benchmark"; PYTHONPATH=build/peers $(IN)/python $$benchmark || exit 1; done

# Libraries that we are compared with, beside the environment; what cannot be had is named as absent.
build/peers/.ready: benchmarks/peers.txt | $(READY)
	-$(IN)/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade \
	  --target build/peers --requirement benchmarks/peers.txt
	@mkdir -p build/peers && touch $@

# The same as a page; cyclictest is measured where it is installed.
.PHONY: bench-page
bench-page: setup build/peers/.ready
	mkdir -p build && cd benchmarks && \
	  PYTHONPATH=../build/peers ../$(IN)/python -m timing.page > ../build/benchmarks.md
	mv build/benchmarks.md docs/benchmarks.md

# The test files of libraries that judge ours (cantools' own databases).
.PHONY: sources
sources: setup
	PYTHON=$(IN)/python .ci/fetch-sources

# What real recordings conceal, explained; takes tens of minutes. RECORDINGS: their folder.
RECORDINGS ?= ../shared/recordings
real-recordings: setup
	$(IN)/python -m benchmarks.real.run $(RECORDINGS)

setup: $(READY)

# Every version and every hash comes from the lock, what builds the project included.
$(READY): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { .ci/find-python; exit 1; }
	test -x $(IN)/python || $(PYTHON) -m venv $(ENVIRONMENT)
	$(IN)/python -m pip install --quiet --disable-pip-version-check \
	  --require-hashes --requirement requirements.lock
	PYTHONWARNINGS=ignore $(IN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-build-isolation --no-deps --editable .
	@touch $@

lock: | $(READY)
	PYTHON=$(IN)/python .ci/lock

clean:
	rm -rf $(ENVIRONMENT) build mutants *.egg-info
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
