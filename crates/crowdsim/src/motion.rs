//! The people of `[[walkers]]` under whichever motion the scenario asks for.

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::hrvo::{Body, Velocity};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::scene::People;

use crate::avoiding::{AvoidingCrowd, Law};
use crate::scenario::{Motion, Scenario};
use crate::walkers::{WAITING_MARGIN, WalkerState};

#[derive(Debug, Clone)]
pub(crate) enum Walkers {
    /// They follow their script.
    Scripted(Vec<WalkerState>),
    /// They avoid each other.
    Avoiding(Box<AvoidingCrowd>),
}

impl Walkers {
    pub(crate) fn new(scenario: &Scenario, map: &StaticMap) -> Self {
        let walkers = &scenario.walkers;
        let people = &scenario.people;
        let law = match people.motion {
            Motion::Scripted => return Self::Scripted(walkers.iter().map(WalkerState::new).collect()),
            Motion::Hrvo => Law::Hrvo(people.hrvo),
            Motion::SocialForce => Law::SocialForce(people.social_force),
        };
        Self::Avoiding(Box::new(AvoidingCrowd::new(law, walkers, people, map)))
    }

    /// Position, metres, and velocity, m/s, of each.
    pub(crate) fn states(&self) -> Vec<(Point2, (f64, f64))> {
        match self {
            Self::Scripted(walkers) => walkers.iter().map(|w| (w.position(), w.velocity())).collect(),
            Self::Avoiding(crowd) => {
                crowd.people().iter().map(|b| (b.position, (b.velocity.x, b.velocity.y))).collect()
            }
        }
    }

    /// How much of the last step each lost against walking on at its preferred speed, 0 to 1; 0 for who rests, stands
    /// or has arrived.
    pub(crate) fn lost_shares(&self) -> impl Iterator<Item = f64> {
        let (scripted, avoiding): (&[WalkerState], &[Body]) = match self {
            Self::Scripted(walkers) => (walkers, &[]),
            Self::Avoiding(crowd) => (&[], crowd.people()),
        };
        scripted.iter().map(WalkerState::lost_share).chain(avoiding.iter().map(lost_share))
    }

    /// All walk for `dt` seconds, and see the robot where it is now. Scripted walkers wait for it. Avoiding walkers
    /// walk around it, and around `others`: recorded and live people, who move by themselves. The heedless take no
    /// notice of the robot. `radius` is a walker's, metres.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        map: &StaticMap,
        radius: f64,
        robot: Body,
        others: impl Iterator<Item = Body>,
    ) {
        match self {
            Self::Scripted(walkers) => {
                let keep_off = robot.radius + radius + WAITING_MARGIN;
                walkers.iter_mut().for_each(|w| w.step(dt, robot.position, keep_off));
            }
            Self::Avoiding(crowd) => crowd.step(dt, map, Some(robot), others),
        }
    }
}

/// The part of the preferred velocity that a body does not have.
fn lost_share(body: &Body) -> f64 {
    let wanted = body.preferred.norm_squared();
    if wanted > 0.0 { (1.0 - body.velocity.dot(&body.preferred) / wanted).clamp(0.0, 1.0) } else { 0.0 }
}

/// The robot as people see it: they expect it to go on as it goes and to do its half of the avoiding.
pub(crate) fn robot_body(pose: Pose2, twist: Twist, radius: f64) -> Body {
    let (sine, cosine) = sin_cos(pose.heading);
    let velocity = Velocity::new(twist.v * cosine, twist.v * sine);
    Body { position: pose.position(), velocity, preferred: velocity, radius, yields: true }
}

/// The i-th of `people`, recorded or live, as others see it: it goes its way and does not yield.
pub(crate) fn passer_by(people: &People, i: usize) -> Body {
    let velocity = Velocity::new(people.vx[i], people.vy[i]);
    Body { position: people.position(i), velocity, preferred: velocity, radius: people.radius, yields: false }
}
