use super::*;
use crate::occupancy::OccupancyGrid;

/// 20 m x 20 m at 0.1 m; occupied where `solid` says so of a cell's centre.
fn map(origin: Pose2, solid: impl Fn(f64, f64) -> bool) -> StaticMap {
    let cells = (0..200 * 200)
        .map(|i| {
            let x = 0.1 * f64::from(i % 200) + 0.05;
            let y = 0.1 * f64::from(i / 200) + 0.05;
            if solid(x, y) { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(200, 200, 0.1, origin, cells).unwrap())
}

fn wall_in_the_east(x: f64, _y: f64) -> bool {
    x > 15.0
}

fn field(map: &StaticMap, laser: LaserModel) -> InformationField {
    InformationField::new(map, &laser, &InformationParams::default())
}

#[test]
fn open_space_tells_nothing() {
    let field = field(&map(Pose2::default(), wall_in_the_east), LaserModel::default());
    assert_eq!(field.at(Pose2::new(9.7, 10.0, 0.0)), Matrix3::zeros());
    assert_ne!(field.at(Pose2::new(10.5, 10.0, 0.0)), Matrix3::zeros());
    // nor does the outside of the map, or the inside of a wall
    assert_eq!(field.at(Pose2::new(-3.0, 10.0, 0.0)), Matrix3::zeros());
    assert_eq!(field.at(Pose2::new(14.0, 20.3, 0.0)), Matrix3::zeros());
    assert_eq!(field.at(Pose2::new(17.0, 10.0, 0.0)), Matrix3::zeros());
}

#[test]
fn heading_matters_with_half_a_view_and_not_with_a_full_one() {
    use std::f64::consts::{PI, TAU};
    let map = map(Pose2::default(), wall_in_the_east);
    let half = field(&map, LaserModel::default());
    let towards = half.at(Pose2::new(13.0, 10.0, 0.0));
    assert!(towards[(0, 0)] > 100.0, "{towards}");
    // A wall behind the laser is not seen; one at its side is half seen.
    assert!(half.at(Pose2::new(13.0, 10.0, PI)).norm() < 1e-9);
    let beside = half.at(Pose2::new(13.0, 10.0, 0.5 * PI));
    assert!((beside[(0, 0)] / towards[(0, 0)] - 0.5).abs() < 0.1, "{beside} {towards}");

    let full = field(&map, LaserModel { fov: TAU, ..LaserModel::default() });
    let reference = full.at(Pose2::new(13.0, 10.0, 0.0));
    // the same beams spread over twice the angle
    assert!((2.0 * reference - towards).norm() < 0.01 * towards.norm());
    for k in 0..24 {
        assert_eq!(full.at(Pose2::new(13.0, 10.0, 0.3 * f64::from(k))), reference);
    }
}

#[test]
fn a_straight_wall_tells_nothing_along_itself() {
    for (turn, solid) in
        [(0.0, (|x, _| x > 15.0) as fn(f64, f64) -> bool), (0.25 * std::f64::consts::PI, |x, y| x + y > 25.0)]
    {
        let field = field(&map(Pose2::default(), solid), LaserModel::default());
        let j = field.at(Pose2::new(11.5, 11.0, turn));
        let (s, c) = sin_cos(turn);
        let across = nalgebra::vector![c, s, 0.0];
        let along = nalgebra::vector![-s, c, 0.0];
        let ratio = along.dot(&(j * along)) / across.dot(&(j * across));
        assert!(ratio < 0.01, "normal at {turn} rad: {ratio} of the information is along the wall");
    }
}

#[test]
fn agrees_with_the_geometry_of_a_wall() {
    let field = field(&map(Pose2::default(), wall_in_the_east), LaserModel::default());
    // Block centres, 0.4 m apart; the last ray within range stands for 5 degrees, and tells most about
    // the heading.
    for distance in [1.6, 2.0, 2.8] {
        // The wall's face is at x = 15; beam b at bearing b ends at distance / cos b, if within 5 m.
        let mut xx = 0.0;
        let mut tt = 0.0;
        let fine = 100_000;
        for i in 0..fine {
            let bearing = std::f64::consts::PI * ((f64::from(i) + 0.5) / f64::from(fine) - 0.5);
            let (s, c) = sin_cos(bearing);
            if distance / c <= 5.0 {
                // n = (1, 0), d = (c, s), d_perp = (-s, c); 20 beams of 0.2 m, divided by 1.1
                let weight = 20.0 / (0.04 * 1.1) / f64::from(fine);
                let incidence = c.max(0.2);
                xx += weight / (incidence * incidence);
                tt += weight * (distance / c * s / incidence).powi(2);
            }
        }
        let j = field.at(Pose2::new(15.0 - distance, 10.2, 0.0));
        assert!((j[(0, 0)] / xx - 1.0).abs() < 0.15, "{distance} m: {} vs {xx}", j[(0, 0)]);
        assert!((j[(2, 2)] / tt - 1.0).abs() < 0.25, "{distance} m: {} vs {tt}", j[(2, 2)]);
    }
}

#[test]
fn ranges_to_points_tell_nothing_about_the_heading() {
    let params = InformationParams { model: MeasurementModel::Range, ..InformationParams::default() };
    let map = map(Pose2::default(), wall_in_the_east);
    let field = InformationField::new(&map, &LaserModel::default(), &params);
    let j = field.at(Pose2::new(13.0, 10.0, 0.0));
    assert_eq!(j[(2, 2)], 0.0);
    assert!(j[(0, 0)] > 0.0 && j[(1, 1)] > 0.0);
    // a sum of 20 unit vectors' squares at most: 20 / (0.04 * 1.1)
    assert!(j.trace() <= 454.6);
}

#[test]
fn a_laser_off_the_centre_moves_with_the_heading() {
    let solid = |x: f64, y: f64| x > 15.0 || (y > 12.0 && (x * 1.3).sin() > 0.8);
    let map = map(Pose2::new(0.4, -0.2, 0.6), solid);
    let lever = Pose2::new(0.3, 0.1, -0.2);
    let offset = field(&map, LaserModel { robot_from_laser: lever, ..LaserModel::default() });
    let centred = field(&map, LaserModel::default());
    for heading in [0.0, 0.8, 2.0, -1.9] {
        let robot = map.grid.origin().compose(Pose2::new(13.03, 10.07, heading));
        let laser = robot.compose(lever);
        // d laser / d robot: the heading carries the laser by (-dy, dx).
        let dx = laser.x - robot.x;
        let dy = laser.y - robot.y;
        let t = Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0);
        let expected = t.transpose() * centred.at(laser) * t;
        assert!((offset.at(robot) - expected).norm() <= 1e-9 * expected.norm().max(1.0));
    }
}

#[test]
fn factors_are_positive_semi_definite_and_close_to_the_sum() {
    let mut r = crate::random::rng(5, 0);
    for trial in 0..500 {
        let mut j = [0.0; 6];
        for _ in 0..trial % 4 {
            let [x, y, t]: [f64; 3] =
                std::array::from_fn(|_| (10.0 * crate::random::uniform(&mut r)).powi(2) - 30.0);
            for (sum, term) in j.iter_mut().zip([x * x, x * y, x * t, y * y, y * t, t * t]) {
                *sum += term;
            }
        }
        let [d1, l21, l31, d2, l32, d3] = factorise(&j).map(f64::from);
        assert!(d1 >= 0.0 && d2 >= 0.0 && d3 >= 0.0);
        let back = [
            d1,
            d1 * l21,
            d1 * l31,
            d1 * l21 * l21 + d2,
            d1 * l21 * l31 + d2 * l32,
            d1 * l31 * l31 + d2 * l32 * l32 + d3,
        ];
        let scale = j[0] + j[3] + j[5];
        for (a, b) in j.iter().zip(back) {
            assert!((a - b).abs() <= 1e-5 * scale, "{j:?} vs {back:?}");
        }
    }
}

#[test]
fn memory_is_below_forty_bytes_a_cell() {
    let pillars = |x: f64, y: f64| x % 2.0 < 0.2 && y % 2.0 < 0.2;
    let field = field(&map(Pose2::default(), pillars), LaserModel::default());
    // 24 headings x 6 numbers x 4 bytes on every 16 cells: 36 bytes
    let bytes = size_of_val(&field.place[..]) + size_of_val(&field.factors[..]);
    assert!(bytes <= 37 * 40_000, "{bytes}");
    assert_ne!(field.at(Pose2::new(5.3, 5.3, 0.0)), Matrix3::zeros());
}
