//! How much longer the way to the goal is for a robot that does not know well where it is.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::roadmap::{Edge, Roadmap};
use super::uncertainty::{Levels, Mix, STATES, Sight, Variances, rise_with_heading};
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
        /// Metres on which the uncertainty of the position falls to a third where a scan tells it.
        pub recovery: f64 [0.01, 1000.0, "m", "faster than at once no filter recovers, and slower than that neither"] = 0.5,
        /// Metres that a metre counts more for each threshold (`uncertainty.threshold`) by which the position is more
        /// uncertain than the threshold.
        pub excess: f64 [0.0, 1000.0, "m per m", "ways longer than that are on no map"] = 0.1,
        /// Thresholds beyond which more uncertainty costs no more.
        pub most_excess: f64 [0.0, 1e6, "thresholds", "no filter is that uncertain"] = 5.0,
        /// Metres that count for arriving where the goal is not. The chance of it is that of a position error greater
        /// than the goal's tolerance.
        pub miss: f64 [0.0, 1e6, "m", "ways longer than that are on no map"] = 45.0,
        /// A place has landmarks if one scan there tells the heading to this standard deviation, radians, and ...
        pub heading_sigma: f64 [1e-4, 10.0, "rad", "no scan is better, and beyond it says nothing"] = 0.05,
        /// ... the position, across the wall that it tells most about, to this one, metres. They are enough to find the
        /// position again if it tells as much along that wall. Both are means over all headings of the robot.
        pub position_sigma: f64 [1e-4, 100.0, "m", "no scan is better, and beyond it says nothing"] = 0.1,
    }
}

impl InformationToGoParams {
    /// What a metre costs a robot that is so uncertain, metres.
    fn rate(&self, variances: &Variances, threshold: f64) -> f32 {
        let excess = (variances.position + variances.heading) / threshold - 1.0;
        (1.0 + self.excess * excess.clamp(0.0, self.most_excess)) as f32
    }

    /// What arriving costs such a robot, which is at the goal up to an error of `tolerance` metres, metres.
    fn missing(&self, variances: &Variances, tolerance: f64) -> f32 {
        (self.miss * exp(-tolerance * tolerance / variances.position)) as f32
    }
}

/// A cost that falls by less, metres, does not let the neighbours be looked at again.
const EXACT: f32 = 0.01;

/// Metres by which the way to a goal counts longer, by place and by how uncertain the robot is there.
///
/// The state of a robot is its place on a roadmap, the variance of its position and that of its heading. A stretch of
/// way changes the two by the odometry's noise and by what a scan tells at its end. The least cost of each state is
/// found backwards from the goal, and the shortest way is taken off: a belief roadmap (Prentice and Roy, 2009) with two
/// numbers for the covariance.
#[derive(Debug, Clone)]
pub struct InformationToGoField {
    grid: Arc<OccupancyGrid>,
    roadmap: Roadmap,
    levels: Levels,
    /// Metres, for each block and state; infinite without a place.
    metres: Vec<f32>,
}

impl InformationToGoField {
    /// For a robot of `radius` metres with that odometry, on the map and laser of `information`. With an error of
    /// position up to `tolerance` metres it is still at the goal. What the trace of the covariance has above
    /// `threshold` is in excess, m2 + rad2.
    pub fn new(
        map: &StaticMap,
        information: &InformationField,
        (goal, tolerance, radius): (Point2, f64, f64),
        noise: &OdometryNoise,
        threshold: f64,
        params: &InformationToGoParams,
    ) -> Self {
        let roadmap = Roadmap::new(map, radius);
        let edges = roadmap.edges(map, radius);
        let levels = Levels::new(noise, params.heading_sigma, params.recovery);
        let mut field = Self { grid: Arc::clone(&map.grid), roadmap, levels, metres: Vec::new() };
        let Some(end) = field.roadmap.nearest(goal) else { return field };
        let shortest = field.shortest(&edges, end);
        let states: Vec<Variances> = (0..STATES).map(|state| field.levels.of(state)).collect();
        let sight = (0..edges.len()).map(|block| match field.roadmap.place(block) {
            Some(place) => seen(information, place, params),
            None => Sight::Nothing,
        });
        let search = Search {
            edges: &edges,
            after: Sight::ALL.map(|sight| [false, true].map(|diagonal| field.after(sight, diagonal))),
            sight: sight.collect(),
            rates: states.iter().map(|v| params.rate(v, threshold)).collect(),
            missing: states.iter().map(|v| params.missing(v, tolerance)).collect(),
        };
        let mut metres = search.run(end, &shortest);
        // What is left is what uncertainty costs. Where the goal cannot be reached from, it stays infinite.
        for (of_block, shortest) in metres.chunks_exact_mut(STATES).zip(shortest) {
            if shortest.is_finite() {
                of_block.iter_mut().for_each(|metres| *metres = (*metres - shortest).max(0.0));
            }
        }
        field.metres = metres;
        field
    }

