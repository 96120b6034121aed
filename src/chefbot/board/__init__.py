"""The line between computer and motor board (docs/protocol.md): pure, for the built and the simulated board.

Nothing here has a clock, a thread or a port; time is integer nanoseconds, given by the caller.

    session = Session(robot, token=os.getpid())
    heard: list[Heard] = session.hear(data, now_ns)       # bytes in; only lines with valid CRC, in order, once
    data: bytes = session.speak(now_ns)                   # call every 20 ms and send: handshake, repeats, heartbeat
    data: bytes = session.command(left, right, now_ns)    # rim speeds in m/s from upstream; send at once
    data: bytes = session.stop(now_ns)                    # emergency stop, repeated by speak; send at once
    session.clear(now_ns)                                 # lift latched faults, said by speak
    session.lost_line()                                   # the cable is out
    session.is_open, .refused, .warning, .version, .flags, .silent(now_ns)

    sensors = Sensors(robot)
    messages: list[Message] = sensors.messages(heard[0])  # Imu before WheelTicks; Range; BatteryState

    health = Health()
    health.take(heard[0].line, now_ns)
    status: DiagnosticStatus = health.report(session, port_name, now_ns)      # about once a second

`link`: `BoardLink(robot, token)` is these three as one; `chapter`: `ChapterLink(robot)` is the same for the chapter's
own board. `probe`: `Probe` tells which of the two is at a port.
`frame`: CRC, `frame(text) -> bytes`, `unframe(line) -> str | None`, `LineSplitter.push(data) -> list[bytes]`.
`lines`: `parse(line) -> Version | Motion | Inertia | Status | Echo | Battery | Uptime | OtherVersion | None`.
`stream`: `Stream.take(line, now_ns) -> Heard(line, stamp_ns, board_us, restarted) | None`.
`words`: `Flag`, `State`, `faults(flags)`, `warnings(flags)`, `reason(number)`.
"""

from chefbot.board.framing import LineSplitter, frame, unframe
from chefbot.board.link_health import Health
from chefbot.board.messages import parse
from chefbot.board.sensors import Sensors
from chefbot.board.sequence_filter import Heard, Stream
from chefbot.board.session import Session

__all__ = ["Health", "Heard", "LineSplitter", "Sensors", "Session", "Stream", "frame", "parse", "unframe"]
