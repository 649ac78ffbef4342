"""Runs: counted, repeatable, kept as they grow; logs are read back or refused."""

from __future__ import annotations

import re
import time
from importlib import import_module
from multiprocessing import active_children

import numpy as np
import pytest

from pkm_gym.benchmark import (
    Cost,
    EvaluationLog,
    find_method,
    load_split,
    method,
    regrets,
    run,
    score,
    setting,
)
from pkm_gym.benchmark.run import Failed
from pkm_gym.benchmark.sources import sources

GUESS = """
@method(evaluations=20)
def guess(view, training):
    span = view.high - view.low
    return proposing(lambda session: view.low + span * session.generator.random(len(span)))
"""


def same(one: EvaluationLog, other: EvaluationLog) -> None:
    assert one.setting == other.setting
    np.testing.assert_array_equal(one.rows, other.rows)
    np.testing.assert_array_equal(one.designs, other.designs)


PEEK = """
@method()
def peek(view, training):
    return proposing(optimum)
"""


def test_a_method_that_peeks_scores_one(shipped, own_methods, peeking):
    problem, split = shipped
    name = own_methods(peeking + PEEK)
    how = setting(problem.name, "val", f"{name}:peek", evaluations=12)
    log = run(how, np.arange(20))
    assert (log.counts == 12).all()
    assert score(regrets(log, problem, split)) == 1.0


def test_several_processes_find_what_one_does(shipped, own_methods):
    problem, _ = shipped
    name = own_methods(GUESS)
    how = setting(problem.name, "val", f"{name}:guess", seed=5)
    assert how.budget == 20  # the method takes no more
    one = run(how, np.arange(10))
    same(one, run(how, np.arange(10), jobs=2))
    assert not np.array_equal(one.designs[0], one.designs[1])  # each task has its own numbers


def test_a_run_goes_on_where_it_was(shipped, own_methods):
    problem, _ = shipped
    name = own_methods(GUESS)
    how = setting(problem.name, "val", f"{name}:guess")
    kept = []
    whole = run(how, np.arange(9), keep=kept.append)
    assert [len(log) for log in kept] == [4, 8, 9]
    same(whole, run(how, np.arange(9), earlier_log=kept[0]))
    same(run(how, np.arange(3)), run(how, np.arange(3), earlier_log=whole))


def test_a_transfer_method_knows_the_pool_and_a_scratch_method_nothing(shipped, own_methods):
    problem, split = shipped
    name = own_methods("""
        @method(knowledge="transfer", start="given")
        def known(view, training):
            def search(session):
                assert len(training) == 100
                session.evaluate(session.start)
                session.evaluate(training.designs[:3])
            return search

        @method()
        def unknown(view, training):
            def search(session):
                assert training is None
                assert session.start is None
            return search
    """)
    log = run(setting(problem.name, "val", f"{name}:known", pool=100), np.arange(4))
    assert (log.setting.start, log.setting.knowledge, log.setting.pool) == (
        "given",
        "transfer",
        100,
    )
    assert (log.counts == 4).all()
    np.testing.assert_array_equal(log.designs[:, 0], split.starts[:4])
    _, train = load_split(problem.name, "train")
    np.testing.assert_array_equal(log.designs[2, 1:4], train.designs[:3])
    log = run(setting(problem.name, "val", f"{name}:unknown", pool=100), np.arange(4))
    assert log.setting.pool == 0
    assert (log.counts == 0).all()
    assert np.isinf(regrets(log, problem, split)).all()


def test_a_method_whose_files_change_is_another_one(shipped, own_methods, tmp_path):
    problem, _ = shipped
    weights = tmp_path / "weights"
    weights.write_text("1")
    name = own_methods(f"""
        from pathlib import Path

        @method(files=lambda name: [Path({str(weights)!r})])
        def mine(view, training):
            return lambda session: None
    """)
    before = setting(problem.name, "val", f"{name}:mine")
    assert setting(problem.name, "val", f"{name}:mine") == before
    weights.write_text("2")
    assert setting(problem.name, "val", f"{name}:mine") != before


