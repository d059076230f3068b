//! What `curionav track` prints, and the table of people that it writes.

use std::collections::BTreeMap;
use std::fmt::Write;

use curionav_planning::geometry::Point2;
use serde::Serialize;

use super::follow::{Course, Drive, Scanned};
use super::score::Score;
use crate::robot_log::Faults;
use crate::statistics::median;

/// A robot that ends farther off than this is elsewhere, metres.
const LOST_M: f64 = 1.0;

/// One person as it was followed.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct TrackRow {
    id: u32,
    /// First and last scan with this person, seconds after the first scan.
    from_s: f64,
    to_s: f64,
    /// Scans in which the person was seen.
    seen_scans: usize,
    /// Where the person was first and last, map frame, metres.
    begins_at: [f64; 2],
    ends_at: [f64; 2],
}

/// Which files the figures are of, as they are told.
pub(super) struct Names {
    pub(super) log: String,
    pub(super) map: Option<String>,
    /// The table of people that was written.
    pub(super) people: Option<String>,
    pub(super) picture: String,
}

/// Figures of one log.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    seed: u64,
    log: String,
    map: Option<String>,
    scans: usize,
    duration_s: f64,
    #[serde(flatten)]
    faults: Faults,
    /// What told where the robot was.
    pose_by: &'static str,
    /// Scans at which the robot knew its place, so that people could be tracked.
    placed_scans: usize,
    references: usize,
    references_are: String,
    /// How far the robot was from its references, metres.
    pose_off_median_m: Option<f64>,
    pose_off_at_end_m: Option<f64>,
    /// People in a scan, with those who are hidden: on average, and at most.
    people_per_scan: f64,
    most_people: usize,
    /// By ascending id.
    tracks: Vec<TrackRow>,
    score: Option<Score>,
    seconds_per_second: f64,
    people: Option<String>,
    picture: String,
}

impl Summary {
    pub(super) fn of(names: Names, drive: &Drive, course: &Course, score: Option<Score>) -> Self {
        let log = &drive.given.log;
        let off = off_references(drive, course);
        let placed = || course.scans.iter().filter(|scanned| scanned.pose.is_some());
        let people: usize = placed().map(|scanned| scanned.people.len()).sum();
        Self {
            seed: drive.seed,
            log: names.log,
            map: names.map,
            scans: log.readings.len(),
            duration_s: log.duration(),
            faults: log.faults.clone(),
            pose_by: drive.way.words(),
            placed_scans: placed().count(),
            references: log.readings.iter().filter(|reading| reading.reference.is_some()).count(),
            references_are: drive.given.references_are.clone(),
            pose_off_median_m: median(&off),
            pose_off_at_end_m: off.last().copied(),
            people_per_scan: people as f64 / placed().count().max(1) as f64,
            most_people: placed().map(|scanned| scanned.people.len()).max().unwrap_or(0),
            tracks: track_rows(course),
            score,
            seconds_per_second: log.duration() / course.wall_s.max(1e-9),
            people: names.people,
            picture: names.picture,
        }
    }

    pub(super) fn is_lost(&self) -> bool {
        self.pose_off_at_end_m.is_some_and(|off| off > LOST_M)
    }

    pub(super) fn words(&self) -> String {
        let mut lines = vec![format!(
            "{}: {} scans in {:.0} s; the robot's place is by {}",
            self.log, self.scans, self.duration_s, self.pose_by
        )];
        lines.extend(self.faults.lines());
        if let (Some(median), Some(at_end)) = (self.pose_off_median_m, self.pose_off_at_end_m) {
            lines.push(format!(
                "the place is off by {median:.2} m in the median and {at_end:.2} m at the end, against {} references, \
                 {}",
                self.references, self.references_are
            ));
        }
        if self.placed_scans < self.scans {
            let unknown = self.scans - self.placed_scans;
            lines.push(format!("the place is not known at {unknown} scans, so no person is tracked there"));
        }
        let followed: Vec<f64> = self.tracks.iter().map(|track| track.to_s - track.from_s).collect();
        lines.push(format!(
            "{} people followed, for {:.1} s in the median; {:.1} in a scan on average, {} at most",
            self.tracks.len(),
            median(&followed).unwrap_or(0.0),
            self.people_per_scan,
            self.most_people
        ));
        lines.extend(self.score.iter().flat_map(Score::lines));
        lines.push(format!("{:.0} times as fast as it was driven", self.seconds_per_second));
        lines.extend(self.people.iter().map(|path| format!("who was where at each scan is in {path}")));
        lines.push(format!("the picture is {}", self.picture));
        lines.join("\n")
    }
}

/// How far the robot was from each reference, metres, in the order of time. Nothing if the references are its place.
fn off_references(drive: &Drive, course: &Course) -> Vec<f64> {
    let readings = drive.given.log.readings.iter();
    let pairs = readings.zip(&course.scans).filter_map(|(reading, scanned)| {
        let reference = reading.reference?;
        Some(reference.position().distance(scanned.pose?.position()))
    });
    if drive.way.is_the_references() { Vec::new() } else { pairs.collect() }
}

fn track_rows(course: &Course) -> Vec<TrackRow> {
    let first = course.scans.first().map_or(0.0, |scanned| scanned.stamp);
    let mut rows: BTreeMap<u32, TrackRow> = BTreeMap::new();
    for scanned in &course.scans {
        for person in &scanned.people {
            let Some(Point2 { x, y }) = scanned.on_map(person.position) else { continue };
            let time = scanned.stamp - first;
            let new = TrackRow {
                id: person.id,
                from_s: time,
                to_s: time,
                seen_scans: 0,
                begins_at: [x, y],
                ends_at: [x, y],
            };
            let row = rows.entry(person.id).or_insert(new);
            row.to_s = time;
            row.ends_at = [x, y];
            row.seen_scans += usize::from(person.age == 0.0);
        }
    }
    rows.into_values().collect()
}

/// Who was where at each scan, as a table: a line per scan and person, in the frame of the map. The last two columns
/// give the place in the frame of the laser.
pub(super) fn people_table(course: &Course) -> String {
    let mut table = String::from("stamp_s,x,y,id,vx,vy,age_s,probability,laser_x,laser_y\n");
    for scanned in &course.scans {
        // Writing into a string does not fail.
        let _ = people_lines(scanned, &mut table);
    }
    table
}

fn people_lines(scanned: &Scanned, table: &mut String) -> std::fmt::Result {
    let Some(pose) = scanned.pose else { return Ok(()) };
    for person in &scanned.people {
        let place = pose.transform(person.position);
        let tip = pose.transform(Point2::new(
            person.position.x + person.velocity.x,
            person.position.y + person.velocity.y,
        ));
        let laser = scanned.in_laser(person.position);
        let stamp = scanned.stamp;
        write!(table, "{stamp:.6},{:.3},{:.3},{}", place.x, place.y, person.id)?;
        write!(table, ",{:.3},{:.3}", tip.x - place.x, tip.y - place.y)?;
        write!(table, ",{:.3},{:.3}", person.age, person.probability)?;
        writeln!(table, ",{:.3},{:.3}", laser.x, laser.y)?;
    }
    Ok(())
}
