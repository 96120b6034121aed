"""Tests of the answer to a refused request: readable for a person on a phone, one line for a program."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.datastructures import Headers

from chefbot.ui.access.refusal_page import refusal, sentences
from chefbot.ui.request_guard import INVALID_TOKEN, NO_TOKEN, WRONG_HOST

ACCEPTS = "text/html,application/xhtml+xml,*/*;q=0.8"


def page(reason: str, languages: str) -> str:
    answer = refusal(reason, Headers({"accept": ACCEPTS, "accept-language": languages}))
    assert answer.status_code == 403 and answer.headers["connection"] == "close"
    assert (
        answer.headers["content-type"].startswith("text/html") and "script" not in bytes(answer.body).decode()
    )
    return bytes(answer.body).decode()


@pytest.mark.parametrize("reason", [NO_TOKEN, INVALID_TOKEN])
@pytest.mark.parametrize("language", ["ar", "de", "es", "fr", "zh"])
def test_a_person_reads_the_reason_in_the_browsers_language(reason: str, language: str) -> None:
    text = page(reason, f"xx,{language}-CH;q=0.9,en;q=0.8")
    assert sentences()[language][reason] in text and f'lang="{language}"' in text
    assert ('dir="rtl"' in text) == (language == "ar")
    assert 'name="viewport"' in text, "else a phone shows it five times too small"


def test_without_a_known_language_the_page_is_in_english() -> None:
    assert INVALID_TOKEN in page(INVALID_TOKEN, "pt-BR,en;q=0.7,de;q=0.3")
    assert INVALID_TOKEN in page(INVALID_TOKEN, "")
    assert "names" in page(WRONG_HOST, "de")


def test_a_program_gets_one_line() -> None:
    answer = refusal(NO_TOKEN, Headers({"accept": "*/*", "accept-language": "de"}))
    assert (answer.status_code, bytes(answer.body).decode()) == (403, NO_TOKEN)
    assert answer.headers["content-type"].startswith("text/plain")


@given(languages=st.text(alphabet=st.characters(max_codepoint=126, min_codepoint=32), max_size=40))
def test_any_list_of_languages_has_an_answer(languages: str) -> None:
    assert "<p>" in page(NO_TOKEN, languages)
