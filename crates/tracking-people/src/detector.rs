//! From a scan to what may be people in it.

use std::sync::Arc;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::occupancy::{Cell, StaticMap};
use curionav_planning::sensor::LaserModel;
use nalgebra::{Matrix3, Vector3};

use crate::alignment::align;
use crate::background::Posed;
use crate::params::TrackerParams;
use crate::segments::{Segment, Sweep};
use crate::shape::{Fit, Likelihoods, centre_behind, fit, middle};

/// What a detection may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something as narrow as a leg. It is one of a person's two legs, or what is seen of a person who is nearly
    /// hidden.
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
    /// How much likelier its shape is that of a person than that of a box, as a logarithm; 0 where it shows none.
    pub roundness: f64,
}

/// What is to be seen of people in one scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seen {
    /// In the order of the beams.
    pub detections: Vec<Detection>,
    /// Whether each beam ended on one of them.
    pub of_people: Vec<bool>,
    /// Pose of the robot after the walls in the scan have been laid on those of the map, map frame.
    pub pose: Pose2,
    /// Covariance of `pose`.
    pub covariance: Matrix3<f64>,
}

/// A scan beside the map.
struct Compared {
    /// Where beams ended, laser frame.
    ends: Vec<Point2>,
    /// Whether they met something.
    met: Vec<bool>,
    /// As [`Detector::off_wall`] gives it; none of beams that met nothing.
    off_walls: Vec<Option<f64>>,
    /// The robot's after the walls in the scan have been laid on those of the map.
    pose: Pose2,
    covariance: Matrix3<f64>,
}

/// Finds people in the scans of a laser on a known map.
#[derive(Debug, Clone)]
pub struct Detector {
    map: Arc<StaticMap>,
    params: TrackerParams,
}

/// By how much a trunk may be wider than the disc that stands for a person, metres: with arms and bags it is.
const WIDER: f64 = 0.25;
/// Up to this width a thing that stands alone may have any shape to be taken for a trunk, metres. A trunk that is
/// partly hidden shows no shape, and neither do two legs beside each other.
const ANY_SHAPE_WIDTH: f64 = 0.45;
/// To be round, a thing that stands alone must fit a circle with less than this many times the squared error of a line.
const ERROR_RATIO_ALONE: f64 = 1.5;
/// The ratio for a thing that touches something else. It is less, because a short piece of a wall fits a circle nearly
/// as well as a line.
const ERROR_RATIO_TOUCHING: f64 = 0.5;
/// With fewer beams a circle cannot be told from a line.
const SHAPE_BEAMS: usize = 4;
/// A pose that is known less well counts as known so well, metres and radians: a start that is told roughly.
const ROUGH_SIGMA: Vector3<f64> = Vector3::new(0.5, 0.5, 0.26);
/// What is wider than a person is cut in two, and each part again, so many times at most: into sixteen pieces.
const CUTS: usize = 4;
/// A point that is at least so far from every wall of the map belongs to no wall, metres. A nearer one may belong to a
/// wall that the map shows a little beside its place.
const STANDS_OUT: f64 = 0.3;
/// Standard deviation, metres, that comes on top of that of a centre where a side of the thing may be hidden.
const PARTIAL_SIGMA: f64 = 0.1;
/// Standard deviation of a centre besides the laser's noise and resolution, metres: no person is a cylinder.
const LEAST_SIGMA: f64 = 0.03;

impl Detector {
    /// A detector on this map.
    pub fn new(map: Arc<StaticMap>, params: TrackerParams) -> Self {
        Self { map, params }
    }

