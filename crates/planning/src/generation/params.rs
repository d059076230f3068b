//! What generators take from a profile.

use crate::collision::CollisionParams;
use crate::collision_risk::RiskParams;
use crate::evaluation::cpc::InformationParams;
use crate::forecast::ForecastParams;
use crate::generation::bi_risk_rrt::BiRiskRrtParams;
use crate::generation::commanded_params::{DwaParams, HrvoRobotParams, MppiParams, TransientGoalParams};
use crate::generation::risk_rrt::RiskRrtParams;
use crate::generation::rollout::RolloutParams;
use crate::generation::rrt_star::RrtStarParams;
use crate::parameters::Range;

crate::parameters! {
    /// Parameters that only generators have.
    #[derive(Default)]
    #[serde(default)]
    #[non_exhaustive]
    pub struct GenerationParams {
        /// How the tree grows.
        pub tree: RrtStarParams [table],
        /// How its branches are driven.
        pub rollout: RolloutParams [table],
        /// What is offered.
        pub candidates: CandidateParams [table],
        /// What is offered to a robot that does not get away.
        pub recovery: RecoveryParams [table],
        /// The tree of the Risk-RRT baselines.
        pub risk_rrt: RiskRrtParams [table],
        /// What Bi-Risk-RRT does besides.
        pub bi_risk_rrt: BiRiskRrtParams [table],
        /// The goals nearby that `transient-goal` chooses from.
        pub transient_goal: TransientGoalParams [table],
        /// Rollouts and critics of `mppi`.
        pub mppi: MppiParams [table],
        /// Arcs and critics of `dwa`.
        pub dwa: DwaParams [table],
        /// The law of `hrvo-robot`.
        pub hrvo_robot: HrvoRobotParams [table],
    }
}

crate::parameters! {
    /// Parameters of candidates.
    #[non_exhaustive]
    pub struct CandidateParams {
        /// Cruising speeds each path is timed with, as fractions of the greatest.
        pub profiles: Vec<f64> [
            0.01, 1.0, "", "it is a share of the greatest speed, and a robot at rest gets nowhere";
            1.0, 8.0, "every branch is timed with each"
        ] = vec![1.0, 0.7, 0.45],
        /// Cruising speed tried when too few candidates are free otherwise.
        pub creep: f64 [0.01, 1.0, "", "it is a share of the greatest speed, and a robot at rest gets nowhere"] = 0.2,
        /// Most candidates, I (A24).
        pub max_candidates: u32
            [1.0, 512.0, "candidates", "the candidates of eight trees fit into one message of 4096"] = 100,
        /// With fewer free candidates than this, straight ways in all directions and creeping are tried too.
        pub min_candidates: u32 [0.0, 512.0, "candidates", "more than max_candidates there never are"] = 20,
        /// Most branches of the tree that are timed.
        pub max_branches: u32
            [1.0, 1000.0, "branches", "each is timed with every profile, and a cycle must end"] = 72,
        /// The goal is reached within this distance, metres: a candidate that stops there is not slow.
        pub goal_tolerance: f64 [in Range::GOAL_TOLERANCE] = 0.5,
        /// Time at which candidates have to differ, seconds.
        pub differ_by: f64 [0.0, 1000.0, "s", "beyond the horizon the last state counts"] = 2.0,
        /// Cell side that tells positions at that time apart, metres.
        pub near_cell: f64 [0.001, 100.0, "m", "below all positions differ, above none"] = 0.1,
        /// Angle that tells headings at that time apart, radians: from rest, little else differs by then.
        pub near_angle: f64 [0.001, 6.3, "rad", "below all headings differ, above none"] = 0.2,
        /// Cell side that tells final positions apart, metres.
        pub end_cell: f64 [0.001, 100.0, "m", "below all positions differ, above none"] = 0.3,
        /// From this angle between heading and way on, turning on the spot first is offered, radians.
        pub turn_from: f64 [0.01, 3.15, "rad", "no angle is greater than half a turn"] = std::f64::consts::FRAC_PI_3,
        /// What is offered besides the tree's branches.
        pub besides: Besides [table] = Besides::default(),
    }
}

crate::parameters! {
    /// Which paths are offered besides the branches of Alg. 1's tree, each with its own switch. This project adds them,
    /// the paper does not (D19).
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct Besides {
        /// The rest of what was decided last, and on towards the goal.
        pub previous: bool = true,
        /// The shortest way to the goal, with a turn on the spot before it where it lies behind.
        pub shortest_way: bool = true,
        /// Thirteen arcs from the tightest left to the tightest right.
        pub arcs: bool = true,
        /// Straight ways in 24 directions, and creeping along every path, where too few candidates are free.
        pub fan: bool = true,
    }
}

crate::parameters! {
    /// When ways out are offered.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RecoveryParams {
        /// Seconds in one place after which ways out are offered instead of what the generator offers. At 0 they never
        /// are.
        pub patience: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 0.0,
        /// Whether a way out that gets somewhere is offered although the robot could not be stopped on it short of
        /// people who stop walking right now, rather than one that stands; and where nothing gets anywhere, the
        /// beginning of the way out between people who stand alone.
        pub insist: bool = false,
        /// How far the robot has to get to be in another place, metres.
        pub radius: f64 [0.01, 10.0, "m", "position estimates differ by less while a robot stands, and a robot may drive for seconds within more"] = 0.5,
    }
}

crate::parameters! {
    /// The part of a profile that a generator needs, as it travels to one: any replica then computes the same.
    #[non_exhaustive]
    pub struct GeneratorPart {
        /// States per candidate.
        pub steps: usize [in GeneratorPart::STEPS],
        /// Seconds between states.
        pub dt: f64 [in GeneratorPart::DT],
        /// Average speed below which a candidate counts as slow, m/s (D4).
        pub min_speed: f64 [in GeneratorPart::MIN_SPEED],
        /// Seconds for which a decision may be driven: before a speed zone the robot is slower by then.
        pub held: f64 [in GeneratorPart::HELD],
        /// The tree and its candidates.
        pub generation: GenerationParams [table],
        /// How much room is kept.
        pub collision: CollisionParams [table],
        /// How the baselines weigh risk.
        pub risk: RiskParams [table],
        /// How people move on.
        pub forecast: ForecastParams [table],
        /// What an observation is worth.
        pub information: InformationParams [table],
    }
}

impl GeneratorPart {
    /// Whether the generator wants [`crate::generation::GenerationInput::information`].
    pub fn looks_for_landmarks(&self) -> bool {
        self.generation.tree.informative > 0.0
    }

    /// What K may be.
    pub const STEPS: Range = Range {
        least: 1.0,
        most: 200.0,
        unit: "states",
        why: "a message takes 256 per candidate, and the previous one's are added while braking",
    };
    /// What the time step may be.
    pub const DT: Range = Range {
        least: 0.02,
        most: 2.0,
        unit: "s",
        why: "a shorter step is no cycle, and in a longer one people pass unseen between two states",
    };

    /// How long a decision may be driven.
    pub const HELD: Range = Range {
        least: 0.01,
        most: 60.0,
        unit: "s",
        why: "a decision outlives its cycle, and beyond a minute no forecast of people holds",
    };

    /// What the slowest speed may be.
    pub const MIN_SPEED: Range = Range { least: 0.0, most: 10.0, unit: "m/s", why: "no robot drives faster" };
}
