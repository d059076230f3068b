//! What is on no map, as a scenario has it.

use super::palette::{INK, THING};
use super::symbols::tracks;
use super::viewport::Viewport;
use svg::node::element::{Group, Polygon};

/// A thing that is on no map, or a part of the floor where walls of the map are gone; metres, map frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Thing {
    /// It stands there all the time.
    Lasting {
        /// Its corners.
        corners: Vec<(f64, f64)>,
    },
    /// It is there for a time, or is pushed along a route.
    Passing {
        /// Its corners where it is first.
        corners: Vec<(f64, f64)>,
        /// Where it is pushed to; empty if it stands.
        route: Vec<(f64, f64)>,
    },
    /// Walls that lie in it are not there.
    Opening {
        /// Its corners.
        corners: Vec<(f64, f64)>,
    },
}

/// All of them.
pub(super) fn things(viewport: &Viewport, things: &[Thing]) -> Group {
    things.iter().fold(Group::new(), |group, thing| match thing {
        Thing::Lasting { corners } => group.add(solid(viewport, corners)),
        Thing::Passing { corners, route } => group
            .add(tracks(viewport, [route.clone()]))
            .add(solid(viewport, corners).set("fill-opacity", 0.3).set("stroke-dasharray", "4 2")),
        Thing::Opening { corners } => group.add(opening(viewport, corners)),
    })
}

pub(super) fn solid(viewport: &Viewport, corners: &[(f64, f64)]) -> Polygon {
    let polygon =
        Polygon::new().set("class", "thing").set("points", viewport.points(corners.iter().copied()));
    polygon.set("fill", THING).set("stroke", INK).set("stroke-width", 0.8)
}

fn opening(viewport: &Viewport, corners: &[(f64, f64)]) -> Polygon {
    let polygon =
        Polygon::new().set("class", "opening").set("points", viewport.points(corners.iter().copied()));
    polygon.set("fill", "#fff").set("fill-opacity", 0.8).set("stroke", INK).set("stroke-dasharray", "1 3")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_passes_is_dashed_and_has_its_route_and_an_opening_is_white() {
        let viewport = Viewport::around((0.0, 0.0), 5.0, 100.0);
        let corners = vec![(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
        let drawn = |thing: Thing| things(&viewport, &[thing]).to_string();
        let lasting = drawn(Thing::Lasting { corners: corners.clone() });
        assert!(lasting.contains("thing") && !lasting.contains("dasharray"), "{lasting}");
        let route = vec![(0.0, 0.0), (3.0, 0.0)];
        let passing = drawn(Thing::Passing { corners: corners.clone(), route });
        assert!(passing.contains("dasharray") && passing.contains("<polyline"), "{passing}");
        let opening = drawn(Thing::Opening { corners });
        assert!(opening.contains("opening") && opening.contains("#fff"), "{opening}");
    }
}