    /// What is seen of people by a scan, for a robot that is at `pose` on the map with this covariance (x, y,
    /// heading). `ranges` are those of the beams of `laser`; [`Beam`] says what they mean.
    pub fn see(&self, ranges: &[f32], laser: &LaserModel, pose: Pose2, covariance: &Matrix3<f64>) -> Seen {
        let count = ranges.len().min(laser.beams as usize);
        let ranges = &ranges[..count];
        if count < 2 {
            return Seen { of_people: vec![false; count], pose, covariance: *covariance, ..Seen::default() };
        }
        let Compared { ends, met, off_walls, pose, covariance } =
            self.compare(ranges, laser, pose, covariance);
        let sweep = Sweep {
            ends: &ends,
            ranges,
            met: &met,
            off_walls: &off_walls,
            gap: laser.bearing(1) - laser.bearing(0),
            full: laser.sees_all_around(),
            jump: self.params.jump,
        };
        let mut pieces = Vec::new();
        for segment in sweep.segments() {
            self.cut(&sweep, segment, CUTS, &mut pieces);
        }
        let mut seen = Seen { detections: Vec::new(), of_people: vec![false; count], pose, covariance };
        for piece in pieces {
            if let Some(detection) = self.classify(&sweep, &piece, laser) {
                seen.detections.push(detection);
                piece.segment.beams.for_each(|at| seen.of_people[sweep.beam(at)] = true);
            }
        }
        seen
    }

    /// Whether the map explains where each beam ended, for a robot as [`Self::see`] takes it: on a wall, as far as the
    /// pose is known, or where the map knows nothing. One that met nothing needs no reason.
    pub fn explained(
        &self,
        ranges: &[f32],
        laser: &LaserModel,
        pose: Pose2,
        covariance: &Matrix3<f64>,
    ) -> Vec<bool> {
        let ranges = &ranges[..ranges.len().min(laser.beams as usize)];
        let compared = self.compare(ranges, laser, pose, covariance);
        compared.off_walls.iter().map(|off_wall| off_wall.is_none_or(|metres| metres == 0.0)).collect()
    }

    fn compare(
        &self,
        ranges: &[f32],
        laser: &LaserModel,
        pose: Pose2,
        covariance: &Matrix3<f64>,
    ) -> Compared {
        let met: Vec<bool> = ranges.iter().map(|range| meets_something(*range, laser)).collect();
        let ends: Vec<Point2> =
            (0..laser.beams).zip(ranges).map(|(i, range)| end(laser, i, *range)).collect();
        let in_robot: Vec<Point2> = ends.iter().map(|end| laser.robot_from_laser.transform(*end)).collect();
        let hits: Vec<Point2> =
            in_robot.iter().zip(&met).filter(|(_, met)| **met).map(|(end, _)| *end).collect();
        let sigma = hypot(laser.range_sigma, self.params.map_sigma);
        let (pose, covariance) = align(&self.map, &hits, sigma, pose, &at_most_rough(covariance));
        let posed = Posed::new(&self.map, pose);
        let off_walls: Vec<Option<f64>> = in_robot
            .iter()
            .zip(&met)
            .map(|(end, met)| if *met { self.off_wall(&posed, *end, sigma, &covariance) } else { None })
            .collect();
        Compared { ends, met, off_walls, pose, covariance }
    }

    /// How far from the walls of the map a beam ended, metres, and `None` where the map is unknown. It is 0 if the beam
    /// may have ended on a wall, given how well the pose is known (`covariance`). `sigma` is the standard deviation of
    /// the laser and of the map's walls together, metres.
    fn off_wall(&self, posed: &Posed<'_>, end: Point2, sigma: f64, covariance: &Matrix3<f64>) -> Option<f64> {
        match posed.cell(end) {
            Cell::Unknown => None,
            Cell::Occupied => Some(0.0),
            Cell::Free => {
                let wall = posed.to_wall(end);
                let variance = sigma * sigma + wall.variance(covariance);
                let reach = self.params.explained_sigmas * variance.sqrt();
                Some(if wall.metres > reach { wall.metres } else { 0.0 })
            }
        }
    }

    /// Adds a segment to the pieces if it is at most as wide as a person. A wider one is cut in two, and so are its
    /// parts, up to `cuts` times. A part that is then still too wide, or has too few beams to be cut, is left out.
    fn cut(&self, sweep: &Sweep<'_>, segment: Segment, cuts: usize, pieces: &mut Vec<Piece>) {
        let piece = Piece::new(sweep, segment);
        if piece.width <= 2.0 * self.params.radius + WIDER {
            pieces.push(piece);
        } else if cuts > 0 && piece.points.len() >= 2 * SHAPE_BEAMS {
            let beams = piece.segment.beams;
            let middle = beams.start + deepest(&piece.points);
            self.cut(sweep, Segment { beams: beams.start..middle }, cuts - 1, pieces);
            self.cut(sweep, Segment { beams: middle..beams.end }, cuts - 1, pieces);
        }
    }

