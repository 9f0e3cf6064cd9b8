# The two commands of the README: `make demo` and `make test`. `make help` lists the rest.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

BODY := .cache/tryon/body.npz
WEB := server/tryon_server/web/.built
WEB_SOURCES := $(shell find protocol/ts clients/core clients/web -name '*.ts' -not -path '*/node_modules/*' -o -name '*.css' \
	-not -path '*/node_modules/*' -o -name '*.html' -not -path '*/node_modules/*' -o -name '*.mjs' -not -path '*/node_modules/*')

.PHONY: help demo test long check chromium proof edits edits-page effects effects-page effects-together-page outfits outfits-page fabrics-page accuracy accuracy-page hard hard-peers hard-page bench bench-page reference precision lock
help:
	@grep -hE '^## ' $(MAKEFILE_LIST) | sed 's/## //'

## make demo     build everything and serve a T-shirt on a walking body at http://127.0.0.1:8000
demo: $(VENV)/.runtime $(BODY) $(WEB)
	$(BIN)/tryon serve

test long: export PYTHONDONTWRITEBYTECODE =  # modules are compiled once, and not by every process that a test begins
## make test     run the tests (Python, TypeScript, browser) but the long ones; installs Chromium where it may
test: $(VENV)/.dev $(BODY) $(WEB) chromium
	npm test --silent
	$(BIN)/python -m pytest -n 3 --dist loadfile -m "not long" --ignore tests/clients
	$(BIN)/python -m pytest -m "not long" tests/clients

## make long     run the tests that `make test` leaves out: whole matrices, long windows
long: $(VENV)/.dev $(BODY) $(WEB) chromium
	$(BIN)/python -m pytest -n 2 --dist loadfile -m long --ignore tests/clients
	$(BIN)/python -m pytest -m long tests/clients

PROOF :=
## make proof    all there is to show, frame by frame: a table in build/proof (meant to take under an hour on two cores)
# PROOF='--strangers FOLDER' adds clips and patterns of your own; other options: .venv/bin/python tests/proof --help
proof: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/proof --whole $(PROOF)

HARD :=
PRESET := live
## make hard     play and judge every hard case: a table in build/hard/live, 1 when a limit was broken (half an hour on two cores)
# PRESET=draft or fit; HARD='--scenes needle corner --seconds 2' and others: .venv/bin/python tests/hard_cases --help
hard: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/hard_cases --preset $(PRESET) --out build/hard/$(PRESET) $(HARD)

EDITS :=
## make edits    worn garments edited hundreds of times and judged: a table in build/edits (hours)
# EDITS='--garments tshirt --edits 40' and others: .venv/bin/python tests/edits --help
edits: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/edits $(EDITS)

PEERS := ours xpbd chebyshev vbd style3d
## make hard-peers  ten telling cases by other solvers, small: figures and pictures in docs/hard (two hours; gets Newton)
hard-peers: $(VENV)/.dev $(BODY)
	$(BIN)/python -m pip install --quiet --no-build-isolation -e '.[peers]'
	for solver in $(PEERS); do $(BIN)/python tests/hard_cases --solver $$solver --telling --vertices 300 --seconds 2.5 \
	--frames --longest 1800 --out build/hard/peers/$$solver || [ $$? = 1 ] || exit; done
	$(BIN)/python tests/hard_cases --compare docs/hard --of $(PEERS:%=build/hard/peers/%)

RUNS := live-cpu live-gpu draft-cpu draft-gpu fit-cpu fit-gpu
## make hard-page  docs/hard_cases.md of the runs kept in docs/hard/runs, side by side, with the worst of each figure
# To keep a run of yours there: cp build/hard/live/run.json docs/hard/runs/live-cpu.json
hard-page: $(VENV)/.dev
	$(BIN)/python tests/hard_cases --document docs/hard_cases.md --of $(RUNS:%=docs/hard/runs/%.json) \
	--beside docs/hard/peers.json || [ $$? = 1 ]

## make edits-page  docs/edits.md of the runs kept in docs/edits/runs
edits-page: $(VENV)/.dev
	$(BIN)/python tests/edits --document docs/edits.md --out docs/edits/runs || [ $$? = 1 ]

EFFECTS :=
## make effects  all effects together: scenes in which every pair of variants meets, judged: a table in build/effects (an hour on two cores)
# EFFECTS='--jobs 28', '--device cuda:0', '--scenes 3 7 --seconds 1' and others: .venv/bin/python tests/covering --help.
# What was cut off goes on where it was.
effects: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/covering $(EFFECTS)

