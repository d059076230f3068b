//! Rays around one place: which walls a scan meets there, and what it tells at each heading.

use std::ops::Range;

use crate::evaluation::cpc::wall_normals::WallNormals;
use crate::numerics::sin_cos;
use crate::occupancy::{Hit, RayCaster, StaticMap};
use crate::sensor::LaserModel;

crate::parameters! {
    /// What a range says about the pose.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum MeasurementModel {
        /// Beams that end on walls: position across the wall, and heading.
        #[default]
        Beam,
        /// The paper's text (eqs. 3 and 8): distances to landmark points, here the cells that beams end
        /// on. Tells nothing about the heading by itself.
        Range,
    }
}

/// Rays cast from each block, 5 degrees apart.
pub(super) const FAN: usize = 72;
/// Headings kept for each block, 15 degrees apart; one is enough for a laser that sees all around.
pub(super) const HEADINGS: usize = 24;
/// Least `|n.d|`: beams that graze a wall are not trusted to be arbitrarily informative.
const LEAST_INCIDENCE: f64 = 0.2;

/// `C^T C` as xx, xy, xt, yy, yt, tt, of a measurement row C = dr/d(x, y, heading) or of several.
pub(super) type Information = [f64; 6];

/// The headings that see one ray: runs of neighbours with equal weights.
type SeenBy = Vec<(Range<usize>, f64)>;

/// The rays cast from every block, and which of them each heading sees.
pub(super) struct Fan<'a> {
    caster: RayCaster<'a>,
    normals: WallNormals,
    directions: [(f64, f64); FAN],
    /// The headings that see each ray. Its weight is its share of the field of view times what one scan's beams are
    /// worth.
    seen_by: Vec<SeenBy>,
    headings: usize,
    model: MeasurementModel,
    /// Range of the laser, cells.
    reach: f64,
    resolution: f64,
}

impl<'a> Fan<'a> {
    /// Prepares the rays of `laser` on `map`; `scan` is the information of all beams of one scan, 1/m2.
    pub(super) fn new(map: &'a StaticMap, laser: &LaserModel, model: MeasurementModel, scan: f64) -> Self {
        let grid = &*map.grid;
        let all_around = laser.sees_all_around();
        let fov = laser.fov.min(std::f64::consts::TAU);
        let spacing = std::f64::consts::TAU / FAN as f64;
        // How much of the sector around ray i lies in the field of view around heading h.
        let weight = |h: usize, i: usize| {
            let away = (i + FAN - h * (FAN / HEADINGS)) % FAN;
            let away = away.min(FAN - away) as f64 * spacing;
            let overlap = (0.5 * fov - away + 0.5 * spacing).clamp(0.0, spacing);
            scan * if all_around { spacing } else { overlap } / fov
        };
        let headings = if all_around { 1 } else { HEADINGS };
        let seen_by = (0..FAN).map(|i| seen_by(headings, |h| weight(h, i))).collect();
        Self {
            caster: RayCaster::new(map),
            normals: WallNormals::new(grid),
            directions: std::array::from_fn(|i| {
                let (s, c) = sin_cos(i as f64 * spacing);
                (c, s)
            }),
            seen_by,
            headings,
            model,
            reach: laser.range_max / grid.resolution(),
            resolution: grid.resolution(),
        }
    }

    /// Headings that are told apart.
    pub(super) fn headings(&self) -> usize {
        self.headings
    }

    /// Directions of the rays in the grid's axes.
    pub(super) fn directions(&self) -> &[(f64, f64); FAN] {
        &self.directions
    }

    /// The share of ray `ray` in what a scan tells at heading `heading`, times what all beams of a scan are worth,
    /// 1/m2.
    pub(super) fn weight(&self, heading: usize, ray: usize) -> f64 {
        let seen_by = self.seen_by[ray].iter().find(|(run, _)| run.contains(&heading));
        seen_by.map_or(0.0, |(_, weight)| *weight)
    }

    /// What a scan from the point (x, y), in cells, tells at each heading, into `headings`; whether any ray ends in
    /// range. Every sum is over the rays in their order.
    pub(super) fn cast(&self, x: f64, y: f64, headings: &mut [Information]) -> bool {
        if self.caster.clearance(x as i64, y as i64).is_none_or(|clear| clear > self.reach + 2.0) {
            return false;
        }
        headings.fill([0.0; 6]);
        let rays = self.rays(x, y);
        for (i, ray) in rays.iter().enumerate() {
            let Some(ray) = ray else { continue };
            let [x, y, t] = ray.row;
            let told: Information = [x * x, x * y, x * t, y * y, y * t, t * t];
            for (run, weight) in &self.seen_by[i] {
                let weighted = told.map(|term| weight * term);
                for sum in &mut headings[run.clone()] {
                    sum.iter_mut().zip(weighted).for_each(|(sum, term)| *sum += term);
                }
            }
        }
        rays.iter().any(Option::is_some)
    }

    /// The rays from the point (x, y), in cells, that end in range.
    pub(super) fn rays(&self, x: f64, y: f64) -> [Option<Ray>; FAN] {
        let hits = self.caster.cast((x, y), &self.directions, self.reach);
        std::array::from_fn(|i| hits[i].as_ref().map(|hit| self.ray(hit, self.directions[i])))
    }

    fn ray(&self, hit: &Hit, (dx, dy): (f64, f64)) -> Ray {
        let range = hit.range * self.resolution;
        let row = match self.model {
            MeasurementModel::Range => [-dx, -dy, 0.0],
            MeasurementModel::Beam => {
                // A post is met head-on from every side.
                let (nx, ny) = self.normals.at(hit.cell).unwrap_or((dx, dy));
                let towards = nx * dx + ny * dy;
                let incidence = towards.abs().max(LEAST_INCIDENCE).copysign(towards);
                let across = ny * dx - nx * dy;
                [-nx / incidence, -ny / incidence, -range * across / incidence]
            }
        };
        Ray { range, row }
    }
}

/// A ray that ends on a wall.
pub(super) struct Ray {
    /// Metres.
    pub(super) range: f64,
    /// The measurement row dr/d(x, y, heading) in the grid's axes.
    pub(super) row: [f64; 3],
}

/// The runs of headings whose weight is positive, and it.
fn seen_by(headings: usize, weight: impl Fn(usize) -> f64) -> SeenBy {
    let mut runs = SeenBy::new();
    for h in (0..headings).filter(|h| weight(*h) > 0.0) {
        match runs.last_mut() {
            Some((run, of)) if run.end == h && *of == weight(h) => run.end += 1,
            _ => runs.push((h..h + 1, weight(h))),
        }
    }
    runs
}

/// `L D L^T` of a positive semi-definite matrix. What is left of a diagonal entry below its rounding
/// noise is nothing.
pub(super) fn factorise(&[xx, xy, xt, yy, yt, tt]: &Information) -> [f32; 6] {
    const NOISE: f64 = 1e-9;
    let divide = |a: f64, d: f64| if d > 0.0 { a / d } else { 0.0 };
    let left = |d: f64, of: f64| if d > NOISE * of { d } else { 0.0 };
    let d1 = left(xx, xx + yy);
    let l21 = divide(xy, d1);
    let l31 = divide(xt, d1);
    let d2 = left(yy - l21 * xy, yy);
    let l32 = divide(yt - l21 * xt, d2);
    let d3 = left(tt - l31 * xt - l32 * l32 * d2, tt);
    [d1, l21, l31, d2, l32, d3].map(|v| v as f32)
}
