//! What a scenario has besides its map, to be drawn.

use curionav_deployment::package::Package;
use curionav_picture::Thing;
use curionav_planning::geometry::Point2;

pub(crate) fn things(package: &Package) -> Vec<Thing> {
    let world = &package.scenario.world;
    let openings = world.openings.iter().map(|region| Thing::Opening { corners: pairs(&region.corners) });
    let objects = world.objects.iter().map(|object| {
        let corners = pairs(&object.corners_on_map());
        let lasts = object.from_s == 0.0 && object.until_s.is_none() && object.route.is_empty();
        if lasts {
            return Thing::Lasting { corners };
        }
        let start = std::iter::once(object.at.position());
        let route: Vec<Point2> = start.chain(object.route.iter().copied()).collect();
        Thing::Passing { corners, route: if object.route.is_empty() { Vec::new() } else { pairs(&route) } }
    });
    openings.chain(objects).collect()
}

fn pairs(points: &[Point2]) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p.x, p.y)).collect()
}
