//! From a scan to what may be people in it.

use std::sync::Arc;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::occupancy::{Cell, StaticMap};
use curionav_planning::sensor::LaserModel;
use nalgebra::Matrix3;

use crate::alignment::align;
use crate::background::Posed;
use crate::params::TrackerParams;
use crate::segments::{Segment, Sweep};
use crate::shape::{Fit, behind, fit, middle};

/// What a detection may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// As narrow as a leg: a person has two of them, or it is what is seen of a person who is nearly hidden.
    Leg,
    /// A trunk, or two legs beside each other: a whole person.
    Trunk,
}

/// Something in a scan that may be a person or a part of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Its centre, robot frame, metres.
    pub position: Point2,
    /// What it may be.
    pub kind: Kind,
    /// Standard deviation of the position on each axis, metres.
    pub sigma: f64,
}

/// What is to be seen of people in one scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seen {
    /// In the order of the beams.
    pub detections: Vec<Detection>,
    /// Whether each beam ended on one of them.
    pub of_people: Vec<bool>,
    /// Where the walls in the scan have shown the robot to be, map frame.
    pub pose: Pose2,
    /// Covariance of `pose`.
    pub covariance: Matrix3<f64>,
}

/// Finds people in the scans of a laser on a known map.
#[derive(Debug, Clone)]
pub struct Detector {
    map: Arc<StaticMap>,
    params: TrackerParams,
}

/// A trunk may be wider than its disc by so much, metres: arms, bags.
const WIDER: f64 = 0.25;
/// What stands alone and is at most this wide is taken for a person whatever its shape, metres: trunks that are partly
/// hidden and legs beside each other have none of their own.
const SHAPELESS: f64 = 0.45;
/// A trunk fits a circle better than a line, or not worse than by this factor of the squares.
const CIRCLE_ODDS: f64 = 1.5;
/// A trunk that touches something fits a circle so many times as well as a line, by the squares.
const CONTINUED_ODDS: f64 = 2.0;
/// With fewer beams a circle cannot be told from a line.
const SHAPE_BEAMS: usize = 4;
/// What is wider than a person is cut in two so many times at most: sixteen people shoulder to shoulder.
const CUTS: usize = 4;
/// What is so far from every wall of the map is no part of one that is there in another shape, metres.
const STANDS_OUT: f64 = 0.3;
/// Standard deviation of a centre of which one side is not seen, metres, in addition.
const PARTIAL_SIGMA: f64 = 0.1;
/// Standard deviation of a centre besides the laser's noise and resolution, metres: no person is a cylinder.
const LEAST_SIGMA: f64 = 0.03;

impl Detector {
    /// A detector on this map.
    pub fn new(map: Arc<StaticMap>, params: TrackerParams) -> Self {
        Self { map, params }
    }

    /// What is seen of people by a scan, for a robot that is at `pose` on the map with this covariance (x, y, heading).
    /// `ranges` are those of the beams of `laser`; beams that are not positive and below its greatest range say nothing.
    pub fn see(&self, ranges: &[f32], laser: &LaserModel, pose: Pose2, covariance: &Matrix3<f64>) -> Seen {
        let count = ranges.len().min(laser.beams as usize);
        let ranges = &ranges[..count];
        if count < 2 {
            return Seen { of_people: vec![false; count], pose, covariance: *covariance, ..Seen::default() };
        }
        let met: Vec<bool> =
            ranges.iter().map(|r| *r > 0.0 && f64::from(*r) < laser.range_max - 1e-6).collect();
        let gap = laser.bearing(1) - laser.bearing(0);
        let ends: Vec<Point2> = (0..count)
            .map(|i| {
                let (s, c) = sin_cos(laser.bearing(i as u32));
                let range = if met[i] { f64::from(ranges[i]) } else { laser.range_max };
                Point2::new(range * c, range * s)
            })
            .collect();
        let in_robot: Vec<Point2> = ends.iter().map(|end| laser.robot_from_laser.transform(*end)).collect();
        let sigma = hypot(laser.range_sigma, self.params.map_sigma);
        let hits: Vec<Point2> =
            in_robot.iter().zip(&met).filter(|(_, met)| **met).map(|(end, _)| *end).collect();
        let (pose, covariance) = align(&self.map, &hits, sigma, pose, covariance);
        let off_walls = self.off_walls(&met, &in_robot, sigma, pose, &covariance);
        let (full, jump) = (laser.sees_all_around(), self.params.jump);
        let sweep = Sweep { ends: &ends, ranges, met: &met, off_walls: &off_walls, gap, full, jump };
        let mut seen = Seen { detections: Vec::new(), of_people: vec![false; count], pose, covariance };
        for segment in sweep.segments() {
            self.classify(&sweep, segment, laser, CUTS, &mut seen);
        }
        seen
    }

    /// How far from the walls of the map each beam ended, metres; 0 if it may have ended on one, within some standard
    /// deviations of where the robot is and how the laser measures (`sigma`, metres). Nothing if it met nothing, or where the
    /// map does not know whether a person can be.
    fn off_walls(
        &self,
        met: &[bool],
        in_robot: &[Point2],
        sigma: f64,
        pose: Pose2,
        covariance: &Matrix3<f64>,
    ) -> Vec<Option<f64>> {
        let posed = Posed::new(&self.map, pose);
        let of_beam = |(end, met): (&Point2, &bool)| match posed.cell(*end) {
            _ if !*met => None,
            Cell::Unknown => None,
            Cell::Occupied => Some(0.0),
            Cell::Free => {
                let wall = posed.to_wall(*end);
                let variance = sigma * sigma + wall.variance(covariance);
                let reach = self.params.explained_sigmas * variance.sqrt();
                Some(if wall.metres > reach { wall.metres } else { 0.0 })
            }
        };
        in_robot.iter().zip(met).map(of_beam).collect()
    }

