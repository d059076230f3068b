//! Candidates of a planner that is not built in: what it proposes, as trajectories within the robot's limits.
//!
//! A profile names such a planner as its generator, with [`PREFIX`] before the planner's name. Nothing here asks it: a
//! program does, and hands on what was answered.

use crate::candidates::CandidateSet;
use crate::generation::GenerationInput;
use crate::generation::commanded::drive;
use crate::geometry::{Pose2, Twist, wrap_angle};
use crate::states::{States, StatesError};

/// What the generator of a profile begins with if it is a planner of one's own.
pub const PREFIX: &str = "own-";

/// Most proposals in one cycle: as many candidates as a built-in generator may offer.
pub const MOST: usize = 512;

/// Whether a generator is a planner of one's own.
pub fn is_own(generator: &str) -> bool {
    generator.starts_with(PREFIX)
}

/// What `ask` makes of `input` for a robot that is as slow as the speed zones around it ask.
pub fn within_zones<R>(input: &GenerationInput<'_>, ask: impl FnOnce(&GenerationInput<'_>) -> R) -> R {
    let robot = input.robot.slowed(input.allowed_share());
    ask(&GenerationInput { robot: &robot, ..*input })
}

/// One thing that the robot could do.
#[derive(Debug, Clone, PartialEq)]
pub enum Proposal {
    /// To drive at this twist for so many seconds and then to brake, both within the robot's limits. A twist beyond the
    /// limits is clipped.
    Drive {
        /// Forward speed and turn rate.
        twist: Twist,
        /// Seconds until the robot brakes.
        seconds: f64,
    },
    /// To be at these poses, map frame, one every `dt` seconds, the first after `dt` seconds. A robot that has come to
    /// the last one stays there. They may be no more than the profile's `steps`.
    Poses(Vec<Pose2>),
}

/// Why a proposal cannot be a candidate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the text of each error says what its fields are")]
pub enum ProposalError {
    /// A number is NaN or infinite.
    #[error("proposal {index} has a number that is not finite")]
    NotFinite { index: usize },
    /// Poses that are none, or more than a candidate has.
    #[error("proposal {index} has {found} poses; give 1 to {most}")]
    Length { index: usize, found: usize, most: usize },
    /// The time until the robot brakes is not within the horizon.
    #[error("proposal {index} is to be driven for {seconds} s; give more than 0 and at most {most} s")]
    Time { index: usize, seconds: f64, most: f64 },
    /// More of them than [`MOST`].
    #[error("there are {found} proposals; give at most {MOST}")]
    Count { found: usize },
    /// The states are no candidates.
    #[error(transparent)]
    States(#[from] StatesError),
}

/// The candidates of these proposals, in their order. They are not checked for collisions: the arbiter checks what it
/// takes.
///
/// # Errors
/// The first proposal that is none; then there is no candidate at all.
pub fn candidates(
    input: &GenerationInput<'_>,
    proposals: &[Proposal],
) -> Result<CandidateSet, ProposalError> {
    if proposals.len() > MOST {
        return Err(ProposalError::Count { found: proposals.len() });
    }
    let steps = input.params.steps;
    let dt = input.params.dt;
    let mut states = States::default();
    for (index, proposal) in proposals.iter().enumerate() {
        match proposal {
            Proposal::Drive { twist, seconds } => {
                let most = steps as f64 * dt;
                if !(twist.v.is_finite() && twist.omega.is_finite() && seconds.is_finite()) {
                    return Err(ProposalError::NotFinite { index });
                }
                if !(*seconds > 0.0 && *seconds <= most + 1e-9) {
                    return Err(ProposalError::Time { index, seconds: *seconds, most });
                }
                // A step that begins at the end of the time is not driven, whatever the sums of steps round to.
                let until = seconds - 1e-9;
                drive(input, &mut states, |t, _, _| if t < until { *twist } else { Twist::default() });
            }
            Proposal::Poses(poses) => {
                if poses.is_empty() || poses.len() > steps {
                    return Err(ProposalError::Length { index, found: poses.len(), most: steps });
                }
                if !poses.iter().all(|pose| [pose.x, pose.y, pose.heading].iter().all(|n| n.is_finite())) {
                    return Err(ProposalError::NotFinite { index });
                }
                follow(input, poses, &mut states);
            }
        }
    }
    let ids = (0..proposals.len() as u32).collect();
    Ok(CandidateSet::new(steps, dt, ids, states)?)
}

/// Appends a robot that is at each pose in turn and then stays. Its twists are those that lead from pose to pose.
fn follow(input: &GenerationInput<'_>, poses: &[Pose2], states: &mut States) {
    let dt = input.params.dt;
    let mut from = input.scene.belief.pose;
    for step in 0..input.params.steps {
        let to = poses.get(step).copied().unwrap_or(from);
        let turn = wrap_angle(to.heading - from.heading);
        // Along the heading halfway: that of the chord of an arc.
        let halfway = Pose2::new(from.x, from.y, from.heading + 0.5 * turn);
        let ahead = halfway.inverse_transform(to.position()).x;
        let length = from.position().distance(to.position());
        let v = if ahead < 0.0 { -length } else { length } / dt;
        states.push(to, Twist { v, omega: turn / dt });
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::generation::GeneratorPart;
    use crate::geometry::Point2;
    use crate::motion::RobotModel;
    use crate::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
    use crate::profile::Profile;
    use crate::scene::{Belief, People, Scene};

    /// What `proposals` become for a robot that stands at the origin of an empty room.
    fn offered(proposals: &[Proposal]) -> Result<CandidateSet, ProposalError> {
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-6.0, -6.0, 0.0), vec![0; 14_400]).unwrap();
        let map = StaticMap::new(grid);
        let goal = Point2::new(4.0, 0.0);
        let geodesic = GeodesicField::new(&map, goal, 0.3);
        let belief = Belief { pose: Pose2::default(), covariance: Matrix3::zeros(), twist: Twist::default() };
        let scene = Scene::new(belief, People::default());
        let params: GeneratorPart = Profile::default().generator_part();
        let input = GenerationInput {
            params: &params,
            map: &map,
            goal,
            geodesic: &geodesic,
            information: None,
            robot: &RobotModel::default(),
            scene: &scene,
            previous: None,
            seed: 1,
        };
        candidates(&input, proposals)
    }

