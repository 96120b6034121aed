"""The link's and the board's state as diagnostics."""

from __future__ import annotations

from chefbot.board.messages import BoardLine, Status, Uptime
from chefbot.board.session import Session
from chefbot.board.status_codes import (
    CLEAR,
    FAULT_LATCHED,
    LATCHED,
    RESUME,
    Flag,
    State,
    faults,
    reason,
    warnings,
)
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus, KeyValue

REFUSALS_SHOWN_NS = 3_000_000_000
"""A refused line is told for so long."""
LOSS_TOLD = 0.02
"""Share of lost or damaged lines in the last second above which it is told."""

HELD_BACK = "the robot waits for a stop to be commanded before it drives: let go of the controls once"

BLIND = "the board's ticks do not come through: the robot is told to stand until they do"


class Health:
    """Collects what lines say of the board; `report` puts it in words, with levels of diagnostic_msgs."""

    def __init__(self) -> None:
        self.status: Status | None = None
        self.uptime: Uptime | None = None
        self._refused_ns = -REFUSALS_SHOWN_NS
        self._counts = (0, 0)
        self._lines = 0
        self._loss = 0.0

    def take(self, line: BoardLine, now_ns: int) -> None:
        """One line that counts."""
        self._lines += 1
        if isinstance(line, Status):
            if self.status is not None and line.refused != self.status.refused:
                self._refused_ns = now_ns
            self.status = line
        if isinstance(line, Uptime):
            self.uptime = line

    def report(self, session: Session, port: str, now_ns: int) -> DiagnosticStatus:
        """Call it at about 1 Hz: the share of lost lines is that since the last call."""
        self._measure_loss(session)
        level, sentences = self._judge(session, now_ns)
        message = " ".join(f"{s[0].upper()}{s[1:]}." for s in sentences) or "The board is well."
        return DiagnosticStatus(level, "board", message, port, self._values(session))

    def _measure_loss(self, session: Session) -> None:
        counts = (session.stream.lost, self._lines)
        lost, heard = (now - before for now, before in zip(counts, self._counts, strict=True))
        self._loss = lost / max(1, lost + heard)
        self._counts = counts

    def _judge(self, session: Session, now_ns: int) -> tuple[int, list[str]]:
        if session.refused is not None:
            return ERROR, [session.refused]
        if session.silent(now_ns):
            return ERROR, ["the board says nothing"]
        stopped = faults(session.flags)
        if stopped:
            release = RESUME if session.flags & LATCHED == Flag.ESTOP_COMMAND else CLEAR
            return ERROR, [*stopped, f"the motors are off; {release}", *self._complaints(session, now_ns)]
        if not session.is_open:
            return ERROR, ["the board talks but does not answer the handshake", *warnings(session.flags)]
        complaints = self._complaints(session, now_ns)
        return (WARN if complaints else OK), complaints

    def _complaints(self, session: Session, now_ns: int) -> list[str]:
        found = warnings(session.flags)
        if session.held_back(now_ns):
            found.append(HELD_BACK)
        if session.blind(now_ns):
            found.append(BLIND)
        if session.warning is not None:
            found.append(session.warning)
        if self._loss > LOSS_TOLD:
            found.append(f"{100 * self._loss:.0f} % of the board's lines are lost or damaged")
        if self.status is not None and now_ns - self._refused_ns < REFUSALS_SHOWN_NS:
            known = self.status.reason == FAULT_LATCHED and session.flags & LATCHED
            found += [] if known else [f"the board refused a line: {reason(self.status.reason)}"]
        return found

    def _values(self, session: Session) -> tuple[KeyValue, ...]:
        values: dict[str, object] = {
            "flags": f"{session.flags:04X}",
            "latched": bool(session.flags & LATCHED),
            "lines": self._lines,
            "lost": session.stream.lost,
            "damaged": session.damaged,
            "left out": session.stream.left_out,
            "restarts": session.stream.restarts,
            "handshakes": session.handshakes,
            **self._told(),
        }
        if session.version is not None:
            values["firmware"] = f"{session.version.port} {session.version.hash:08X}"
        return tuple(KeyValue(key, str(value)) for key, value in values.items())

    def _told(self) -> dict[str, object]:
        """Of the last `s` and `t` lines."""
        told: dict[str, object] = {}
        if (status := self.status) is not None:
            known = status.state in State.__members__.values()
            told["state"] = State(status.state).name.lower() if known else status.state
            told["speeds"] = f"{status.set_left} {status.set_right} ticks/s"
            told["duties"] = f"{status.duty_left} {status.duty_right}"
            told["refused"] = status.refused
            told["last refusal"] = reason(status.reason) if status.reason else "none"
            told["illegal encoder steps"] = f"{status.illegal_left} {status.illegal_right}"
        if (uptime := self.uptime) is not None:
            told["uptime"] = f"{uptime.uptime} s"
            told["lines without room"] = uptime.dropped
            told["control steps missed"] = uptime.missed
        return told
