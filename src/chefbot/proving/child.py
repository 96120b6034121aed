"""The process of one run: `python -m chefbot.proving.child FOLDER`, with the run's spec on standard input.

It writes FOLDER/record.json. It exits when its standard input ends, so that it never outlives its worker.
"""

from __future__ import annotations

import os
import sys
import threading
import traceback
from pathlib import Path

import msgspec

from chefbot.errors import ChefbotError
from chefbot.proving.record import CANNOT_RUN, LENGTH_BYTES, RECORD_NAME
from chefbot.proving.run import make_run
from chefbot.proving.run_spec import RunSpec, crashed
from chefbot.storage.atomic_files import write_atomic

TRACEBACK_LINES = 4


def main() -> int:
    """Make the run; an error becomes the failure of its record, as other seeds may do without it."""
    folder = Path(sys.argv[1])
    stdin = sys.stdin.buffer
    spec = msgspec.msgpack.decode(stdin.read(int.from_bytes(stdin.read(LENGTH_BYTES), "big")), type=RunSpec)
    threading.Thread(target=_exit_at_end_of_input, name="parent watch", daemon=True).start()
    try:
        record = make_run(spec, folder)
    except ChefbotError as error:
        record = crashed(spec, f"{CANNOT_RUN}{error}")
    except Exception:
        record = crashed(spec, "".join(traceback.format_exc().splitlines(keepends=True)[-TRACEBACK_LINES:]))
    write_atomic(folder / RECORD_NAME, msgspec.json.encode(record))
    return 0


def _exit_at_end_of_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # threads of libraries may still wait
