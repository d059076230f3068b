//! Things that are on no map: where they are, how far away, and what the laser sees of them.

use std::collections::BTreeSet;

use curionav_planning::footprint::FootprintShape;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::hrvo::{Body, Velocity};
use curionav_planning::motion::Footprint;
use curionav_planning::numerics::atan2;
use curionav_planning::occupancy::OccupancyGrid;
use curionav_planning::random::{Rng, uniform};

use crate::beams::{Beams, disc_range};
use crate::scenario::WorldObject;
use crate::walkers::{WAITING_MARGIN, WalkerState};

/// All things of a scenario.
#[derive(Debug, Clone)]
pub(crate) struct Things {
    all: Vec<Thing>,
}

#[derive(Debug, Clone)]
struct Thing {
    shape: FootprintShape,
    outline: Footprint,
    pose: Pose2,
    /// How it is pushed, if it is.
    pushed: Option<WalkerState>,
    /// First and last second of its stay.
    stay: (f64, f64),
    is_there: bool,
    low: bool,
    glass: f64,
}

impl Things {
    pub(crate) fn new(objects: &[WorldObject]) -> Self {
        Self { all: objects.iter().map(Thing::new).collect() }
    }

    /// What there is at `time`, seconds, after another `dt`, while a robot of `radius` metres stands at `robot`. Gives
    /// whether something that is not pushed has come or gone.
    pub(crate) fn step(&mut self, time: f64, dt: f64, robot: Point2, radius: f64) -> bool {
        let mut changed = false;
        for thing in &mut self.all {
            changed |= thing.comes_or_goes(time, robot, radius) && thing.pushed.is_none();
            thing.push_on(dt, robot, radius);
        }
        changed
    }

    fn there(&self) -> impl Iterator<Item = &Thing> {
        self.all.iter().filter(|thing| thing.is_there)
    }

    /// Distance from a point to the nearest thing, metres; infinite without any, 0 inside one.
    pub(crate) fn distance(&self, p: Point2) -> f64 {
        self.there().map(|thing| thing.shape.distance_to_point(thing.pose, p)).fold(f64::INFINITY, f64::min)
    }

    /// Those that are pushed, as people see them: they do not yield.
    pub(crate) fn pushed(&self) -> impl Iterator<Item = Body> {
        self.there().filter_map(|thing| {
            let (x, y) = thing.pushed.as_ref()?.velocity();
            let velocity = Velocity::new(x, y);
            let radius = thing.shape.circumscribed_radius();
            Some(Body {
                position: thing.pose.position(),
                velocity,
                preferred: velocity,
                radius,
                yields: false,
            })
        })
    }

    /// The cells that lie under things that stand.
    pub(crate) fn covered(&self, grid: &OccupancyGrid) -> BTreeSet<usize> {
        // A cell counts if the thing comes nearer to its centre than half of its side.
        let near = 0.5 * grid.resolution();
        let mut covered = BTreeSet::new();
        for thing in self.there().filter(|thing| thing.pushed.is_none()) {
            let reach = thing.shape.circumscribed_radius() + near;
            for index in 0..grid.cells().len() {
                let centre = grid.centre(index % grid.width(), index / grid.width());
                let is_far = centre.distance_squared(thing.pose.position()) > reach * reach;
                if !is_far && thing.shape.distance_to_point(thing.pose, centre) < near {
                    covered.insert(index);
                }
            }
        }
        covered
    }

    /// Shortens the beams of a laser at `laser` that meet a thing. Glass lets some of them through, drawn for every
    /// beam of every scan.
    pub(crate) fn shorten(&self, beams: &mut Beams<'_>, laser: Pose2, random: &mut Rng) {
        for thing in self.there().filter(|thing| !thing.low) {
            let pose = laser.relative(thing.pose);
            let passed = thing.draw_passed(beams.len(), random);
            let skin = Skin::new(&thing.outline, pose);
            beams.shorten(pose.position(), thing.shape.circumscribed_radius(), |beam, direction| {
                if passed.get(beam) == Some(&true) { f64::INFINITY } else { skin.range(direction) }
            });
        }
    }
}

/// An outline as a laser sees it, in the laser's frame.
enum Skin {
    Disc { centre: Point2, radius: f64 },
    Polygon(Vec<Point2>),
}

impl Skin {
    fn new(outline: &Footprint, pose: Pose2) -> Self {
        match outline {
            Footprint::Disc { radius } => Self::Disc { centre: pose.position(), radius: *radius },
            Footprint::Polygon { vertices } => {
                Self::Polygon(vertices.iter().map(|v| pose.transform(*v)).collect())
            }
        }
    }

    /// Distance along a unit vector, metres.
    fn range(&self, direction: (f64, f64)) -> f64 {
        match self {
            Self::Disc { centre, radius } => disc_range(*centre, *radius, direction),
            Self::Polygon(corners) => polygon_range(corners, direction),
        }
    }
}

impl Thing {
    fn new(object: &WorldObject) -> Self {
        let outline = object.outline();
        Self {
            shape: FootprintShape::from(&outline),
            outline,
            pose: object.at,
            pushed: object.walker().map(|walker| WalkerState::new(&walker)),
            stay: (object.from_s, object.until_s.unwrap_or(f64::INFINITY)),
            is_there: object.from_s <= 0.0,
            low: object.low,
            glass: object.glass,
        }
    }

    /// For each of so many beams, whether it passes through; nothing if none does.
    fn draw_passed(&self, beams: usize, random: &mut Rng) -> Vec<bool> {
        let drawn = if self.glass > 0.0 { beams } else { 0 };
        (0..drawn).map(|_| uniform(random) < self.glass).collect()
    }

    /// Whether it has come or gone.
    fn comes_or_goes(&mut self, time: f64, robot: Point2, radius: f64) -> bool {
        let was = self.is_there;
        let is_due = (self.stay.0..self.stay.1).contains(&time);
        // A thing is not put down where the robot is.
        self.is_there = is_due && (was || self.shape.distance_to_point(self.pose, robot) > radius);
        was != self.is_there
    }

    /// Pushes it on for `dt` seconds, if it is there to be pushed.
    fn push_on(&mut self, dt: f64, robot: Point2, radius: f64) {
        let Some(pushed) = self.pushed.as_mut().filter(|_| self.is_there) else { return };
        pushed.step(dt, robot, self.shape.circumscribed_radius() + radius + WAITING_MARGIN);
        let at = pushed.position();
        let (x, y) = pushed.velocity();
        let heading = if x == 0.0 && y == 0.0 { self.pose.heading } else { atan2(y, x) };
        self.pose = Pose2::new(at.x, at.y, heading);
    }
}

/// Distance along the unit vector `direction` from the origin to a convex polygon, counter-clockwise; 0 inside it,
/// infinite past it.
fn polygon_range(corners: &[Point2], direction: (f64, f64)) -> f64 {
    let mut enters = 0.0_f64;
    let mut leaves = f64::INFINITY;
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        // The outward normal of a side, and how far the origin and the ray lie beyond the side.
        let normal = (b.y - a.y, a.x - b.x);
        let beyond = -(normal.0 * a.x + normal.1 * a.y);
        let along = normal.0 * direction.0 + normal.1 * direction.1;
        if along < 0.0 {
            enters = enters.max(beyond / -along);
        } else if along > 0.0 {
            leaves = leaves.min(-beyond / along);
        } else if beyond > 0.0 {
            return f64::INFINITY;
        }
    }
    if enters <= leaves { enters } else { f64::INFINITY }
}
