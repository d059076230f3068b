//! What has no schema of its own, as shapes: people, candidates by cost, the goal, and how sure the robot is of where
//! it is.

use curionav_planning::numerics::{atan2, eigenvalues};
use curionav_schemas as wire;
use foxglove::messages::{
    ArrowPrimitive, Color, CylinderPrimitive, LinePrimitive, Point3, SceneEntity, SceneUpdate, Vector3,
    line_primitive,
};

use super::foxglove_messages::{MAP_FRAME, pose, timestamp};

/// Metres.
const PERSON_HEIGHT: f64 = 1.7;
/// Heights above the ground at which flat things are drawn, metres, so that none hides another.
const CANDIDATES_AT: f64 = 0.02;
const CHOSEN_AT: f64 = 0.06;
/// Widths of lines, metres.
const CANDIDATE_WIDTH: f64 = 0.02;
const CHOSEN_WIDTH: f64 = 0.08;
/// An ellipse of this many standard deviations holds 95 % of a normal distribution in the plane.
const SIGMAS: f64 = 2.448;
/// Below this speed a person has no arrow, m/s.
const STANDING: f64 = 0.05;

const fn color(r: f64, g: f64, b: f64, a: f64) -> Color {
    Color { r, g, b, a }
}

/// One entity, which replaces that of the same name on its topic.
fn update(name: &str, time: u64, shapes: SceneEntity) -> SceneUpdate {
    let timestamp = timestamp(time);
    let frame_id = MAP_FRAME.into();
    let id = name.into();
    let entity = SceneEntity { timestamp, frame_id, id, ..shapes };
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}

fn flat(name: &str, time: u64, x: f64, y: f64, heading: f64, axes: [f64; 2], color: Color) -> SceneUpdate {
    let cylinders = vec![cylinder(x, y, heading, [axes[0], axes[1], 0.01], color)];
    update(name, time, SceneEntity { cylinders, ..SceneEntity::default() })
}

fn cylinder(x: f64, y: f64, heading: f64, size: [f64; 3], color: Color) -> CylinderPrimitive {
    CylinderPrimitive {
        pose: pose(x, y, size[2] / 2.0, heading),
        size: Some(Vector3 { x: size[0], y: size[1], z: size[2] }),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(color),
    }
}

/// People of a scene and where they go: an arrow is as long as one second's way.
pub(super) fn people(people: &wire::People, time: u64) -> SceneUpdate {
    let mut shapes = SceneEntity::default();
    let width = 2.0 * people.radius;
    for i in 0..people.id.len() {
        let x = people.x[i];
        let y = people.y[i];
        let vx = people.vx[i];
        let vy = people.vy[i];
        shapes.cylinders.push(cylinder(x, y, 0.0, [width, width, PERSON_HEIGHT], color(0.9, 0.5, 0.1, 0.8)));
        let speed = (vx * vx + vy * vy).sqrt();
        if speed > STANDING {
            shapes.arrows.push(ArrowPrimitive {
                pose: pose(x, y, CHOSEN_AT, atan2(vy, vx)),
                shaft_length: speed,
                shaft_diameter: 0.05,
                head_length: 0.15,
                head_diameter: 0.15,
                color: Some(color(0.9, 0.5, 0.1, 1.0)),
            });
        }
    }
    update("people", time, shapes)
}

/// Where the robot is with 95 % probability, if its belief is right.
pub(super) fn ellipse(belief: &wire::Belief, time: u64) -> SceneUpdate {
    let xx = belief.covariance[0];
    let xy = belief.covariance[1];
    let yy = belief.covariance[4];
    // The direction of the greater one.
    let heading = 0.5 * atan2(2.0 * xy, xx - yy);
    let (greater, less) = eigenvalues(xx, xy, yy);
    let axes = [greater, less].map(|variance| 2.0 * SIGMAS * variance.max(0.0).sqrt());
    flat("belief", time, belief.x, belief.y, heading, axes, color(0.2, 0.4, 0.9, 0.4))
}

/// Where to go, as wide as it suffices to come.
pub(super) fn goal(mission: &wire::Mission, time: u64) -> SceneUpdate {
    let wire::MissionOrder { goal_x, goal_y, goal_tolerance, .. } = mission.order;
    flat("goal", time, goal_x, goal_y, 0.0, [2.0 * goal_tolerance; 2], color(0.1, 0.7, 0.2, 0.6))
}

/// All candidates: green costs little, red much, grey was rejected or not scored, blue and wide was chosen.
pub(super) fn candidates(report: &wire::CycleReport, time: u64) -> SceneUpdate {
    let steps = report.candidates.steps as usize;
    let count = report.candidates.count as usize;
    let least = report.open_costs().fold(f64::INFINITY, f64::min);
    let range = (report.open_costs().fold(f64::NEG_INFINITY, f64::max) - least).max(1e-9);
    let lines = (0..count).map(|index| {
        let share = report.open_cost(index).map(|cost| (cost - least) / range);
        let (shade, z, thickness) = match share {
            _ if report.chosen == Some(index as u32) => (color(0.1, 0.3, 1.0, 1.0), CHOSEN_AT, CHOSEN_WIDTH),
            Some(share) => (color(share, 1.0 - share, 0.1, 0.7), CANDIDATES_AT, CANDIDATE_WIDTH),
            None => (color(0.5, 0.5, 0.5, 0.3), 0.0, CANDIDATE_WIDTH),
        };
        let states = index * steps..(index + 1) * steps;
        let points = states.map(|k| Point3 { x: report.candidates.x[k], y: report.candidates.y[k], z });
        LinePrimitive {
            r#type: line_primitive::Type::LineStrip as i32,
            thickness,
            points: points.collect(),
            color: Some(shade),
            ..LinePrimitive::default()
        }
    });
    update("candidates", time, SceneEntity { lines: lines.collect(), ..SceneEntity::default() })
}
