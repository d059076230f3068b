//! How much one scan tells about the pose, everywhere on the map: `C^T N'^-1 C` of eqs. 8, 10, 11.
//!
//! A beam in direction `d` that ends after `r` metres on a wall with normal `n` changes with the pose
//! of the laser by
//! ```text
//! dr/d(x, y) = -n / (n.d)        dr/dheading = -r (n.d_perp) / (n.d)
//! ```
//! where `d_perp` is `d` turned by +90 degrees (the beam model, A4). In open space no beam ends within
//! range and the information is zero.
//!
//! Computed once per map and laser: from the centre of each block of cells a fan of rays is cast, and
//! for each heading those within the field of view are summed. Nothing is stored where nothing is seen.

mod lookup;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::evaluation::cpc::beam_fan::{Fan, HEADINGS, MeasurementModel, factorise};
use crate::geometry::{Point2, Pose2};
use crate::numerics::{eigenvalues, sin_cos};
use crate::occupancy::{Cell, OccupancyGrid, StaticMap};
use crate::sensor::LaserModel;
use crate::workers::{Alone, Piece, Workers};

/// Cells along a block's side: 0.2 m at the paper's resolution, well below the ranges measured.
const BLOCK: usize = 4;
crate::parameters! {
    /// Parameters of the observation model.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct InformationParams {
        /// What a range says about the pose.
        pub model: MeasurementModel [words] = MeasurementModel::Beam,
        /// Standard deviation of one range as the localiser takes it, metres (A5; its `sigma_hit`, not the
        /// laser's own noise).
        pub sigma: f64
            [0.001, 10.0, "m", "no laser is better than a millimetre, and beyond 10 m a range says nothing"] = 0.2,
        /// Beams of one scan that count, spread over the field of view; never more than the laser has.
        pub beams: u32 [1.0, 8192.0, "beams", "a laser has no more"] = 20,
        /// Neighbouring beams err together; the information of a scan is divided by this, at least 1. With 20 beams,
        /// 1.1 makes a scan worth what the localiser takes it for: 30 beams and an exponent of 0.6.
        pub correlation: f64
            [1.0, 1e6, "beams", "independent beams have 1, and beyond the greatest a scan says nothing"] = 1.1,
    }
}

impl InformationParams {
    /// The rays of `laser` on `map`.
    pub(super) fn fan<'a>(&self, map: &'a StaticMap, laser: &LaserModel) -> Fan<'a> {
        let beams = f64::from(self.beams.min(laser.beams));
        let scan = beams / (self.sigma * self.sigma * self.correlation.max(1.0));
        Fan::new(map, laser, self.model, scan)
    }
}

/// Information J about (x, y, heading) as `L D L^T` with unit lower triangular L, in the order d1, l21,
/// l31, d2, l32, d3. Positive semi-definite whatever the rounding, and three scalar measurements to a
/// Kalman filter: direction (1, l21, l31) with variance 1/d1, (0, 1, l32) with 1/d2, (0, 0, 1) with 1/d3.
pub(super) type Factor = [f64; 6];

/// The observation information of one scan, on blocks of cells and headings.
#[derive(Debug, Clone)]
pub struct InformationField {
    origin: Pose2,
    sin_cos: (f64, f64),
    blocks_per_metre: f64,
    columns: usize,
    rows: usize,
    headings: usize,
    robot_from_laser: Pose2,
    /// Place of each block's first factor; 0 where nothing is seen.
    place: Arc<[u32]>,
    /// Factors in the grid's axes, `[block, heading]`, the first `headings` of them zero.
    factors: Arc<[[f32; 6]]>,
}

impl InformationField {
    /// Casts the rays: some 40 ms for a laser of 5 m on a map of 350 000 cells.
    pub fn new(map: &StaticMap, laser: &LaserModel, params: &InformationParams) -> Self {
        Self::by(&Alone, map, laser, params)
    }

