# Two commands do all the set-up: `make demo` and `make test`. They need Python 3.11 or newer and make.
PYTHON ?= python3
BIN := .venv/bin
# Python compiles what it imports; compiling everything ahead is half of the time of an install.
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet --no-compile
# So what is imported must be kept compiled: where the environment forbids it, each process would compile it again.
unexport PYTHONDONTWRITEBYTECODE
INPUTS := pyproject.toml requirements/build.in

# What `make robustness` compares.
CONTROLLERS := ik ik-cautious ik-sensed thesis-ik rl

.PHONY: demo test release cluster pages fuzz sweep robustness bench engines learn ship study compare picture docs docs-links lock family

demo: .venv/.run
	$(BIN)/inhand asterisk --out results/demo --overwrite

test: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy -n 2
	$(BIN)/lint-imports
	OMP_NUM_THREADS=1 $(BIN)/pytest  # two workers have a core each: threads of BLAS would fight for them

# The pages for a browser in Chromium, which must be there, with chromedriver.
pages: .venv/.dev
	$(BIN)/pytest -n 0 tests/test_page.py tests/test_browser.py

# 2,000 bad inputs, other ones each time: minutes.
fuzz: .venv/.dev
	$(BIN)/pytest -n 2 --hypothesis-profile fuzz tests/test_fuzz.py

# Wheel and sdist in empty environments, oldest and newest requirements, every Python that is here, a notebook: 10 minutes.
# Needs uv and a package index.
release: .venv/.dev
	.ci/release

# A real Ray, Dask and submitit on this machine, each with two workers of which one is killed: some 400 MB, a minute.
cluster: .venv/.dev
	$(BIN)/python -m venv .venv-cluster
	.venv-cluster/bin/python -m pip --disable-pip-version-check install --quiet --editable '.[ray,dask,slurm]' pytest hypothesis
	PYTHONPATH=tests OMP_NUM_THREADS=1 .venv-cluster/bin/python -m pytest -p no:cacheprovider --override-ini addopts= \
		--override-ini filterwarnings= tests/test_clusters.py

sweep: .venv/.run
	$(BIN)/inhand sweep

# 1,008 trials a level and strength, 192 a single quantity, in starts and worlds that no plan has seen: half an hour.
robustness: .venv/.run
	$(BIN)/inhand robustness --controllers $(CONTROLLERS) --disturbances levels --trials 63 --seed 11 --out results/levels
	$(BIN)/inhand robustness --controllers $(CONTROLLERS) --disturbances singles --curves --trials 12 --seed 11 --out results/singles

bench: .venv/.dev
	$(BIN)/python benchmarks/stepping.py
	$(BIN)/python benchmarks/engines.py
	$(BIN)/python benchmarks/decisions.py
	$(BIN)/python benchmarks/environments.py
	$(BIN)/python benchmarks/reach_time.py
	$(BIN)/python benchmarks/rehearsal.py
	$(BIN)/python benchmarks/disturbed.py
	$(BIN)/python benchmarks/contacts.py
	$(BIN)/python benchmarks/planning.py
	$(BIN)/python benchmarks/mixed_hands.py
	$(BIN)/python benchmarks/report_time.py
	$(BIN)/python benchmarks/before.py

# PyBullet against MuJoCo: a minute, then hours on one core for 480 trials each of three controllers.
engines: .venv/.dev
	$(BIN)/python benchmarks/matching.py
	$(BIN)/python benchmarks/gap.py --keep results/gap --out results/gap/gap.png

# Trains every row of the learning tables: hours.
learn: .venv/.dev
	$(BIN)/python benchmarks/learning.py --groups privileged given thesis ablations stages

