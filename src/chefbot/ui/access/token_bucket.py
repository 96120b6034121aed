"""Token bucket: a rate limit that allows short bursts."""

from __future__ import annotations


class TokenBucket:
    """Allows `rate` messages per second, and `burst` at once after a pause; times in s of one monotonic clock."""

    def __init__(self, rate: float, burst: float, now: float) -> None:
        self.rate, self.burst = rate, burst
        self._tokens, self._updated = burst, now

    def take(self, now: float) -> bool:
        """Count a message and return whether it is within the limit."""
        self._tokens = min(self.burst, self._tokens + (now - self._updated) * self.rate) - 1.0
        self._updated = now
        return self._tokens >= 0.0

    def give_back(self) -> None:
        """Leave the last message out of the count."""
        self._tokens += 1.0
