//! The drawings, `drawings/*.toml`: a floor plan with a task on it, in a few shapes.

use std::collections::BTreeMap;

use anyhow::Context;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use serde::Deserialize;
use toml::{Table, Value};

use super::layout::{Layout, Polygon};
use super::patrol::PatrolParams;
use super::route::{Route, RouteKind};

/// A floor plan and the task on it, metres and radians.
pub(super) struct Plan {
    pub(super) layout: Layout,
    pub(super) start: Pose2,
    pub(super) goal: Point2,
    pub(super) routes: Vec<Route>,
    /// Crowd zones and their share of the people: the last takes the rest.
    pub(super) crowds: Vec<(Polygon, f64)>,
    pub(super) patrols: PatrolParams,
    pub(super) description: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drawing {
    description: String,
    start: Pose2,
    goal: Point2,
    frame: Option<Frame>,
    outline: Vec<Corner>,
    /// Its last corners, where scenarios differ in some of them only.
    #[serde(default)]
    edge: Vec<Corner>,
    masonry: Vec<Shape>,
    furniture: Vec<Shape>,
    #[serde(default)]
    more: Vec<Shape>,
    /// What is passed on the way from start to goal.
    #[serde(default)]
    routes: BTreeMap<RouteKind, Vec<Corner>>,
    #[serde(default)]
    crowds: Vec<(Shape, f64)>,
    #[serde(default)]
    patrols: PatrolParams,
}

/// Local coordinates, which follow the building.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Frame {
    /// Degrees north of the east of a circle, and metres beyond its radius.
    Arc { middle: Point2, radius: f64 },
    /// Metres ahead along the diagonal from a point, and to its right.
    Diagonal { from: Point2 },
}

/// One corner of a polygon, or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum Corner {
    Map(Point2),
    Local {
        local: (f64, f64),
    },
    /// The front of a shop on an arc: from, to (degrees), and metres beyond the radius.
    Front {
        front: (f64, f64, f64),
    },
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Shape {
    /// Two opposite corners.
    Rectangle([f64; 4]),
    Polygon(Vec<Corner>),
    /// A rectangle in local coordinates.
    Local {
        local: [f64; 4],
    },
    /// An octagon: its middle and radius.
    Pillar {
        pillar: (f64, f64, f64),
    },
    /// A rectangle around a middle: length, depth, and degrees that it is turned by.
    Stand {
        stand: (f64, f64, f64, f64, f64),
    },
}

impl Plan {
    /// Reads a drawing. A table `only.SCENARIO` in it has the fields that are different in this scenario.
    pub(super) fn read(text: &str, scenario: &str) -> anyhow::Result<Self> {
        let mut table: Table = text.parse().context("drawing")?;
        if let Some(Value::Table(mut only)) = table.remove("only")
            && let Some(Value::Table(own)) = only.remove(scenario)
        {
            table.extend(own);
        }
        let drawing: Drawing = table.try_into().context("drawing")?;
        let frame = drawing.frame;
        let polygons = |shapes: &[Shape]| shapes.iter().map(|s| s.polygon(frame.as_ref())).collect();
        let corners = |list: &[Corner]| corners(list, frame.as_ref());
        let start = drawing.start;
        let goal = drawing.goal;
        let route = |(kind, via): (RouteKind, Vec<Corner>)| Route {
            kind,
            way: [vec![start.position()], corners(&via), vec![goal]].concat(),
        };
        Ok(Self {
            layout: Layout {
                outline: [corners(&drawing.outline), corners(&drawing.edge)].concat(),
                masonry: polygons(&drawing.masonry),
                furniture: [polygons(&drawing.furniture), polygons(&drawing.more)].concat(),
            },
            start,
            goal,
            routes: drawing.routes.into_iter().map(route).collect(),
            crowds: (drawing.crowds.iter().map(|(zone, share)| (zone.polygon(frame.as_ref()), *share)))
                .collect(),
            patrols: drawing.patrols,
            description: drawing.description,
        })
    }
}

impl Frame {
    fn point(&self, u: f64, v: f64) -> Point2 {
        match self {
            Self::Arc { middle, radius } => {
                let (s, c) = sin_cos(u.to_radians());
                Point2::new(middle.x + (radius + v) * c, middle.y + (radius + v) * s)
            }
            Self::Diagonal { from } => {
                let s = std::f64::consts::FRAC_1_SQRT_2;
                Point2::new(from.x + s * (u + v), from.y + s * (u - v))
            }
        }
    }
}

/// The point (u, v) of local coordinates; of the map's if the drawing has no frame.
fn local(frame: Option<&Frame>, u: f64, v: f64) -> Point2 {
    frame.map_or(Point2::new(u, v), |frame| frame.point(u, v))
}

fn corners(list: &[Corner], frame: Option<&Frame>) -> Polygon {
    let points = |corner: &Corner| match *corner {
        Corner::Map(point) => vec![point],
        Corner::Local { local: (u, v) } => vec![local(frame, u, v)],
        Corner::Front { front: (from, to, outward) } => {
            [from, 0.5 * (from + to), to].map(|degrees| local(frame, degrees, outward)).to_vec()
        }
    };
    list.iter().flat_map(points).collect()
}

impl Shape {
    fn polygon(&self, frame: Option<&Frame>) -> Polygon {
        match self {
            Self::Rectangle(ends) => rectangle(*ends, Point2::new),
            Self::Polygon(list) => corners(list, frame),
            Self::Local { local: ends } => rectangle(*ends, |u, v| local(frame, u, v)),
            Self::Pillar { pillar: (x, y, radius) } => {
                let d = radius * std::f64::consts::FRAC_1_SQRT_2;
                let r = *radius;
                [(r, 0.0), (d, d), (0.0, r), (-d, d), (-r, 0.0), (-d, -d), (0.0, -r), (d, -d)]
                    .map(|(dx, dy)| Point2::new(x + dx, y + dy))
                    .to_vec()
            }
            Self::Stand { stand: (x, y, length, depth, degrees) } => {
                let (s, c) = sin_cos(degrees.to_radians());
                rectangle([-0.5, -0.5, 0.5, 0.5], |u, v| {
                    Point2::new(x + c * u * length - s * v * depth, y + s * u * length + c * v * depth)
                })
            }
        }
    }
}

fn rectangle([x0, y0, x1, y1]: [f64; 4], point: impl Fn(f64, f64) -> Point2) -> Polygon {
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| point(x, y)).to_vec()
}