# Trains the policies that ship and puts them, with their cards, where they ship from: minutes.
ship: .venv/.dev
	$(BIN)/inhand train --out results/ship --overwrite
	cp results/ship/best/actor.json results/ship/best/actor.safetensors results/ship/config.json src/inhand/policies/default
	rm -f src/inhand/policies/default/risk.safetensors  # of the policy before
	$(BIN)/inhand train --preset privileged --seed 1 --out results/privileged --overwrite
	cp results/privileged/best/actor.json results/privileged/best/actor.safetensors results/privileged/config.json src/inhand/policies/privileged
	$(BIN)/inhand train --preset family --out results/ship-family --overwrite
	cp results/ship-family/best/actor.json results/ship-family/best/actor.safetensors results/ship-family/config.json src/inhand/policies/family
	$(BIN)/inhand train --preset family-privileged --out results/family-privileged --overwrite
	cp results/family-privileged/best/actor.json results/family-privileged/best/actor.safetensors results/family-privileged/config.json src/inhand/policies/family-privileged
	$(BIN)/inhand train --preset spatial-privileged --out results/space-privileged --overwrite
	cp results/space-privileged/best/actor.json results/space-privileged/best/actor.safetensors results/space-privileged/config.json src/inhand/policies/spatial-privileged
	$(BIN)/inhand train --preset spatial --seed 2 --out results/space --overwrite
	cp results/space/best/actor.json results/space/best/actor.safetensors results/space/config.json src/inhand/policies/spatial
	$(BIN)/python studies/plans.py
	$(BIN)/python studies/feel.py --out src/inhand/policies/default

study: .venv/.run
	$(BIN)/python benchmarks/expert.py
	$(BIN)/python benchmarks/sequences.py

# Policies with 12 hands and 10 objects that they never saw, beside each hand's own expert: on perfect knowledge, ten core
# minutes; on real senses, undisturbed and at field, along four directions and both turns, an hour of a core in all.
SOME := --directions Out,Right,In-Left,"Out'-Left'",twist --new
family: .venv/.dev
	$(BIN)/python studies/family.py --policy rl-family-privileged
	$(BIN)/python studies/family.py $(SOME) --out results/family-sensed
	$(BIN)/python studies/family.py $(SOME) --disturb field --out results/family-sensed-field

# Structured against end to end: hours.
compare: .venv/.dev
	$(BIN)/python studies/compare.py

# The pictures of the first page and of the concepts.
picture: .venv/.run
	$(BIN)/python docs/draw_picture.py
	$(BIN)/python docs/draw_concepts.py
	$(BIN)/python docs/draw_frames.py

# The site, in build/docs/index.html; a warning is an error. `docs-links` asks the network for every link outside.
SPHINX := $(BIN)/python -m sphinx -q -W --keep-going -n
docs: .venv/.docs
	$(SPHINX) -b html docs build/docs

docs-links: .venv/.docs
	$(SPHINX) -b linkcheck docs build/links

.venv/.run: pyproject.toml requirements/run.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "inhand needs Python 3.11 or newer: make PYTHON=python3.11 ...")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(PIP) --no-deps --require-hashes -r requirements/run.txt
	$(PIP) --no-deps --no-build-isolation --editable .
	touch $@

# While one core unpacks, the other compiles the kernels that tests would wait for.
.venv/.dev: .venv/.run requirements/dev.txt
	$(BIN)/inhand asterisk --directions Right --trials 1 --quiet --out "$$(mktemp -d)/first" & first=$$!; \
	$(PIP) --no-deps --require-hashes -r requirements/dev.txt && { wait $$first || true; }
	touch $@

.venv/.docs: .venv/.run requirements/docs.txt
	$(PIP) --no-deps --require-hashes -r requirements/docs.txt
	touch $@

# Needs uv. mink asks for the full `mujoco`; the lock leaves that and its viewers out (docs/design.md).
LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate
lock:
	$(LOCK) $(INPUTS) --output-file requirements/run.txt
	$(LOCK) $(INPUTS) --extra dev --extra bullet --extra design --extra dxf --extra lerobot --extra onnx --extra rl --constraints requirements/run.txt --overrides requirements/overrides.txt \
		$(addprefix --no-emit-package ,mujoco mujoco-studio glfw pyopengl websockets) --output-file requirements/dev.txt
	$(LOCK) --group docs --constraints requirements/dev.txt --output-file requirements/docs.txt
