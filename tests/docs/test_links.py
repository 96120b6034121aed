"""The link checker of the site finds missing files, missing anchors and pages without a link to them."""

from __future__ import annotations

from pathlib import Path

from tests.support.links import problems


def page(folder: Path, name: str, body: str) -> None:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"<html><body>{body}</body></html>")


def test_a_site_without_faults_passes(tmp_path: Path) -> None:
    page(
        tmp_path,
        "index.html",
        '<a href="sub/a.html#part">a</a> <a href="https://example.org/x">x</a><h1 id="top">t</h1>',
    )
    page(
        tmp_path,
        "sub/a.html",
        '<h2 id="part">p</h2><a href="../index.html#top">up</a><a href="#part">here</a>',
    )
    assert problems(tmp_path) == []


def test_a_missing_file_is_listed(tmp_path: Path) -> None:
    page(tmp_path, "index.html", '<a href="gone.html">gone</a><img src="picture.png">')
    assert [line.split(" leads")[0] for line in problems(tmp_path)] == [
        "index.html: gone.html",
        "index.html: picture.png",
    ]


def test_a_missing_anchor_is_listed(tmp_path: Path) -> None:
    page(tmp_path, "index.html", '<a href="a.html#gone">a</a>')
    page(tmp_path, "a.html", "")
    assert problems(tmp_path) == ["index.html: a.html#gone leads to an anchor that does not exist"]


def test_a_page_that_nothing_leads_to_is_listed(tmp_path: Path) -> None:
    page(tmp_path, "index.html", "")
    page(tmp_path, "a.html", '<a href="b.html">b</a>')
    page(tmp_path, "b.html", '<a href="a.html">a</a><a href="index.html">index</a>')
    assert [line.split(":")[0] for line in problems(tmp_path)] == ["a.html", "b.html"]


def test_a_folder_without_a_site_is_reported_in_one_sentence(tmp_path: Path) -> None:
    assert len(problems(tmp_path)) == 1
