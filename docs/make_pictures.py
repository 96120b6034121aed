"""Makes the pictures of docs/ from real runs: `python docs/make_pictures.py [FOLDER [NAME ...]]`.

Pictures and runs go into FOLDER; without one the repository's own docs/pictures are written, with runs in
runs/pictures. Two demos in the hotel, one with the depth camera and one with the lidar, are run first unless they are
there already. Everything drawn comes out of their logs or out of the library itself.
"""

from __future__ import annotations

import sys

from pictures_of_the_robot import (
    calibration,
    generated_office,
    odometry,
    robot_from_its_file,
    seen_by_the_camera,
    simulated_world,
)
from pictures_of_thought import amcl, delivery, dwa, exploration, hotel, planning, slam

ALL = (
    hotel,
    robot_from_its_file,
    simulated_world,
    generated_office,
    seen_by_the_camera,
    odometry,
    slam,
    exploration,
    amcl,
    planning,
    dwa,
    delivery,
    calibration,
)


def main() -> None:
    """All pictures, or those named on the command line behind the folder."""
    wanted = sys.argv[2:]
    known = [picture.__name__ for picture in ALL]
    if not set(wanted) <= set(known):
        sys.exit(
            f"no picture is called {', '.join(sorted(set(wanted) - set(known)))}; there are {', '.join(known)}"
        )
    for picture in ALL:
        if not wanted or picture.__name__ in wanted:
            picture()


if __name__ == "__main__":
    main()
