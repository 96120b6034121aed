"""Tests of the languages of the web UI: complete catalogues, a page that uses them and has room for them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from string import Formatter
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab
from tests.ui.conftest import Page

from chefbot.behavior import waiting
from chefbot.board.status_codes import FAULTS, as_text, motors_off
from chefbot.delivery import status_messages
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.safety import stop_latch
from chefbot.ui import pending_requests, request_guard, server
from chefbot.ui.access import roles
from chefbot.ui.commands import Drive, Stop
from chefbot.ui.display.views import DeliveryView, RoundStopView, StatusView
from chefbot.ui.files import FOLDER

CATALOGUES = {path.stem: json.loads(path.read_text()) for path in sorted(FOLDER.glob("languages/*.json"))}
SCRIPTS = [path for path in FOLDER.rglob("*.js") if "vendor" not in path.parts]
UNTRANSLATED = re.compile(r"Chefbot|Esc|50 %|[^A-Za-z]*|[a-z,.]")
"""The product, names and letters of keys, values."""
CHOOSE = """(() => {
  const choice = document.getElementById('language');
  choice.value = '%s';
  choice.dispatchEvent(new Event('change'));
})()"""
ENGLISH_LEFT = """(async () => {
  const { page } = await (await fetch('languages/%s.json')).json();
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), left = [];
  while (texts.nextNode()) {
    const text = texts.currentNode.data.trim();
    if (page[text] && page[text] !== text && texts.currentNode.parentElement.checkVisibility()) left.push(text);
  }
  return left;
})()"""
SIZES = [(390, 844), (1440, 900)]
UP = "!document.body.classList.contains('offline')"


class PageTexts(HTMLParser):
    """Collects the texts of an HTML file, and the attributes that people and screen readers read."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []
        self._tag = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._tag = tag
        self.texts += [
            value for name, value in attrs if name in ("aria-label", "title", "placeholder") and value
        ]

    def handle_data(self, data: str) -> None:
        if self._tag not in ("script", "title"):
            self.texts.append(" ".join(data.split()))


def texts_of_the_page() -> set[str]:
    """Return the texts of index.html, and the messages that scripts translate."""
    page = PageTexts()
    page.feed((FOLDER / "index.html").read_text())
    messages = [text for path in SCRIPTS for text in re.findall(r'\btr\("([^"]+)"', path.read_text())]
    return {text for text in (*page.texts, *messages) if not UNTRANSLATED.fullmatch(text)}


def fields(text: str) -> list[str]:
    return sorted(name for _, name, _, _ in Formatter().parse(text) if name is not None)


def test_every_text_of_the_page_is_in_the_catalogue() -> None:
    assert set(CATALOGUES["de"]["page"]) == texts_of_the_page()


@pytest.mark.parametrize("code", [code for code in CATALOGUES if code != "de"])
def test_all_catalogues_have_the_same_messages(code: str) -> None:
    assert {part: list(messages) for part, messages in CATALOGUES[code].items()} == {
        part: list(messages) for part, messages in CATALOGUES["de"].items()
    }


@pytest.mark.parametrize("code", CATALOGUES)
def test_translations_have_the_fields_of_their_message(code: str) -> None:
    for messages in CATALOGUES[code].values():
        for message, translation in messages.items():
            assert translation.strip()
            assert fields(translation) == fields(message), message


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_scripts_show_no_text_that_is_not_translated(path: Path) -> None:
    """A text of several words stands in `tr("...")`, so that a new one cannot be forgotten."""
    code = re.sub(r"^\s*//.*$|\s//\s.*$", "", path.read_text(), flags=re.MULTILINE)
    code = re.sub(r'\btr\("[^"]+"', "", code)
    texts = re.findall(r'["`]([A-Z][a-z]+ [^"`]*)["`]', code)
    assert [text for text in texts if not text.startswith("The texts in ")] == []


def test_the_page_offers_exactly_the_catalogues() -> None:
    line = re.search(r"LANGUAGES = \{(.*?)\}", (FOLDER / "language.js").read_text())
    assert line is not None
    assert sorted(re.findall(r"(\w+):", line[1])) == sorted(["en", *CATALOGUES])


