//! How much longer the way to the goal is for a robot that does not know well where it is.

use std::sync::Arc;

use super::roadmap::{Edge, Roadmap};
use crate::evaluation::cpc::InformationField;
use crate::geometry::Point2;
use crate::motion::OdometryNoise;
use crate::numerics::exp;
use crate::occupancy::{Front, OccupancyGrid, StaticMap};

crate::parameters! {
    /// What uncertainty on the way to the goal costs, as metres.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct InformationToGoParams {
        /// Metres of blind way that one metre makes up for where a scan tells the position.
        pub recovery: f64 [0.1, 1000.0, "m per m", "slower than that no filter recovers, and faster than at once neither"] = 5.0,
        /// Metres that a metre counts more for each threshold (`uncertainty.threshold`) by which the position is more
        /// uncertain than the threshold.
        pub excess: f64 [0.0, 1000.0, "m per m", "ways longer than that are on no map"] = 0.3,
        /// Thresholds beyond which more uncertainty costs no more.
        pub most_excess: f64 [0.0, 1e6, "thresholds", "no filter is that uncertain"] = 5.0,
        /// Metres that count for arriving where the goal is not. The chance of it is that of a position error greater
        /// than the goal's tolerance.
        pub miss: f64 [0.0, 1e6, "m", "ways longer than that are on no map"] = 20.0,
        /// A place has landmarks if one scan there tells the heading to this standard deviation, radians, and ...
        pub heading_sigma: f64 [1e-4, 10.0, "rad", "no scan is better, and beyond it says nothing"] = 0.05,
        /// ... the position, across the wall that it tells most about, to this one, metres. They are enough to find the
        /// position again if it tells as much along that wall. Both are means over all headings of the robot.
        pub position_sigma: f64 [1e-4, 100.0, "m", "no scan is better, and beyond it says nothing"] = 0.1,
    }
}

/// Metres without a landmark beyond which uncertainty grows no further.
const LONGEST_BLIND: f64 = 12.0;

/// Metres by which the way to a goal counts longer, by place and by how uncertain the robot is there.
///
/// The state of a robot is its place and how far it has driven without a landmark. Both follow from the edges of a
/// roadmap: an edge to a place where a scan tells the position makes up for some of the blind way (`recovery`), one to a
/// place along a single wall leaves it as it is, and any other makes it longer. Odometry alone makes the trace of the
/// covariance grow with the blind way u by 2 p u + h u + h u^3 / 3, with the variances p of position and h of heading per
/// metre: an error of heading displaces everything driven after it. One search from the goal backwards (Dijkstra, 1959)
/// gives the least cost of each state, of which the shortest way is taken off: a belief roadmap (Prentice and Roy, 2009)
/// with one number for the covariance.
#[derive(Debug, Clone)]
pub struct InformationToGoField {
    grid: Arc<OccupancyGrid>,
    roadmap: Roadmap,
    /// What is seen at the place of each block.
    sight: Vec<Sight>,
    /// Metres, for each block and step of blind way; infinite without a place.
    metres: Vec<f32>,
    /// l(u) of each step of blind way, ascending, m2 + rad2.
    trace: Vec<f64>,
}

/// What one scan tells, as a mean over headings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sight {
    /// Too little.
    Nothing,
    /// Heading, and position across a wall but not along it.
    Wall,
    /// Heading and position.
    Position,
}

