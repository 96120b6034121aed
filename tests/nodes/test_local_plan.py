"""The candidates of a controller as a message."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.control.controller import ComparedTwists
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.navigation import TrajectoryCandidates
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.validity import check
from chefbot.nodes.navigation.local_plan import candidates_message

TWISTS = np.array([[0.0, 0.0], [0.2, 0.5], [0.4, -0.5]])


def test_the_message_has_what_was_compared() -> None:
    scores = np.array([1.0, np.inf, 0.5])
    compared = ComparedTwists(SE2(1.0, 2.0, 0.5), (0.1, 0.2), TWISTS, scores, 1.7)
    message = TrajectoryCandidates.from_cdr(candidates_message(Header.of(5, "odom"), compared).to_cdr())
    check(message)
    assert message.pose.se2 == pytest.approx((1.0, 2.0, 0.5))
    assert (message.present.linear.x, message.present.angular.z) == (0.1, 0.2)
    assert np.column_stack([message.linear, message.angular]) == pytest.approx(TWISTS)
    assert list(message.scores) == [1.0, np.inf, 0.5] and message.duration == pytest.approx(1.7)


def test_nothing_compared_is_an_empty_message() -> None:
    message = candidates_message(Header.of(5, "odom"), None)
    check(message)
    assert len(message.scores) == 0 and message.header.frame_id == "odom"