    /// Adds what a segment is taken for, if for anything; a wide one is cut in two so many times.
    fn classify(
        &self,
        sweep: &Sweep<'_>,
        segment: Segment,
        laser: &LaserModel,
        cuts: usize,
        seen: &mut Seen,
    ) {
        let params = &self.params;
        let points: Vec<Point2> = segment.beams.clone().map(|at| sweep.end(at)).collect();
        let (first, last) = (segment.beams.start, segment.beams.end - 1);
        let centre = middle(&points);
        let distance = hypot(centre.x, centre.y);
        // The outermost beams end half a gap inside of its edges, on the mean.
        let spacing = sweep.gap * distance;
        let width = points[0].distance(points[points.len() - 1]) + spacing;
        if width > 2.0 * params.radius + WIDER {
            if cuts > 0 && points.len() >= 2 * SHAPE_BEAMS {
                let at = first + deepest(&points);
                for beams in [first..at, at..last + 1] {
                    self.classify(sweep, Segment { beams }, laser, cuts - 1, seen);
                }
            }
            return;
        }
        let [before, after] = sweep.beside(&segment);
        let sides = [(before, first), (after, last)];
        let meets = |side: Option<usize>| side.filter(|at| sweep.met[sweep.beam(*at)]);
        // Whether the rest of it is behind something nearer, or outside of the view.
        let goes_unseen = |&(side, edge): &(Option<usize>, usize)| {
            side.is_none() || meets(side).is_some_and(|at| sweep.range(at) + params.jump < sweep.range(edge))
        };
        let partial = sides.iter().any(goes_unseen);
        // A thing that goes on in what the map explains, or was cut, is a person only if it has the shape of one. What is seen
        // whole and stands out from the walls of the map ends at them.
        let stands_out = !partial && segment.beams.clone().any(|at| sweep.off_wall(at) >= Some(STANDS_OUT));
        let ends = |at: usize| stands_out && sweep.off_wall(at) == Some(0.0);
        let goes_on = |&&(side, edge): &&(Option<usize>, usize)| {
            meets(side).is_some_and(|at| sweep.joined(at, edge) && !ends(at))
        };
        let continued = sides.iter().filter(goes_on).count();
        let noise = laser.range_sigma * laser.range_sigma / points.len() as f64 + spacing * spacing / 12.0;
        let mut sigma = (noise + LEAST_SIGMA * LEAST_SIGMA).sqrt();
        if partial {
            sigma = hypot(sigma, PARTIAL_SIGMA);
        }
        // As narrow as a leg is also what is left to see of a trunk, but that is not as round.
        let narrow = width <= params.leg_width_max;
        let trunk = (!narrow || partial).then(|| fit(&points, params.radius));
        let enough = points.len() >= SHAPE_BEAMS;
        let is_trunk = |trunk: &Fit| enough && trunk.circle < fit(&points, params.leg_radius).circle;
        let leg = narrow && !trunk.as_ref().is_some_and(is_trunk);
        let shape = trunk.filter(|_| !leg);
        let alone = continued == 0;
        // A short piece of a wall fits a circle nearly as well as a line.
        let odds = if alone { CIRCLE_ODDS } else { 1.0 / CONTINUED_ODDS };
        let has_shape = shape.as_ref().is_some_and(|fit| enough && fit.circle < odds * fit.line);
        let accepted = alone && (leg || width <= SHAPELESS) || has_shape && continued < 2;
        if !accepted || width + spacing < params.leg_width_min {
            return;
        }
        let position = match shape {
            None => behind(centre, params.leg_radius),
            Some(fit) if has_shape || partial => fit.centre,
            Some(_) => behind(centre, 0.5 * width),
        };
        let kind = if leg { Kind::Leg } else { Kind::Trunk };
        seen.detections.push(Detection { position: laser.robot_from_laser.transform(position), kind, sigma });
        segment.beams.for_each(|at| seen.of_people[sweep.beam(at)] = true);
    }
}

/// Where a wide thing is cut: where it lies deepest behind the line between its ends, as between two people, but leaving
/// enough for a person on either side. In the middle of what has no such place.
fn deepest(points: &[Point2]) -> usize {
    let (a, b) = (points[0], points[points.len() - 1]);
    let length = a.distance(b).max(1e-9);
    // Outward of the laser, which is at the origin.
    let (nx, ny) = ((b.y - a.y) / length, (a.x - b.x) / length);
    let outward = if nx * a.x + ny * a.y >= 0.0 { 1.0 } else { -1.0 };
    let depth = |i: usize| outward * ((points[i].x - a.x) * nx + (points[i].y - a.y) * ny);
    let margin = SHAPE_BEAMS.max(points.len() / 5);
    let inner = margin..points.len() + 1 - margin;
    let best = inner.clone().max_by(|i, j| depth(*i).total_cmp(&depth(*j)).then(j.cmp(i)));
    let half = points.len() / 2;
    best.filter(|i| depth(*i) > depth(half) + 0.02).unwrap_or(half)
}
