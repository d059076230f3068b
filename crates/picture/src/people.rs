//! People around a robot on a map: how they were followed, and where they were known to be.

use super::map_layer::map_layer;
use super::page::{MAP_ID, pane};
use super::palette::PERSON;
use super::symbols::{disc, path};
use super::tracks::{Entry, Track, sheet, viewport};
use super::viewport::Viewport;
use curionav_schemas::OccupancyGrid;
use svg::node::element::Group;

/// Radius of a mark, metres; never too small to see.
const MARK_M: f64 = 0.12;
/// What the ways of people are called in the legend.
const PEOPLE: &str = "people, as tracked";

/// Places of one kind on a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks<'a> {
    /// What stands there, for the legend.
    pub name: &'a str,
    /// As CSS writes it, such as `#009E73`.
    pub colour: &'a str,
    /// Metres, map frame.
    pub points: Vec<(f64, f64)>,
}

/// The map with the `way` of the robot, the ways of `people` as thin lines, and marks on top. What has no points is
/// left out of the legend.
pub fn people_svg(
    map: &OccupancyGrid,
    way: &Track<'_>,
    people: &[Vec<(f64, f64)>],
    marks: &[Marks<'_>],
) -> String {
    let matters = way.points.iter().copied().chain(people.iter().flatten().copied());
    let viewport = viewport(map, matters.collect());
    let mut inside = pane(viewport.width, viewport.height).add(map_layer(map, MAP_ID, &viewport)).add(path(
        &viewport,
        way.points.iter().copied(),
        way.colour,
        1.8,
    ));
    for track in people {
        inside = inside.add(path(&viewport, track.iter().copied(), PERSON, 1.2));
    }
    for kind in marks {
        inside = inside.add(drawn(kind, &viewport));
    }
    sheet("people", map, &viewport, inside, &entries(way, people, marks))
}

fn drawn(marks: &Marks<'_>, viewport: &Viewport) -> Group {
    marks.points.iter().fold(Group::new(), |group, at| {
        let ring = disc(viewport, *at, MARK_M).set("fill", marks.colour).set("fill-opacity", 0.35);
        group.add(ring.set("stroke", marks.colour).set("stroke-width", 1))
    })
}

fn entries<'a>(way: &Track<'a>, people: &[Vec<(f64, f64)>], marks: &[Marks<'a>]) -> Vec<Entry<'a>> {
    let mut entries = Vec::new();
    if !way.points.is_empty() {
        entries.push(Entry { name: way.name, colour: way.colour });
    }
    if !people.is_empty() {
        entries.push(Entry { name: PEOPLE, colour: PERSON });
    }
    let placed = marks.iter().filter(|kind| !kind.points.is_empty());
    entries.extend(placed.map(|kind| Entry { name: kind.name, colour: kind.colour }));
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::Pose;

    #[test]
    fn way_people_and_marks_are_drawn_and_what_has_no_points_is_not_named() {
        let map = OccupancyGrid {
            resolution: 1.0,
            width: 10,
            height: 10,
            origin: Pose { x: 0.0, y: 0.0, heading: 0.0 },
            cells: vec![0; 100].into(),
            limits: None,
            map: curionav_schemas::MapId([0; 32]),
        };
        let way = Track { name: "robot", colour: "#0072B2", points: vec![(1.0, 1.0), (8.0, 2.0)] };
        let found = Marks { name: "found", colour: "#009E73", points: vec![(2.0, 3.0), (4.0, 3.0)] };
        let missed = Marks { name: "missed", colour: "#D55E00", points: vec![] };
        let picture = people_svg(&map, &way, &[vec![(2.0, 3.0), (4.0, 3.0)]], &[found, missed]);
        assert!(["robot", PEOPLE, "found"].iter().all(|name| picture.contains(name)), "{picture}");
        assert!(!picture.contains("missed"));
        assert_eq!(picture.matches("<circle").count(), 2);
        // A picture without people is one, too.
        let nothing = Track { points: vec![], ..way };
        assert!(people_svg(&map, &nothing, &[], &[]).contains("<svg"));
    }
}
