//! Looking the information up for eight poses at a time.

use super::{Factor, HEADINGS, InformationField};
use crate::geometry::Pose2;
use crate::lanes::{
    LANES, Level, Select, Simd, SimdBase, dispatch, f64x8, floor, greater, indices, lesser, sin_cos,
};

/// An index that no map has.
const NOWHERE: f64 = u32::MAX as f64;

impl InformationField {
    /// Information about the robot's pose in the grid's axes, for a robot at `pose` in the map.
    pub(super) fn factor(&self, pose: Pose2) -> Factor {
        dispatch!(Level::baseline(), simd => {
            let [x, y, heading] = [pose.x, pose.y, pose.heading].map(|n| f64x8::splat(simd, n));
            self.factors_at(x, y, heading).map(|lanes| lanes[0])
        })
    }

    /// [`Self::factor`] of eight poses.
    #[inline(always)]
    pub(in crate::evaluation::cpc) fn factors_at<S: Simd>(
        &self,
        x: f64x8<S>,
        y: f64x8<S>,
        heading: f64x8<S>,
    ) -> [f64x8<S>; 6] {
        let laser = self.laser_at(x, y, heading);
        self.of_robot(&laser, self.stored(x.simd, &self.places(&laser)))
    }

    /// Where the lasers of eight robots are.
    #[inline(always)]
    pub(in crate::evaluation::cpc) fn laser_at<S: Simd>(
        &self,
        x: f64x8<S>,
        y: f64x8<S>,
        heading: f64x8<S>,
    ) -> LaserAt<S> {
        let dx = x - self.origin.x;
        let dy = y - self.origin.y;
        let (s, c) = self.sin_cos;
        let x = c * dx + s * dy;
        let y = c * dy - s * dx;
        let heading = heading - self.origin.heading;
        let lever = self.robot_from_laser;
        if lever.x == 0.0 && lever.y == 0.0 {
            return LaserAt { x, y, heading: heading + lever.heading, arm: None };
        }
        let (s, c) = sin_cos(heading);
        let ax = c * lever.x - s * lever.y;
        let ay = s * lever.x + c * lever.y;
        LaserAt { x: x + ax, y: y + ay, heading: heading + lever.heading, arm: Some((ax, ay)) }
    }

    /// What is told of the lasers, as what is told of the robots that carry them.
    #[inline(always)]
    pub(in crate::evaluation::cpc) fn of_robot<S: Simd>(
        &self,
        laser: &LaserAt<S>,
        [d1, l21, l31, d2, l32, d3]: [f64x8<S>; 6],
    ) -> [f64x8<S>; 6] {
        // Turning the robot also carries the laser along by (-ay, ax) per radian; each direction h of
        // the factor becomes (h1, h2, h3 - ay h1 + ax h2).
        match laser.arm {
            None => [d1, l21, l31, d2, l32, d3],
            Some((ax, ay)) => [d1, l21, l31 - ay + ax * l21, d2, l32 + ax, d3],
        }
    }

    /// Places of the factors for eight lasers; below `headings` where nothing is seen.
    #[inline(always)]
    pub(in crate::evaluation::cpc) fn places<S: Simd>(&self, laser: &LaserAt<S>) -> [usize; LANES] {
        let column = laser.x * self.blocks_per_metre;
        let row = laser.y * self.blocks_per_metre;
        let inside = column.simd_ge(0.0)
            & row.simd_ge(0.0)
            & column.simd_lt(self.columns as f64)
            & row.simd_lt(self.rows as f64);
        let block = floor(row) * self.columns as f64 + floor(column);
        let block = indices(inside.select(block, f64x8::splat(laser.x.simd, NOWHERE)));
        let bin = if self.headings == 1 { [0; LANES] } else { indices(bin(laser.heading)) };
        // Nothing is seen outside; the factors at 0 are of no information.
        std::array::from_fn(|lane| self.place.get(block[lane]).map_or(0, |&p| p as usize) + bin[lane])
    }