def delivery_sentences() -> Iterator[str]:
    """Yield a sentence of every kind that the delivery node publishes."""
    for name, text in vars(status_messages).items():
        if name.isupper() and isinstance(text, str) and name not in ("ROUND_WAITS", "PARKING_PLACE"):
            yield text.strip().format(3)
    for name in (
        "on_the_way",
        "with_food_back",
        "at",
        "not_taken",
        "battery_skipped",
        "not_served",
        "left_out",
    ):
        yield getattr(status_messages, name)("table_3")
    waits = DeliveryStatus(queue=("table_1", "table_2"), place="table_1", on_trays=("table_2", "table_1"))
    for trays in (0, 2):
        yield status_messages.load(waits, trays)
    food_back = DeliveryStatus(queue=("table_1",), untaken=("table_2", "table_3"))
    yield from (status_messages.load(food_back, 0), status_messages.unload(food_back))
    yield status_messages.take(waits)
    yield status_messages.take(DeliveryStatus(place="table_1"))
    yield status_messages.not_reached("table_1", "No progress: the robot is stuck.")
    yield status_messages.stopped(waits)
    for state, loaded in (("idle", False), ("returning", True), ("driving", True)):
        status = DeliveryStatus(state=state, loaded=loaded, place="table_1")
        yield status_messages.choose(status, "The emergency stop is released.")
    yield status_messages.ended(["table_1", "table_2", "table_3"])
    yield status_messages.ended([])
    yield status_messages.refused(["table_1"], 20.0, 45.0)
    yield status_messages.refused_below(["table_1"], 0.15)


def other_sentences() -> Iterator[str]:
    """Yield what the emergency stop, requests and the wait for people say."""
    yield from (text for name, text in vars(stop_latch).items() if name.isupper() and isinstance(text, str))
    yield from (pending_requests.ORDER_UNCONFIRMED, pending_requests.STOP_UNCONFIRMED)
    yield from (server.ONLY_STOP, server.REVOKED, roles.ONLY_VIEW)
    yield from (request_guard.INVALID_TOKEN, request_guard.NO_TOKEN)
    yield roles.refusal("waiter", Drive(0.1, 0.0))
    yield from (f"Board: {as_text(motors_off(flag))}" for flag in FAULTS)
    for people in ((), (3,), (3, 4, 5)):
        yield from (waiting._who(people, stood) for stood in ((0.0, 4.0) if people else (0.0,)))


@pytest.fixture(scope="module")
def spanish() -> Iterator[Callable[[str], str]]:
    """The function that translates a sentence of the robot, in a page in Spanish."""
    page = Page()
    with open_tab(page.url, NO_GPU) as tab:
        choose(tab, "es")

        def translate(sentence: str) -> str:
            script = f"import('./language.js').then((module) => module.translated({json.dumps(sentence)}))"
            return str(tab.evaluate(script))

        yield translate
    page.server.stop()


def choose(tab: Tab, code: str) -> None:
    """Choose a language as a person does; the page loads again."""
    tab.wait_for(UP)
    tab.reload_by(CHOOSE % code)
    tab.wait_for(f"document.documentElement.lang === '{code}' && {UP}")


