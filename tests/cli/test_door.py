"""The front door: verbs by name, errors as sentences, nothing imported before it is needed."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import pkm_gym
from pkm_gym.__main__ import VERBS
from pkm_gym.studies.cli.options import FixOption, Name, SetOption

CHECKOUT = Path(pkm_gym.__file__).parent.parent


def python(*words: str, cwd: Path = CHECKOUT) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, cwd=cwd
    )


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_help_names_every_verb_with_its_line(run, words):
    result = run(*words)
    assert result.exit_code == 0
    for name, (_, line) in VERBS.items():
        assert any(name in row and line in row for row in result.stdout.splitlines())


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_has_help(run, name):
    result = run(name, "--help")
    assert result.exit_code == 0
    assert f"Usage: pkm-gym {name} " in result.stdout


def test_help_imports_no_verb_and_no_heavy_library():
    code = (
        "import sys\n"
        "from pkm_gym.__main__ import main\n"
        "sys.argv = ['pkm-gym', '--help']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('LOADED', *sys.modules)"
    )
    loaded = set(python("-c", code).stdout.partition("LOADED ")[2].split())
    assert "pkm_gym.__main__" in loaded
    assert not any(name.startswith("pkm_gym.studies") for name in loaded)
    assert not loaded & {"numba", "scipy", "matplotlib", "optuna", "torch"}


def test_version_is_the_package_s(run):
    assert run("--version").stdout == f"pkm_gym {version('pkm_gym')}\n"


@pytest.mark.parametrize("package", ["pkm_gym", "studies"])
def test_the_package_runs_as_a_module(package):
    result = python("-m", package, "list")
    assert result.returncode == 0
    assert "diamond" in result.stdout


def test_running_studies_in_the_checkout_loads_no_second_copy():
    code = (
        "import runpy, sys\n"
        "sys.argv = ['studies', 'list']\n"
        "try: runpy.run_module('studies', run_name='__main__', alter_sys=True)\n"
        "except SystemExit: pass\n"
        "print('LOADED', *sys.modules)"
    )
    loaded = set(python("-c", code).stdout.partition("LOADED ")[2].split())
    assert "pkm_gym.studies.verbs.list" in loaded
    assert {name for name in loaded if name.partition(".")[0] == "studies"} <= {"studies"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("lst",), "unknown verb 'lst'; did you mean 'list'?"),
        (("solve_tasks", "diamond"), "unknown verb 'solve_tasks'; did you mean 'solve-tasks'?"),
        (("evaluate",), "NAME is missing; see pkm-gym evaluate --help"),
        (("list", "a", "b"), "too many words: b; see pkm-gym list --help"),
        (
            ("evaluate", "diamond", "--pictur", "a.png"),
            "unknown option '--pictur'; did you mean '--picture'?; see pkm-gym evaluate --help",
        ),
        (("evaluate", "diamnd"), "unknown mechanism 'diamnd'; did you mean 'diamond'?"),
        (("evaluate", "diamond", "--set"), "--set needs a value after it"),
        (("evaluate", "diamond", "--json=3"), "--json takes no value"),
        (
            ("search", "diamond", "--trials", "x"),
            "--trials is 'x': it must be a whole number; see pkm-gym search --help",
        ),
        (
            ("search", "diamond", "--trials", "0"),
            "--trials is '0': it must be at least 1; see pkm-gym search --help",
        ),
        (
            ("dashboard", "--port", "70000"),
            "--port is '70000': it must be at most 65535; see pkm-gym dashboard --help",
        ),
        (
            ("grid", "diamond", "--step", "x"),
            "--step is 'x': it must be a number; see pkm-gym grid --help",
        ),
    ],
)
def test_a_mistyped_command_is_refused_in_one_sentence(refused, words, sentence):
    assert refused(*words) == sentence


def test_a_verb_s_value_error_leaves_as_its_sentence(refused, verb):
    def probe() -> None:
        raise ValueError("lam_e is wrong")

    verb(probe)
    assert refused("probe") == "lam_e is wrong"


def test_a_file_that_cannot_be_used_is_named(refused, verb):
    def probe() -> None:
        Path("no/such/file").read_text()

    verb(probe)
    assert refused("probe") == "no/such/file: No such file or directory"


def test_a_database_that_does_not_answer_any_more_exits_1(run, verb):
    def probe() -> None:
        raise TimeoutError("the storage has not answered for 60 s")

    verb(probe)
    result = run("probe")
    assert result.exit_code == 1
    assert result.stderr == "pkm-gym: the storage has not answered for 60 s\n"


def test_ctrl_c_exits_130_without_a_traceback(run, verb):
    def probe() -> None:
        raise KeyboardInterrupt

    verb(probe)
    result = run("probe")
    assert result.exit_code == 130
    assert result.stderr == "pkm-gym: interrupted\n"


@pytest.mark.parametrize(
    "bug", [RuntimeError("a bug"), EOFError("x"), ModuleNotFoundError("x", name="x")]
)
def test_a_bug_is_not_hidden(run, verb, bug):
    def probe() -> None:
        raise bug

    verb(probe)
    assert run("probe").exception is bug


@pytest.mark.parametrize(
    ("module", "words"), [("optuna", ["search", "diamond"]), ("optuna_dashboard", ["dashboard"])]
)
def test_a_missing_extra_is_named_with_the_command_that_installs_it(module, words, tmp_path):
    code = (
        f"import sys; sys.modules[{module!r}] = None; sys.argv = ['pkm-gym', *{words!r}]\n"
        "from pkm_gym.__main__ import main; main()"
    )
    result = python("-c", code, cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1] == (
        f'pkm-gym: this verb needs the extra "studies" (there is no module {module}): '
        'pip install "pkm_gym[studies]"'
    )


def test_verbs_of_the_models_alone_need_no_extra():
    verbs = ("list", "evaluate", "figures", "picture", "movie", "export", "validate", "twin_check",
             "solve_tasks", "splits", "score")  # fmt: skip
    code = f"""
