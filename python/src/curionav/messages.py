"""The messages of the wire contract, one frozen dataclass each; units are SI and radians.

Poses are in the map frame unless a field says otherwise, arrays are NumPy arrays. ``Message.encode()`` gives the CBOR
bytes, ``Message.decode(bytes)`` reads and checks them. `generate_messages.py` writes this file from the contract,
``schemas/*.cddl``: change it there. A docstring says what stands on the wire; a field that is absent there is ``None``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from . import message_methods as methods
from .array import F32, F64, I8, U8, U32, Array, Indices, ScoredOnly
from .field_types import (
    Bytes,
    Float,
    Fraction,
    Integer,
    MapId,
    Name,
    NonNegative,
    Number,
    Params,
    Positive,
    Text,
    Uint,
    Uint32,
)
from .message_methods import NO_PARENT
from .record import Message, Record, coded


@dataclass(frozen=True, eq=False, kw_only=True)
class Pose(Record):
    """Position and heading in the frame that its field names."""

    x: Number
    """m"""
    y: Number
    """m"""
    heading: Number
    """rad, counter-clockwise from x"""


class Footprint(Record):
    """Outline of the robot around its centre of rotation."""

    TAGGED: ClassVar[bool] = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Disc(Footprint):
    """A disc."""

    kind: Literal["disc"] = "disc"
    radius: Positive
    """m, positive"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Polygon(methods.Polygon, Footprint):
    """A polygon in the robot frame, counter-clockwise."""

    kind: Literal["polygon"] = "polygon"
    x: Annotated[F64, Array("f64", "vertices", limit=64)]
    """[vertices <= 64] m, robot frame, counter-clockwise, 3 or more"""
    y: Annotated[F64, Array("f64", "vertices")]
    """[vertices] m"""


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotModel(Record):
    """Outline and limits of a unicycle."""

    footprint: Footprint
    v_max: Positive
    """m/s, positive"""
    a_max: Positive
    """m/s^2, positive"""
    omega_max: Positive
    """rad/s, positive"""
    alpha_max: Positive
    """rad/s^2, positive"""
    v_reverse: NonNegative | None = None
    """m/s backwards, not negative; absent: 0, never backwards"""


@dataclass(frozen=True, eq=False, kw_only=True)
class LaserModel(Record):
    """A planar laser range finder."""

    robot_from_laser: Pose
    """laser in the robot frame"""
    fov: Annotated[float, Float(high=6.283186307179586, positive=True)]
    """rad, positive, at most 6.283186307179586 (a full turn), centred on the laser's heading"""
    beams: Annotated[int, Integer(2, 8192)]
    """equally spaced, counter-clockwise; over a full turn the last is beside the first"""
    range_max: Positive
    """m, positive"""
    range_sigma: NonNegative
    """m, not negative: standard deviation"""


@dataclass(frozen=True, eq=False, kw_only=True)
class OdometryNoise(Record):
    """Variance of dead reckoning per distance."""

    position_per_metre: NonNegative
    """m^2 per m, not negative"""
    position_per_radian: NonNegative
    """m^2 per rad, not negative"""
    heading_per_metre: NonNegative
    """rad^2 per m, not negative"""
    heading_per_radian: NonNegative
    """rad^2 per rad, not negative"""


Degradation = Annotated[dict[str, Any], coded({
    "evaluated_locally": {"term": Name}, "partly_evaluated": {"term": Name}, "not_evaluated": {"term": Name},
    "generated_locally": {}, "partly_generated": {}, "not_generated": {}, "cut_short": {}, "not_prepared": {},
    "people_unknown": {},
})]
"""What was not as it should be: a `code` and its parameters."""


Evaluated = Literal["pool", "local", "none"]
"""What has evaluated a term: replicas (pool), the arbiter itself (local), nothing."""


MissionState = Literal["preparing", "running", "paused", "cancelled", "finished"]
"""Where a mission stands."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Previous(Record):
    """A trajectory that an earlier cycle has chosen."""

    candidate: Uint32 | None = None
    """identifier, in the cycle it comes from"""
    stamp: Number
    """s, of its scene, robot clock"""
    valid_for_s: NonNegative
    """s after the stamp, not negative"""
    dt: Positive
    """s between states, positive"""
    x: Annotated[F64, Array("f64", "K", limit=256)]
    """[1 + K <= 256] m; number k (from 0) is due at stamp + k * dt, the first is where the robot was"""
    y: Annotated[F64, Array("f64", "K")]
    """[1 + K] m"""
    heading: Annotated[F64, Array("f64", "K")]
    """[1 + K] rad"""
    v: Annotated[F64, Array("f64", "K")]
    """[1 + K] m/s"""
    omega: Annotated[F64, Array("f64", "K")]
    """[1 + K] rad/s"""


PreviousState = Annotated[dict[str, Any], coded({
    "held": {}, "absent": {}, "expired": {}, "strayed": {"distance_m": Number}, "hits_wall": {"after_s": Number},
    "hits_person": {"person": Uint32, "after_s": Number},
})]
"""What came of the previous trajectory: a `code` and its parameters."""


Reason = Annotated[dict[str, Any], coded({
    "arrived": {}, "turns_to_heading": {}, "waits_for_goal": {}, "least_cost": {}, "least_cost_free": {},
    "only_slow_free": {}, "no_candidates": {"previous": PreviousState},
    "not_scored": {"term": Name, "previous": PreviousState}, "none_free": {"previous": PreviousState},
    "mission_not_running": {"state": MissionState}, "not_prepared": {}, "people_unknown": {}, "no_way_to_goal": {},
    "goal_occupied": {}, "localises": {}, "place_unknown": {},
})]
"""Why a cycle was decided as it was: a `code` and its parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Decision(methods.Decision, Message):
    """The end of every planning cycle.

    The robot is to `follow` a candidate that every active term has scored, to `hold` the tail of the previous
    decision, or to `stop`. The trajectory is in the map frame.
    """

    NAME: ClassVar[str] = "decision"
    MAX_BYTES: ClassVar[int] = 128 << 10
    epoch: Uint
    """arbiter's incarnation; the driver takes those of one arbiter until that one has been silent for 0.6 s"""
    seq: Uint
    """cycle within the epoch"""
    tick: Uint
    """of the scene"""
    stamp: Number
    """s, of the scene, robot clock"""
    valid_for_s: NonNegative
    """s after the stamp, not negative"""
    action: Literal["follow", "hold", "stop"]
    reason: Reason
    arrived: bool
    """believed to be at the goal"""
    candidate: Uint32 | None = None
    """identifier of the one followed"""
    dt: Positive
    """s between states, positive"""
    x: Annotated[F64, Array("f64", "K", limit=256)]
    """[K <= 256] m; state k (from 0) is due at stamp + (k + 1) * dt; 0 for stop only"""
    y: Annotated[F64, Array("f64", "K")]
    """[K] m"""
    heading: Annotated[F64, Array("f64", "K")]
    """[K] rad"""
    v: Annotated[F64, Array("f64", "K")]
    """[K] m/s"""
    omega: Annotated[F64, Array("f64", "K")]
    """[K] rad/s"""
    uncertainty: Number
    """m^2, trace of the belief's position covariance"""
    uncertain: bool
    evaluated: dict[str, Evaluated]
    """by term"""
    degraded: list[Degradation]
    """what was not as it should be"""
    elapsed_us: Uint
    """microseconds"""