    /// Stored information about the lasers' own poses, all in the grid's axes, metres.
    #[inline(always)]
    pub(in crate::evaluation::cpc) fn stored<S: Simd>(
        &self,
        simd: S,
        places: &[usize; LANES],
    ) -> [f64x8<S>; 6] {
        let rows: [&[f32; 6]; LANES] = std::array::from_fn(|lane| &self.factors[places[lane]]);
        let [a, b, c] = [column_of(simd, rows, 0), column_of(simd, rows, 1), column_of(simd, rows, 2)];
        let [d, e, f] = [column_of(simd, rows, 3), column_of(simd, rows, 4), column_of(simd, rows, 5)];
        [a, b, c, d, e, f]
    }
}

/// Where eight lasers are in the grid's axes, metres and radians.
pub(in crate::evaluation::cpc) struct LaserAt<S: Simd> {
    pub(in crate::evaluation::cpc) x: f64x8<S>,
    pub(in crate::evaluation::cpc) y: f64x8<S>,
    heading: f64x8<S>,
    /// Where each is from the middle of its robot, unless it sits there.
    arm: Option<(f64x8<S>, f64x8<S>)>,
}

/// The same number of each row.
#[inline(always)]
fn column_of<S: Simd>(simd: S, rows: [&[f32; 6]; LANES], i: usize) -> f64x8<S> {
    f64x8::from_fn(simd, |lane| f64::from(rows[lane][i]))
}

/// Which of the headings of a block is nearest.
#[inline(always)]
fn bin<S: Simd>(heading: f64x8<S>) -> f64x8<S> {
    // A whole number of turns is added first, for the bins to be positive.
    const TURNS: f64 = (HEADINGS * 1_000_000) as f64;
    const COUNT: f64 = HEADINGS as f64;
    let zero = f64x8::splat(heading.simd, 0.0);
    let most = f64x8::splat(heading.simd, NOWHERE);
    let bins = heading * (COUNT / std::f64::consts::TAU) + (TURNS + 0.5);
    let bins = floor(lesser(greater(bins, zero), most));
    // Half a bin more keeps the quotient away from whole numbers, where its rounding would matter.
    bins - floor((bins + 0.5) * (1.0 / COUNT)) * COUNT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::cpc::InformationParams;
    use crate::evaluation::cpc::tests::{corridor, map};
    use crate::random::{rng, uniform};
    use crate::sensor::LaserModel;

    /// One pose at a time and branch by branch.
    fn plain(field: &InformationField, x: f64, y: f64, heading: f64) -> Factor {
        let p = field.origin.inverse_transform(crate::geometry::Point2::new(x, y));
        let column = p.x * field.blocks_per_metre;
        let row = p.y * field.blocks_per_metre;
        if column < 0.0 || row < 0.0 || column >= field.columns as f64 || row >= field.rows as f64 {
            return [0.0; 6];
        }
        let place = field.place[row as usize * field.columns + column as usize] as usize;
        let turns = (heading - field.origin.heading) / std::f64::consts::TAU;
        let bin = (turns * HEADINGS as f64).round().rem_euclid(HEADINGS as f64) as usize;
        field.factors[place + if field.headings == 1 { 0 } else { bin }].map(f64::from)
    }

    #[test]
    fn eight_poses_at_a_time_are_looked_up_as_one_by_one() {
        let seed = 3;
        let mut seen = 0;
        let mut r = rng(seed, 0);
        for (fov, origin) in [(std::f64::consts::PI, Pose2::default()), (7.0, Pose2::new(-3.0, 1.0, 0.4))] {
            let laser = LaserModel { fov, ..LaserModel::default() };
            let field = InformationField::new(&map(origin, corridor), &laser, &InformationParams::default());
            for _ in 0..20_000 {
                let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut r);
                let pose = Pose2::new(between(-5.0, 35.0), between(-5.0, 25.0), between(-9.0, 9.0));
                let found = field.factor(pose);
                assert_eq!(found, plain(&field, pose.x, pose.y, pose.heading), "seed {seed}, {pose:?}");
                seen += usize::from(found != [0.0; 6]);
            }
        }
        assert!(seen > 3000, "poses that see something: {seen}");
    }

    #[test]
    fn a_heading_of_any_size_has_a_bin() {
        for heading in [0.0, -0.0, 6e5, -6e5, 7e6, -7e6, 1e300, -1e300, f64::MAX] {
            let found = dispatch!(Level::baseline(), simd => bin(f64x8::splat(simd, heading))[0]);
            assert!((0.0..24.0).contains(&found) && found.fract() == 0.0, "{found} for {heading}");
        }
    }
}
