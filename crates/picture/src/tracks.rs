//! Ways over a map, such as where a robot was and where it believed it was.

use super::axes::{AXIS, on_axes, scale_bar};
use super::map_layer::{definition, known, map_layer};
use super::page::{MAP_HEIGHT, MAP_ID, RIM, WIDTH, document, file, pane};
use super::symbols::{line, path, text};
use super::viewport::{Bounds, Viewport};
use curionav_schemas::OccupancyGrid;
use svg::node::element::{Definitions, Group, SVG};

/// Free space around the tracks that is shown of a large map, m.
const MARGIN_M: f64 = 3.0;
/// A map is shown whole while it has at most this many times the area of the part that matters.
const WHOLE_UP_TO: f64 = 4.0;
/// Height of the legend, px.
const LEGEND: f64 = 34.0;
/// Width of an entry of it, px.
const ENTRY: f64 = 180.0;

/// A way over a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Track<'a> {
    /// What it is, for the legend.
    pub name: &'a str,
    /// As CSS writes it.
    pub colour: &'a str,
    /// Metres, map frame.
    pub points: Vec<(f64, f64)>,
}

/// The map with the tracks, the last on top; those without points are left out.
pub fn tracks_svg(map: &OccupancyGrid, tracks: &[Track<'_>]) -> String {
    let tracks: Vec<&Track<'_>> = tracks.iter().filter(|track| !track.points.is_empty()).collect();
    // The first may lead far off the map; the others say what matters.
    let matters: Vec<(f64, f64)> =
        tracks.iter().rev().take(2).flat_map(|track| track.points.iter().copied()).collect();
    let viewport = viewport(map, matters);
    let mut inside = pane(viewport.width, viewport.height).add(map_layer(map, MAP_ID, &viewport));
    let mut entries = Vec::new();
    for track in tracks {
        let way = path(&viewport, track.points.iter().copied(), track.colour, 1.8);
        inside = inside.add(way.set("stroke-opacity", 0.85));
        entries.push(Entry { name: track.name, colour: track.colour });
    }
    sheet("tracks", map, &viewport, inside, &entries)
}

/// The view of the part of a map around these points, of a large map, or of all of it.
pub(super) fn viewport(map: &OccupancyGrid, matters: Vec<(f64, f64)>) -> Viewport {
    let mut shown = known(map);
    if !matters.is_empty() {
        shown = shown.part(Bounds::of(matters).grown(MARGIN_M), WHOLE_UP_TO);
    }
    Viewport::fit(shown, WIDTH - 2.0 * RIM - AXIS.0, MAP_HEIGHT - AXIS.1)
}

/// A line of the legend.
pub(super) struct Entry<'a> {
    pub(super) name: &'a str,
    pub(super) colour: &'a str,
}

/// A picture with a legend above a map, on which is drawn what is `inside`.
pub(super) fn sheet(
    name: &str,
    map: &OccupancyGrid,
    viewport: &Viewport,
    inside: SVG,
    entries: &[Entry<'_>],
) -> String {
    let width = viewport.width.max(ENTRY * entries.len() as f64) + AXIS.0 + 2.0 * RIM;
    let height = viewport.height + AXIS.1 + LEGEND + 2.0 * RIM;
    let plan = on_axes(viewport, inside.add(scale_bar(viewport)), (RIM, RIM + LEGEND));
    let definitions = Definitions::new().add(definition(map, MAP_ID));
    file(&document(name, (width, height), definitions).add(legend(entries)).add(plan))
}

fn legend(entries: &[Entry<'_>]) -> Group {
    entries.iter().enumerate().fold(Group::new(), |group, (index, entry)| {
        let left = RIM + AXIS.0 + ENTRY * index as f64;
        let bar = line((left, RIM + 8.0), (left + 30.0, RIM + 8.0), "line");
        let bar = bar.set("stroke", entry.colour).set("stroke-width", 3);
        group.add(bar).add(text((left + 38.0, RIM + 12.0), "", entry.name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::Pose;

    #[test]
    fn every_track_with_points_is_drawn_and_named() {
        let map = OccupancyGrid {
            resolution: 1.0,
            width: 10,
            height: 10,
            origin: Pose { x: 0.0, y: 0.0, heading: 0.0 },
            cells: vec![0; 100].into(),
            limits: None,
            map: curionav_schemas::MapId([0; 32]),
        };
        let track = |name, points| Track { name, colour: "#123456", points };
        let tracks = [track("by odometry", vec![(1.0, 1.0), (8.0, 2.0)]), track("nothing", vec![])];
        let picture = tracks_svg(&map, &tracks);
        assert!(picture.contains("by odometry") && !picture.contains("nothing"));
        assert!(picture.contains("#123456") && picture.ends_with("</svg>\n"));
        // No track is no reason to fail.
        assert!(tracks_svg(&map, &[]).contains("<svg"));
    }
}