Rejection = Annotated[dict[str, Any], coded({
    "not_scored": {"term": Name}, "unreachable": {"step": Uint32}, "hits_wall": {"after_s": Number},
    "hits_person": {"person": Uint32, "after_s": Number}, "slow": {},
})]
"""Why a candidate was rejected: a `code` and its parameters."""


CommandReason = Literal[
    "tracking", "slowed", "in_doubt", "too_close", "way_unseen", "arrived", "told_to_stop", "mission_not_running",
    "no_odometry", "paused", "no_lease", "base_clock_wrong", "no_decision", "decision_expired",
    "decision_of_another_run", "decision_invalid", "decision_belief_unknown", "no_belief", "lost", "belief_too_old",
    "belief_of_another_run", "no_scan", "scan_too_old", "scan_of_another_run", "blind_refused", "blind_narrow",
    "blind_short", "blind_silent", "blind_rare", "blind_map",
]
"""What the driver does.

"tracking", "slowed", "in_doubt", "too_close" and "way_unseen" follow the decision: the second and third one more
slowly, the fourth one braking for what the laser sees, the fifth one for what it has not seen. All others stop.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Twist(Message):
    """What the base is to do now, and what becomes of the newest decision."""

    NAME: ClassVar[str] = "twist"
    MAX_BYTES: ClassVar[int] = 2 << 10
    lease: Uint
    """grant of the base under which the driver drives; the base obeys no other"""
    epoch: Uint
    """of the newest decision that the driver has taken; 0 before the first"""
    seq: Uint
    """of the same decision"""
    tick: Uint
    stamp: Number
    """s, robot clock"""
    v: Number
    """m/s, forward"""
    omega: Number
    """rad/s"""
    reason: CommandReason
    since: Number
    """s, robot clock: stamp of the first command since which the reason has been this one"""


@dataclass(frozen=True, eq=False, kw_only=True)
class CandidateSet(Message):
    """Candidate trajectories in the map frame."""

    NAME: ClassVar[str] = "candidate_set"
    MAX_BYTES: ClassVar[int] = 12288 << 10
    count: Annotated[int, Integer(0, 4096)]
    steps: Annotated[int, Integer(1, 256)]
    dt: Positive
    """s between states, positive"""
    id: Annotated[U32, Array("u32", "count", high=2**32 - 1)]
    """[count] of equal costs the lower wins"""
    x: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] m; state k (from 0) is (k + 1) * dt after the scene's stamp"""
    y: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] m"""
    heading: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] rad"""
    v: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] m/s, forward speed that led to the state"""
    omega: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] rad/s, turn rate that led to the state"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Crowd(Record):
    """One component of the crowd density model."""

    x: Number
    """m, mean"""
    y: Number
    """m, mean"""
    sigma: NonNegative
    """m^2, not negative: variance along each axis (equation 17 of the paper)"""
    weight: NonNegative
    """not negative, in the mixture"""
    members: Uint32
    """people"""


@dataclass(frozen=True, eq=False, kw_only=True)
class ObstacleCells(Record):
    """What the robot has seen and is on no map: squares of equal size that are turned alike."""

    x: Annotated[F32, Array("f32", "*", limit=4096)]
    """[* <= 4096] m, map frame: centres"""
    y: Annotated[F32, Array("f32", "x")]
    """[x] m, map frame"""
    heading: Number
    """rad, map frame: direction of two of their sides"""
    side: Positive
    """m, positive"""
    close_ways: bool
    """they close every way to the goal"""


Confidence = Literal["sure", "doubtful", "lost"]
"""Whether a robot may act on a belief: in doubt it drives at most 0.2 m/s, and when lost it follows no plan."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Health(Record):
    """How far a belief can be trusted beyond its covariance."""

    outside_weight: Fraction
    """0..1, probability that the robot is not in the heaviest cluster"""
    scan_fit: Fraction
    """0..1, how well the scan fits the map at the mean"""
    particles: Uint32
    confidence: Confidence


