"""The protocol between computer and motor board (docs/protocol.md): pure, for the real and the simulated board.

Nothing here has a clock, a thread or a port; time is integer nanoseconds, given by the caller.

    session = BoardSession(robot, token=os.getpid())
    received: list[ReceivedLine] = session.receive_data(data, now_ns)  # lines with a valid CRC, in order, once
    data: bytes = session.data_to_send(now_ns)            # call every 20 ms and send: handshake, repeats, heartbeat
    data: bytes = session.command(left, right, now_ns)    # requested wheel speeds, rad/s; send at once
    data: bytes = session.stop(now_ns)                    # emergency stop, repeated by data_to_send; send at once
    session.clear(now_ns)                                 # clear latched faults, sent by data_to_send
    session.connection_lost()                             # the serial connection is lost
    session.is_open, .refused, .warning, .version, .flags, .silent(now_ns)

    sensors = SensorConverter(robot)
    messages: list[Message] = sensors.messages(received[0])    # Imu before WheelTicks; Range; BatteryState

    health = LinkDiagnostics()
    health.update(received[0].line, now_ns)
    status: DiagnosticStatus = health.report(session, port_name, now_ns)      # about once a second

`link`: `BoardLink(robot, token)` combines these three; `chapter_board`: `ChapterLink(robot)` is the same for the
book chapter's original board. `autodetect`: `ProtocolProbe` detects which of the two is at a port.
`framing`: CRC, `frame(text) -> bytes`, `unframe(line) -> str or None`, `LineSplitter.push(data) -> list[bytes]`.
`messages`: `parse(line)` returns a BoardLine of its type, or None.
`sequence_filter`: `SequenceFilter.accept(line, now_ns) -> ReceivedLine or None`.
`status_codes`: `BoardFlag`, `BoardState`, `faults(flags)`, `warnings(flags)`, `reason(number)`.
"""

from chefbot.board.framing import LineSplitter, frame, unframe
from chefbot.board.link_health import LinkDiagnostics
from chefbot.board.messages import parse
from chefbot.board.sensors import SensorConverter
from chefbot.board.sequence_filter import ReceivedLine, SequenceFilter
from chefbot.board.session import BoardSession

__all__ = [
    "BoardSession",
    "LineSplitter",
    "LinkDiagnostics",
    "ReceivedLine",
    "SensorConverter",
    "SequenceFilter",
    "frame",
    "parse",
    "unframe",
]