def test_noise_is_told_to_the_method_but_not_scored(shipped, own_methods, peeking):
    problem, split = shipped
    name = own_methods(peeking + PEEK)
    how = setting(problem.name, "val", f"{name}:peek", evaluations=1, noise=0.3)
    assert score(regrets(run(how, np.arange(8)), problem, split)) == 1.0


HELPERS = {
    "import": ("import helper_of_tests", "helper_of_tests.py"),
    "from": ("from helper_of_tests import SIZE", "helper_of_tests.py"),
    "in a function": ("def later():\n    import helper_of_tests", "helper_of_tests.py"),
    "in a package": ("from folder_of_tests import helper", "folder_of_tests/helper.py"),
    "a package's own": ("import folder_of_tests.other", "folder_of_tests/__init__.py"),
}


@pytest.mark.parametrize("how", HELPERS)
def test_a_method_whose_imported_helper_changes_is_another_one(own_methods, tmp_path, how):
    line, file = HELPERS[how]
    (tmp_path / "folder_of_tests").mkdir()
    for path in ("helper_of_tests", "folder_of_tests/__init__", "folder_of_tests/helper",
                 "folder_of_tests/other", "unused"):  # fmt: skip
        (tmp_path / f"{path}.py").write_text("SIZE = 1\n")
    name = f"{own_methods(line + GUESS)}:guess"
    before = setting("diamond", "val", name)
    (tmp_path / "unused.py").write_text("SIZE = 2\n")
    assert setting("diamond", "val", name) == before
    (tmp_path / file).write_text("SIZE = 2\n")
    assert setting("diamond", "val", name) != before


def test_our_methods_depend_on_what_they_import_from_their_folder():
    found = sources(import_module("pkm_gym.benchmark.transfer"))
    parts = {"transfer.py", "ladder.py", "interpolation.py", "optima.py", "session.py"}
    assert parts <= {path.name for path in found}
    assert {path.parent.name for path in found} == {"benchmark"}


BAD = """
@method()
def bad(view, training):
    def search(session):
        session.evaluate(view.low)
        {}
    return search
"""


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("raise RuntimeError('no idea\\nat all')", "RuntimeError: no idea$"),
        ("session.evaluate(2.0 * view.high + 1.0)", "ValueError: .* within the search bounds"),
        ("raise SystemExit(0)", "SystemExit: 0"),
    ],
)
def test_a_failing_method_is_named_with_its_task(own_methods, line, reason, jobs):
    how = setting("diamond", "val", f"{own_methods(BAD.format(line))}:bad")
    with pytest.raises(Failed, match=rf"bad failed on val task \d after 1 evaluations: {reason}"):
        run(how, np.arange(8), jobs=jobs)


def test_a_method_that_ends_its_process_is_named(own_methods):
    name = own_methods(BAD.format("import os; os._exit(3)"))
    with pytest.raises(Failed, match="bad ended a process that it ran in"):
        run(setting("diamond", "val", f"{name}:bad"), np.arange(8), jobs=2)


def test_a_failure_ends_the_workers_that_go_on(own_methods, tmp_path):
    """One task fails; the process with the other tasks would never end by itself."""
    (tmp_path / "turns").mkdir()
    name = own_methods(
        BAD.format(f"""
        import os, pathlib, time
        turns = pathlib.Path({str(tmp_path / "turns")!r})
        (turns / str(os.getpid())).touch()
        if len(list(turns.iterdir())) > 1:
            raise RuntimeError("enough")
        while True:
            time.sleep(0.05)
    """)
    )
    before = {process.pid for process in active_children()}
    with pytest.raises(Failed, match="enough"):
        run(setting("diamond", "val", f"{name}:bad"), np.arange(8), jobs=2)
    until = time.monotonic() + 20.0
    while {process.pid for process in active_children()} - before and time.monotonic() < until:
        time.sleep(0.1)
    assert not {process.pid for process in active_children()} - before