@dataclass(frozen=True, eq=False, kw_only=True)
class Belief(methods.Belief, Message):
    """Where the robot believes it is: the heaviest cluster of particles."""

    NAME: ClassVar[str] = "belief"
    MAX_BYTES: ClassVar[int] = 2 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    x: Number
    """m, map frame: mean of the heaviest cluster"""
    y: Number
    """m, map frame"""
    heading: Number
    """rad, map frame"""
    covariance: Annotated[F64, Array("f64", 3, 3)]
    """[3, 3] of (x, y, heading); m^2, m rad, rad^2; of all places while outside_weight > 0.05"""
    v: Number
    """m/s, forward, from odometry"""
    omega: Number
    """rad/s, from odometry"""
    health: Health


@dataclass(frozen=True, eq=False, kw_only=True)
class People(methods.People, Message):
    """The people that a tracker sees."""

    NAME: ClassVar[str] = "people"
    MAX_BYTES: ClassVar[int] = 128 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    frame: Literal["map", "robot"]
    """robot: x ahead, y left; velocities over ground along these axes"""
    radius: NonNegative
    """m, not negative: of a person"""
    id: Annotated[U32, Array("u32", "people", high=2**32 - 1, limit=1024)]
    """[people <= 1024] steady over time"""
    x: Annotated[F64, Array("f64", "people")]
    """[people] m"""
    y: Annotated[F64, Array("f64", "people")]
    """[people] m"""
    vx: Annotated[F64, Array("f64", "people")]
    """[people] m/s"""
    vy: Annotated[F64, Array("f64", "people")]
    """[people] m/s"""
    position_covariance: Annotated[F64, Array("f64", "people", 3)] | None = None
    """[people, 3] (xx, xy, yy) m^2, in `frame`; absent: without error"""
    velocity_covariance: Annotated[F64, Array("f64", "people", 3)] | None = None
    """[people, 3] (xx, xy, yy) m^2/s^2, in `frame`; absent: without error"""
    age: Annotated[F32, Array("f32", "people", low=0.0)] | None = None
    """[people] s since each was seen last, not negative; absent: all are seen now"""
    probability: Annotated[F32, Array("f32", "people", low=0, high=1)] | None = None
    """[people] 0..1 that each is a person and no thing; absent: all surely are"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene(methods.Scene, Message):
    """One moment as the planner sees it."""

    NAME: ClassVar[str] = "scene"
    MAX_BYTES: ClassVar[int] = 168 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    belief: Belief
    people: People
    """in the map frame"""
    obstacles: Annotated[U32, Array("u32", "*", high=2**32 - 1, limit=8192)] | None = None
    """[* <= 8192] what stands on no map: first cell of a run and cells in it, in turn; ascending"""
    passage_m: Number | None = None
    """m, the least room that the way ahead leaves beside the robot, if that is little"""
    uncertain: bool
    """localisation counts as uncertain (with hysteresis)"""
    in_place_s: NonNegative
    """s for which the robot has not left the place where it is, not negative"""
    impatient: bool = False
    """no if left out; terms which give way count less: it has not moved on, or people are at its goal"""


@dataclass(frozen=True, eq=False, kw_only=True)
class TermReport(methods.TermReport, Record):
    """One term of the cost."""

    term: Name
    weight: Number
    scale: Positive
    """what the raw cost is divided by, positive"""
    active: bool
    """its condition held"""
    evaluated: Evaluated
    scored: Annotated[U32, Indices("candidates.count")]
    """indices of the candidates it has scored, ascending; no other has a cost under it"""
    raw: Annotated[F64, ScoredOnly("candidates.count")]
    """[candidates], NaN for one that is not scored: term's unit"""
    cost: Annotated[F64, ScoredOnly("candidates.count")]
    """[candidates], NaN for one that is not scored: weighted: what it adds to the total"""
    alone: Uint32 | None = None
    """index of the candidate that would be followed by this term alone; absent: none"""
    without: Uint32 | None = None
    """that of the one with this term's weight 0, all else being equal"""
    doubled: Uint32 | None = None
    """with its weight doubled"""
    halved: Uint32 | None = None
    """with its weight halved"""