    #[test]
    fn a_twist_is_driven_within_the_limits_and_ends_at_rest() {
        let robot = RobotModel::default();
        let twist = Twist { v: 50.0, omega: -90.0 };
        let set = offered(&[Proposal::Drive { twist, seconds: 0.6 }]).unwrap();
        let states = set.states(0);
        let most = robot.a_max * 0.6 + 1e-9;
        assert!(states.v.iter().all(|v| (0.0..=most).contains(v)), "{:?}", states.v);
        assert!(states.omega.iter().all(|omega| omega.abs() <= robot.omega_max), "{:?}", states.omega);
        // The second state is reached at 0.6 s, the third while it brakes.
        assert!(states.v[1] > states.v[0] && states.v[2] < states.v[1], "{:?}", states.v);
        assert_eq!(states.v.last(), Some(&0.0));
    }

    #[test]
    fn poses_are_what_is_driven_with_the_twists_between_them() {
        let poses = vec![Pose2::new(0.3, 0.0, 0.0), Pose2::new(0.1, 0.0, 0.3)];
        let states = offered(&[Proposal::Poses(poses)]).unwrap().states(0);
        let dt = Profile::default().dt;
        assert_eq!((states.x[0], states.x[1], states.x[2]), (0.3, 0.1, 0.1));
        assert!((states.v[0] - 0.3 / dt).abs() < 1e-12 && (states.v[1] + 0.2 / dt).abs() < 1e-12);
        assert_eq!((states.v[2], states.omega[2]), (0.0, 0.0));
        assert!((states.omega[1] - 0.3 / dt).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_proposal_is_refused_by_its_index() {
        let good = Proposal::Drive { twist: Twist::default(), seconds: 0.6 };
        let after = |bad: Proposal| offered(&[good.clone(), bad]).unwrap_err().to_string();
        let nan = Twist { v: f64::NAN, omega: 0.0 };
        assert!(after(Proposal::Drive { twist: nan, seconds: 0.6 }).starts_with("proposal 1 has a number"));
        let far = Proposal::Poses(vec![Pose2::new(f64::INFINITY, 0.0, 0.0)]);
        assert!(after(far).starts_with("proposal 1 has a number"));
        let long = Proposal::Drive { twist: Twist::default(), seconds: 99.0 };
        assert!(after(long).starts_with("proposal 1 is to be driven for 99 s"));
        assert!(after(Proposal::Poses(Vec::new())).starts_with("proposal 1 has 0 poses"));
        let many = vec![good; MOST + 1];
        assert_eq!(offered(&many), Err(ProposalError::Count { found: MOST + 1 }));
    }
}
