# What people run while they work on Perpetua; .ci/run does all of it.
.PHONY: setup test fast lint types docs

setup:  # environment with everything that lint, types, tests and documentation need
	./setup.sh --dev

test:  # every test, about 20 minutes on two cores
	.venv/bin/python -m pytest

fast:  # the tests of a few seconds each, without Blender, Infinigen and Slurm
	.venv/bin/python -m pytest -m "not blender and not cluster and not infinigen and not slow"

lint:
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .

types:
	.venv/bin/mypy

docs:  # the site, into site/; to read it: python3 -m http.server --directory site
	NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build --strict
