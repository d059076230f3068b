//! What the driver's guard may be told: how carefully it brakes, and zones in which something stops or slows the robot.

use std::collections::BTreeSet;

use curionav_planning::geometry::Point2;
use curionav_planning::parameters::{FieldError, Ranged};

curionav_planning::parameters! {
    /// How the guard judges a command.
    pub struct GuardSettings {
        /// Share of `a_max` that the guard counts on. The rest is for a slope, a load, a wet floor.
        pub braking_share: f64 [
            0.3, 1.0, "", "a base with less of its declared brakes needs a smaller `a_max`, and more it cannot have"
        ] = 0.8,
        /// Speed at which something comes towards the robot of which no earlier scan says how it moves, m/s. ISO 13855
        /// has 1.6 m/s for a person who walks.
        pub approach: f64 [0.0, 3.0, "m/s", "slower things stand, and faster ones run"] = 1.6,
        /// Within this distance what no earlier scan explains counts as coming, metres.
        pub unknown_within: f64 [0.0, 10.0, "m", "farther away the next scans say in time how it moves"] = 2.0,
        /// Speed that the robot itself may still have when something that moves meets it, m/s.
        pub meeting_speed: f64 [0.0, 0.3, "m/s", "a faster robot would hurt the person that it meets"] = 0.2,
        /// Room between the robot's edge and what moves ahead of it at which it drives at `near_speed`, metres. With
        /// more room it may be so much faster as it could slow down again on the way.
        pub near_gap: f64 [0.0, 3.0, "m", "with more room than 3 m to each person no robot passes a corridor"] = 0.1,
        /// Greatest speed with no more room than `near_gap` to what moves ahead, m/s.
        pub near_speed: f64 [0.05, 2.0, "m/s", "slower robots never get through, and faster ones frighten"] = 0.3,
        /// Half of the angle within which something is ahead, radians.
        pub near_angle: f64 [0.0, 1.6, "rad", "what is more than a quarter turn aside is not ahead"] = 0.8,
    }
}

curionav_planning::parameters! {
    /// What becomes of the robot while something is in a zone.
    pub enum ZoneKind {
        /// It brakes, and neither drives nor turns.
        Stop,
        /// It drives no faster than the zone's `speed`.
        Slow,
    }
}

curionav_planning::parameters! {
    /// A polygon that moves with the robot, as Nav2's collision monitor has. What the scan shows inside stops or slows
    /// the robot, whichever way it goes.
    pub struct Zone {
        /// What messages call it.
        pub name: String [name, "give the zone a name, such as \"front\""],
        /// `"stop"` or `"slow"`.
        pub kind: ZoneKind [words],
        /// Corners in order, each with `x` (ahead) and `y` (to the left) in the robot's frame, metres.
        pub vertices: Vec<Point2> [table; 3.0, 64.0, "fewer have no area, and more no drawing needs"],
        /// Greatest speed while something is inside, m/s; of a zone of kind `slow` alone.
        #[serde(default)]
        pub speed: Option<f64> [0.01, 10.0, "m/s", "a zone for less is a zone that stops"],
        /// Least number of end points of beams inside. Fewer are noise.
        #[serde(default = "default_points")]
        pub points: u32 [1.0, 1000.0, "points", "a zone without any would act always"],
    } check Self::agrees
}

/// As in Nav2's collision monitor.
fn default_points() -> u32 {
    4
}

/// Farther from the robot than this no corner of a zone makes sense, metres.
const FARTHEST: f64 = 50.0;
/// Smaller polygons hold no point, square metres.
const LEAST_AREA: f64 = 1e-3;

impl Zone {
    fn agrees(&self) -> Result<(), FieldError> {
        match (self.kind, self.speed) {
            (ZoneKind::Slow, None) => {
                return Err(FieldError::new("speed", "is missing", "give the greatest speed inside, m/s"));
            }
            (ZoneKind::Stop, Some(_)) => {
                let mend = "leave it out, or give kind = \"slow\"";
                return Err(FieldError::new("speed", "is given, and the zone stops", mend));
            }
            _ => {}
        }
        if let Some(i) = self.vertices.iter().position(|v| v.distance(Point2::default()) > FARTHEST) {
            let problem = format!("is farther away than {FARTHEST} m");
            return Err(FieldError::new(format!("vertices[{i}]"), problem, "give it in the robot's frame"));
        }
        if self.crosses_itself() {
            let mend = "list the corners in order around the zone";
            return Err(FieldError::new("vertices", "cross each other's edges", mend));
        }
        if self.area() < LEAST_AREA {
            let problem = format!("hold less than {LEAST_AREA} m2");
            return Err(FieldError::new("vertices", problem, "give corners that are not in one line"));
        }
        Ok(())
    }

    fn edges(&self) -> impl Iterator<Item = (Point2, Point2)> {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().copied().zip(next.copied())
    }

    fn area(&self) -> f64 {
        let twice: f64 = self.edges().map(|(a, b)| a.x * b.y - b.x * a.y).sum();
        0.5 * twice.abs()
    }

    fn crosses_itself(&self) -> bool {
        let edges: Vec<(Point2, Point2)> = self.edges().collect();
        let pairs = (0..edges.len()).flat_map(|i| (i + 1..edges.len()).map(move |k| (i, k)));
        pairs.into_iter().any(|(i, k)| cross(edges[i], edges[k]))
    }

    /// Whether a point of the robot's frame is inside: the rule of even and odd crossings.
    pub fn holds(&self, x: f64, y: f64) -> bool {
        let mut inside = false;
        let Some(mut a) = self.vertices.last() else { return false };
        for b in &self.vertices {
            if (a.y > y) != (b.y > y) && x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x) {
                inside = !inside;
            }
            a = b;
        }
        inside
    }

    /// Distance of the corner that is farthest from the robot's centre, metres.
    pub fn reach(&self) -> f64 {
        self.vertices.iter().map(|v| v.distance(Point2::default())).fold(0.0, f64::max)
    }
}

/// Whether two edges cross between their ends.
fn cross(one: (Point2, Point2), other: (Point2, Point2)) -> bool {
    let splits =
        |edge: (Point2, Point2), ends: (Point2, Point2)| side(edge, ends.0) * side(edge, ends.1) < 0.0;
    splits(one, other) && splits(other, one)
}

/// Positive if a point lies to the left of an edge.
fn side((from, to): (Point2, Point2), p: Point2) -> f64 {
    (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x)
}

/// Zones of one robot are few.
const ZONES_MAX: usize = 16;

/// Whether the zones make sense, one by one and together. `radius` is that of the robot's disc, if it is declared.
///
/// # Errors
/// Names the zone and the field.
pub fn check_zones(zones: &[Zone], radius: Option<f64>) -> Result<(), FieldError> {
    if zones.len() > ZONES_MAX {
        let problem = format!("are {}", zones.len());
        return Err(FieldError::new("zones", problem, format!("give at most {ZONES_MAX}")));
    }
    let mut names = BTreeSet::new();
    for (i, zone) in zones.iter().enumerate() {
        let outer = format!("zones[{i}]");
        zone.check().map_err(|fault| fault.below(&outer))?;
        if !names.insert(&zone.name) {
            let problem = format!("is `{}`, as of another zone", zone.name);
            return Err(FieldError::new("name", problem, "give each zone its own").below(&outer));
        }
        if radius.is_some_and(|radius| zone.reach() <= radius) {
            let mend = "draw the zone larger than `limits.radius`";
            return Err(FieldError::new("vertices", "lie within the robot itself", mend).below(&outer));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zone(text: &str) -> Result<Zone, String> {
        let zone: Zone = toml::from_str(text).map_err(|e| e.message().to_owned())?;
        check_zones(std::slice::from_ref(&zone), Some(0.3)).map_err(|e| e.to_string())?;
        Ok(zone)
    }

    const AHEAD: &str =
        "vertices = [{x = 0.2, y = -0.4}, {x = 1.0, y = -0.4}, {x = 1.0, y = 0.4}, {x = 0.2, y = 0.4}]";

    #[test]
    fn a_zone_holds_what_is_inside_whichever_way_its_corners_go_round() {
        let ahead = zone(&format!("name = \"front\"\nkind = \"stop\"\n{AHEAD}")).unwrap();
        let reversed = Zone { vertices: ahead.vertices.iter().rev().copied().collect(), ..ahead.clone() };
        for zone in [ahead, reversed] {
            assert!(zone.holds(0.5, 0.0) && zone.holds(0.9, 0.39));
            assert!(!zone.holds(1.1, 0.0) && !zone.holds(0.5, 0.5) && !zone.holds(-0.5, 0.0));
            assert_eq!(zone.points, 4);
        }
    }

    #[test]
    fn a_zone_that_makes_no_sense_is_named_with_its_field_and_how_to_mend_it() {
        let flat = "vertices = [{x = 0.5, y = 0.0}, {x = 1.0, y = 0.0}, {x = 2.0, y = 0.0}]";
        let bow =
            "vertices = [{x = 1.0, y = 0.0}, {x = 2.0, y = 1.0}, {x = 2.0, y = 0.0}, {x = 1.0, y = 0.9}]";
        let tiny = "vertices = [{x = 0.0, y = 0.0}, {x = 0.1, y = 0.0}, {x = 0.1, y = 0.1}]";
        for (rest, said) in [
            (format!("kind = \"slow\"\n{AHEAD}"), "zones[0].speed: is missing; give"),
            (format!("kind = \"stop\"\nspeed = 0.3\n{AHEAD}"), "zones[0].speed: is given, and"),
            (format!("kind = \"stop\"\npoints = 0\n{AHEAD}"), "zones[0].points: is 0; give 1 to 1000"),
            (format!("kind = \"stop\"\n{flat}"), "zones[0].vertices: hold less than 0.001 m2; give"),
            (format!("kind = \"stop\"\n{bow}"), "zones[0].vertices: cross each other"),
            (format!("kind = \"stop\"\n{tiny}"), "zones[0].vertices: lie within the robot itself; draw"),
            ("kind = \"halt\"\nvertices = []".into(), "unknown variant `halt`"),
        ] {
            let fault = zone(&format!("name = \"front\"\n{rest}")).unwrap_err();
            assert!(fault.starts_with(said), "{fault}");
        }
        let one = zone(&format!("name = \"front\"\nkind = \"stop\"\n{AHEAD}")).unwrap();
        let twice = check_zones(&[one.clone(), one], None).unwrap_err().to_string();
        assert!(twice.starts_with("zones[1].name: is `front`"), "{twice}");
    }
}
