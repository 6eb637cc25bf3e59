# The two commands: `make run` and `make test`. Everything is installed into .venv, but for ROS 1, and a display and a
# browser for tests, which come with the system's packages, and ROS 2, which has a folder of its own.
PYTHON ?= python3
BIN := .venv/bin
# A module is compiled when it is first loaded: most of what is installed never is.
INSTALL := $(BIN)/python -m pip install --quiet --no-compile
# The Dockerfile installs a copy: SOURCE='.[video]'
SOURCE ?= --editable '.[video]'
# Of three workers one mostly waits, for ROS 1 (tests/support/schedule.py): enough for two cores.
JOBS ?= 3
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Hundreds of tests start Python, which would otherwise compile all that it loads each time.
unexport PYTHONDONTWRITEBYTECODE

# Asked before .venv is made: one of an older Python would be there to stay.
IS_NEW_ENOUGH := 'import sys; sys.version_info < (3, 11) and sys.exit("Python 3.11 or newer is needed, and this is \
%d.%d; name another: make PYTHON=python3.12" % tuple(sys.version_info[:2]))'

.PHONY: run lesson test quick dev hooks system debian ros1 ros2 display browser check collected docs bench soak hashes fuzz format clean

run: .venv/.installed
	$(BIN)/cellwright run lesson

# The ROS 1 class of 2017 in a minute or two: cell, program, score, and the picture lesson.png.
lesson: ros1 .venv/.installed
	scripts/lesson

# Packages of the system are fetched while those of Python are, and ROS 2 is built and the tests compiled while types are
# checked.
test:
	$(MAKE) --jobs=3 system check collected
	$(BIN)/pytest -n $(JOBS)

# What needs no ROS, browser or display, and takes little time.
quick: .venv/.installed-dev
	$(BIN)/pytest -n 2 -m "not ros1 and not browser and not display and not slow"

# The tools of tests and checks alone: nothing of the system's.
dev: .venv/.installed-dev

# Checks of each commit, in .git/hooks; .pre-commit-config.yaml lists them.
hooks: .venv/.installed-dev
	$(INSTALL) --group hooks
	$(BIN)/pre-commit install

# ROS 2 last: pip installs it, which the tools of tests upgrade first. Clients of Kilted use most interfaces of Jazzy, so that
# little is built for them; a folder that is named is Jazzy's.
system: debian .venv/.installed-dev
	scripts/install-ros2
	env -u CELLWRIGHT_ROS2_HOME scripts/install-ros2 kilted --interfaces jazzy

# One after the other: dpkg locks its database.
debian:
	$(MAKE) ros1
	$(MAKE) display
	$(MAKE) browser

# Every test read and none run: else each worker has to compile them all for itself. What cannot be read the run tells.
collected: .venv/.installed-dev
	-@$(BIN)/pytest --collect-only --quiet --quiet > /dev/null

# Into the system, and only where that is allowed without asking; tests of it are skipped where it is not.
ros1:
	scripts/install-ros1

# Into the user's data, with interfaces that are built once; for tools to build them as ROS 1.
ros2: .venv/.installed
	scripts/install-ros2

# Into the system, too: a display without a screen, for tests of windows.
display:
	scripts/install-display

# And a browser, for tests of the page.
browser:
	scripts/install-browser

check: .venv/.installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tools.prose
	$(BIN)/python -m tools.house

# The documentation as a site, in site/; a link that leads nowhere is an error.
docs: .venv/.installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "site/index.html; with its search: $(BIN)/python -m http.server -d site"

# What things cost: to be read on a machine that has nothing else to do. AGAINST is the folder of another checkout.
bench: .venv/.installed-dev
	$(BIN)/python -m benchmarks --write docs/benchmarks.md $(if $(AGAINST),--against "$(AGAINST)")

# Ten simulated hours of a cell and of a robot: is memory flat, and the state that of the same run cut into restores?
HOURS ?= 10
soak: .venv/.installed
	$(BIN)/python -m benchmarks.soak --hours $(HOURS) --picture soak.svg

# Are the state hashes of all bundled trials and tasks what tests/data/state_hashes.json says?
hashes: .venv/.installed
	$(BIN)/python -m tests.state_hashes

# Random and hostile files, for a minute each reader or as long as SECONDS says; TARGETS names some of them.
SECONDS ?= 60
fuzz: .venv/.installed-dev
	$(BIN)/python -m fuzz --seconds $(SECONDS) $(TARGETS)

format: .venv/.installed-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# A .venv without pip is one whose making failed (Debian needs python3-venv for it): it is made again.
.venv/.installed: pyproject.toml
	@test -x $(BIN)/pip || $(PYTHON) -c $(IS_NEW_ENOUGH)
	test -x $(BIN)/pip || $(PYTHON) -m venv --clear .venv
	$(INSTALL) $(SOURCE)
	@touch $@

# Debian's pip 23.0 knows no --group.
.venv/.installed-dev: .venv/.installed
	$(INSTALL) --upgrade "pip>=25.1"
	$(INSTALL) --group dev
	@touch $@

clean:
	rm -rf .venv build dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
