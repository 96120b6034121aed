"""Names of the profiles of realism."""

from __future__ import annotations

from typing import get_args

import pytest

from chefbot.errors import UserError
from chefbot.sim.realism import RealismProfile, check_profile


@pytest.mark.parametrize("profile", get_args(RealismProfile))
def test_each_profile_has_its_name(profile: str) -> None:
    check_profile(profile)


@pytest.mark.parametrize("profile", ["", "foo", "Real", "perfect "])
def test_another_name_is_refused_with_the_three(profile: str) -> None:
    with pytest.raises(UserError, match="must be real, perfect or assembled"):
        check_profile(profile)