impl InformationToGoField {
    /// For a robot of `radius` metres with that odometry, on the map and laser of `information`. With an error of position
    /// up to `tolerance` metres it is still at the goal. The position counts as certain below a trace of `certain`, and what
    /// is above one of `threshold` is in excess, m2 + rad2.
    pub fn new(
        map: &StaticMap,
        information: &InformationField,
        (goal, tolerance, radius): (Point2, f64, f64),
        noise: &OdometryNoise,
        (certain, threshold): (f64, f64),
        params: &InformationToGoParams,
    ) -> Self {
        let roadmap = Roadmap::new(map, radius);
        let edges = roadmap.edges(map, radius);
        let step = 0.5 * roadmap.spacing;
        let levels = (LONGEST_BLIND / step).ceil() as usize + 1;
        let trace: Vec<f64> = (0..levels).map(|k| certain + blind_trace(noise, k as f64 * step)).collect();
        let sight: Vec<Sight> = (0..roadmap.len())
            .map(|block| roadmap.place(block).map_or(Sight::Nothing, |p| seen(information, p, params)))
            .collect();
        let rates = trace.iter().map(|l| {
            let excess = (l / threshold - 1.0).clamp(0.0, params.most_excess);
            (1.0 + params.excess * excess) as f32
        });
        let mut field =
            Self { grid: Arc::clone(&map.grid), roadmap, sight, metres: Vec::new(), trace: trace.clone() };
        let Some(end) = field.roadmap.nearest(goal) else { return field };
        let missing = |l: &f64| (params.miss * exp(-tolerance * tolerance / l.max(1e-9))) as f32;
        let search =
            Search { field: &field, edges: &edges, rates: rates.collect(), recovery: params.recovery };
        let uncertain = search.run(end, &trace.iter().map(missing).collect::<Vec<_>>());
        let shortest = field.shortest(&edges, end);
        // What is left is what uncertainty costs.
        field.metres = uncertain;
        for (block, shortest) in shortest.into_iter().enumerate() {
            for at in field.states(block) {
                let more = field.metres[at] - shortest;
                field.metres[at] = if more.is_finite() { more.max(0.0) } else { f32::INFINITY };
            }
        }
        field
    }

    /// Metres that the way from `p` counts more for a robot whose covariance has this trace, between the places around.
    /// Zero where no place is near from which the goal can be reached.
    pub fn at(&self, p: Point2, trace: f64) -> f64 {
        let (column, row) = self.roadmap.between(&self.grid, p);
        let (c, r) = (column.floor(), row.floor());
        let (u, v) = (column - c, row - r);
        let (mut sum, mut weights) = (0.0, 0.0);
        let level = self.level(trace);
        for (dc, dr, weight) in [
            (0.0, 0.0, (1.0 - u) * (1.0 - v)),
            (1.0, 0.0, u * (1.0 - v)),
            (0.0, 1.0, (1.0 - u) * v),
            (1.0, 1.0, u * v),
        ] {
            if let Some(metres) = self.of_block(c + dc, r + dr, level) {
                sum += weight * metres;
                weights += weight;
            }
        }
        if weights > 1e-9 { sum / weights } else { 0.0 }
    }

    /// What it takes in memory, bytes.
    pub fn bytes(&self) -> usize {
        let blocks = size_of_val(&self.sight[..]) + self.roadmap.bytes();
        size_of_val(&self.metres[..]) + size_of_val(&self.trace[..]) + blocks
    }

    /// How many steps of blind way make a covariance of this trace.
    fn level(&self, trace: f64) -> f64 {
        let above = self.trace.partition_point(|l| *l <= trace);
        match (above.checked_sub(1), self.trace.get(above)) {
            (None, _) => 0.0,
            (Some(below), None) => below as f64,
            (Some(below), Some(next)) => {
                below as f64 + (trace - self.trace[below]) / (next - self.trace[below]).max(1e-12)
            }
        }
    }

    fn of_block(&self, column: f64, row: f64, level: f64) -> Option<f64> {
        let (columns, rows) = (self.roadmap.columns as f64, self.roadmap.rows as f64);
        if !(column >= 0.0 && row >= 0.0 && column < columns && row < rows) {
            return None;
        }
        let block = row as usize * self.roadmap.columns + column as usize;
        let states = self.states(block);
        let metres = |k: usize| self.metres.get(states.start + k).copied().map(f64::from);
        let last = self.trace.len() - 1;
        let below = (level as usize).min(last);
        let (a, b) = (metres(below)?, metres((below + 1).min(last))?);
        let between = a + (b - a) * (level - below as f64).min(1.0);
        between.is_finite().then_some(between)
    }

