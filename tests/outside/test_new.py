"""``pkm-gym new``: what it writes, and what it refuses."""

from __future__ import annotations

import pytest

from pkm_gym.studies.verbs.new import written

NAME = "biglide"


def test_what_it_writes_passes_its_own_tests(python):
    done = python("-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "5 passed" in done.stdout


def test_what_it_writes_is_tidy(python):
    for words in (("check",), ("format", "--check")):
        done = python("-m", "ruff", *words, ".")
        assert done.returncode == 0, done.stdout + done.stderr


def test_it_says_how_to_go_on(run, tmp_path):
    lines = run("new", "two_rails", "-o", tmp_path / "mine").splitlines()
    assert lines[-3:] == [
        f"cd {tmp_path / 'mine'}",
        "python -m pytest",
        "pkm-gym evaluate two_rails.problem:TwoRailsProblem",
    ]
    assert (tmp_path / "mine" / "two_rails" / "problem.py").is_file()


def test_every_name_is_written_in_full():
    for place, text in written("two_rails"):
        assert "$" not in text.replace("\n$", ""), place
        assert NAME not in text.lower(), place
    names = {str(place) for place, _ in written("two_rails")}
    assert {"pyproject.toml", "README.md", "two_rails/declared.py"} <= names


def test_nothing_is_overwritten(refused, folder):
    before = {path: path.read_bytes() for path in folder.rglob("*.py")}
    assert refused("new", "other", "-o", folder).endswith("exists: choose another folder with -o")
    assert {path: path.read_bytes() for path in folder.rglob("*.py")} == before


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("Two-Link", "did you mean 'two_link'?"),
        ("2r", "did you mean 'r'?"),
        ("class", "that begins with a letter"),
        ("diamond", "'diamond' is taken by pkm_gym.mechanisms.diamond.problem:DiamondProblem"),
        ("numpy", "'numpy' is taken by numpy: choose another name, such as 'my_numpy'"),
    ],
)
def test_a_name_that_is_none_is_refused(refused, tmp_path, name, sentence):
    assert sentence in refused("new", name, "-o", tmp_path / "x")
    assert list(tmp_path.iterdir()) == []


def test_the_template_holds_no_more_than_one_sitting_reads():
    lines = sum(len(text.splitlines()) for place, text in written(NAME) if place.suffix == ".py")
    assert lines < 300
