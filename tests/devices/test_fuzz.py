"""The computer's end of the line, fuzzed; `make fuzz SECONDS=3600` goes on with ever new seeds."""

from __future__ import annotations

import pytest
from tests.devices.host_fuzz import RUN_BYTES, fuzz


@pytest.mark.rotated
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
def test_ten_million_random_bytes_from_the_board_do_no_harm(seed: int) -> None:
    """Two million for each seed; every second one with forged lines."""
    tally = fuzz(seed, RUN_BYTES)
    assert tally.bytes >= RUN_BYTES
    assert tally.believed > 10_000 and tally.damaged > 10_000 and tally.sessions > 10 and tally.moving > 1_000
