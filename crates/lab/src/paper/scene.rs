//! A finished scene, and what it was meant to be.

use curionav_crowdsim::Scenario;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;

use super::layout::Polygon;
use super::published::Published;

/// What kind of way a route is (D16).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RouteKind {
    /// Free of people, for the greater part out of reach of any landmark.
    Bare,
    /// Along landmarks and through the crowd.
    Crowded,
    /// Free of people, along landmarks.
    Landmarks,
}

/// One way from start to goal that the scene offers.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// What it is like.
    pub kind: RouteKind,
    /// Corners, the start first and the goal last, metres.
    pub way: Vec<Point2>,
}

/// A finished scene: map, scenario, and what it was meant to be.
#[derive(Debug, Clone)]
pub struct PaperScene {
    /// The static map with its distance fields.
    pub map: StaticMap,
    /// The scenario; its map file is the one [`super::files`] writes.
    pub scenario: Scenario,
    /// One route of each kind; none for scenes without that claim.
    pub routes: Vec<Route>,
    /// Zones that hold the patrols.
    pub crowds: Vec<Polygon>,
    /// The published numbers it follows, if it is one of the paper's.
    pub published: Option<&'static Published>,
}