@dataclass(frozen=True, eq=False, kw_only=True)
class TermTime(Record):
    """Time that one term took."""

    term: Name
    us: Uint
    """microseconds from asking to the last answer; terms overlap"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Timings(Record):
    """Where a cycle's time went."""

    generate_us: Uint
    """microseconds"""
    evaluate_us: Annotated[list[TermTime], {"limit": 32}]
    arbitrate_us: Uint
    """microseconds"""
    total_us: Uint
    """microseconds"""


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleReport(methods.CycleReport, Message):
    """Everything that went into a decision."""

    NAME: ClassVar[str] = "cycle_report"
    MAX_BYTES: ClassVar[int] = 20480 << 10
    robot: Name
    epoch: Uint
    seq: Uint
    map: MapId
    scene: Scene
    candidates: CandidateSet
    terms: Annotated[list[TermReport], {"limit": 32}]
    scored: Annotated[U32, Indices("candidates.count")]
    """indices of the candidates that every active term has scored, ascending"""
    total: Annotated[F64, ScoredOnly("candidates.count")]
    """[candidates], NaN for one that is not scored: cost, the sum of the active terms'"""
    rejected: Annotated[list[dict[str, Any] | None], methods.Rejections("candidates.count", Rejection)]
    """one entry per candidate: why it was rejected, `None` if it was not"""
    chosen: Uint32 | None = None
    """index of the candidate chosen"""
    runner_up: Uint32 | None = None
    """index of the one that would have been followed without it"""
    margin: Number | None = None
    """its total minus that of the chosen one; negative if cost alone did not decide"""
    decision: Decision
    timings: Timings
    crowds: Annotated[list[Crowd], {"limit": 1024}]
    obstacles: ObstacleCells | None = None
    """of the scene, for those who do not have the map; absent without any"""
    driven: Twist | None = None
    """the driver's last command before this cycle; absent until one is heard"""
    gap: Uint
    """planning ticks between the previous cycle and this one, which had none"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Place(Record):
    """Somewhere that the robot came to."""

    x: Number
    """m"""
    y: Number
    """m"""
    since: Number
    """s, robot clock: when it came there"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Tree(methods.Tree, Message):
    """A generator's search tree, or whatever else it goes on with.

    It travels with the requests.
    """

    NAME: ClassVar[str] = "tree"
    MAX_BYTES: ClassVar[int] = 3072 << 10
    parent: Annotated[U32, Array("u32", "nodes", high=2**32 - 1, limit=16384)]
    """[nodes <= 16384] index; 4294967295: a root, of which there may be several; no cycles"""
    columns: Annotated[dict[str, Annotated[F64, Array("f64", "*", limit=32768)]], {"limit": 8}]
    """[* <= 32768] What the generator goes on with and cannot work out again; it goes on with its own columns alone:
      rrt-star        x, y: [nodes] m
      risk-rrt        omega, v: [nodes] the twist that led to the node, rad/s and m/s; root: x, y (m), heading (rad),
                      and when it is passed, s of the robot's clock
      bi-risk-rrt     the same of both trees, that in time first; found: 1 if the second is the path found with it, else
                      0; risk: of the second tree's nodes
      mppi            no nodes; omega, v: the commands, rad/s and m/s; since: when the first begins, s
      transient-goal  no nodes; goal: x, y (m), and since when it is the goal, s
      dwa, hrvo-robot nothing
    """


@dataclass(frozen=True, eq=False, kw_only=True)
class Memory(Message):
    """What the arbiter carried into a cycle.

    With the mission and the scene of the cycle's report it decides the cycle: a replay needs nothing else. Published
    only while something listens.
    """

    NAME: ClassVar[str] = "memory"
    MAX_BYTES: ClassVar[int] = 20480 << 10
    robot: Name
    epoch: Uint
    seq: Uint
    """of the cycle it was carried into"""
    run: Uint
    """of the mission in force"""
    revision: Uint
    """of the mission in force"""
    version: str
    """of the arbiter's program"""
    uncertain: bool
    """the scene before counted as uncertain"""
    members: Annotated[U32, Array("u32", "*", high=2**32 - 1, limit=1024)]
    """[* <= 1024] ids of the people in the scene before, ascending"""
    place: Place | None = None
    """the place that the robot has not left; absent before the first cycle"""
    region: Place | None = None
    """the wider place that it has not left while patient; absent if it never loses patience"""
    impatient_since: Number | None = None
    """s, robot clock; absent while it is patient"""
    unseen: Place | None = None
    """where something stands that only the driver sees, and when it last braked for it"""
    previous: Previous | None = None
    """the trajectory being driven"""
    driven: Twist | None = None
    """the driver's newest command; absent until one is heard"""
    trees: Annotated[list[Tree], {"limit": 8}]
    """of the generators; empty: nothing to go on with"""


CborFault = Literal[
    "trailing_bytes", "too_many_items", "too_deep", "cut_short", "indefinite_length", "reserved_information",
    "unassigned_simple",
]
"""Why bytes are not one CBOR item of definite length."""