    /// The same, in pieces that `workers` do.
    pub fn by(
        workers: &dyn Workers,
        map: &StaticMap,
        laser: &LaserModel,
        params: &InformationParams,
    ) -> Self {
        let grid = &*map.grid;
        let columns = grid.width().div_ceil(BLOCK);
        let rows = grid.height().div_ceil(BLOCK);
        let fan = params.fan(map, laser);
        let headings = fan.headings();
        let mut bands: Vec<Band> = (0..rows.div_ceil(BAND)).map(|_| Band::default()).collect();
        let pieces = bands.iter_mut().enumerate().map(|(i, band)| -> Piece<'_> {
            let fan = &fan;
            Box::new(move || *band = Band::of(grid, fan, columns, i * BAND..rows.min((i + 1) * BAND)))
        });
        workers.run(pieces.collect());
        let mut factors = vec![[0.0; 6]; headings];
        factors.reserve_exact(bands.iter().map(|band| band.factors.len()).sum());
        let mut place = Vec::with_capacity(columns * rows);
        for band in bands {
            let first = factors.len();
            place.extend(band.place.iter().map(|place| place.map_or(0, |place| (first + place) as u32)));
            factors.extend(band.factors);
        }
        let origin = grid.origin();
        Self {
            origin,
            sin_cos: sin_cos(origin.heading),
            blocks_per_metre: 1.0 / (grid.resolution() * BLOCK as f64),
            columns,
            rows,
            headings,
            robot_from_laser: laser.robot_from_laser,
            place: place.into(),
            factors: factors.into(),
        }
    }

    /// The field of the same laser in another place on the robot, which shares the memory of this one: where the laser
    /// sits changes what is looked up, not what it sees.
    pub fn mounted(&self, robot_from_laser: Pose2) -> Self {
        Self { robot_from_laser, ..self.clone() }
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.place) + size_of_val(&*self.factors)
    }

    /// Information of one scan about the robot's pose (x, y, heading) at `pose`, in the map frame:
    /// 1/m2, 1/(m rad), 1/rad2. Zero outside the map, inside walls and where nothing is in range.
    pub fn at(&self, pose: Pose2) -> Matrix3<f64> {
        let [d1, l21, l31, d2, l32, d3] = self.factor(pose);
        let l = Matrix3::new(1.0, 0.0, 0.0, l21, 1.0, 0.0, l31, l32, 1.0);
        let in_grid = l * Matrix3::from_diagonal(&nalgebra::vector![d1, d2, d3]) * l.transpose();
        let turn = self.map_from_grid();
        turn * in_grid * turn.transpose()
    }

    /// Centres of the blocks of cells within `radius` metres of `centre`, and what a scan tells there: the trace of the
    /// laser's information, averaged over headings. Blocks that see nothing are left out.
    pub fn worth_around(&self, centre: Point2, radius: f64) -> impl Iterator<Item = (Point2, f64)> + '_ {
        let middle = self.origin.inverse_transform(centre);
        let along = |p: f64, end: usize| {
            let at = |p: f64| ((p * self.blocks_per_metre).max(0.0) as usize).min(end);
            at(p - radius)..(at(p + radius) + 1).min(end)
        };
        let columns = along(middle.x, self.columns);
        let blocks =
            along(middle.y, self.rows).flat_map(move |row| columns.clone().map(move |column| (column, row)));
        blocks.filter_map(move |(column, row)| {
            let first = self.place[row * self.columns + column] as usize;
            let at = |index: usize| (index as f64 + 0.5) / self.blocks_per_metre;
            let p = Point2::new(at(column), at(row));
            let trace = |[d1, l21, l31, d2, l32, d3]: &[f32; 6]| {
                f64::from(d1 * (1.0 + l21 * l21 + l31 * l31) + d2 * (1.0 + l32 * l32) + d3)
            };
            let sum = || self.factors[first..first + self.headings].iter().map(trace).sum::<f64>();
            (first > 0 && p.distance(middle) <= radius)
                .then(|| (self.origin.transform(p), sum() / self.headings as f64))
        })
    }

    /// What one scan tells of the robot at `p`, averaged over headings: of its position along the direction that it
    /// tells most about and across that, 1/m2, and of its heading, 1/rad2.
    pub fn mean_at(&self, p: Point2) -> [f64; 3] {
        let [mut xx, mut xy, mut yy, mut tt] = [0.0; 4];
        for k in 0..self.headings {
            let heading = k as f64 * std::f64::consts::TAU / self.headings as f64;
            let [d1, l21, l31, d2, l32, d3] = self.factor(Pose2::new(p.x, p.y, heading));
            xx += d1;
            xy += d1 * l21;
            yy += d1 * l21 * l21 + d2;
            tt += d1 * l31 * l31 + d2 * l32 * l32 + d3;
        }
        let mean = 1.0 / self.headings as f64;
        let (most, least) = eigenvalues(xx * mean, xy * mean, yy * mean);
        [most, least, tt * mean]
    }

    /// The blocks that see something, in the order of their factors: the point (x, y) from which each has its rays,
    /// cells.
    pub(super) fn seeing<'a>(&'a self, grid: &'a OccupancyGrid) -> impl Iterator<Item = (f64, f64)> + 'a {
        let blocks = self.place.iter().enumerate().filter(|(_, place)| **place > 0);
        blocks.map(|(block, _)| centre(grid, block % self.columns, block / self.columns))
    }

    /// Which of [`Self::seeing`] has its factor at `place`, and for which heading; none where nothing is seen.
    pub(super) fn seeing_at(&self, place: usize) -> Option<(usize, usize)> {
        Some(((place / self.headings).checked_sub(1)?, place % self.headings))
    }

    /// A point of the map frame in the grid's axes, metres from its corner.
    pub(super) fn grid_from_map(&self, p: Point2) -> Point2 {
        self.origin.inverse_transform(p)
    }

    /// Heading of the grid's first axis in the map frame, radians.
    pub(super) fn grid_heading(&self) -> f64 {
        self.origin.heading
    }

    /// Turns vectors (x, y, heading) of the grid's axes into the map's.
    pub(super) fn map_from_grid(&self) -> Matrix3<f64> {
        let (s, c) = self.sin_cos;
        Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
    }
}

/// The middle of a block on the grid, cells.
fn centre(grid: &OccupancyGrid, column: usize, row: usize) -> (f64, f64) {
    let middle = |i: usize, end: usize| ((i * BLOCK + BLOCK / 2) as f64).min(end as f64 - 0.5);
    (middle(column, grid.width()), middle(row, grid.height()))
}

/// Rows of blocks that are one piece of work: few enough to share them evenly, many enough to be worth it.
const BAND: usize = 8;

/// The field of some rows of blocks.
#[derive(Default)]
struct Band {
    /// Place of each block's first factor, if anything is seen.
    place: Vec<Option<usize>>,
    factors: Vec<[f32; 6]>,
}

impl Band {
    fn of(grid: &OccupancyGrid, fan: &Fan<'_>, columns: usize, rows: Range<usize>) -> Self {
        let mut band = Self::default();
        let mut headings = vec![[0.0; 6]; fan.headings()];
        for (row, column) in rows.flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let (x, y) = centre(grid, column, row);
            let is_free = grid.cell(grid.index(x as usize, y as usize)) == Cell::Free;
            let sees = is_free && fan.cast(x, y, &mut headings);
            band.place.push(sees.then_some(band.factors.len()));
            if sees {
                band.factors.extend(headings.iter().map(factorise));
            }
        }
        band
    }
}

#[cfg(test)]
#[path = "information_field_tests.rs"]
mod tests;