    /// What a piece is taken for, if for a person or a part of one.
    fn classify(&self, sweep: &Sweep<'_>, piece: &Piece, laser: &LaserModel) -> Option<Detection> {
        if piece.width + piece.spacing < self.params.leg_width_min {
            return None;
        }
        let context = Context::new(sweep, &piece.segment);
        let (kind, centre) = match self.trunk(piece, context) {
            None if context.joined_sides > 0 => return None,
            None => (Kind::Leg, centre_behind(piece.centre, self.params.leg_radius)),
            Some(trunk) => (Kind::Trunk, trunk_centre(piece, &trunk, context)?),
        };
        let mut sigma = piece.sigma(laser.range_sigma);
        if context.partial {
            sigma = hypot(sigma, PARTIAL_SIGMA);
        }
        let roundness = if piece.shows_shape() { self.roundness(sweep, piece, context, laser) } else { 0.0 };
        Some(Detection { position: laser.robot_from_laser.transform(centre), kind, sigma, roundness })
    }

    /// How much likelier a piece is the front of a person, or a part of it, than a thing. A narrow one that is seen
    /// whole may be two legs beside each other, and so be flat. Of a part it does not show how wide the whole is; a
    /// narrow part may be flat as well.
    fn roundness(&self, sweep: &Sweep<'_>, piece: &Piece, context: Context, laser: &LaserModel) -> f64 {
        let likelihoods =
            Likelihoods::of(&piece.points, self.params.radius, hypot(laser.range_sigma, LEAST_SIGMA));
        let mut beams = piece.segment.beams.clone();
        let stands_out = beams.all(|at| sweep.off_wall(at) >= Some(STANDS_OUT));
        let is_whole = stands_out && !context.partial && context.joined_sides == 0;
        match (is_whole, piece.width <= ANY_SHAPE_WIDTH) {
            (true, true) => likelihoods.over_round(),
            (true, false) => likelihoods.over_round().min(likelihoods.over_flat()),
            (false, true) => likelihoods.over_flat().max(0.0),
            (false, false) => likelihoods.over_flat(),
        }
    }

    /// The disc of a trunk fitted to a piece, or `None` if the piece is too narrow for a trunk. A narrow piece may
    /// still be the visible part of a trunk. It then may go on unseen, and fits a trunk's circle better than a leg's.
    fn trunk(&self, piece: &Piece, context: Context) -> Option<Fit> {
        let is_narrow = piece.width <= self.params.leg_width_max;
        if is_narrow && !context.partial {
            return None;
        }
        let trunk = fit(&piece.points, self.params.radius);
        let is_trunk = !is_narrow
            || piece.shows_shape() && trunk.circle < fit(&piece.points, self.params.leg_radius).circle;
        is_trunk.then_some(trunk)
    }
}

/// Whether a beam met something.
fn meets_something(range: f32, laser: &LaserModel) -> bool {
    matches!(Beam::of(range, 0.0, laser.range_max), Beam::Obstacle(_))
}

/// The covariance of a pose that is known at least so well. Of a robot that may be anywhere the map would explain every
/// beam, and nothing would stand in its way.
fn at_most_rough(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let variances = covariance.diagonal();
    let scale = Matrix3::from_diagonal(&ROUGH_SIGMA.zip_map(&variances, |rough, variance| {
        if variance > rough * rough { rough / variance.sqrt() } else { 1.0 }
    }));
    scale * covariance * scale
}

/// Where beam `i` ended, laser frame: at the greatest range if it met nothing.
fn end(laser: &LaserModel, i: u32, range: f32) -> Point2 {
    let (s, c) = sin_cos(laser.bearing(i));
    let range = if meets_something(range, laser) { f64::from(range) } else { laser.range_max };
    Point2::new(range * c, range * s)
}