Refusal = Annotated[dict[str, Any], coded({
    "oversize": {"found": Uint, "most": Uint}, "wrong_encoding": {"found": str, "expected": str},
    "malformed": {"offset": Uint, "fault": CborFault}, "wrong_structure": {"detail": str}, "not_finite": {},
    "out_of_range": {"found": Number, "least": Number, "most": Number}, "not_positive": {"found": Number},
    "wrong_length": {"found": Uint, "expected": Uint}, "too_many": {"found": Uint, "most": Uint},
    "too_few": {"found": Uint, "least": Uint}, "not_a_name": {"found": str},
    "unknown_name": {"found": str, "known": list[str]}, "no_such_index": {"found": Uint}, "cyclic_parents": {},
    "not_ascending": {}, "wrong_frame": {}, "not_a_map": {}, "unsafe_path": {"found": str}, "not_a_hash": {},
    "unexpected_payload": {}, "wrong_robot": {}, "wrong_commander": {}, "unreachable_goal": {"x": Number, "y": Number},
    "no_room_at_goal": {"x": Number, "y": Number, "room": Number, "radius": Number}, "wrong_map": {},
    "invalid": {"detail": str}, "beyond_robot": {"found": Number, "least": Number, "most": Number},
    "realtime_only": {}, "lease_held": {"holder": Name}, "no_lease": {}, "no_mission": {}, "no_decision": {},
    "wrong_state": {"found": MissionState, "needed": MissionState}, "already_finished": {},
    "stale_revision": {"found": Uint, "current": Uint}, "pose_lost": {}, "busy": {}, "overloaded": {}, "stopped": {},
    "cold": {"detail": str}, "no_map": {"detail": str}, "no_replica": {"term": Name, "may_come": bool, "detail": str},
    "failed": {"detail": str}, "unknown": {},
}, otherwise="unknown")]
"""Why a request is refused: a `code` and its parameters.

A `detail` is text of a library or a check of its own, for a person.
"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Reject(Message):
    """Payload of an error reply.

    A reader takes a code that it does not know for "unknown".
    """

    NAME: ClassVar[str] = "reject"
    MAX_BYTES: ClassVar[int] = 4 << 10
    field: str | None = None
    """path such as scene.people.x"""
    why: Refusal


MissionEnd = Annotated[dict[str, Any], coded({
    "reached": {}, "timeout": {}, "lost": {}, "no_way_to_goal": {}, "goal_occupied": {}, "cancelled": {},
    "unprepared": {"role": Name, "instance": Name, "reject": Reject}, "world_failed": {"reject": Reject},
})]
"""Why a mission ended: a `code` and its parameters."""


Clock = Literal["lockstep", "realtime"]
"""How time passes: every stream is awaited, or the newest wins."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MissionOrder(methods.MissionOrder, Record):
    """What is to be done, and everything that the services of the robot share for it."""

    robot: Name
    map: MapId
    initial_pose: Pose
    """where localisation starts"""
    initial_covariance: Annotated[F64, Array("f64", 3, 3)]
    """[3, 3] of (x, y, heading); m^2, m rad, rad^2"""
    initial_doubtful: bool | None = None
    """whether the initial pose may be wrong; absent: false"""
    goal_x: Number
    """m"""
    goal_y: Number
    """m"""
    goal_heading: Number | None = None
    """rad; absent if any will do"""
    way: Annotated[F64, Array("f64", "points", 2, limit=1024)] | None = None
    """[points, 2 <= 1024] m: the way to the goal, two points or more; absent for any"""
    goal_tolerance: Positive
    """m, positive"""
    profile: Params
    """planner profile: generator, terms, arbitration"""
    localizer: Params
    """localiser's parameters"""
    tracker: Params | None = None
    """parameters of the tracker of people; absent: none differs from its default"""
    laser: LaserModel
    robot_model: RobotModel
    odometry_noise: OdometryNoise
    seed: Uint
    clock: Clock
    time_scale: Positive
    """simulated seconds per second of wall time, with a realtime clock; positive"""
    tick_s: Positive
    """s between ticks, positive"""
    plan_every: Annotated[int, Integer(1, 4294967295)]
    """ticks between plans"""
    require: list[Name]
    """roles that must be ready before it runs"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Mission(Message):
    """What a robot is to do, as its driver says."""

    NAME: ClassVar[str] = "mission"
    MAX_BYTES: ClassVar[int] = 256 << 10
    lease: Uint
    """grant of the base under which the driver drives; 0: it has none"""
    run: Uint
    """counts the missions begun on this robot; a changed goal keeps it"""
    revision: Uint
    """grows with every change of what is to be done"""
    order: MissionOrder
    ready: list[Name]
    """roles ready for this revision"""
    state: MissionState
    has_run: bool
    """the robot may have left its start"""
    end: MissionEnd | None = None
    """once it is cancelled or finished"""


class MissionCommand(Message):
    """A wish about a robot's mission, on mission/command/{by}, from clients.

    It reaches every driver of the robot. The reply is the mission as it is then; that of the driver that holds the
    lease counts.
    """

    NAME: ClassVar[str] = "mission_command"
    MAX_BYTES: ClassVar[int] = 257 << 10
    TAGGED: ClassVar[bool] = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Cancel(MissionCommand):
    """Give up."""

    kind: Literal["cancel"] = "cancel"


@dataclass(frozen=True, eq=False, kw_only=True)
class ChangeGoal(MissionCommand):
    """Go elsewhere on the same map."""

    kind: Literal["goal"] = "goal"
    x: Number
    """m"""
    y: Number
    """m"""
    heading: Number | None = None
    """rad; absent if any will do"""
    way: Annotated[F64, Array("f64", "points", 2, limit=1024)] | None = None
    """[points, 2 <= 1024] m: the way there, two points or more; the robot goes on meanwhile"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Finish(MissionCommand):
    """A revision is over, and why."""

    kind: Literal["finish"] = "finish"
    revision: Uint
    end: MissionEnd


@dataclass(frozen=True, eq=False, kw_only=True)
class SetMission(MissionCommand):
    """Begin a mission with this order."""

    kind: Literal["set"] = "set"
    order: MissionOrder


@dataclass(frozen=True, eq=False, kw_only=True)
class Readiness(Message):
    """A service's word on a revision, on mission/ready, from the services that the mission requires.

    It is prepared, or says why it never can be. The reply is the mission as it is then.
    """

    NAME: ClassVar[str] = "readiness"
    MAX_BYTES: ClassVar[int] = 8 << 10
    role: Name
    instance: Name
    revision: Uint
    """that it has prepared for"""
    refused: Reject | None = None
    """why it can never be ready for this revision; absent: it is ready"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Lease(Message):
    """Who may drive a robot.

    Its base grants this to one driver at a time, and obeys the commands of that one alone.
    """

    NAME: ClassVar[str] = "lease"
    MAX_BYTES: ClassVar[int] = 1 << 10
    lease: Uint
    """number of the grant, which the holder's commands carry; 0: no driver holds it"""
    holder: Name | None = None
    """instance of the driver that holds it"""
    wanted_by: Name | None = None
    """instance of a driver that has asked the holder to go"""
    paused: bool
    """the base lets no motion through until it is resumed"""


@dataclass(frozen=True, eq=False, kw_only=True)
class LeaseRequest(Message):
    """A driver's wish, on lease/request/{by}, to its base.

    The reply is the lease as it is then; it is refused while another driver holds it. A holder repeats its wish; one
    that has not done so for 1 s may lose the lease.
    """

    NAME: ClassVar[str] = "lease_request"
    MAX_BYTES: ClassVar[int] = 1 << 10
    driver: Name
    """instance of the driver"""
    lease: Uint
    """the grant that it has; 0: none"""
    wish: Literal["hold", "take_over", "release"]
    """take_over: the holder is asked to go first"""
    paused: bool
    """the driver is paused; a base that was restarted learns it from here"""


