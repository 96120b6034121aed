"""Diagnostics of the serial link and the motor board."""

from __future__ import annotations

from chefbot.board.imu_chips import chip_name, imu_fault
from chefbot.board.messages import BoardLine, StatusLine, UptimeLine
from chefbot.board.session import BoardSession
from chefbot.board.status_codes import (
    FAULT_LATCHED,
    LATCHED,
    BoardFlag,
    BoardState,
    as_text,
    motors_off,
    reason,
    warnings,
)
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus, KeyValue

REFUSALS_SHOWN_NS = 3_000_000_000
"""Time for which a refused line stays in the diagnostics, ns."""
MAX_LOSS = 0.02
"""Share of lost or damaged lines in the last second above which a warning is reported."""

NEUTRAL_REQUIRED = "a stop must be commanded before the robot drives: release the controls once"

TICKS_STALE = "no encoder ticks from the board: the robot is stopped until they are received again"


class LinkDiagnostics:
    """Collects the state of the board from its lines and reports it with the levels of diagnostic_msgs."""

    def __init__(self) -> None:
        self.status: StatusLine | None = None
        self.uptime: UptimeLine | None = None
        self._refused_ns = -REFUSALS_SHOWN_NS
        self._counts = (0, 0)
        self._lines = 0
        self._loss = 0.0

    def update(self, line: BoardLine, now_ns: int) -> None:
        """Update the state from one accepted line."""
        self._lines += 1
        if isinstance(line, StatusLine):
            if self.status is not None and line.refused != self.status.refused:
                self._refused_ns = now_ns
            self.status = line
        if isinstance(line, UptimeLine):
            self.uptime = line

    def report(self, session: BoardSession, port: str, now_ns: int) -> DiagnosticStatus:
        """Return the diagnostics; call it at about 1 Hz, as the share of lost lines is taken since the last
        call."""
        self._measure_loss(session)
        level, sentences = self._assess(session, now_ns)
        message = as_text(sentences) or "The board is OK."
        return DiagnosticStatus(level, "board", message, port, self._values(session))

    def _measure_loss(self, session: BoardSession) -> None:
        # Loss rate since the last report.
        counts = (session.stream.lost, self._lines)
        lost, received = (now - previous for now, previous in zip(counts, self._counts, strict=True))
        self._loss = lost / max(1, lost + received)
        self._counts = counts

    def _assess(self, session: BoardSession, now_ns: int) -> tuple[int, list[str]]:
        if session.refused is not None:
            return ERROR, [session.refused]
        if session.silent(now_ns):
            return ERROR, ["no data from the board"]
        # Latched faults: the motors are off until they are cleared.
        latched_faults = motors_off(session.flags)
        if latched_faults:
            return ERROR, [*latched_faults, *self._warnings(session, now_ns)]
        if not session.is_open:
            return ERROR, ["the board sends data but does not answer the handshake", *warnings(session.flags)]
        sentences = self._warnings(session, now_ns)
        return (WARN if sentences else OK), sentences

    def _warnings(self, session: BoardSession, now_ns: int) -> list[str]:
        sentences = warnings(session.flags)
        if session.flags & BoardFlag.IMU_BAD and self.uptime is not None:
            sentences = [*warnings(session.flags & ~BoardFlag.IMU_BAD), imu_fault(self.uptime.imu)]
        if session.waiting_for_stop(now_ns):
            sentences.append(NEUTRAL_REQUIRED)
        if session.ticks_stale(now_ns):
            sentences.append(TICKS_STALE)
        if session.warning is not None:
            sentences.append(session.warning)
        if self._loss > MAX_LOSS:
            sentences.append(f"{100 * self._loss:.0f} % of the board's lines are lost or damaged")
        if self.status is not None and now_ns - self._refused_ns < REFUSALS_SHOWN_NS:
            # A latched fault is reported itself, as long as it is latched.
            is_known = self.status.reason == FAULT_LATCHED
            sentences += [] if is_known else [f"the board refused a line: {reason(self.status.reason)}"]
        return sentences

    def _values(self, session: BoardSession) -> tuple[KeyValue, ...]:
        values: dict[str, object] = {
            "flags": f"{session.flags:04X}",
            "latched": bool(session.flags & LATCHED),
            "lines": self._lines,
            "lost": session.stream.lost,
            "damaged": session.damaged,
            "rejected": session.stream.rejected,
            "restarts": session.stream.restarts,
            "handshakes": session.handshakes,
            **self._board_values(),
        }
        if session.version is not None:
            values["firmware"] = f"{session.version.port} {session.version.hash:08X}"
        return tuple(KeyValue(key, str(value)) for key, value in values.items())

    def _board_values(self) -> dict[str, object]:
        """Return the figures of the last `s` and `t` lines."""
        values: dict[str, object] = {}
        if (status := self.status) is not None:
            known_state = status.state in BoardState.__members__.values()
            values["state"] = BoardState(status.state).name.lower() if known_state else status.state
            values["speeds"] = f"{status.set_left} {status.set_right} ticks/s"
            values["duties"] = f"{status.duty_left} {status.duty_right}"
            values["refused"] = status.refused
            values["last refusal"] = reason(status.reason) if status.reason else "none"
            values["illegal encoder steps"] = f"{status.illegal_left} {status.illegal_right}"
        if (uptime := self.uptime) is not None:
            values["uptime"] = f"{uptime.uptime} s"
            values["lines dropped (buffer full)"] = uptime.dropped
            values["control steps missed"] = uptime.missed
            values["IMU"] = chip_name(uptime.imu)
        return values
