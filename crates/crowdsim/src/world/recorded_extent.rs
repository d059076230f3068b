//! What is said of a scenario's recordings, and which of their people take part.

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters::FieldError;

use crate::recorded::{Recording, Step};
use crate::scenario::{Recorded, Scenario};

/// Where the people of one of a scenario's recordings are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedExtent {
    /// How many people there are.
    pub people: usize,
    /// First and last time in the recording, seconds.
    pub span: (f64, f64),
    /// Least and greatest x and y, map frame, metres.
    pub corners: (Point2, Point2),
    /// The share of their positions that lie on the map's free floor.
    pub on_floor: f64,
    /// The median speed of those steps that lead anywhere, m/s; none if no person moves.
    pub usual_speed: Option<f64>,
    /// The fastest step; none if there is no step.
    pub fastest: Option<Step>,
}

/// Slower than this no person walks, m/s: recorded positions of people who stand move as well.
const STANDING_MPS: f64 = 0.1;
/// What people walk at, m/s, as a median over many.
const WALKING_MPS: [f64; 2] = [0.3, 3.0];
/// Faster than this no person runs, m/s.
const RUNNING_MPS: f64 = 10.0;

impl RecordedExtent {
    /// What is odd about these people, a sentence each.
    pub fn odd(&self) -> Vec<String> {
        let mut odd = Vec::new();
        if let Some(Step { id, time, speed }) = self.fastest.filter(|step| step.speed > RUNNING_MPS) {
            odd.push(format!(
                "person {id} moves at {speed:.1} m/s at {time:.1} s, faster than anyone runs; look for mixed-up ids, \
                 the unit of positions and fps"
            ));
        }
        let [least, most] = WALKING_MPS;
        if let Some(speed) = self.usual_speed.filter(|speed| !(least..=most).contains(speed)) {
            odd.push(format!(
                "people move at {speed:.2} m/s as a rule, and walk at {least} to {most}; look at fps"
            ));
        }
        odd
    }
}

impl RecordedExtent {
    pub(super) fn of(setup: &Recorded, map: &StaticMap, recording: &Recording) -> Self {
        let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
        let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut all = 0_usize;
        let mut free = 0_usize;
        for p in recording.positions().map(|p| setup.pose.transform(p)) {
            low = Point2::new(low.x.min(p.x), low.y.min(p.y));
            high = Point2::new(high.x.max(p.x), high.y.max(p.y));
            all += 1;
            let cell = map.grid.locate(p).map(|(column, row)| map.grid.index(column, row));
            free += usize::from(cell.is_some_and(|cell| map.to_obstacle.cell(cell) > 0.0));
        }
        let mut speeds: Vec<f64> =
            recording.steps().map(|step| step.speed).filter(|speed| *speed > STANDING_MPS).collect();
        speeds.sort_by(f64::total_cmp);
        Self {
            people: recording.ids().len(),
            span: recording.span(),
            corners: (low, high),
            on_floor: free as f64 / all.max(1) as f64,
            usual_speed: speeds.get(speeds.len() / 2).copied(),
            fastest: recording.steps().reduce(|a, b| if b.speed > a.speed { b } else { a }),
        }
    }
}

/// The recordings with only the people the scenario asks for.
pub(super) fn chosen(
    scenario: &Scenario,
    map: &StaticMap,
    mut recordings: Vec<Recording>,
) -> Result<Vec<Recording>, FieldError> {
    if recordings.len() != scenario.recorded.len() {
        let wanted = scenario.recorded.len();
        let found = recordings.len();
        let problem = format!("names {wanted} recordings, {found} came along");
        return Err(FieldError::new("recorded", problem, "send every recording with the scenario"));
    }
    for (i, (setup, recording)) in scenario.recorded.iter().zip(&mut recordings).enumerate() {
        if let Some(ids) = &setup.ids {
            recording.keep(ids).map_err(|id| {
                let problem = format!("no person in {} has id {id}", setup.file);
                FieldError::new(format!("recorded[{i}].ids"), problem, "list ids of the recording")
            })?;
        }
        let RecordedExtent { span: (_, last), corners: (low, high), on_floor, .. } =
            RecordedExtent::of(setup, map, recording);
        if setup.start_s > last && !setup.r#loop {
            let problem = format!("is {} s, and the recording ends at {last:.1} s", setup.start_s);
            return Err(FieldError::new(
                format!("recorded[{i}].start_s"),
                problem,
                "begin earlier, or say `loop = true`",
            ));
        }
        if on_floor == 0.0 {
            let x = format!("{:.1} to {:.1}", low.x, high.x);
            let y = format!("{:.1} to {:.1}", low.y, high.y);
            let problem = format!("puts all people off the map's free floor: x from {x} m, y from {y} m");
            return Err(FieldError::new(format!("recorded[{i}].pose"), problem, "give map_from_recording"));
        }
    }
    Ok(recordings)
}
