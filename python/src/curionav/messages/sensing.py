"""What the robot senses and where it believes it is (``schemas/sensing.cddl``).

Every stream carries the ``tick`` it belongs to; a ``stamp`` is the robot's clock, in s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from ..array import F32, F64, U32, Array, Variances
from ..field_types import MAX_MAGNITUDE, Fault, Fraction, NonNegative, Number, Positive, Uint, Uint32
from ..record import Message, Record
from .robot import Pose


@dataclass(frozen=True, eq=False, kw_only=True)
class Scan(Message):
    """One turn of the laser.

    ``ranges`` has shape [beams], m; ``range_max`` stands for nothing hit. The first beam is at ``angle_min``, the next
    ``angle_increment`` further (rad, laser frame); ``laser`` is the laser's pose in the robot frame.
    """

    NAME: ClassVar[str] = "scan"
    MAX_BYTES: ClassVar[int] = 64 << 10

    tick: Uint
    stamp: Number
    angle_min: Number
    angle_increment: Number
    range_max: Positive
    laser: Pose
    ranges: Annotated[F32, Array("f32", "beams", low=0.0, limit=8192)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Odometry(Message):
    """Pose (m, rad, odometry frame), forward speed ``v`` (m/s) and turn rate ``omega`` (rad/s)."""

    NAME: ClassVar[str] = "odometry"
    MAX_BYTES: ClassVar[int] = 1 << 10

    tick: Uint
    stamp: Number
    x: Number
    y: Number
    heading: Number
    v: Number
    omega: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class People(Message):
    """The people a tracker sees; every array has shape [people].

    ``id`` is steady over time, ``x`` and ``y`` are in m, ``vx`` and ``vy`` in m/s over ground; in the frame ``robot``
    x points ahead and y left. ``radius`` is that of a person, m. ``position_covariance`` (m^2) and
    ``velocity_covariance`` (m^2/s^2) have shape [people, 3], of (xx, xy, yy) in the same frame; they are ``None`` if
    people are known without error. ``age`` is for how long each has not been seen, s; ``None``: all are seen now.
    """

    NAME: ClassVar[str] = "people"
    MAX_BYTES: ClassVar[int] = 128 << 10

    tick: Uint
    stamp: Number
    frame: Literal["map", "robot"]
    radius: NonNegative
    id: Annotated[U32, Array("u32", "people", high=2**32 - 1, limit=1024)]
    x: Annotated[F64, Array("f64", "people")]
    y: Annotated[F64, Array("f64", "people")]
    vx: Annotated[F64, Array("f64", "people")]
    vy: Annotated[F64, Array("f64", "people")]
    position_covariance: Annotated[F64, Array("f64", "people", 3)] | None = None
    velocity_covariance: Annotated[F64, Array("f64", "people", 3)] | None = None
    age: Annotated[F32, Array("f32", "people", low=0.0)] | None = None

    def check(self) -> None:
        """No variance is negative."""
        for name in ("position_covariance", "velocity_covariance"):
            values = getattr(self, name)
            if values is None:
                continue
            flat = values.reshape(-1)
            wrong = [i for i in range(flat.size) if i % 3 != 1 and flat[i] < 0.0]
            if wrong:
                raise Fault("out_of_range", f"{name}[{wrong[0]}]", found=float(flat[wrong[0]]), least=0.0, most=1e12)


@dataclass(frozen=True, eq=False, kw_only=True)
class Health(Record):
    """How far a belief can be trusted beyond its covariance.

    ``outside_weight`` is the share of particle weight outside the heaviest cluster, ``scan_fit`` how well the scan fits
    the map at the mean (both 0..1).
    """

    outside_weight: Fraction
    scan_fit: Fraction
    particles: Uint32
    converged: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class Belief(Message):
    """Mean (m, rad, map frame) and covariance of the heaviest cluster; ``v`` (m/s) and ``omega`` (rad/s) from odometry.

    ``covariance`` has shape [3, 3], of (x, y, heading): m^2, m rad, rad^2.
    """

    NAME: ClassVar[str] = "belief"
    MAX_BYTES: ClassVar[int] = 2 << 10

    tick: Uint
    stamp: Number
    x: Number
    y: Number
    heading: Number
    covariance: Variances
    v: Number
    omega: Number
    health: Health

    def check(self) -> None:
        """No variance is negative."""
        check_variances("covariance", self.covariance)


@dataclass(frozen=True, eq=False, kw_only=True)
class Particles(Message):
    """Poses the robot may have (m, rad, map frame), which the belief is made of; every array has shape [particles].

    ``weight`` says how likely each is beside the others. Twice a second of the robot's clock, for those who look on.
    """

    NAME: ClassVar[str] = "particles"
    MAX_BYTES: ClassVar[int] = 129 << 10

    tick: Uint
    stamp: Number
    x: Annotated[F32, Array("f32", "particles", limit=8192)]
    y: Annotated[F32, Array("f32", "particles")]
    heading: Annotated[F32, Array("f32", "particles")]
    weight: Annotated[F32, Array("f32", "particles", low=0.0)]


def check_variances(field: str, covariance: F64) -> None:
    """Refuses a negative variance on the diagonal."""
    least = float(np.asarray(covariance).diagonal().min())
    if least < 0.0:
        raise Fault("out_of_range", field, found=least, least=0.0, most=MAX_MAGNITUDE)


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene(Message):
    """One moment as the planner sees it: the belief, the people in the map frame, whether localisation is uncertain.

    ``in_place_s`` are the seconds for which the robot has not left the place where it is. ``impatient`` says that it
    has stayed where it is for so long that terms which give way count less.
    """

    NAME: ClassVar[str] = "scene"
    MAX_BYTES: ClassVar[int] = 132 << 10

    tick: Uint
    stamp: Number
    belief: Belief
    people: People
    uncertain: bool
    in_place_s: NonNegative
    impatient: bool = False

    def check(self) -> None:
        """The people are in the map frame."""
        if self.people.frame != "map":
            raise Fault("wrong_frame", "people.frame")
