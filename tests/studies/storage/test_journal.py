"""The journal: what a full disk, a crash or damage leaves of it."""

from __future__ import annotations

import json
from pathlib import Path

import optuna
import pytest
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

from pkm_gym.studies.storage.journal import Journal
from pkm_gym.studies.storage.storages import open_storage, quiet

PATH = Path("a.journal")


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def opened():
    """Open the journal as one more process would."""
    with quiet():
        return optuna.create_study(
            study_name="a", storage=open_storage(str(PATH)), load_if_exists=True,
            sampler=optuna.samplers.RandomSampler(seed=1),
        )  # fmt: skip


def searched(study, trials=1):
    with quiet():
        study.optimize(lambda trial: trial.suggest_float("x", 0.0, 1.0), n_trials=trials)


def content(study):
    return [(t.number, t.state, t.params, t.values, t.user_attrs) for t in study.get_trials()]


def by_plain_optuna():
    return optuna.load_study(study_name="a", storage=JournalStorage(JournalFileBackend(str(PATH))))


def lines():
    return PATH.read_bytes().splitlines(keepends=True)


@pytest.mark.parametrize("left", [0, 1, 20, 90])
def test_a_full_disk_costs_the_entry_that_does_not_fit_and_nothing_else(limited, left):
    one, other = opened(), opened()
    searched(one, 3)
    kept = content(one)
    with limited(PATH.stat().st_size + left), pytest.raises(OSError, match="too large") as caught:
        other.set_user_attr("long", "x" * 200)
    assert caught.value.filename == str(PATH.absolute())
    searched(one, 2)
    searched(other, 2)
    assert content(one)[:3] == kept
    assert content(one) == content(other) == content(opened()) == content(by_plain_optuna())
    assert len(content(one)) == 7
    assert "long" not in opened().user_attrs


def test_what_a_killed_process_left_half_written_hinders_nobody():
    one, other = opened(), opened()
    searched(one, 2)
    with PATH.open("ab") as file:
        file.write(lines()[-1][:40])
    assert len(content(other)) == 2  # it reads up to the half line
    searched(one, 2)
    searched(other, 2)
    assert content(one) == content(other) == content(opened()) == content(by_plain_optuna())
    assert len(content(one)) == 6


@pytest.mark.parametrize("cut", [1, 12, 60, -1])
def test_a_glued_line_loses_only_the_entry_that_was_never_finished(cut, capsys):
    """As Optuna's own journal leaves it, when another process goes on after half a line."""
    searched(opened(), 3)
    kept = lines()
    half = json.dumps({"op_code": 4, "worker_id": "w", "study_id": 0, "datetime_start": "2026"})
    PATH.write_bytes(b"".join(kept[:6]) + half[:cut].encode() + b"".join(kept[6:]))
    with pytest.raises(json.JSONDecodeError):
        by_plain_optuna()
    assert [t[1] for t in content(opened())] == 3 * [TrialState.COMPLETE]
    assert f"{str(PATH.absolute())!r}, line 7, begins with half an entry" in capsys.readouterr().err
    searched(opened())
    assert len(content(opened())) == 4


def test_a_damaged_setting_is_left_out_with_a_warning(capsys):
    one = opened()
    searched(one)
    one.set_user_attr("kept", 1)
    one.set_user_attr("lost", 2)
    searched(one)
    damaged = [line.replace(b'"lost":', b'"lost\0:') for line in lines()]
    PATH.write_bytes(b"".join(damaged))
    assert opened().user_attrs == {"kept": 1}
    assert content(opened()) == content(one)
    number = next(i for i, line in enumerate(damaged, 1) if b"lost" in line)
    assert f"line {number}, is damaged and left out" in capsys.readouterr().err
    late = opened()
    searched(one)  # entries are still counted alike
    assert content(late) == content(one) == content(opened())


@pytest.mark.parametrize(
    "change",
    [
        lambda line: line[:-20] + b"\n",  # cut in the middle
        lambda line: line.replace(b'"worker_id"', b'"worker_jd"'),
        lambda line: b'{"op_code":x' + line[12:],
        lambda line: bytes(len(line) - 1) + b"\n",  # as some file systems leave it after a crash
    ],
)
def test_a_damaged_creation_is_refused_by_its_line(change):
    searched(opened(), 2)
    content = lines()
    number = next(i for i, line in enumerate(content) if line.startswith(b'{"op_code":4'))
    content[number] = change(content[number])
    PATH.write_bytes(b"".join(content))
    with pytest.raises(ValueError, match=f"^'.*a.journal', line {number + 1}, is damaged: restore"):
        open_storage(str(PATH))
    assert lines() == content


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ({"op_code": 99, "worker_id": "w"}, "line 3, has the unknown op_code 99: it is damaged"),
        ({"op_code": "4", "worker_id": "w"}, "line 3, has the unknown op_code '4'"),
        ({"op_code": 0, "worker_id": "w"}, "line 3, is damaged: restore the file"),
        ({"op_code": 0, "worker_id": "w", "study_name": "b", "directions": [7]}, "line 3, is dam"),
    ],
)
def test_an_entry_that_nobody_understands_is_refused_by_its_line(entry, said):
    opened().set_user_attr("x", 1)
    with PATH.open("a") as file:
        file.write(json.dumps(entry) + "\n")
    with pytest.raises(ValueError, match=f"^'.*a.journal', {said}"):
        open_storage(str(PATH))


def test_an_unknown_op_code_that_arrives_later_is_refused_by_its_line():
    study = opened()
    with PATH.open("a") as file:
        file.write('{"op_code":99,"worker_id":"w"}\n')
    with pytest.raises(ValueError, match="line 2, has the unknown op_code 99"):
        study.get_trials()


def test_reading_goes_on_where_it_was_or_from_the_beginning():
    study = opened()
    searched(study, 2)
    journal = Journal(PATH.absolute())
    whole = list(journal.read_logs(0))
    assert whole == [json.loads(line) for line in lines()]
    assert list(journal.read_logs(len(whole))) == []
    searched(study)
    assert list(journal.read_logs(len(whole))) == [json.loads(x) for x in lines()[len(whole) :]]
    assert list(journal.read_logs(3)) == [json.loads(line) for line in lines()[3:]]


def test_the_first_entry_may_be_half_written():
    PATH.write_bytes(b'{"op_c')
    searched(opened())
    assert len(content(by_plain_optuna())) == 1