    /// Where the values of a block are.
    fn states(&self, block: usize) -> std::ops::Range<usize> {
        block * self.trace.len()..(block + 1) * self.trace.len()
    }

    /// Metres from each place to that of block `end`.
    fn shortest(&self, edges: &[Vec<Edge>], end: usize) -> Vec<f32> {
        let mut metres = vec![f32::INFINITY; edges.len()];
        let mut front = Front::new((2.0 * std::f64::consts::SQRT_2 * self.roadmap.spacing) as f32);
        metres[end] = 0.0;
        front.push(0.0, end);
        while let Some((so_far, from)) = front.pop() {
            if so_far > metres[from] {
                continue;
            }
            for edge in &edges[from] {
                let longer = so_far + edge.metres;
                if longer < metres[edge.to] {
                    metres[edge.to] = longer;
                    front.push(longer, edge.to);
                }
            }
        }
        metres
    }
}

/// The search from the goal backwards.
struct Search<'a> {
    field: &'a InformationToGoField,
    edges: &'a [Vec<Edge>],
    /// What a metre costs at each step of blind way.
    rates: Vec<f32>,
    /// Steps of blind way that one step makes up for.
    recovery: f64,
}

impl Search<'_> {
    /// The least cost from each state to the place of block `end`, where arriving costs `missing` by the blind way.
    fn run(&self, end: usize, missing: &[f32]) -> Vec<f32> {
        let Self { field, edges, rates, recovery } = self;
        let mut metres = vec![f32::INFINITY; field.roadmap.len() * rates.len()];
        let dearest = rates.iter().copied().fold(1.0, f32::max);
        let mut front = Front::new((2.0 * std::f64::consts::SQRT_2 * field.roadmap.spacing) as f32 * dearest);
        let offer = |metres: &mut Vec<f32>, front: &mut Front, state: usize, cost: f32| {
            if cost < metres[state] {
                metres[state] = cost;
                front.push(cost, state);
            }
        };
        for (level, state) in field.states(end).enumerate() {
            offer(&mut metres, &mut front, state, missing[level]);
        }
        let last = rates.len() - 1;
        while let Some((so_far, state)) = front.pop() {
            if so_far > metres[state] {
                continue;
            }
            let (block, level) = (state / rates.len(), state % rates.len());
            for edge in &edges[block] {
                let states = field.states(edge.to);
                // Which states of the place before this edge lead here?
                let less = (edge.halves as f64 * recovery) as usize;
                let before = match field.sight[block] {
                    Sight::Position if level == 0 => 0..(less + 1).min(last + 1),
                    Sight::Position => (level + less).min(last + 1)..(level + less + 1).min(last + 1),
                    Sight::Wall => level..level + 1,
                    Sight::Nothing if level == last => last.saturating_sub(edge.halves)..last + 1,
                    Sight::Nothing if level >= edge.halves => level - edge.halves..level - edge.halves + 1,
                    Sight::Nothing => continue,
                };
                for before in before {
                    let cost = so_far + rates[before] * edge.metres;
                    offer(&mut metres, &mut front, states.start + before, cost);
                }
            }
        }
        metres
    }
}

/// By how much the trace has grown after so many metres without a landmark.
fn blind_trace(noise: &OdometryNoise, metres: f64) -> f64 {
    let (position, heading) = (noise.position_per_metre, noise.heading_per_metre);
    2.0 * position * metres + heading * metres + heading * metres * metres * metres / 3.0
}

fn seen(information: &InformationField, p: Point2, params: &InformationToGoParams) -> Sight {
    let [most, least, of_heading] = information.mean_at(p);
    let enough = |information: f64, sigma: f64| information * sigma * sigma >= 1.0;
    if !enough(of_heading, params.heading_sigma) || !enough(most, params.position_sigma) {
        Sight::Nothing
    } else if enough(least, params.position_sigma) {
        Sight::Position
    } else {
        Sight::Wall
    }
}