def test_a_failure_while_preparing_is_named(own_methods):
    name = own_methods("""
        @method()
        def bad(view, training):
            return 1 / 0
    """)
    with pytest.raises(Failed, match="bad failed while it prepared: ZeroDivisionError"):
        run(setting("diamond", "val", f"{name}:bad"), np.arange(2))


def test_a_module_that_can_not_be_imported_is_refused(own_methods):
    name = own_methods("1 / 0")
    with pytest.raises(ValueError, match=f"{name} can't be imported: ZeroDivisionError: division"):
        setting("diamond", "val", f"{name}:it")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"method": "randon"}, "unknown method 'randon'; did you mean 'random'?"),
        ({"method": "no_such_module:it"}, "there is no module 'no_such_module'"),
        ({"method": "pkm_gym:polish"}, "pkm_gym has no method 'polish'"),
        ({"name": "diamant"}, "unknown mechanism 'diamant'; did you mean 'diamond'?"),
        ({"split": "vall"}, "unknown split 'vall'; did you mean 'val'?"),
        ({"evaluations": 0}, "evaluations is 0: it must be at least 1"),
        ({"noise": -0.1}, "noise is -0.1: it must be at least 0"),
        ({"noise": float("nan")}, "noise is nan: it must be at least 0"),
        ({"pool": 5000}, "pool is 5000: there are 4096 training tasks"),
    ],
)
def test_settings_are_refused_in_one_sentence(arguments, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        setting(**{"name": "diamond", "split": "val", "method": "random"} | arguments)


def test_every_method_of_the_table_is_one():
    from pkm_gym.benchmark import METHODS

    for name in METHODS:
        assert find_method(name).prepare.__doc__


@pytest.fixture
def log(shipped, own_methods) -> EvaluationLog:
    name = own_methods(GUESS)
    return run(setting(shipped[0].name, "val", f"{name}:guess"), np.arange(4), command="a test")


def test_a_log_is_read_back_as_it_was_written(log, tmp_path):
    log.save(tmp_path / "log.npz")
    read = EvaluationLog.load(tmp_path / "log.npz")
    same(log, read)
    np.testing.assert_array_equal(log.seconds, read.seconds)
    assert (read.version, read.command) == (log.version, "a test")


def test_a_spoilt_log_is_refused_by_name(log, tmp_path):
    path = tmp_path / "log.npz"
    with pytest.raises(ValueError, match=r"log.npz' does not exist: expected an npz"):
        EvaluationLog.load(path)
    log.save(path)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ValueError, match=r"log.npz' is damaged or no npz file"):
        EvaluationLog.load(path)
    np.savez(path, rows=np.arange(3))
    with pytest.raises(ValueError, match=r"log.npz' is no log of a run: it lacks designs"):
        EvaluationLog.load(path)


@pytest.mark.parametrize(
    ("stated", "sentence"),
    [
        ({"start": "gven"}, "unknown start 'gven'; did you mean 'given'?"),
        ({"knowledge": "transfr"}, "unknown knowledge 'transfr'; did you mean 'transfer'?"),
        ({"training": lambda _: Cost(5)}, "a method with a training knows of other tasks"),
    ],
)
def test_a_track_that_there_is_not_is_refused(stated, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        method(**stated)(find_method("random").prepare)


def test_a_method_that_was_trained_before_is_charged_the_whole_pool(shipped, own_methods):
    name = own_methods("""
        from pkm_gym.benchmark import Cost

        @method(knowledge="transfer", training=lambda name: Cost(5))
        def mine(view, training):
            return lambda session: None
    """)
    how = setting(shipped[0].name, "val", f"{name}:mine", pool=1)
    assert how.pool == shipped[0].declared.splits["train"]