## make effects-together-page  docs/effects_together.md of the runs kept in docs/effects/runs
# To keep a run of yours there: cp build/effects/scenes.jsonl docs/effects/runs/cpu.jsonl
effects-together-page: $(VENV)/.dev
	$(BIN)/python tests/covering --document docs/effects_together.md --of $(wildcard docs/effects/runs/*.jsonl) || [ $$? = 1 ]

## make effects-page  docs/effects.md: pictures of each effect, what it costs by the runs kept, a plain T-shirt before and now
# What it costs here: .venv/bin/python tests/support/effect_costs.py --vertices 33 --frames 60 --jobs 8 --out docs/effects/runs/costs-cpu.json
effects-page: $(VENV)/.dev
	$(BIN)/python tests/support/effect_pictures.py --out docs/effects --document docs/effects.md
	$(BIN)/python tests/support/effect_names.py --document docs/effects.md
	$(BIN)/python tests/support/effect_costs.py --document docs/effects.md --of $(wildcard docs/effects/runs/costs-*.json)
	$(BIN)/python tests/support/before_effects.py --document docs/effects.md

OUTFITS :=
## make outfits  three garments over each other in walk and squat, every frame judged, against one: build/outfits/run.json (ten minutes)
# OUTFITS='--vertices 10000 --device cuda:0 --preset live' and others: .venv/bin/python tests/outfits --help
outfits: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/outfits $(OUTFITS)

## make outfits-page  their tables in docs/effects.md, of the runs kept in docs/effects/runs
# To keep a run of yours there: cp build/outfits/run.json docs/effects/runs/outfits-cpu.json
outfits-page: $(VENV)/.dev
	$(BIN)/python tests/outfits --document docs/effects.md --of $(wildcard docs/effects/runs/outfits-*.json) || [ $$? = 1 ]

## make fabrics-page  docs/fabrics.md: how each fabric drapes and looks; measures those that are not in docs/fabrics/runs
fabrics-page: $(VENV)/.dev
	$(BIN)/python tests/fabrics --out docs/fabrics/runs
	$(BIN)/python tests/fabrics --out docs/fabrics/runs --document docs/fabrics.md

ACCURACY :=
## make accuracy  what accuracy costs: errors of steps against a float64 Newton IPC reference: build/accuracy (hours)
# ACCURACY='--states 12 --sweep --jobs 8', '--times --vertices 2500', '--tailor', '--device cuda:0' and others:
# .venv/bin/python tests/accuracy --help. What was cut off goes on where it was.
accuracy: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/accuracy $(ACCURACY)

## make accuracy-page  docs/accuracy.md of the runs kept in docs/accuracy/runs, with its plots
# To keep a run of yours there: cp build/accuracy/*.jsonl docs/accuracy/runs
accuracy-page: $(VENV)/.dev
	$(BIN)/python tests/accuracy --document docs/accuracy.md --out docs/accuracy/runs || [ $$? = 1 ]

BENCH :=
## make bench    time of a frame and where it goes, with judged frames: a table in build/bench (a few minutes)
# BENCH='--vertices 10000 20000 --device cuda:0' and others: .venv/bin/python solver/bench --help
bench: $(VENV)/.dev $(BODY)
	$(BIN)/python solver/bench $(BENCH)

BENCH_RUNS = $(wildcard docs/bench/runs/*.json)
## make bench-page  docs/bench.md of the runs kept in docs/bench/runs, side by side, with plots
# To keep a run of yours there: cp build/bench/results.json docs/bench/runs/NAME.json
bench-page: $(VENV)/.dev
	$(BIN)/python solver/bench --document docs/bench.md --of $(BENCH_RUNS) || [ $$? = 1 ]

REFERENCE = $(BIN)/python tests/reference && TRYON_FRAMES=300 $(BIN)/python -m pytest -q tests/solver/verification/test_determinism.py
## make reference hold contact scenes to full Newton in float64, two long runs to each other: part of the proof
reference: $(VENV)/.dev
	$(REFERENCE)

## make precision steps in float32 held to the same steps in float64: a table in build/precision.md
precision: $(VENV)/.dev $(BODY)
	$(BIN)/python tests/precision

## make check    lint, types, layering, generated files
check: $(VENV)/.dev node_modules/.built
	$(BIN)/ruff check solver server protocol clients/python scripts tests
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tryon_protocol.generate_ts --check
	npm run check --silent

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# A stamp is newer than its lock file, so an environment is brought up to date exactly when a lock changes.
$(VENV)/.runtime: requirements.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@
$(VENV)/.dev: requirements-dev.lock pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-dev.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@ $(VENV)/.runtime

$(BODY): scripts/make_body.py scripts/make_body.requirements.txt $(wildcard solver/tryon_solver/body/making/*.py) | $(VENV)/.runtime
	$(BIN)/python scripts/make_body.py
	touch $@

node_modules/.built: package-lock.json package.json
	npm ci --no-audit --no-fund --loglevel=error
	touch $@
$(WEB): node_modules/.built $(WEB_SOURCES)
	npm run build --silent
	touch $@

# The browser tests drive Debian's Chromium; elsewhere they look for one on the PATH and say so when there is none.
chromium:
	@command -v chromium chromium-browser google-chrome >/dev/null || [ -n "$$CHROMIUM" ] || \
	{ [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get update -qq && apt-get install -y -qq chromium; } || \
	echo "No Chromium found: the browser tests will be skipped. Install it, or set CHROMIUM to its path."

LOCK := uv pip compile --universal --python-version 3.10 --generate-hashes --no-header --no-emit-index-url --quiet
## make lock     rewrite the lock files from pyproject.toml (needs uv)
lock:
	$(LOCK) --extra dev --extra build pyproject.toml -o requirements-dev.lock
	$(LOCK) --extra build pyproject.toml -c requirements-dev.lock -o requirements.lock