    /// Metres that the way from `p` counts more for a robot of this covariance (x, y, heading), between the places
    /// around. Zero where no place is near from which the goal can be reached.
    pub fn at(&self, p: Point2, covariance: &Matrix3<f64>) -> f64 {
        let (column, row) = self.roadmap.between(&self.grid, p);
        let c = column.floor();
        let r = row.floor();
        let u = column - c;
        let v = row - r;
        let mut sum = 0.0;
        let mut weights = 0.0;
        let variances =
            Variances { position: covariance[(0, 0)] + covariance[(1, 1)], heading: covariance[(2, 2)] };
        let mix = self.levels.around(variances);
        for (dc, dr, weight) in [
            (0.0, 0.0, (1.0 - u) * (1.0 - v)),
            (1.0, 0.0, u * (1.0 - v)),
            (0.0, 1.0, (1.0 - u) * v),
            (1.0, 1.0, u * v),
        ] {
            if let Some(metres) = self.of_block(c + dc, r + dr, &mix) {
                sum += weight * metres;
                weights += weight;
            }
        }
        if weights > 1e-9 { sum / weights } else { 0.0 }
    }

    /// What it takes in memory, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.metres[..]) + self.roadmap.bytes()
    }

    fn of_block(&self, column: f64, row: f64, mix: &Mix) -> Option<f64> {
        let columns = self.roadmap.columns as f64;
        let rows = self.roadmap.rows as f64;
        if !(column >= 0.0 && row >= 0.0 && column < columns && row < rows) {
            return None;
        }
        let block = row as usize * self.roadmap.columns + column as usize;
        let of_block = self.metres.get(block * STATES..(block + 1) * STATES)?;
        of_block[0].is_finite().then(|| f64::from(mixed(of_block, mix)))
    }

    /// What becomes of each state on an edge, which is taken to be as long as a block's side or, diagonal, half as long
    /// again.
    fn after(&self, sight: Sight, diagonal: bool) -> Vec<Mix> {
        let metres = self.roadmap.spacing * if diagonal { 1.5 } else { 1.0 };
        (0..STATES)
            .map(|state| self.levels.around(self.levels.after(self.levels.of(state), sight, metres)))
            .collect()
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
    edges: &'a [Vec<Edge>],
    /// [`InformationToGoField::after`] each of [`Sight::ALL`], straight and diagonal.
    after: [[Vec<Mix>; 2]; Sight::ALL.len()],
    /// What is seen at the place of each block.
    sight: Vec<Sight>,
    /// What a metre costs in each state.
    rates: Vec<f32>,
    /// What arriving costs in each state.
    missing: Vec<f32>,
}

impl Search<'_> {
    /// The least cost of each block and state: it falls from the cost of the shortest way, in rounds that go outward
    /// and inward in turns, until no block lowers another's.
    fn run(&self, end: usize, shortest: &[f32]) -> Vec<f32> {
        let dearest = self.rates.iter().copied().fold(1.0, f32::max);
        let worst = self.missing.iter().copied().fold(0.0, f32::max);
        let mut metres: Vec<f32> = shortest
            .iter()
            .flat_map(|metres| std::iter::repeat_n(metres * dearest + worst, STATES))
            .collect();
        let mut order: Vec<usize> =
            (0..self.edges.len()).filter(|block| shortest[*block].is_finite()).collect();
        order.sort_by(|a, b| shortest[*a].total_cmp(&shortest[*b]));
        let mut stale = vec![true; self.edges.len()];
        let mut lowered = true;
        while std::mem::take(&mut lowered) {
            for &block in &order {
                if !std::mem::take(&mut stale[block]) {
                    continue;
                }
                let least = self.least(block, end, &metres);
                let of_block = &mut metres[block * STATES..(block + 1) * STATES];
                let fall = of_block.iter().zip(&least).fold(0.0, |most: f32, (old, new)| most.max(old - new));
                of_block.iter_mut().zip(least).for_each(|(old, new)| *old = old.min(new));
                if fall > EXACT {
                    lowered = true;
                    self.edges[block].iter().for_each(|edge| stale[edge.to] = true);
                }
            }
            order.reverse();
        }
        metres
    }

    /// The least cost of each state of a block by those of its neighbours.
    fn least(&self, block: usize, end: usize, metres: &[f32]) -> [f32; STATES] {
        let mut least = [f32::INFINITY; STATES];
        if block == end {
            least.copy_from_slice(&self.missing);
        }
        for edge in &self.edges[block] {
            let after = &self.after[self.sight[edge.to] as usize][usize::from(edge.diagonal)];
            let beyond = &metres[edge.to * STATES..(edge.to + 1) * STATES];
            for ((least, mix), rate) in least.iter_mut().zip(after).zip(&self.rates) {
                *least = least.min(rate * edge.metres + mixed(beyond, mix));
            }
        }
        rise_with_heading(&mut least);
        least
    }
}

fn mixed(of_states: &[f32], mix: &Mix) -> f32 {
    mix.iter().map(|(state, weight)| weight * of_states[*state]).sum()
}

fn seen(information: &InformationField, p: Point2, params: &InformationToGoParams) -> Sight {
    let [most, least, of_heading] = information.mean_at(p);
    if !tells(of_heading, params.heading_sigma) || !tells(most, params.position_sigma) {
        Sight::Nothing
    } else if tells(least, params.position_sigma) {
        Sight::Position
    } else {
        Sight::Wall
    }
}

/// Whether so much information tells a number to this standard deviation.
fn tells(information: f64, sigma: f64) -> bool {
    information * sigma * sigma >= 1.0
}
