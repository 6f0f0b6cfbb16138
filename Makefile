# Two commands for a fresh machine: `make demo` and `make test`. Needs Python 3.11+, make and a C compiler.
PYTHON ?= python3
PORT   ?= bench:
JOBS   ?= 3
VENV   := .venv
BIN    := $(VENV)/bin
PT     := $(BIN)/pulsetrainer
D      := build/demo

FIRMWARE := $(shell find firmware -name '*.[ch]')
CORE     := $(wildcard pulsetrainer/core/*.py)
DIAGNOSE := $(wildcard pulsetrainer/diagnosis/*.py pulsetrainer/diagnosis/causes/*.py) pulsetrainer/steps/diagnose.py
REPORT   := $(wildcard pulsetrainer/report/*.py pulsetrainer/report/templates/*) pulsetrainer/steps/evaluate.py
PULSES   := normal bifid
METHODS  := paper continuous extended
PLAYED   := $(foreach m,$(METHODS),$(foreach p,$(PULSES),$(D)/played-$(p)-$(m).h5))

# What breaks off while it is recorded is kept, as the program says, but under a name that is no target: make
# would delete it, or take it for whole.
RECORDING = $(@:.h5=-recording.h5)
.DELETE_ON_ERROR:
.SECONDARY:
.PHONY: install demo ideal test test-slow lint faults bench mutate blind docs site bounds firmware-mps2 firmware-cost clean help

help:  ## say what there is
	@grep -E '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 16

# act one: the paper's method and the continuous inverse; act two: what the model gets wrong, extended, played again
demo: $(D)/report.html $(D)/diagnosis.html $(D)/prediction.h5  ## the whole chain, twice: as identified, and extended by what a diagnosis finds
	@$(PT) evaluate $(PLAYED)
	@$(PT) evaluate $(D)/unseen.h5 --model $(D)/model-continuous.h5 --model $(D)/model-extended.h5
	@echo "open in a browser: $(D)/report.html $(D)/diagnosis.html"

# --- set-up -----------------------------------------------------------------------------------------
$(VENV)/installed: pyproject.toml
	@echo "making $(VENV), a Python environment of its own"
	@$(PYTHON) -m venv $(VENV)
	@echo "downloading and installing pulsetrainer and its libraries (numpy, scipy, matplotlib, h5py ...): a minute or two"
	@$(BIN)/pip install --quiet --disable-pip-version-check --editable .
	@touch $@
	@echo "done; now: . $(BIN)/activate"

# what the tests need holds what the program needs: on a fresh machine all of it in one go
$(VENV)/installed-test: pyproject.toml
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "downloading and installing pulsetrainer with what its tests need into $(VENV): a minute or two"
	@$(BIN)/pip install --quiet --disable-pip-version-check --use-pep517 --editable '.[test]'
	@touch $(VENV)/installed $@

install: $(VENV)/installed  ## the program into .venv

# --- the main job: a rule a file; only what is stale is made again ------------------------------------
$(D):
	mkdir -p $@

$(D)/run.h5: $(FIRMWARE) pulsetrainer/core/excitations.py | $(VENV)/installed $(D)
	$(PT) capture identification --port '$(PORT)' -o $(RECORDING) --overwrite && mv $(RECORDING) $@

# the paper: relays, closest match, spline; ours: continuous reading, exact inverse
$(D)/model-paper.h5: $(D)/run.h5 $(CORE)
	$(PT) identify $< --reading relay -o $@ --overwrite
$(D)/model-continuous.h5: $(D)/run.h5 $(CORE)
	$(PT) identify $< --reading continuous -o $@ --overwrite

# the second act: the same device, not told what it hides, on a signal that tells causes apart
$(D)/diagnostic.h5: $(FIRMWARE) pulsetrainer/core/excitations.py | $(VENV)/installed $(D)
	$(PT) capture diagnostic --port '$(PORT)' -o $(RECORDING) --overwrite && mv $(RECORDING) $@
$(D)/diagnosis.h5 $(D)/diagnosis.html &: $(D)/diagnostic.h5 $(D)/model-continuous.h5 $(DIAGNOSE)
	$(PT) diagnose $< --model $(D)/model-continuous.h5 -o $(D)/diagnosis.h5 --html $(D)/diagnosis.html --overwrite
$(D)/model-extended.h5: $(D)/diagnosis.h5 $(D)/model-continuous.h5
	$(PT) extend $< --model $(D)/model-continuous.h5 -o $@ --overwrite
# a run that neither model was fitted to, at the rate of a pulse
$(D)/unseen.h5: $(FIRMWARE) pulsetrainer/core/excitations.py | $(VENV)/installed $(D)
	$(PT) capture identification --speed 6 --port '$(PORT)' -o $(RECORDING) --overwrite && mv $(RECORDING) $@

define PULSE_RULES
$(D)/drive-$(1)-$(2).h5: $(D)/model-$(2).h5 waveforms/$(1).csv pulsetrainer/steps/invert.py
	$(PT) invert $(1) --model $$< -o $$@ --overwrite
$(D)/played-$(1)-$(2).h5: $(D)/drive-$(1)-$(2).h5 $(FIRMWARE)
	$(PT) play $$< --port '$(PORT)' -o $$(RECORDING) --overwrite && mv $$(RECORDING) $$@
endef
$(foreach m,$(METHODS),$(foreach p,$(PULSES),$(eval $(call PULSE_RULES,$(p),$(m)))))

$(D)/evaluation.h5 $(D)/report.html &: $(PLAYED) $(REPORT)
	$(PT) evaluate $(PLAYED) -o $(D)/evaluation.h5 --html $(D)/report.html --overwrite > /dev/null

$(D)/prediction.h5: $(D)/unseen.h5 $(D)/model-continuous.h5 $(D)/model-extended.h5
	$(PT) evaluate $< --model $(D)/model-continuous.h5 --model $(D)/model-extended.h5 -o $@ --overwrite > /dev/null

# static hysteresis and sensor noise only: what the continuous inverse itself leaves
ideal: $(VENV)/installed
	$(MAKE) D=build/ideal PORT='bench:?ideal' METHODS=continuous build/ideal/evaluation.h5

bounds: $(D)/report.html tests/regression/bounds.toml  ## hold the demo's figures against their bounds
	$(PT) evaluate $(PLAYED) --bounds tests/regression/bounds.toml

# --- checks -------------------------------------------------------------------------------------------
# An emulator that keeps pace with the wall clock needs half a processor, so two at a time and nothing else. The other
# tests wait for each other's devices a fifth of their time: a worker more than the two processors fills that.
# What one start has compiled serves the others, whatever the environment says.
REALTIME := tests/cli tests/link
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest
test: $(VENV)/installed-test  ## every part of the program, in a few minutes
	$(PYTEST) -m "realtime and not slow" $(REALTIME) -n 2 --dist worksteal
	$(PYTEST) -m "not realtime and not slow" -n $(JOBS) --dist worksteal

test-slow: $(VENV)/installed-test  ## the tests that are left: long records, whole chains, every fault of the emulated device; laws on more examples
	$(PYTEST) -m "realtime and slow" $(REALTIME)
	$(PYTEST) -m "not realtime and slow" -n $(JOBS) --dist worksteal
	HYPOTHESIS_PROFILE=full $(PYTEST) tests/law -n $(JOBS) --dist worksteal

lint: $(VENV)/installed-test  ## style, types, import contracts
	$(BIN)/ruff check --output-format=concise .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

faults: $(VENV)/installed-test  ## kill -9, full disks, damaged files, fuzzing: hundreds of tries, one table
	$(BIN)/python tests/faults/run.py --tries $(or $(TRIES),560) --seed $(or $(SEED),1)

bench: $(VENV)/installed-test  ## speed and memory, as ratios in one run
	$(BIN)/python -m pytest benchmarks -p no:xdist --timeout=0 -s

mutate: $(VENV)/installed-test  ## whether the tests notice small faults in PACKAGE (core): COUNT of them (40) by SEED (1)
	$(BIN)/python tests/mutation/mutate.py $(or $(PACKAGE),core) --seed $(or $(SEED),1) --count $(or $(COUNT),40)

blind: $(VENV)/installed-test  ## the full blind grid of the diagnosis on all cores (hours of processor time)
	$(BIN)/python tests/blind/run.py -o build/blind.h5

ARM_TOOLS := arm-none-eabi-gcc qemu-system-arm
firmware-mps2 firmware-cost: arm-tools

.PHONY: arm-tools
arm-tools:
	@for tool in $(ARM_TOOLS); do command -v $$tool > /dev/null || { echo "$$tool is not there; on Debian:" \
	"sudo apt-get install -y --no-install-recommends gcc-arm-none-eabi qemu-system-arm" >&2; exit 1; }; done

docs: $(VENV)/installed-test $(D)/evaluation.h5 $(D)/prediction.h5 ideal  ## the reference pages, off the code; the README's figures, off the demo
	$(BIN)/python docs/demo.py $(D)/evaluation.h5 $(D)/prediction.h5 build/ideal/evaluation.h5
	$(BIN)/python docs/make.py
	$(BIN)/python docs/figures.py

site: $(VENV)/installed-test  ## the documentation as a site in build/site, which fetches nothing
	$(BIN)/python docs/site.py --run
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --config-file build/mkdocs.yml
	@echo "site: build/site/index.html; with its search: $(BIN)/python -m http.server -d build/site"

firmware-mps2:  ## the firmware for the emulated Cortex-M4F (Debian: gcc-arm-none-eabi, qemu-system-arm)
	$(MAKE) -C firmware mps2

firmware-cost:  ## cycles of the control interrupt, RAM and flash, on the emulated Cortex-M4F
	$(MAKE) -C firmware cost

clean:  ## remove what was built
	rm -rf build $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis
