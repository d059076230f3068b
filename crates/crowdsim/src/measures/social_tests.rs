//! Hand-made tracks, with the arithmetic beside the expected number.

use curionav_planning::geometry::{Pose2, Twist};

use super::*;

/// Half a second a row along the x axis, 1 m/s, alone, walls 2 m away; each row changed by `change`.
fn rows(count: usize, change: impl Fn(usize, &mut Truth)) -> Vec<Truth> {
    (0..count)
        .map(|i| {
            let mut row = Truth {
                tick: i as u64,
                time: 0.5 * i as f64,
                pose: Pose2::new(0.5 * i as f64, 0.0, 0.0),
                twist: Twist { v: 1.0, omega: 0.0 },
                person_distance: f64::INFINITY,
                seen_person_distance: f64::INFINITY,
                person_clearance: f64::INFINITY,
                wall_clearance: 2.0,
                wall_impact: None,
                touching: Vec::new(),
                overlaps: Vec::new(),
                is_in_group: false,
                held_up: 0.0,
                held_up_near: 0.0,
                time_to_collision: f64::INFINITY,
            };
            change(i, &mut row);
            row
        })
        .collect()
}

/// The measures of a run to (10, 0) with this outcome.
fn judged(outcome: Outcome, rows: Vec<Truth>) -> BTreeMap<&'static str, f64> {
    let to_go = |p: Point2| p.distance(Point2::new(10.0, 0.0));
    let task = Task { outcome, shortest_m: 10.0, to_go: &to_go, robot_radius: 0.3 };
    social_measures(&rows.iter().collect::<Vec<_>>(), &task)
}

fn measured(count: usize, change: impl Fn(usize, &mut Truth)) -> BTreeMap<&'static str, f64> {
    judged(Outcome::Reached, rows(count, change))
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-12
}

#[test]
fn success_is_arrival_in_time_without_touching_anything() {
    assert!(measured(21, |_, _| {})["success"] == 1.0);
    assert_eq!(judged(Outcome::Lost, rows(21, |_, _| {}))["success"], 0.0);
    let late = judged(Outcome::Timeout, rows(21, |_, _| {}));
    assert_eq!((late["success"], late["timeout"], late["spl"]), (0.0, 1.0, 0.0));
    let touched = measured(21, |i, row| row.person_clearance = if i == 4 { -0.01 } else { 1.0 });
    assert_eq!((touched["success"], touched["timeout"], touched["spl"]), (0.0, 0.0, 0.0));
}

#[test]
fn collisions_are_counted_in_steps() {
    // person overlapped in rows 3 to 5; wall hit in rows 7 and 8, overlapped in row 9
    let m = measured(12, |i, row| {
        row.person_clearance = if (3..=5).contains(&i) { -0.1 } else { 0.0 };
        row.wall_impact = (i == 7 || i == 8).then_some(0.1);
        row.wall_clearance = if i == 9 { -0.01 } else { 0.0 };
    });
    assert_eq!(
        (m["human_collision_steps"], m["wall_collision_steps"], m["agent_collision_steps"]),
        (3.0, 3.0, 0.0)
    );
}

#[test]
fn a_window_without_progress_is_a_failure() {
    // Rows 0, 10, 20, 30 are 5 s apart. x there: 0, 5, 5.05, 4 of 10: progress 5, 0.05, -1.05; the fourth
    // window is cut off
    let x = |i: usize| match i {
        0..=9 => 0.0,
        10..=19 => 5.0,
        20..=29 => 5.05,
        _ => 4.0,
    };
    assert_eq!(measured(35, |i, row| row.pose.x = x(i))["failures_to_progress"], 2.0);
    assert_eq!(measured(21, |_, _| {})["failures_to_progress"], 0.0);
    // 0.11 m in 5 s is progress enough
    assert_eq!(measured(11, |i, row| row.pose.x = 0.011 * i as f64)["failures_to_progress"], 0.0);
}

