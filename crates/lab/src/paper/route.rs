//! The ways from start to goal that a scene offers.

use curionav_planning::geometry::Point2;
use serde::Deserialize;

/// What kind of way a route is (D16).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum RouteKind {
    /// Free of people, for the greater part out of reach of any landmark.
    Bare,
    /// Along landmarks and through the crowd.
    Crowded,
    /// Free of people, along landmarks.
    Landmarks,
}

/// One way from start to goal that the scene offers.
#[derive(Debug, Clone)]
pub(super) struct Route {
    pub(super) kind: RouteKind,
    /// Corners, the start first and the goal last, metres.
    pub(super) way: Vec<Point2>,
}
