//! Hand-made tracks, with the arithmetic beside the expected number.

use curionav_planning::geometry::{Pose2, Twist};

use super::*;

/// One row: at x metres, nothing near, moving at 1 m/s.
fn at(tick: u64, x: f64) -> Truth {
    Truth {
        tick,
        time: tick as f64 * 0.5,
        pose: Pose2::new(x, 0.0, 0.0),
        twist: Twist { v: 1.0, omega: 0.0 },
        person_distance: f64::INFINITY,
        seen_person_distance: f64::INFINITY,
        person_clearance: f64::INFINITY,
        wall_clearance: 3.0,
        wall_impact: None,
        touching: Vec::new(),
        overlaps: Vec::new(),
        is_in_group: false,
        held_up: 0.0,
        held_up_near: 0.0,
        time_to_collision: f64::INFINITY,
    }
}

/// Rows of half a second, each changed by `change`, the estimate exact and converged.
fn run(rows: u64, change: impl Fn(u64, &mut Truth)) -> Measures {
    let row = |tick| {
        let mut truth = at(tick, 0.5 * tick as f64);
        change(tick, &mut truth);
        Row { estimate: truth.pose, truth, trace: 0.05 }
    };
    Measures::of(&(0..rows).map(row).collect::<Vec<_>>())
}

fn touch(id: u32) -> Touch {
    Touch { id, robot_speed: 0.25, person_speed: -0.5 }
}

fn traces(traces: &[f64]) -> Measures {
    let row = |(tick, trace): (usize, &f64)| Row {
        truth: at(tick as u64, 0.0),
        estimate: Pose2::default(),
        trace: *trace,
    };
    Measures::of(&traces.iter().enumerate().map(row).collect::<Vec<_>>())
}

fn distances(distances: &[f64]) -> Measures {
    run(distances.len() as u64, |tick, truth| {
        truth.person_distance = distances[tick as usize];
        truth.person_clearance = distances[tick as usize] - 0.55;
    })
}

#[test]
fn length_time_and_speed() {
    // 4 intervals: 0.5 m forth, 0.5 m forth, 1 m back, 0.5 m forth = 2.5 m in 2 s
    let x = [0.0, 0.5, 1.0, 0.0, 0.5];
    let m = run(5, |tick, truth| truth.pose.x = x[tick as usize]);
    assert_eq!((m.length_m, m.time_s, m.vel_mps), (2.5, 2.0, 1.25));
}