/// A segment, or a part of one, with what is measured of it.
struct Piece {
    segment: Segment,
    /// Ends of its beams, laser frame.
    points: Vec<Point2>,
    /// Their mean.
    centre: Point2,
    /// Metres between neighbouring beams at this distance.
    spacing: f64,
    /// Metres.
    width: f64,
}

impl Piece {
    fn new(sweep: &Sweep<'_>, segment: Segment) -> Self {
        let points: Vec<Point2> = segment.beams.clone().map(|at| sweep.end(at)).collect();
        let centre = middle(&points);
        let spacing = sweep.gap * hypot(centre.x, centre.y);
        // On either side the edge of the thing lies half a spacing beyond the outermost beam, on average.
        let width = points[0].distance(points[points.len() - 1]) + spacing;
        Self { segment, points, centre, spacing, width }
    }

    /// Whether there are enough beams to tell a circle from a line.
    fn shows_shape(&self) -> bool {
        self.points.len() >= SHAPE_BEAMS
    }

    /// Standard deviation of the centre of a piece that is seen whole, metres.
    fn sigma(&self, range_sigma: f64) -> f64 {
        let noise = range_sigma * range_sigma / self.points.len() as f64 + self.spacing * self.spacing / 12.0;
        (noise + LEAST_SIGMA * LEAST_SIGMA).sqrt()
    }
}

/// What lies beside a piece.
#[derive(Clone, Copy)]
struct Context {
    /// Whether the rest of it may be behind something nearer, or outside of the view.
    partial: bool,
    /// On how many of its two sides something else joins on: the other part, if it was cut there, or what the map
    /// explains, such as a wall.
    joined_sides: usize,
}

impl Context {
    fn new(sweep: &Sweep<'_>, segment: &Segment) -> Self {
        let sides = sweep.sides(segment);
        let partial = sides.iter().any(|side| sweep.goes_unseen(side));
        // If the whole thing is seen and stands out from the walls, it is not part of a wall that it touches.
        let is_no_wall = !partial && segment.beams.clone().any(|at| sweep.off_wall(at) >= Some(STANDS_OUT));
        let joined_sides = sides.iter().filter(|side| sweep.goes_on(side, is_no_wall)).count();
        Self { partial, joined_sides }
    }
}

/// The centre of a piece that is a trunk, or `None` if it is none. A piece that is joined on one side is a trunk only
/// if it is round. A piece that is joined on both sides is none.
fn trunk_centre(piece: &Piece, trunk: &Fit, context: Context) -> Option<Point2> {
    let is_alone = context.joined_sides == 0;
    let ratio = if is_alone { ERROR_RATIO_ALONE } else { ERROR_RATIO_TOUCHING };
    let is_round = piece.shows_shape() && trunk.circle < ratio * trunk.line;
    let is_trunk = is_round && context.joined_sides < 2 || is_alone && piece.width <= ANY_SHAPE_WIDTH;
    is_trunk.then(|| match is_round || context.partial {
        true => trunk.centre,
        false => centre_behind(piece.centre, 0.5 * piece.width),
    })
}

/// Where a wide thing is cut: where it lies deepest behind the line between its ends, as between two people, but
/// leaving enough for a person on either side. A thing without such a place is cut in its middle.
fn deepest(points: &[Point2]) -> usize {
    let a = points[0];
    let b = points[points.len() - 1];
    let length = a.distance(b).max(1e-9);
    let nx = (b.y - a.y) / length;
    let ny = (a.x - b.x) / length;
    // Outward of the laser, which is at the origin.
    let outward = if nx * a.x + ny * a.y >= 0.0 { 1.0 } else { -1.0 };
    let depths: Vec<f64> = points.iter().map(|p| outward * ((p.x - a.x) * nx + (p.y - a.y) * ny)).collect();
    let margin = SHAPE_BEAMS.max(points.len() / 5);
    let inner = margin..points.len() + 1 - margin;
    let best = inner.max_by(|i, j| depths[*i].total_cmp(&depths[*j]).then(j.cmp(i)));
    let half = points.len() / 2;
    best.filter(|i| depths[*i] > depths[half] + 0.02).unwrap_or(half)
}