@dataclass(frozen=True, eq=False, kw_only=True)
class PauseRequest(Message):
    """A pause or its end, on pause/{by}, from clients.

    It reaches the base and every driver of the robot.
    """

    NAME: ClassVar[str] = "pause_request"
    MAX_BYTES: ClassVar[int] = 1 << 10
    paused: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class PauseReply(Message):
    """The reply to it, once it is obeyed."""

    NAME: ClassVar[str] = "pause_reply"
    MAX_BYTES: ClassVar[int] = 1 << 10
    role: Name
    """driver, or that of the base"""
    instance: Name
    lease: Uint
    """of a driver: the grant that it has; of a base: the grant that it obeys; 0: none"""
    paused: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class CandidateShard(methods.CandidateShard, Record):
    """Candidates to be scored: a candidate_set, of which columns may be absent that the term does not read.

    A replica whose term reads an absent one refuses the question and names it.
    """

    count: Annotated[int, Integer(0, 4096)]
    steps: Annotated[int, Integer(1, 256)]
    dt: Positive
    """s between states, positive"""
    id: Annotated[U32, Array("u32", "count", high=2**32 - 1)]
    """[count]"""
    x: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] m"""
    y: Annotated[F64, Array("f64", "count", "steps")]
    """[count, steps] m"""
    heading: Annotated[F64, Array("f64", "count", "steps")] | None = None
    """[count, steps] rad"""
    v: Annotated[F64, Array("f64", "count", "steps")] | None = None
    """[count, steps] m/s"""
    omega: Annotated[F64, Array("f64", "count", "steps")] | None = None
    """[count, steps] rad/s"""


@dataclass(frozen=True, eq=False, kw_only=True)
class GenerateRequest(Message):
    """Asks a generator for candidates.

    The last chunk of the key it is asked on is the robot's name.
    """

    NAME: ClassVar[str] = "generate_request"
    MAX_BYTES: ClassVar[int] = 4096 << 10
    epoch: Uint
    """arbiter's incarnation"""
    seq: Uint
    """cycle within the epoch"""
    budget_ms: Annotated[int, Integer(0, 10000)]
    """ms left for the answer"""
    map: MapId
    goal_x: Number
    """m"""
    goal_y: Number
    """m"""
    scene: Scene
    tree: Tree | None = None
    """of the previous reply; absent on the first cycle and after a change of goal"""
    seed: Uint
    """of this cycle"""
    iterations: Uint32
    """to spend, no more than a profile may ask for; 0: only warm up for the map"""
    generator: Name
    """which generator of the service"""
    robot_model: RobotModel
    laser: LaserModel
    params: Params
    """the generator's"""


@dataclass(frozen=True, eq=False, kw_only=True)
class GenerateReply(Message):
    """Candidates, and the tree to hand back with the next request."""

    NAME: ClassVar[str] = "generate_reply"
    MAX_BYTES: ClassVar[int] = 15360 << 10
    epoch: Uint
    """as asked"""
    seq: Uint
    """as asked"""
    instance: Name
    """which replica answers"""
    candidates: CandidateSet
    tree: Tree
    """to hand back with the next request"""
    elapsed_us: Uint
    """microseconds"""
    cut: bool
    """whether the budget ended its growth: another machine would have grown another tree"""