#[test]
fn rmse_is_over_position_only() {
    // errors 0, 3, 4 and 5 (3-4-5): sqrt((0 + 9 + 16 + 25) / 4) = sqrt(12.5)
    let row = |(tick, (dx, dy)): (usize, (f64, f64))| Row {
        truth: at(tick as u64, 1.0),
        estimate: Pose2::new(1.0 + dx, dy, 2.0),
        trace: 0.1,
    };
    let errors = [(0.0, 0.0), (3.0, 0.0), (0.0, 4.0), (3.0, 4.0)];
    let rows: Vec<Row> = errors.into_iter().enumerate().map(row).collect();
    assert!((Measures::of(&rows).rmse_m - 12.5_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn convergence_must_last_a_second() {
    // at most 0.1 from 0.5 s on for half a second only, then from 2.0 s on; the run takes 4.0 s
    let m = traces(&[0.5, 0.09, 0.1, 0.2, 0.1, 0.05, 0.05, 0.05, 0.05]);
    assert_eq!((m.tcm, m.nm), (2.0 / 4.0, Some(0)));
    let never = traces(&[0.5, 0.3, 0.2, 0.11]);
    assert_eq!((never.tcm, never.nm), (1.0, None));
    assert_eq!(traces(&[0.05, 0.05, 0.05, 0.05]).tcm, 0.0);
    // half a second at the end is no second
    let on_trial = traces(&[0.5, 0.5, 0.05, 0.05]);
    assert_eq!((on_trial.tcm, on_trial.nm), (1.0, None));
}

#[test]
fn a_loss_of_convergence_counts_again_only_below_four_fifths() {
    // converged at 0 s, certain at 1 s; lost at 1.5 s; 0.09 does not re-arm, 0.07 does; lost again
    let m = traces(&[0.05, 0.05, 0.05, 0.11, 0.09, 0.12, 0.07, 0.11, 0.2]);
    assert_eq!((m.tcm, m.nm), (0.0, Some(2)));
    // crossings before convergence is certain are none
    assert_eq!(traces(&[0.05, 0.2, 0.05, 0.2, 0.05, 0.05, 0.05]).nm, Some(0));
}

#[test]
fn the_error_counts_as_small_once_it_has_been_for_two_seconds() {
    let errors = |errors: &[f64]| {
        let row = |(tick, error): (usize, &f64)| Row {
            truth: at(tick as u64, 4.0),
            estimate: Pose2::new(4.0 + error, 0.0, 1.0),
            trace: 0.05,
        };
        Measures::of(&errors.iter().enumerate().map(row).collect::<Vec<_>>()).tce_s
    };
    // below 0.3 m from 0.5 s on for one second only, and from 2.5 s on for two
    assert_eq!(errors(&[0.5, 0.2, 0.2, 0.2, 0.4, 0.29, 0.0, 0.0, 0.0, 0.0]), Some(2.5));
    assert_eq!(errors(&[0.5, 0.2, 0.2, 0.2, 0.4, 0.29, 0.0, 0.0, 0.0]), None);
    assert_eq!(errors(&[0.1; 5]), Some(0.0));
}

#[test]
fn td_and_md_count_only_people_in_view_beside_the_count_of_all() {
    // Rows 2, 3 and 5 are near a person, and only row 5 is near one in view.
    let all = [3.0, 1.5, 1.4, 0.9, 1.6, 1.2, 2.0];
    let seen = [f64::INFINITY, 1.5, 2.0, f64::INFINITY, 1.6, 1.2, 2.0];
    let m = run(7, |tick, truth| {
        truth.person_distance = all[tick as usize];
        truth.seen_person_distance = seen[tick as usize];
    });
    assert_eq!((m.td, m.md_m), (1.5 / 3.0, Some(0.9)));
    assert_eq!((m.td_in_view, m.md_in_view_m), (0.5 / 3.0, Some(1.2)));
    let hidden = distances(&[1.0, 1.0]);
    assert_eq!((hidden.td, hidden.td_in_view, hidden.md_in_view_m), (1.0, 0.0, None));
}

#[test]
fn time_near_people_and_intrusions() {
    // below 1.5 m in rows 2, 3 and 5 of 7: 3 * 0.5 s of 3 s; entered twice; least 0.9
    let m = distances(&[3.0, 1.5, 1.4, 0.9, 1.6, 1.2, 2.0]);
    assert_eq!((m.td, m.nt, m.md_m), (1.5 / 3.0, 2, Some(0.9)));
    // near from the start: the first row has no duration and no person came near
    let m = distances(&[1.0, 1.0, 2.0]);
    assert_eq!((m.td, m.nt, m.md_m), (0.5 / 1.0, 0, Some(1.0)));
    let m = run(3, |_, _| {});
    assert_eq!((m.td, m.nt, m.md_m), (0.0, 0, None));
}

#[test]
fn the_least_gap_is_to_a_person_or_to_a_wall() {
    let m = distances(&[3.0, 1.55, 2.0]); // 1.55 - 0.55 = 1.0, the wall is 3 m away
    assert!((m.clearance_min_m - 1.0).abs() < 1e-12);
    let m = run(3, |tick, truth| truth.wall_clearance = 0.5 + tick as f64);
    assert_eq!(m.clearance_min_m, 0.5);
}

#[test]
fn each_contact_of_a_moving_robot_is_one_collision() {
    // person 4 in rows 1 to 3, person 5 in rows 2 and 5: three episodes
    let touching: [&[u32]; 7] = [&[], &[4], &[4, 5], &[4], &[], &[5], &[]];
    let m =
        run(7, |tick, truth| truth.touching = touching[tick as usize].iter().map(|id| touch(*id)).collect());
    // rows are half a second apart
    let found: Vec<_> =
        m.collisions.iter().map(|c| (c.time, c.person, c.robot_speed, c.person_speed)).collect();
    let of = |time, id| (time, Some(id), 0.25, -0.5);
    assert_eq!(found, [of(0.5, 4), of(1.0, 5), of(2.5, 5)]);
}

#[test]
fn a_standing_robot_does_not_collide() {
    // touched while standing: no collision; when it drives off at 0.06 m/s inside the same contact, a collision
    let speeds = [0.0, 0.04, 0.05, 0.05];
    let standing = |tick: u64, truth: &mut Truth| {
        truth.twist.v = speeds[tick as usize];
        truth.touching = vec![touch(4)];
    };
    let m = run(4, standing);
    assert_eq!(m.collisions, []);
    let m = run(4, |tick, truth| {
        standing(tick, truth);
        truth.twist.v += 0.01;
    });
    assert_eq!(m.collisions.len(), 1);
}

#[test]
fn pressing_on_against_a_wall_is_one_collision() {
    // hit at 0.8 m/s, pushed at 0.05 m/s, away by 1 cm (still the same contact), pushed, away, hit again
    let impact = [None, Some(0.8), Some(0.05), None, Some(0.05), None, Some(0.3)];
    let gap = [1.0, 0.0, 0.0, 0.01, 0.0, 0.5, 0.0];
    let m = run(7, |tick, truth| {
        truth.wall_impact = impact[tick as usize];
        truth.wall_clearance = gap[tick as usize];
    });
    let found: Vec<_> =
        m.collisions.iter().map(|c| (c.time, c.person, c.robot_speed, c.person_speed)).collect();
    assert_eq!(found, [(0.5, None, 0.8, 0.0), (3.0, None, 0.3, 0.0)]);
}