@pytest.mark.slow
@needs_chromium
def test_sentences_of_the_robot_are_translated(spanish: Callable[[str], str]) -> None:
    english = re.compile(r"\b(the|is|was|not|and|round|robot is|table|of|to|has|it)\b", re.IGNORECASE)
    for sentence in (*delivery_sentences(), *other_sentences()):
        assert not english.search(spanish(sentence)), (sentence, spanish(sentence))


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize(
    ("sentence", "translation"),
    [
        ("On the way to table 3.", "En camino a Mesa 3."),
        ("The round was ended; not served: table 1, table 2 and kitchen.",
         "La ronda se terminó; sin servir: Mesa 1, Mesa 2 y Cocina."),
        ("Wire: this computer is too slow, messages are lost on /odom, /tf; and 2 more",
         "Red: este ordenador es demasiado lento, se pierden mensajes: /odom y /tf; y 2 más"),
        ("Wire: this computer is too slow, messages are lost on /odom, /tf and 2 more",
         "Red: este ordenador es demasiado lento, se pierden mensajes: /odom, /tf y 2 más"),
        ("The keep-out zone 1 lies at x 2.28 m, y -1.00 m.", "En x 2.28 m, y -1.00 m está: Zona prohibida 1."),
        ("Incident of chefbot, 2026-01-31 09:05, saved by mehmet: no reason given",
         "Incidente de chefbot, 2026-01-31 09:05, guardado por mehmet: sin motivo indicado"),
        ("On this map there is no place called 'table_1' (did you mean 'table_6'?).",
         "En este mapa no hay ningún lugar llamado Mesa 1 (quizá Mesa 6)."),
        ("Table 3 was moved; keep-out zone 1 was added",
         "se movió Mesa 3; nuevo: Zona prohibida 1"),
        ("The place table_1 lies in the keep-out zone 1 and cannot be reached.",
         "El lugar Mesa 1 está en una zona (Zona prohibida 1) y no es accesible."),
        ("The round was ended; not served: table 1, Pizza corner and kitchen.",
         "La ronda se terminó; sin servir: Mesa 1, Pizza corner y Cocina."),
        ("table 3 was not reached: No progress: the robot is stuck.",
         "No se llegó a Mesa 3: Sin avance: el robot está atascado."),
        ("table 3 was not reached: no path leads to the goal because of the keep-out zone 1",
         "No se llegó a Mesa 3: ningún camino lleva al destino (Zona prohibida 1)"),
        ("No path leads to the goal because of an obstacle.", "Un obstáculo cierra el camino al destino."),
        ("The map has changed in the meantime (last change: Table 3 was moved, by Ana); look at it and press again",
         "El mapa ha cambiado mientras tanto (último cambio: se movió Mesa 3, por Ana); mírelo y pulse otra vez"),
        ("Recovery 1: no progress: the robot is stuck.", "Recuperación 1: Sin avance: el robot está atascado."),
        ("The controller waits: The depth camera has not sent anything yet.",
         "El controlador espera: Aún no hay datos de: cámara de profundidad."),
        ("Something new happened. The battery is low.", "Something new happened. La batería está baja."),
        ("On the way to Zimmer (2).", "En camino a Zimmer (2)."),
        ("Stopped: the lidar sees an obstacle 0.12 m behind on the left.",
         "Parado: Obstáculo a 0.12 m detrás a la izquierda, sensor: lidar."),
        ("At table 3 something unknown happened to 5 % of it", "At table 3 something unknown happened to 5 % of it"),
    ],
)  # fmt: skip
def test_a_sentence_is_translated_in_its_parts(
    spanish: Callable[[str], str], sentence: str, translation: str
) -> None:
    assert spanish(sentence) == translation


@pytest.mark.slow
@needs_chromium
def test_labels_leave_sentences_translated(page: Any) -> None:
    """A kitchen that is called Pantry is a name in its sentences, or the word that they have for it."""
    page.server.set_layer("labels", {"kitchen": "Pantry", "table_1": "Fenster", "table_2": "Sofa"})
    with open_tab(page.url, NO_GPU) as tab:
        choose(tab, "es")
        call = "import('./language.js').then((module) => module.translated(%s))"
        sentences = {
            "In the kitchen. Load the food for table 1 and table 2, then press 'Loaded'.":
                "En la cocina. Cargue la comida para Fenster y Sofa y pulse «Cargado».",
            "On the way to kitchen.": "En camino a Pantry.",
            "At table_1 something new": "At Fenster something new",
        }  # fmt: skip
        tab.wait_for(f"{call % json.dumps('On the way to kitchen.')}.then((text) => text.includes('Pantry'))")
        for sentence, translation in sentences.items():
            assert tab.evaluate(call % json.dumps(sentence)) == translation


@pytest.mark.slow
@needs_chromium
def test_a_very_long_sentence_does_not_keep_the_page_busy(spanish: Callable[[str], str]) -> None:
    for length in (490, 10**6):
        text = ("The a marked b at x c m, y d m, " * length)[:length]
        assert spanish(text) == text


@pytest.fixture
def serving(page: Any) -> Any:
    """A robot on its round, with a forecast, a failed table and a warning."""
    show_a_room(page.server)
    missed = ("table 3 was not reached: No progress: the robot is stuck.",)
    page.server.set_layer(
        "delivery",
        DeliveryView(
            state="driving", place="table_1", round_active=True, loaded=True, queue=("table_2",),
            delivered=("table_4",), step="On the way to table 1.", missed=missed,
        ),
    )  # fmt: skip
    stops = [("table_1", 8.0), ("table_2", 15.0), ("home", 30.0)]
    forecast = tuple(
        RoundStopView(place=place, distance=distance, time=60.0, battery=80.0) for place, distance in stops
    )
    page.server.set_layer("forecast", forecast)
    warnings = ("The lidar has sent nothing for more than 0.3 s.",)
    page.server.set_layer("status", StatusView(phase="On the way to table 1.", warnings=warnings))
    return page


