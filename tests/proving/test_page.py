"""The page of a proof: one file without external references that shows what was judged and what was not."""

from __future__ import annotations

import io
import re
import shlex
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.support.proving_runs import a_record, tiny

from chefbot.proving.comparison import changes
from chefbot.proving.page import DETAILED_RUNS, JUDGED, TUNING, again_command, page, worst_first
from chefbot.proving.pictures import distributions, path_picture
from chefbot.proving.record import RunRecord

OUT = Path("runs/tiny")
REFERENCES = {"src", "href", "xlink:href", "srcset", "data", "action", "poster", "background"}
EMPTY = {"meta", "br"}


class Reader(HTMLParser):
    """Reads a page: its references, visible text, tables, and elements that were not closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.rows: list[list[str]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.references += [value or "" for name, value in attrs if name in REFERENCES]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


def plan() -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.full((8, 8), 254, np.uint8)).save(buffer, "png")
    return buffer.getvalue()


def records(count: int = 14) -> list[RunRecord]:
    failed = {3: "table_1 <b>was</b> not reached", 6: "it hung"}
    return [
        a_record(seed, success=seed not in failed, failure=failed.get(seed, ""), plan=plan())
        for seed in range(1, count + 1)
    ]


def test_the_page_is_one_file_without_external_references() -> None:
    old = [a_record(seed, figures={"time": 10.0}) for seed in range(1, 15)]
    text = page([tiny()], records(3), changes(old, records()), OUT)
    reader = Reader(text)
    assert reader.references
    assert all(one.startswith(("#", "data:")) for one in reader.references)
    assert all(one.startswith("#") for one in re.findall(r"url\(([^)]*)\)", text))
    assert not reader.tags & {"script", "link", "iframe", "img", "object", "embed", "base"}
    assert "@import" not in text
    targets = {one[1:] for one in reader.references if one.startswith("#")}
    assert targets <= set(re.findall(r"id=['\"]([^'\"]+)['\"]", text))
    assert reader.open == []


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the pictures, which take most of a page's time."""
    monkeypatch.setattr("chefbot.proving.page.path_picture", lambda *_: None)
    monkeypatch.setattr("chefbot.proving.page.distributions", lambda *_: None)


def test_odd_seeds_are_judged_and_even_ones_are_not(no_pictures: None) -> None:
    rows = {row[1]: row for row in Reader(page([tiny()], records(), [], OUT)).rows if len(row) == 6}
    assert (rows[JUDGED][2], rows[JUDGED][5]) == ("86%", "6 of 7")
    assert (rows[TUNING][2], rows[TUNING][5]) == ("86%", "6 of 7")
    assert rows[JUDGED][3] == "49% to 97%"


def test_a_page_of_even_seeds_states_that_nothing_is_judged(no_pictures: None) -> None:
    even = [record for record in records() if record.seed % 2 == 0]
    text = page([tiny()], even, [], OUT)
    assert f"<p class='bad'>{TUNING}.</p>" in text
    assert JUDGED not in text
    assert f"<p class='bad'>{TUNING}.</p>" not in page([tiny()], records(), [], OUT)


def test_a_missed_claim_is_marked(no_pictures: None) -> None:
    assert "class='n bad'>86%" in page([tiny(claim=0.9)], records(), [], OUT)
    assert "class='n bad'>86%" not in page([tiny(claim=0.8)], records(), [], OUT)


def test_the_worst_runs_come_first_with_their_commands(no_pictures: None) -> None:
    text = Reader(page([tiny()], records(), [], OUT)).text
    found = [int(seed) for seed in re.findall(r"seed (\d+):", text)]
    assert found[:2] == [3, 6]
    assert len(found) == DETAILED_RUNS
    assert "table_1 <b>was</b> not reached" in text, "escaped, not shown in bold"
    command = "chefbot prove runs/tiny/scenarios/tiny.yaml --seeds 3 --record --out runs/tiny_3"
    assert command in text


def test_failed_runs_then_incidents_then_time_are_worst(no_pictures: None) -> None:
    good, slow = a_record(1), a_record(2, sim_time=100.0)
    bumped = a_record(4, incidents=[(0.0, 0.0, 0.0, "near miss")] * 3)
    failed = a_record(6, success=False)
    assert worst_first([good, slow, bumped, failed]) == [failed, bumped, slow, good]


def test_the_command_that_makes_a_run_again_can_be_pasted(no_pictures: None) -> None:
    command = again_command(tiny(), a_record(7), Path("runs/my results"))
    assert shlex.split(command) == [
        "chefbot",
        "prove",
        "runs/my results/scenarios/tiny.yaml",
        "--seeds",
        "7",
        "--record",
        "--out",
        "runs/my results_7",
    ]


def test_the_median_of_an_even_number_is_between_the_middle_ones(no_pictures: None) -> None:
    two = [a_record(seed, figures={"time": time}) for seed, time in ((1, 10.0), (3, 20.0))]
    rows = [row for row in Reader(page([tiny()], two, [], OUT)).rows if row[0] == "time"]
    assert rows == [["time", "15", "10 to 20", "s"]]


def test_what_got_worse_is_marked(no_pictures: None) -> None:
    old = [a_record(seed, figures={"time": 10.0, "collisions": 3.0 + seed}) for seed in range(1, 40)]
    text = page([tiny()], records(20), changes(old, records(20)), OUT)
    by_figure = {row[1]: row for row in Reader(text).rows if len(row) == 7}
    assert by_figure["time"][5] == "worse"
    assert by_figure["collisions"][5] == "better"
    assert by_figure["success"][5] == ""
    assert "<tr class='bad'><td>tiny</td><td>time</td>" in text


def test_a_scenario_without_runs_has_no_section(no_pictures: None) -> None:
    assert "id='other'" not in page([tiny(), tiny(name="other")], records(), [], OUT)


# Pictures


@pytest.mark.parametrize("with_plan", [b"", plan()])
def test_a_path_is_drawn_with_its_incidents(with_plan: bytes) -> None:
    record = a_record(1, plan=with_plan, incidents=[(0.5, 0.1, 0.2, "collision with wall")])
    picture = path_picture(record)
    assert picture is not None
    assert picture.startswith(b"<svg")
    assert (b"data:image/png;base64" in picture) == bool(with_plan)
    assert path_picture(record) == picture


def test_a_run_that_did_not_drive_has_no_path() -> None:
    assert path_picture(a_record(1, path=[])) is None
    assert path_picture(a_record(1, path=[(0.0, 0.0, 0.0)])) is None


def test_figures_that_vary_are_drawn() -> None:
    picture = distributions(records(3))
    assert picture is not None
    assert b"time, s" in picture
    assert b"collisions" not in picture
    assert distributions([a_record(1), a_record(8)]) is None
