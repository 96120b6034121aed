"""The process of the secure router: status lines, and its end with the input."""

from __future__ import annotations

import io
import json
import sys

import pytest

from chefbot.fleet import router_process
from chefbot.fleet.router_process import FAILED, OPEN

CONFIG = {"mode": "peer", "scouting": {"multicast": {"enabled": False}}, "listen": {"endpoints": []}}


class Session:
    """A session that notes whether it was closed while input was left."""

    def __init__(self, stdin: io.StringIO) -> None:
        self.stdin, self.closed = stdin, False

    def close(self) -> None:
        assert self.stdin.read() == "", "the router runs until the input ends"
        self.closed = True


def test_the_router_runs_until_its_input_ends(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stdin = io.StringIO(json.dumps(CONFIG) + "\nmore\n")
    session, configs = Session(stdin), []
    monkeypatch.setattr(sys, "stdin", stdin)
    monkeypatch.setattr(router_process.zenoh, "try_init_log_from_env", lambda: None)
    monkeypatch.setattr(router_process.zenoh, "open", lambda config: configs.append(config) or session)
    router_process.main()
    assert capsys.readouterr().out == f"{OPEN}\n" and session.closed
    assert "peer" in str(configs[0])


@pytest.mark.parametrize("text", ["nonsense", '{"mode": "no such mode"}', ""])
def test_an_invalid_configuration_is_one_status_line(
    text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(text + "\n"))
    monkeypatch.setattr(router_process.zenoh, "try_init_log_from_env", lambda: None)
    router_process.main()
    out = capsys.readouterr().out
    assert out.startswith(FAILED) and out.count("\n") == 1 and not out.startswith(OPEN)