@pytest.mark.rotated
@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("code", CATALOGUES)
def test_no_screen_shows_english_in_another_language(serving: Any, code: str) -> None:
    with open_tab(serving.url, NO_GPU) as tab:
        choose(tab, code)
        for width, height in SIZES:
            tab.resize(width, height)
            tab.wait_for("document.querySelectorAll('#queue li').length === 1")
            for panel in ("serve", "drive", "health"):
                tab.evaluate(f"document.querySelector('[data-tab={panel}]').click()")
                assert tab.evaluate(ENGLISH_LEFT % code) == [], (panel, width)
                assert tab.evaluate("document.documentElement.scrollWidth") == width, panel
        assert tab.evaluate("getComputedStyle(document.body).direction") == ("rtl" if code == "ar" else "ltr")
        assert not tab.errors()


@pytest.mark.slow
@needs_chromium
def test_a_round_is_served_in_german(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer(
        "delivery", DeliveryView(state="waiting", place="table_1", waits_for="taken", round_active=True)
    )
    with open_tab(page.url, NO_GPU) as tab:
        choose(tab, "de")
        tab.wait_for("document.querySelectorAll('#tables button').length === 2")
        assert tab.evaluate("document.querySelector('#tables button').textContent") == "Tisch 1"
        assert tab.evaluate("document.getElementById('stop').textContent") == "STOPP"
        tab.wait_for("!document.getElementById('taken').hidden")
        tab.evaluate("document.getElementById('taken').click()")
        assert page.next_command().place == "table_1"  # the robot's own name of the place


@pytest.mark.slow
@needs_chromium
def test_the_language_is_the_browsers_until_another_is_chosen(page: Any) -> None:
    with open_tab(page.url, NO_GPU) as tab:
        assert tab.evaluate("document.documentElement.lang") == "en"
        agent = tab.evaluate("navigator.userAgent")
        tab.call("Emulation.setUserAgentOverride", userAgent=agent, acceptLanguage="it-IT,fr-CH,de")
        tab.reload_by("location.reload()")
        tab.wait_for("document.documentElement.lang === 'fr'")
        choose(tab, "en")
        tab.reload_by("location.reload()")
        tab.wait_for(f"document.documentElement.lang === 'en' && {UP}")


@pytest.mark.slow
@needs_chromium
def test_a_browser_without_storage_keeps_no_language(page: Any) -> None:
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(UP)
        tab.evaluate("Storage.prototype.setItem = () => { throw new Error('blocked'); }")
        tab.evaluate(CHOOSE % "de")
        tab.wait_for("document.getElementById('notice').textContent.includes('cannot store settings')")
        assert tab.evaluate("document.getElementById('language').value") == "en"


@pytest.mark.slow
@needs_chromium
def test_a_missing_catalogue_leaves_the_page_in_english(page: Any) -> None:
    with open_tab(page.url, NO_GPU) as tab:
        tab.wait_for(UP)
        tab.call("Network.setBlockedURLs", urls=["*/languages/fr.json"])
        tab.reload_by(CHOOSE % "fr")
        tab.wait_for(f"{UP} && document.getElementById('notice').textContent.includes('Français')")
        assert tab.evaluate("document.documentElement.lang") == "en"
        assert tab.evaluate("document.getElementById('stop').textContent") == "STOP"


@pytest.mark.slow
@needs_chromium
def test_a_catalogue_that_never_arrives_does_not_keep_stop_away(page: Any) -> None:
    with open_tab(page.url, NO_GPU) as tab:
        choose(tab, "ar")
        tab.call(
            "Fetch.enable", patterns=[{"urlPattern": "*/languages/ar.json"}]
        )  # held back, as nobody continues it
        before = len(tab.events)
        tab.evaluate("void setTimeout(() => location.reload(), 100)")
        tab.wait_for_event("Fetch.requestPaused", before)
        tab.wait_for(f"{UP} && document.getElementById('stop').textContent === 'STOP'")
        tab.evaluate("document.getElementById('stop').dispatchEvent(new PointerEvent('pointerdown'))")
        assert isinstance(page.next_command(), Stop)
