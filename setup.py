"""What pyproject.toml cannot say: top-level folders of files that are installed below the package."""

from setuptools import find_packages, setup

RESOURCES = ("assets_manifest", "blender_scripts", "configs")

homes = {f"perpetua.resources.{name}": name for name in RESOURCES}
parts = {
    f"perpetua.resources.{name}.{part}": f"{name}/{part.replace('.', '/')}"
    for name in RESOURCES
    for part in find_packages(name)
}

setup(packages=[*find_packages(include=["perpetua", "perpetua.*"]), *homes, *parts], package_dir={**homes, **parts})
