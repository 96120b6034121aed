"""Makes docs/pictures/*.png from real runs: `python docs/make_pictures.py [folder for the runs]`.

Two demos in the hotel, one with the depth camera and one with the lidar, are run first unless the folder
(runs/pictures) holds them already. Everything drawn comes out of their logs or out of the library itself.
"""

from __future__ import annotations

import sys

from picture_tools import PICTURES
from pictures_of_the_robot import (
    calibration,
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
    PICTURES.mkdir(exist_ok=True)
    wanted = sys.argv[2:]
    for picture in ALL:
        if not wanted or picture.__name__ in wanted:
            picture()


if __name__ == "__main__":
    main()
