"""What a contribution has to pass, in new environments: ``nox`` runs all, ``nox -s tests`` one.

Only Python 3.11 is tested. Another that is installed here: ``nox --force-python 3.13``.
"""

import shutil
from pathlib import Path

import nox

nox.options.default_venv_backend = "venv"
nox.options.reuse_existing_virtualenvs = True


@nox.session(python="3.11")
def lint(session: nox.Session) -> None:
    """Style, format and types."""
    make(session, "lint")


@nox.session(python="3.11")
def tests(session: nox.Session) -> None:
    """All but the slow tests; with ``-- slow`` the slow ones."""
    make(session, "test-slow" if "slow" in session.posargs else "test")


@nox.session(python="3.11")
def docs(session: nox.Session) -> None:
    """Pages and API reference into build/docs, warnings as errors."""
    make(session, "docs")


@nox.session(python="3.11")
def wheel(session: nox.Session) -> None:
    """Build the wheel, install it with its dependencies, and use it in an empty folder."""
    folder = Path(session.create_tmp()).resolve()
    shutil.rmtree("build/lib", ignore_errors=True)  # else files that are gone would be packed
    session.run("pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), ".")
    (built,) = folder.glob("*.whl")
    session.install("-c", "constraints.txt", f"pkm_gym[studies,agents] @ {built.as_uri()}")
    session.chdir(folder)
    session.run("pkm-gym", "list")
    session.run("pkm-gym", "evaluate", "diamond")
    session.run("pkm-gym", "study", "diamond", "--trials", "20")
    session.run("pkm-gym", "design", "diamond", "--set", "task.payload=1.5kg")
    session.run("pkm-gym", "picture", "diamond")


def make(session: nox.Session, target: str) -> None:
    """Run a target of the Makefile, which installs what it needs, in the session's environment."""
    session.run("make", target, f"VENV={session.virtualenv.location}", external=True)
