# Every target does its own set-up first; once that is done it costs a moment.
#
#   make demo ARGS="--scenes 5 --seed 3"      options for the command behind the target
#   make demo PYTHON=/path/to/python3.12      another interpreter
#   make lock ARGS=--upgrade                  newest versions of the dependencies

.DEFAULT_GOAL := help
.PHONY: help setup demo test lint bench soak msg_defs lock check_installs clean distclean
SHELL := bash
python := .venv/bin/python
export PYTHON

# Another environment's libraries (an activated one, or an apt ROS 2) must not mix with ours.
ifneq ($(AMENT_PREFIX_PATH)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport LD_LIBRARY_PATH
endif
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH RMW_IMPLEMENTATION

help: ## this list
	@awk -F ':.*## ' '/^[a-z_]+:.*## / {printf "make %-16s %s\n", $$1, $$2}' Makefile

setup: ## .venv with all dependencies, system libraries if missing
	@tools/setup.sh

demo: setup ## real nodes look at simulated scenes; ends with a report in runs/
	@.venv/bin/scenesense demo $(ARGS)

test: setup ## all tests
	@ROS_PYTHON_CHECK_FIELDS=1 $(python) -m pytest $(ARGS)

lint: setup ## ruff and mypy
	@$(python) -m ruff check
	@$(python) -m ruff format --check
	@$(python) -m mypy

bench: setup ## measure the figures that the documentation quotes
	@.venv/bin/scenesense bench $(ARGS)

msg_defs: setup ## write the JSON Schemas of all messages
	@$(python) -m ros_scenesense.messages.schemas msg_defs

soak: setup ## an hour of work, 100 kills, 10,000 hostile messages; takes 80 minutes
	@SCENESENSE_CUT_S=10 $(python) -m pytest test/test_several_hosts.py
	@.venv/bin/scenesense soak --minutes 60 --kills 100 --fuzz 10000 $(ARGS)

lock: setup ## write requirements.lock from setup.py
	@PYTHON=$(python) tools/lock.sh $(ARGS)

check_installs: setup ## pip and colcon, plain and editable, each tried in a temporary folder
	@tools/check_installs.sh

clean: ## remove what building and testing left behind
	rm -rf build dist install log *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -path ./.venv -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## the same, and .venv
	rm -rf .venv
