"""Databases: made by several at once, away for a while or for good, damaged, missing."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from pkm_gym.studies.dashboard.server import serving
from pkm_gym.studies.storage import database
from pkm_gym.studies.storage.storages import exists, open_storage, study_names
from pkm_gym.studies.storage.studies import finished

OPEN = """
import sys
from pkm_gym.studies.storage.storages import open_storage
sys.stdin.readline()
open_storage(sys.argv[1])
"""

SQLITE = "sqlite:///a.db"


@pytest.fixture
def missing(tmp_path, monkeypatch):
    """The URL of a SQLite database that isn't there."""
    monkeypatch.chdir(tmp_path)
    return SQLITE


@pytest.mark.parametrize("kind", ["sqlite", "postgresql"])
def test_processes_that_make_a_database_at_once_wait_for_each_other(kind, request, missing):
    url = missing if kind == "sqlite" else request.getfixturevalue("server").new_database()
    makers = [
        subprocess.Popen(
            [sys.executable, "-c", OPEN, url], stdin=subprocess.PIPE, stderr=subprocess.PIPE
        )
        for _ in range(6)
    ]
    for maker in makers:
        maker.stdin.write(b"\n")
        maker.stdin.flush()
    assert [maker.communicate()[1] for maker in makers] == 6 * [b""]
    assert {maker.returncode for maker in makers} == {0}
    assert study_names(open_storage(url)) == []


@pytest.mark.parametrize("way", [signal.SIGINT, signal.SIGQUIT])
def test_a_search_goes_on_when_its_database_is_back(server, searched, way):
    url, kept = server.new_database(), []

    def report(count, _):
        if count == 10 and not kept:
            kept.append(count)
            server.stop(way)
            threading.Timer(2.0, server.start).start()

    found = searched(trials=20, storage=url, report=report)
    assert kept == [10]
    assert found.finished == len(finished(found.study)) == 20


def test_a_search_whose_database_stays_away_says_so_and_loses_nothing(
    server, searched, monkeypatch
):
    monkeypatch.setattr(database, "PATIENCE", 1.0)
    url = server.new_database()

    def report(count, _):
        if count == 10:
            server.stop()

    with pytest.raises(
        TimeoutError,
        match=r"^the storage 'postgresql://pkm@/.*' has not answered for 1 s \(.*\): what it was "
        "told is kept there, and the same command goes on$",
    ):
        searched(trials=20, storage=url, report=report)
    server.start()
    found = searched(trials=20, storage=url)
    assert found.finished == len(finished(found.study)) == 20
    assert [t.number for t in finished(found.study)][:10] == list(range(10))


def test_an_operation_that_fails_for_good_is_told_at_once(searched):
    found = searched(trials=2, storage=SQLITE)
    with sqlite3.connect("a.db") as connection:
        connection.execute("drop table trials")
    connection.close()
    with pytest.raises(
        OSError, match=r"^the storage 'sqlite:///a\.db' failed: no such table: .*; "
    ):
        found.study._storage.get_all_trials(found.study._study_id)


def test_a_database_that_another_process_writes_to_is_waited_for(searched):
    study = searched(trials=2, storage=f"{SQLITE}?timeout=0.01").study
    other = sqlite3.connect("a.db", isolation_level=None, check_same_thread=False)
    other.execute("begin immediate")
    threading.Timer(1.0, other.rollback).start()
    study.set_user_attr("x", 1)
    other.close()
    assert study.user_attrs["x"] == 1


@pytest.mark.parametrize("url", [SQLITE, "sqlite:///file:a.db?uri=true", "sqlite://"])
def test_a_missing_database_is_refused_and_not_made(missing, url):
    del missing
    assert not exists(url)
    with pytest.raises(ValueError, match=r"there is no storage '.*': `pkm-gym search` makes one"):
        open_storage(url, create=False)
    with pytest.raises(ValueError, match="there is no storage"), serving(url, 0):
        pass
    assert list(Path().iterdir()) == []


def test_a_database_without_studies_is_not_written_to_by_who_reads_it(missing):
    sqlite3.connect("a.db").close()
    with pytest.raises(ValueError, match=r"can't open the storage 'sqlite:///a\.db': no such "):
        open_storage(missing, create=False)
    assert Path("a.db").read_bytes() == b""


@pytest.mark.parametrize(
    ("url", "said"),
    [
        (
            "oracle://me:secret@host/x",
            r"'oracle://me:\*\*\*@host/x': the Python module \w+ is not in",
        ),
        ("nothing://host/x", "'nothing://host/x': Can't load plugin"),
        ("postgresql://host:port/x", "'postgresql://host:port/x': invalid literal for int"),
        ("sqlite:///no/such/folder/a.db", "a.db': unable to open database file"),
    ],
)
@pytest.mark.parametrize("create", [True, False])
def test_a_database_that_cannot_be_opened_is_refused_in_one_sentence(url, said, create):
    if not exists(url) and not create:
        said = "there is no storage"
    with pytest.raises(ValueError, match=said) as caught:
        open_storage(url, create=create)
    assert "\n" not in str(caught.value)