import sys
from importlib import import_module
sys.modules["optuna"] = None
for verb in {verbs!r}:
    import_module(f"pkm_gym.studies.verbs.{{verb}}")
print("torch" in sys.modules)
"""
    assert python("-c", code).stdout == "False\n"


@pytest.mark.parametrize(
    "words",
    [
        ["disc", "--set", "a=1", "b=2", "c=3", "--fix", "x=1", "y=2"],
        ["disc", "--set", "a=1", "--set", "b=2", "--set", "c=3", "--fix", "x=1", "--fix", "y=2"],
        ["disc", "--set=a=1", "b=2", "--fix", "x=1", "y=2", "--set", "c=3"],
        ["--set", "a=1", "b=2", "c=3", "disc", "--fix=x=1", "y=2"],
        ["--fix", "x=1", "y=2", "--set", "a=1", "b=2", "--set", "c=3", "--", "disc"],
    ],
)
def test_several_values_may_follow_one_flag(run, verb, words):
    def probe(name: Name, set_: SetOption = None, fix: FixOption = None) -> None:
        print(name, set_, fix)

    verb(probe)
    result = run("probe", *words)
    assert result.stdout == "disc ['a=1', 'b=2', 'c=3'] ['x=1', 'y=2']\n"


def test_a_value_without_its_flag_is_refused(refused, verb):
    def probe(name: Name, set_: SetOption = None) -> None:
        print(name, set_)

    verb(probe)
    assert "too many words: b=2" in refused("probe", "--set", "a=1", "disc", "b=2")


def test_module_in_the_current_folder_is_found(tmp_path):
    (tmp_path / "mine.py").touch()
    command = [
        Path(sys.executable).with_name("pkm-gym"),
        "benchmark",
        "diamond",
        "--method",
        "mine:x",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "mine has no method 'x'" in done.stderr