@dataclass(frozen=True, eq=False, kw_only=True)
class EvaluateRequest(methods.EvaluateRequest, Message):
    """Asks an evaluator for the costs of a shard of the batch.

    The last chunk of the key it is asked on is the robot's name.
    """

    NAME: ClassVar[str] = "evaluate_request"
    MAX_BYTES: ClassVar[int] = 13312 << 10
    epoch: Uint
    seq: Uint
    shard: Uint32
    """which part of the batch"""
    budget_ms: Annotated[int, Integer(0, 10000)]
    """ms left for the answer"""
    map: MapId
    goal_x: Number
    """m"""
    goal_y: Number
    """m"""
    laser: LaserModel
    robot_model: RobotModel
    odometry_noise: OdometryNoise
    scene: Scene
    candidates: CandidateShard
    """the shard; none: only warm up for the map"""
    params: Params
    """the term's"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scores(Message):
    """Costs of a shard's candidates."""

    NAME: ClassVar[str] = "scores"
    MAX_BYTES: ClassVar[int] = 64 << 10
    epoch: Uint
    """as asked"""
    seq: Uint
    """as asked"""
    shard: Uint32
    """as asked"""
    term: Name
    instance: Name
    """which replica answers"""
    cost: Annotated[F64, Array("f64", "candidates", limit=4096)]
    """[candidates <= 4096] those of the shard in their order, term's unit, lower is better"""
    elapsed_us: Uint
    """microseconds of computing, without what was waited for a slot"""
    slots: Uint32
    """shards it computes at once"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scan(methods.Scan, Message):
    """One turn of the laser.

    Two or more beams sweep more than 0 rad and at most a turn and a step. A range of NaN or 0 says nothing: the beam
    has failed. One below range_min says that something is there, at range_min; one of range_max or more that nothing
    is there as far as range_max.
    """

    NAME: ClassVar[str] = "scan"
    MAX_BYTES: ClassVar[int] = 64 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    angle_min: Number
    """rad, first beam, laser frame"""
    angle_increment: Number
    """rad from beam to beam; negative for a laser that turns clockwise"""
    range_min: NonNegative | None = None
    """m, not negative, less than range_max; absent: 0"""
    range_max: Positive
    """m, positive; the localizer uses scans of up to 200 m"""
    laser: Pose
    """laser in the robot frame, at most 5 m from its origin"""
    ranges: Annotated[F32, Array("f32", "beams", low=0.0, nan=True, limit=8192)]
    """[beams <= 8192] m, not negative or NaN; the localizer needs 2 or more"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Odometry(Message):
    """Pose and speed by dead reckoning."""

    NAME: ClassVar[str] = "odometry"
    MAX_BYTES: ClassVar[int] = 1 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    x: Number
    """m, odometry frame"""
    y: Number
    """m, odometry frame"""
    heading: Number
    """rad, odometry frame"""
    v: Number
    """m/s, forward"""
    omega: Number
    """rad/s"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Particles(Message):
    """Poses that the robot may have, of which the belief is made."""

    NAME: ClassVar[str] = "particles"
    MAX_BYTES: ClassVar[int] = 129 << 10
    tick: Uint
    stamp: Number
    """s, robot clock"""
    x: Annotated[F32, Array("f32", "particles", limit=8192)]
    """[particles <= 8192] m, map frame: where the robot may be"""
    y: Annotated[F32, Array("f32", "particles")]
    """[particles] m, map frame"""
    heading: Annotated[F32, Array("f32", "particles")]
    """[particles] rad, map frame"""
    weight: Annotated[F32, Array("f32", "particles", low=0.0)]
    """[particles] not negative: how likely each is beside the others"""


Prepared = Annotated[dict[str, Any], coded({
    "map": {"map": MapId}, "goal": {"map": MapId, "x": Number, "y": Number},
    "sensor": {"map": MapId, "beams": Uint32, "fov": Number, "range_max": Number}, "revision": {"revision": Uint},
    "waiting": {"revision": Uint, "reject": Reject},
})]
"""Something that a service is prepared for, or waits for: a `code` and its parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ServiceStatus(Message):
    """What a service says of itself; it counts since its start."""

    NAME: ClassVar[str] = "service_status"
    MAX_BYTES: ClassVar[int] = 256 << 10
    role: Name
    instance: Name
    robot: Name | None = None
    """the one it works for"""
    version: str
    """of the program"""
    uptime_s: NonNegative
    """s, not negative"""
    time_s: Number
    """s since 1970 began, UTC, by its own clock, when it answered"""
    load: NonNegative
    """not negative: requests waiting or computed, for each it can compute at once; above 1: a queue"""
    requests: Uint
    """answered since the start; of arbiter, driver and localizer: ticks"""
    rejected: Uint
    """refused since the start"""
    p50_ms: NonNegative
    """ms, not negative, to serve a request"""
    p99_ms: NonNegative
    """ms, not negative"""
    prepared: list[Prepared]
    """what it is prepared for"""
    metrics: Annotated[dict[str, Number] | None, {"limit": 512, "free_keys": True}] = None
    """samples of its metrics endpoint, named as there: NAME{LABEL="VALUE"}"""


@dataclass(frozen=True, eq=False, kw_only=True)
class OccupancyGrid(methods.OccupancyGrid, Message):
    """A map of cells."""

    NAME: ClassVar[str] = "occupancy_grid"
    MAX_BYTES: ClassVar[int] = 31254 << 10
    width: Annotated[int, Integer(1, 16000000)]
    """cells along x"""
    height: Annotated[int, Integer(1, 16000000)]
    """cells along y"""
    resolution: Positive
    """m, side of a cell, positive"""
    origin: Pose
    """outer corner of cell (0, 0)"""
    cells: Annotated[I8, Array("i8", "height", "width", low=-1, high=100)]
    """[height, width] -1..100, row of least y first; -1 unknown, else per cent occupied"""
    limits: Annotated[U8, Array("u8", "height", "width", low=0, high=100)] | None = None
    """[height, width] 0..100 zones: per cent of a robot's greatest speed; 0: keepout; absent: none"""
    map: MapId
    """SHA-256 of width, height (u64), resolution, origin x, y, heading (f64), cells, limits"""