#[test]
fn stalled_and_stopped_time() {
    // rows 2 to 5 at 0.04 m/s: 4 * 0.5 s; of these 4 and 5 at 0.0005 m/s; of these row 5 turns
    let m = measured(9, |i, row| {
        row.twist.v = [1.0, 1.0, 0.04, -0.04, 0.0005, 0.0, 0.05, 1.0, 1.0][i];
        row.twist.omega = if i == 5 { -0.02 } else { 0.0 };
    });
    assert_eq!((m["stalled_s"], m["stopped_s"], m["time_s"]), (2.0, 0.5, 4.0));
}

#[test]
fn length_and_its_ratio_to_the_shortest_way() {
    // 20 steps of 0.5 m, but to (5, 1.2) and back: 18 * 0.5 + 2 * sqrt(0.25 + 1.44) = 9 + 2 * 1.3 = 11.6
    let detour = measured(21, |i, row| row.pose.y = if i == 10 { 1.2 } else { 0.0 });
    assert!(near(detour["length_m"], 11.6) && near(detour["spl"], 10.0 / 11.6));
    // shorter than the shortest way, by the tolerance of the goal: 1
    let short = measured(20, |_, _| {});
    assert_eq!((short["length_m"], short["spl"]), (9.5, 1.0));
}

#[test]
fn speed_acceleration_and_jerk() {
    // v 0, 0.5, 1, 1, 0.5 each 0.5 s: a 1, 1, 0, -1: j 0, -2, -2
    let m = measured(5, |i, row| row.twist.v = [0.0, 0.5, 1.0, 1.0, 0.5][i]);
    assert_eq!((m["speed_min_mps"], m["speed_avg_mps"], m["speed_max_mps"]), (0.0, 0.6, 1.0));
    assert_eq!((m["accel_min_mps2"], m["accel_avg_mps2"], m["accel_max_mps2"]), (-1.0, 0.75, 1.0));
    assert!(near(m["jerk_avg_mps3"], 4.0 / 3.0));
    assert_eq!((m["jerk_min_mps3"], m["jerk_max_mps3"]), (-2.0, 0.0));
}

#[test]
fn clearing_distance_is_the_gap_to_walls() {
    // (0.4 + 1.0 + 1.6) / 3
    let m = measured(3, |i, row| row.wall_clearance = [0.4, 1.0, 1.6][i]);
    assert!(near(m["clearing_distance_min_m"], 0.4) && near(m["clearing_distance_avg_m"], 1.0));
}

#[test]
fn zones_are_of_the_closest_person() {
    // intimate 0.44 and -0.1, personal 0.45, 0.5 and 1.19, social 1.2 and 3.59, beyond 3.6, 8 and no person
    let gaps = [0.44, -0.1, 0.45, 0.5, 1.19, 1.2, 3.59, 3.6, 8.0, f64::INFINITY];
    let m = measured(10, |i, row| {
        row.person_clearance = gaps[i];
        row.person_distance = gaps[i] + 0.55;
    });
    assert_eq!((m["intimate_share"], m["personal_share"], m["social_share"]), (0.2, 0.3, 0.2));
    // under 0.5: 0.44, -0.1, 0.45
    assert_eq!(m["space_compliance"], 0.3);
    // overlap as 0: (0.44 + 0 + 0.45 + 0.5 + 1.19 + 1.2 + 3.59 + 3.6 + 8) / 9 = 18.97 / 9
    assert!(near(m["closest_person_avg_m"], 18.97 / 9.0));
    // -0.1 + 0.55 between centres, less the robot's 0.3
    assert!(near(m["human_distance_min_m"], 0.45));
    assert!(near(m["people_distance_min_m"], 0.15));
}

#[test]
fn without_people_distances_are_none() {
    let m = measured(5, |_, _| {});
    assert_eq!(
        (
            m.get("human_distance_min_m").copied(),
            m.get("people_distance_min_m").copied(),
            m.get("closest_person_avg_m").copied()
        ),
        (None, None, None)
    );
    assert_eq!(
        (m.get("time_to_collision_min_s").copied(), m["social_share"], m["space_compliance"]),
        (None, 0.0, 0.0)
    );
}

#[test]
fn the_least_time_to_collision_counts() {
    let m = measured(4, |i, row| row.time_to_collision = [f64::INFINITY, 2.5, 1.5, 4.0][i]);
    assert_eq!(m.get("time_to_collision_min_s").copied(), Some(1.5));
}

