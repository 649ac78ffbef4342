"""The dashboard in a browser: the study, its best value, a picture; and what it refuses."""

from __future__ import annotations

import http.client
import json
import shutil
import socket
import urllib.request
from pathlib import Path

import pytest

from pkm_gym.studies.dashboard.server import serving, storages
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage.storages import default_storage, open_storage, study_names

CHROMIUM, DRIVER = (shutil.which(name) for name in ("chromium", "chromedriver"))
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1400,1800",
)
CONTENT = "return document.body.textContent"  # what graphs say, too
PATIENCE = 60.0  # seconds for a page to show what is waited for


@pytest.fixture
def browser(tmp_path):
    """A headless Chromium with a profile of its own."""
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("needs Chromium and its driver: apt-get install chromium chromium-driver")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path / 'profile'}"):
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    yield driver
    driver.quit()


@pytest.mark.slow
def test_a_browser_sees_the_study_its_best_trial_its_note_and_a_picture(
    browser, diamond, tmp_path, monkeypatch
):
    from selenium.webdriver.support.ui import WebDriverWait

    monkeypatch.chdir(tmp_path)
    found = search(diamond, sampler="random", trials=160, seed=4)
    feasible = [t for t in found.study.trials if t.user_attrs["feasible"]]
    assert feasible[0].number != found.trial  # it was the best until another one came
    value = str(found.best.objectives[0, 0])

    def shows(address, text):
        browser.get(address)
        page = WebDriverWait(browser, PATIENCE)
        page.until(lambda driver: text in driver.execute_script(CONTENT))

    def drawn(driver):
        widths = driver.execute_script(
            "return [...document.images].filter(i => i.src.includes('/artifacts/'))"
            ".map(i => i.naturalWidth)"
        )
        return len(widths) == 2 and min(widths) > 800

    with serving(default_storage("diamond"), 0) as address:
        shows(address, "diamond-random")
        shows(f"{address}/studies/0", value)
        shows(f"{address}/studies/0", f"Best Trial (number={found.trial})")
        graphs = ("feasible designs: ", "over each variable", "that matter most", "depends on")
        for words in (*graphs, "paper, our model", "verified optimum"):
            shows(f"{address}/studies/0", words)
        shows(f"{address}/studies/0/note", "verified optimum")
        WebDriverWait(browser, PATIENCE).until(drawn)
        for number in (found.trial, feasible[0].number):
            shows(f"{address}/studies/0/trials?numbers={number}", "mechanism.png")
            WebDriverWait(browser, PATIENCE).until(drawn)
            shows(f"{address}/studies/0/trials?numbers={number}", "design.toml")
            shows(f"{address}/studies/0/trials?numbers={number}", "model.xml")


def test_the_address_serves_the_studies_of_a_storage(searched):
    searched(trials=3, name="mine")
    with serving(default_storage("diamond"), 0) as address:
        root = address.removesuffix("/dashboard")
        with urllib.request.urlopen(f"{root}/api/studies", timeout=60) as answer:
            names = [study["study_name"] for study in json.load(answer)["study_summaries"]]
    assert names == ["mine"]


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 204),
        ({"Host": "localhost"}, 204),
        ({"Host": "LOCALHOST:8080"}, 204),
        ({"Host": "[::1]:8080"}, 204),
        ({"Origin": "http://localhost:8080"}, 204),
        ({"Host": "elsewhere.example"}, 403),
        ({"Host": "elsewhere.example:8080"}, 403),
        ({"Host": "127.0.0.1.elsewhere.example"}, 403),
        ({"Host": "192.168.0.7:8080"}, 403),
        ({"Host": ""}, 403),
        ({"Origin": "http://elsewhere.example"}, 403),
        ({"Origin": "null"}, 403),
    ],
)
def test_only_pages_of_this_machine_may_delete_a_study(searched, headers, status):
    searched(trials=1)
    with serving(default_storage("diamond"), 0) as address:
        root = address.removesuffix("/dashboard").removeprefix("http://")
        connection = http.client.HTTPConnection(root, timeout=60)
        connection.request("DELETE", "/api/studies/0", b"{}", headers)
        assert connection.getresponse().status == status
        connection.close()
    assert len(study_names(open_storage(default_storage("diamond")))) == (status == 403)


def test_a_port_that_is_taken_is_refused(searched):
    searched(trials=1)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with (
            pytest.raises(ValueError, match=f"can't listen on port {port} .*: choose another"),
            serving(default_storage("diamond"), port),
        ):
            pass


def test_a_missing_or_empty_storage_is_refused(searched):
    with pytest.raises(ValueError, match="there is no storage 'nowhere'"), serving("nowhere", 0):
        pass
    assert not Path("nowhere").exists()
    open_storage("empty.journal")
    with (
        pytest.raises(ValueError, match=r"the storage 'empty\.journal' is empty"),
        serving("empty.journal", 0),
    ):
        pass
    with pytest.raises(ValueError, match="there is no study under"):
        storages()
    searched(trials=1)
    assert storages() == storages("diamond") == [default_storage("diamond")]
    assert storages(storage="other.journal") == ["other.journal"]
    with pytest.raises(ValueError, match="unknown mechanism 'diamnd'; did you mean 'diamond'"):
        storages("diamnd")
    with pytest.raises(ValueError, match="two storages"):
        storages("diamond", "other.journal")