@dataclass(frozen=True, eq=False, kw_only=True)
class InjectRequest(Message):
    """Run this scenario."""

    NAME: ClassVar[str] = "inject_request"
    MAX_BYTES: ClassVar[int] = 65536 << 10
    scenario: Params
    """as in a scenario file"""
    files: Annotated[dict[str, Annotated[bytes, Bytes()]], {"limit": 32, "free_keys": True}]
    """by the relative path the scenario names them with"""
    profile: Params
    """the whole planner profile, as in a profile file"""
    seed: Uint | None = None
    """absent: the scenario's own"""
    clock: Clock
    time_scale: Positive
    """simulated seconds per second of wall time, with a realtime clock; positive"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Contact(Record):
    """A collision, with a person or with a wall."""

    time_s: NonNegative
    """s since the start, not negative"""
    person: Uint32 | None = None
    """absent for a wall"""
    robot_mps: Number
    """m/s, of the robot towards the person or wall; negative: away"""
    person_mps: Number
    """m/s, of the person towards the robot; 0 for a wall"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cycles(Record):
    """The planning cycles of a run."""

    count: Uint
    skipped: Uint | None = None
    """ticks that a cycle was due in and that had none"""
    late: Uint | None = None
    """decided only after the next one was due"""
    first_choice: Uint | None = None
    """followed the candidate that the planner wanted most"""
    other_choice: dict[str, Uint] | None = None
    """in how many not, by the code of the decision's reason"""
    degraded: Uint
    degraded_by: dict[str, Uint] | None = None
    """in how many each degradation occurred, by its code"""
    p50_ms: NonNegative
    """ms, wall time, not negative"""
    p99_ms: NonNegative
    """ms, not negative"""
    max_ms: NonNegative
    """ms, not negative"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Measures(Record):
    """The measures of the paper and a few more."""

    rmse_m: NonNegative
    """m, not negative: localisation error"""
    tcm: Fraction
    """0..1 of the run before localisation converged; 1: never"""
    nm: Uint32 | None = None
    """times convergence was lost after that; absent if it never converged"""
    tce_s: NonNegative | None = None
    """s, not negative: until the error stayed below 0.3 m for 2 s; absent if it never did"""
    td: Fraction
    """0..1 of the time: closer to people than comfortable"""
    md_m: Number | None = None
    """m, least distance to a person, between centres; absent if there were no people"""
    td_in_view: Fraction | None = None
    """0..1, td among people that no wall hides from the robot; absent in older results"""
    md_in_view_m: Number | None = None
    """m, md_m among people that no wall hides from the robot; absent if there was none"""
    nt: Uint32
    """times it came closer than comfortable"""
    vel_mps: NonNegative
    """m/s, not negative: mean"""
    length_m: NonNegative
    """m driven, not negative"""
    time_s: NonNegative
    """s, not negative"""
    collisions: Uint32
    """contacts while driving"""
    clearance_min_m: Number
    """m to people and walls; negative in contact"""


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleTrace(Record):
    """Where the people were."""

    rows: Annotated[int, Integer(0, 360000)]
    """the trace's, or 0 if not recorded"""
    id: Annotated[U32, Array("u32", "people", high=2**32 - 1, limit=1024)]
    """[people <= 1024]"""
    xy: Annotated[F32, Array("f32", "rows", "people", 2)]
    """[rows, people, 2] m; 0 where absent"""
    present: Annotated[U8, Array("u8", "rows", "people", low=0, high=1)]
    """[rows, people] 0..1, 1 where present"""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace(methods.Trace, Record):
    """What happened, tick by tick; of a long run at evenly spaced ticks."""

    rows: Annotated[int, Integer(0, 360000)]
    """one per tick, or per so many of a long run"""
    columns: list[Name]
    """their names"""
    values: Annotated[F64, Array("f64", "rows", "*")]
    """[rows, *] a number for each column"""
    people: PeopleTrace


@dataclass(frozen=True, eq=False, kw_only=True)
class RunResult(Message):
    """A run that came to an end."""

    NAME: ClassVar[str] = "run_result"
    MAX_BYTES: ClassVar[int] = 31744 << 10
    scenario: str
    planner: str
    seed: Uint
    outcome: Literal["reached", "timeout", "lost", "no_way"]
    """the last one: obstacles or people close the goal"""
    measures: Measures
    contacts: Annotated[list[Contact] | None, {"limit": 256}] = None
    """the collisions, in their order"""
    social: dict[str, Number] | None = None
    """social navigation by name, units in the names"""
    cycles: Cycles
    real_time_factor: NonNegative
    """simulated seconds per second of wall time, not negative"""
    decisions_sha256: Annotated[str, Text(is_hash=True)]
    """over scene stamps and chosen trajectories"""
    trace: Trace


@dataclass(frozen=True, eq=False, kw_only=True)
class RunStatus(Message):
    """How a world's run goes."""

    NAME: ClassVar[str] = "run_status"
    MAX_BYTES: ClassVar[int] = 32764 << 10
    run: Uint
    """rises with every run, also over a restart of the simulator"""
    world: Name
    state: Literal["idle", "preparing", "running", "finished", "failed"]
    tick: Uint
    time_s: NonNegative
    """s, simulated, not negative"""
    distance_to_goal: NonNegative
    """m, true, not negative"""
    error: MissionEnd | None = None
    """why it failed"""
    result: RunResult | None = None


_MESSAGES: list[type[Message]] = [
    Scan, Odometry, People, Belief, Particles, Mission, MissionCommand, Readiness, Lease, LeaseRequest, PauseRequest,
    PauseReply, Decision, Twist, Scene, CandidateSet, Tree, CycleReport, Memory, GenerateRequest, GenerateReply,
    EvaluateRequest, Scores, OccupancyGrid, InjectRequest, RunStatus, RunResult, ServiceStatus, Reject,
]

MESSAGES: dict[str, type[Message]] = {message.NAME: message for message in _MESSAGES}
"""Every message by its name in the encoding string, which is also its CDDL rule."""


__all__ = [
    "MESSAGES", "NO_PARENT", "Belief", "Cancel", "CandidateSet", "CandidateShard", "CborFault", "ChangeGoal", "Clock",
    "CommandReason", "Confidence", "Contact", "Crowd", "CycleReport", "Cycles", "Decision", "Degradation", "Disc",
    "EvaluateRequest", "Evaluated", "Finish", "Footprint", "GenerateReply", "GenerateRequest", "Health",
    "InjectRequest", "LaserModel", "Lease", "LeaseRequest", "Measures", "Memory", "Message", "Mission",
    "MissionCommand", "MissionEnd", "MissionOrder", "MissionState", "ObstacleCells", "OccupancyGrid", "Odometry",
    "OdometryNoise", "Particles", "PauseReply", "PauseRequest", "People", "PeopleTrace", "Place", "Polygon", "Pose",
    "Prepared", "Previous", "PreviousState", "Readiness", "Reason", "Record", "Refusal", "Reject", "Rejection",
    "RobotModel", "RunResult", "RunStatus", "Scan", "Scene", "Scores", "ServiceStatus", "SetMission", "TermReport",
    "TermTime", "Timings", "Trace", "Tree", "Twist",
]