#[test]
fn heading_changes_add_up_across_the_half_turn() {
    // 3.0 -> -3.0 is 2 pi - 6 = 0.283; back to 3.0 the same; to 2.5: 0.5
    let m = measured(4, |i, row| row.pose.heading = [3.0, -3.0, 3.0, 2.5][i]);
    assert!(near(m["heading_change_rad"], 2.0 * (std::f64::consts::TAU - 6.0) + 0.5));
}

#[test]
fn standing_for_three_seconds_is_a_freeze() {
    // stalled in rows 2 to 8 (3.0 s), 11 to 16 (2.5 s: none) and 20 to 29, the end (4.5 s)
    let stalled = |i: usize| (2..=8).contains(&i) || (11..=16).contains(&i) || i >= 20;
    let m = measured(30, |i, row| row.twist.v = if stalled(i) { 0.0 } else { 0.5 });
    assert_eq!((m["freezes"], m["frozen_s"]), (2.0, 7.5));
    let m = measured(30, |_, _| {});
    assert_eq!((m["freezes"], m["frozen_s"]), (0.0, 0.0));
    // nothing is 0, as people write it
    assert_eq!(format!("{} {}", m["stalled_s"], m["stopped_s"]), "0 0");
}

#[test]
fn an_empty_track_has_measures() {
    let m = judged(Outcome::Timeout, Vec::new());
    assert_eq!((m["time_s"], m["length_m"], m["speed_max_mps"], m["freezes"]), (0.0, 0.0, 0.0, 0.0));
}

#[test]
fn overlaps_are_told_by_who_moved_and_where_the_person_was() {
    use crate::world::Overlap;
    let at = |id: u32, degrees: f64| Overlap { id, bearing: degrees.to_radians() };
    // Person 1 ahead in rows 2 to 4 of a robot that moves: one episode. Row 5 to 6: the robot stands, person 2 comes
    // from behind and 3 to its side; row 8: person 1 again, at the left rear of the robot that moves.
    let m = measured(10, |i, row| match i {
        2..=4 => row.overlaps = vec![at(1, 44.0)],
        5 | 6 => {
            row.twist.v = 0.09;
            row.overlaps = vec![at(2, 180.0), at(3, -46.0)];
        }
        8 => row.overlaps = vec![at(1, 134.0)],
        _ => {}
    });
    let counts = [
        "standing_ahead",
        "standing_beside",
        "standing_behind",
        "moving_ahead",
        "moving_beside",
        "moving_behind",
    ]
    .map(|name| m[format!("overlaps_{name}").as_str()]);
    assert_eq!(counts, [0.0, 1.0, 1.0, 1.0, 1.0, 0.0]);
}

#[test]
fn coming_between_people_counts_once_each_time() {
    // In the group in rows 0 to 1 and 4 to 6 of 10: twice, half of the rows.
    let m = measured(10, |i, row| row.is_in_group = i < 2 || (4..7).contains(&i));
    assert_eq!((m["group_intrusions"], m["group_intrusion_share"]), (2.0, 0.5));
}

#[test]
fn what_people_lose_adds_up() {
    // 4 steps of 0.5 s: one person stands still, another walks at half of its speed for two of the steps, far away.
    let m = measured(5, |i, row| {
        row.held_up_near = 1.0;
        row.held_up = if i > 2 { 1.5 } else { 1.0 };
    });
    // near 4 * 0.5 * 1; all 2 * 0.5 * 1 + 2 * 0.5 * 1.5
    assert_eq!((m["people_delay_near_s"], m["people_delay_s"]), (2.0, 2.5));
}

#[test]
fn turning_to_and_fro_is_irregular_and_one_turn_is_not() {
    // Headings 0, 0.5, 0, 0.5, 0.5: turned 1.5 rad of which 0.5 was needed, on 4 * 0.5 m.
    let heading = [0.0, 0.5, 0.0, 0.5, 0.5];
    let m = measured(5, |i, row| row.pose.heading = heading[i]);
    assert!(near(m["path_irregularity_radpm"], 1.0 / 2.0), "{m:?}");
    let m = measured(5, |i, row| row.pose.heading = 0.1 * i as f64);
    assert!(near(m["path_irregularity_radpm"], 0.0), "{m:?}");
}
