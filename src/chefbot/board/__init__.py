"""The protocol between computer and motor board (docs/protocol.md): pure, for the real and the simulated board.

Nothing here has a clock, a thread or a port; time is integer nanoseconds, given by the caller.

    session = Session(robot, token=os.getpid())
    received: list[Heard] = session.hear(data, now_ns)    # only lines with a valid CRC, in order, once
    data: bytes = session.speak(now_ns)                   # call every 20 ms and send: handshake, repeats, heartbeat
    data: bytes = session.command(left, right, now_ns)    # requested wheel speeds at the ground, m/s; send at once
    data: bytes = session.stop(now_ns)                    # emergency stop, repeated by speak; send at once
    session.clear(now_ns)                                 # clear latched faults, sent by speak
    session.lost_line()                                   # the serial connection is lost
    session.is_open, .refused, .warning, .version, .flags, .silent(now_ns)

    sensors = Sensors(robot)
    messages: list[Message] = sensors.messages(received[0])    # Imu before WheelTicks; Range; BatteryState

    health = Health()
    health.take(received[0].line, now_ns)
    status: DiagnosticStatus = health.report(session, port_name, now_ns)      # about once a second

`link`: `BoardLink(robot, token)` combines these three; `chapter_board`: `ChapterLink(robot)` is the same for the
book chapter's original board. `autodetect`: `Probe` detects which of the two is at a port.
`framing`: CRC, `frame(text) -> bytes`, `unframe(line) -> str or None`, `LineSplitter.push(data) -> list[bytes]`.
`messages`: `parse(line)` returns a Version, Motion, Inertia, Status, Echo, Battery, Uptime, OtherVersion or None.
`sequence_filter`: `Stream.take(line, now_ns) -> Heard(line, stamp_ns, board_time_us, restarted) or None`.
`status_codes`: `Flag`, `State`, `faults(flags)`, `warnings(flags)`, `reason(number)`.
"""

from chefbot.board.framing import LineSplitter, frame, unframe
from chefbot.board.link_health import Health
from chefbot.board.messages import parse
from chefbot.board.sensors import Sensors
from chefbot.board.sequence_filter import Heard, Stream
from chefbot.board.session import Session

__all__ = ["Health", "Heard", "LineSplitter", "Sensors", "Session", "Stream", "frame", "parse", "unframe"]
