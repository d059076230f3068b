"""What a robot is: pose, outline, limits of motion, laser, odometry noise (``schemas/0-basics.cddl``)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from ..array import F64, Array
from ..field_types import Fault, Float, Integer, NonNegative, Number, Positive
from ..record import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class Pose(Record):
    """Position (m) and heading (rad, counter-clockwise from x) in the frame its field names."""

    x: Number
    y: Number
    heading: Number


class Footprint(Record):
    """Outline of the robot around its centre of rotation: a `Disc` or a `Polygon`."""

    TAGGED: ClassVar[bool] = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Disc(Footprint):
    """A disc of ``radius`` m."""

    kind: Literal["disc"] = "disc"
    radius: Positive


@dataclass(frozen=True, eq=False, kw_only=True)
class Polygon(Footprint):
    """A polygon in the robot frame, counter-clockwise; ``x`` and ``y`` have shape [vertices], m, 3 or more."""

    kind: Literal["polygon"] = "polygon"
    x: Annotated[F64, Array("f64", "vertices", limit=64)]
    y: Annotated[F64, Array("f64", "vertices")]

    def check(self) -> None:
        """Three vertices at least."""
        if len(self.x) < 3:
            raise Fault("too_few", "x", found=len(self.x), least=3)


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotModel(Record):
    """Outline and limits of a unicycle: speed m/s, acceleration m/s^2, turn rate rad/s, its change rad/s^2."""

    footprint: Footprint
    v_max: Positive
    a_max: Positive
    omega_max: Positive
    alpha_max: Positive


@dataclass(frozen=True, eq=False, kw_only=True)
class LaserModel(Record):
    """A planar laser range finder.

    ``robot_from_laser`` is its pose in the robot frame, ``fov`` its field of view (rad, up to a full turn, centred on
    its heading), ``range_max`` and ``range_sigma`` (standard deviation) are in m; ``beams`` are equally spaced,
    counter-clockwise.
    """

    robot_from_laser: Pose
    fov: Annotated[float, Float(high=math.tau + 1e-6, positive=True)]
    beams: Annotated[int, Integer(2, 8192)]
    range_max: Positive
    range_sigma: NonNegative


@dataclass(frozen=True, eq=False, kw_only=True)
class OdometryNoise(Record):
    """Variance of dead reckoning per distance: position m^2/m and m^2/rad, heading rad^2/m and rad^2/rad."""

    position_per_metre: NonNegative
    position_per_radian: NonNegative
    heading_per_metre: NonNegative
    heading_per_radian: NonNegative
