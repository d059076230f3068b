//! Recorded pedestrians: the two forms the ETH and UCY trajectories are published in.

use std::collections::BTreeMap;

use curionav_planning::geometry::Point2;
use curionav_planning::text::loose_text;

use crate::scenario::RecordingFormat;

/// A gap in a person's frames longer than this is an absence, seconds; a shorter one is walked straight.
const MAX_GAP_S: f64 = 2.0;
/// Most rows of one recording: fifty times the longest of the UCY set.
const MAX_ROWS: usize = 1_000_000;

/// Why a recording could not be read, with the line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct RecordingError(String);

impl RecordingError {
    fn at(line: usize, problem: &str) -> Self {
        Self(format!("line {line}: {problem}"))
    }
}

/// All people of a recording, in the recording's own frame of reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    tracks: Vec<Track>,
    first: f64,
    last: f64,
}

/// One person: times (seconds, ascending) and the positions then.
#[derive(Debug, Clone, PartialEq)]
struct Track {
    id: u32,
    times: Vec<f64>,
    positions: Vec<Point2>,
}

/// A recorded person at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedPerson {
    /// Number of the person, from 0: all people of the recording in the order of their ids. It stays the same over
    /// time.
    pub index: usize,
    /// Metres, recording frame.
    pub position: Point2,
    /// m/s, recording frame: from the positions in the recorded frames before and after this instant.
    pub velocity: Point2,
}

/// A step of a recorded person between two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Who.
    pub id: u32,
    /// When it begins, seconds.
    pub time: f64,
    /// How fast it is, m/s.
    pub speed: f64,
}

impl Recording {
    /// Reads a recording; `fps` turns frame numbers into seconds. Columns are parted by blanks or commas. Blank lines,
    /// lines that begin with `#`, and a first line of names are skipped; rows may come in any order. Velocities in the
    /// file are ignored: they are smoothed and do not fit the positions.
    pub fn parse(text: &str, format: RecordingFormat, fps: f64) -> Result<Self, RecordingError> {
        let mut people: BTreeMap<u32, Vec<(f64, Point2, usize)>> = BTreeMap::new();
        let mut rows = 0;
        let lines =
            text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.trim().starts_with('#'));
        for (count, (i, text)) in lines.enumerate() {
            if count == 0 && words(text).all(|word| word.parse::<f64>().is_err()) {
                continue;
            }
            let (frame, id, position) =
                row(text, format).map_err(|problem| RecordingError::at(i + 1, &problem))?;
            people.entry(id).or_default().push((frame, position, i + 1));
            rows += 1;
            if rows > MAX_ROWS {
                return Err(RecordingError(format!("the recording has more than {MAX_ROWS} rows; cut it")));
            }
        }
        let tracks = people
            .into_iter()
            .map(|(id, frames)| Track::new(id, frames, fps))
            .collect::<Result<Vec<_>, _>>()?;
        let ends = tracks.iter().flat_map(|t| [t.times.first(), t.times.last()]).flatten();
        let (first, last) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &t| (a.min(t), b.max(t)));
        if tracks.is_empty() {
            let empty = "the recording is empty; give a file with at least one row";
            return Err(RecordingError(empty.to_owned()));
        }
        Ok(Self { tracks, first, last })
    }

    /// The text of a recording in the bytes of its file; see [`Self::parse`].
    ///
    /// # Errors
    /// They are compressed, or a line is wrong.
    pub fn read(bytes: &[u8], format: RecordingFormat, fps: f64) -> Result<Self, RecordingError> {
        let text = loose_text(bytes).map_err(|error| RecordingError(error.to_string()))?;
        Self::parse(&text, format, fps)
    }

    /// Every step of every person between two frames: who, when, and how fast, m/s.
    pub fn steps(&self) -> impl Iterator<Item = Step> {
        self.tracks.iter().flat_map(|track| {
            let pairs = track.times.windows(2).zip(track.positions.windows(2));
            pairs.filter_map(|(times, ends)| {
                let gap = times[1] - times[0];
                let speed = ends[0].distance(ends[1]) / gap;
                (gap > 0.0 && gap <= MAX_GAP_S).then_some(Step { id: track.id, time: times[0], speed })
            })
        })
    }

    /// Every position of every person, recording frame, metres.
    pub fn positions(&self) -> impl Iterator<Item = Point2> {
        self.tracks.iter().flat_map(|track| track.positions.iter().copied())
    }

    /// Times of the first and of the last frame, seconds.
    pub fn span(&self) -> (f64, f64) {
        (self.first, self.last)
    }

    /// Ids of all people, ascending.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = u32> {
        self.tracks.iter().map(|t| t.id)
    }

    /// Keeps only these people. The first id that is not in the recording is the error.
    pub fn keep(&mut self, ids: &[u32]) -> Result<(), u32> {
        if let Some(missing) = ids.iter().find(|id| self.ids().all(|known| known != **id)) {
            return Err(*missing);
        }
        self.tracks.retain(|t| ids.contains(&t.id));
        Ok(())
    }

    /// All who are present `time` seconds into the recording, by ascending id. Positions are linear between
    /// frames and exact at them.
    pub fn at(&self, time: f64) -> impl Iterator<Item = RecordedPerson> {
        self.tracks.iter().enumerate().filter_map(move |(index, track)| {
            track.at(time).map(|(position, velocity)| RecordedPerson { index, position, velocity })
        })
    }

    /// The time within the recording if it began again after its last frame, seconds.
    pub fn wrapped(&self, time: f64) -> f64 {
        let length = self.last - self.first;
        if length > 0.0 { self.first + (time - self.first).rem_euclid(length) } else { time }
    }
}

impl Track {
    fn new(id: u32, mut frames: Vec<(f64, Point2, usize)>, fps: f64) -> Result<Self, RecordingError> {
        frames.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        if let Some(pair) = frames.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let problem = format!("person {id} is already at frame {} in line {}", pair[0].0, pair[0].2);
            return Err(RecordingError::at(pair[1].2, &problem));
        }
        let times = frames.iter().map(|(frame, ..)| frame / fps).collect();
        let positions = frames.iter().map(|(_, position, _)| *position).collect();
        Ok(Self { id, times, positions })
    }

    fn at(&self, time: f64) -> Option<(Point2, Point2)> {
        let next = self.times.partition_point(|&t| t <= time);
        let i = next.checked_sub(1)?;
        let exact = self.times[i] == time;
        if next == self.times.len() && !exact {
            return None;
        }
        // The pair of frames around `time`; at the very last frame the pair before it.
        let from = if next == self.times.len() { i.saturating_sub(1) } else { i };
        let to = (from + 1).min(self.times.len() - 1);
        let a = self.positions[from];
        let b = self.positions[to];
        let gap = self.times[to] - self.times[from];
        if gap <= 0.0 || gap > MAX_GAP_S {
            return exact.then(|| (self.positions[i], Point2::default()));
        }
        let velocity = Point2::new((b.x - a.x) / gap, (b.y - a.y) / gap);
        let since = time - self.times[i];
        let here = self.positions[i];
        Some((Point2::new(here.x + velocity.x * since, here.y + velocity.y * since), velocity))
    }
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty())
}

/// (frame, id, position) of one line.
fn row(line: &str, format: RecordingFormat) -> Result<(f64, u32, Point2), String> {
    let (columns, y, names) = match format {
        RecordingFormat::Obsmat => (8, 4, "frame, id, x, z, y, vx, vz, vy"),
        RecordingFormat::Text => (4, 3, "frame, id, x, y"),
    };
    let numbers = words(line).map(|word| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(format!("`{word}` is not finite")),
        Err(_) => Err(format!("`{word}` is not a number; this format has the columns {names}")),
    });
    let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
    if numbers.len() != columns {
        return Err(format!("has {} columns; this format has {columns}: {names}", numbers.len()));
    }
    let id = numbers[1];
    if id < 0.0 || id.fract() != 0.0 || id > f64::from(u32::MAX) {
        return Err(format!("{id} is not an id; ids are whole numbers from 0"));
    }
    Ok((numbers[0], id as u32, Point2::new(numbers[2], numbers[y])))
}

#[cfg(test)]
mod tests {
    use curionav_testing::reference_data;

    use super::*;

    const TWO: &str =
        "0 1 0.0 0.0\n0 2 5.0 5.0\n\n10 1 1.0 2.0\n20 1 2.0 2.0\n90 1 9.0 9.0\n100 1 9.0 10.0\n";

    fn people(recording: &Recording, time: f64) -> Vec<(usize, f64, f64)> {
        recording.at(time).map(|p| (p.index, p.position.x, p.position.y)).collect()
    }

    #[test]
    fn commas_remarks_and_a_line_of_names_are_read_past() {
        let commas = "# of the foyer\nframe,person,x,y\n0,1,0.0,0.0\n10, 1, 1.0, 2.0\n";
        let plain = "0 1 0.0 0.0\n10 1 1.0 2.0\n";
        let [commas, plain] =
            [commas, plain].map(|text| Recording::parse(text, RecordingFormat::Text, 10.0).unwrap());
        assert_eq!(commas, plain);
        assert_eq!((plain.span(), plain.positions().count()), ((0.0, 1.0), 2));
        let error = Recording::parse("0 1 0 0\nframe person x y\n", RecordingFormat::Text, 10.0).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("line 2: `frame` is not a number; this format has the columns frame")
        );
    }

    #[test]
    fn positions_are_exact_at_frames_and_linear_between() {
        let r = Recording::parse(TWO, RecordingFormat::Text, 25.0).unwrap();
        assert_eq!(people(&r, 0.0), [(0, 0.0, 0.0), (1, 5.0, 5.0)]);
        assert_eq!(people(&r, 0.4), [(0, 1.0, 2.0)]);
        assert_eq!(people(&r, 0.2), [(0, 0.5, 1.0)]);
        // one metre and two metres in 0.4 s
        assert_eq!(r.at(0.1).next().unwrap().velocity, Point2::new(2.5, 5.0));
    }

    #[test]
    fn people_appear_and_vanish_and_are_absent_in_long_gaps() {
        let r = Recording::parse(TWO, RecordingFormat::Text, 25.0).unwrap();
        assert_eq!((r.first, r.last), (0.0, 4.0));
        assert_eq!(people(&r, -0.1), []);
        assert_eq!(people(&r, 1.0), []); // frames 20 to 90 are 2.8 s apart
        assert_eq!(people(&r, 0.8), [(0, 2.0, 2.0)]);
        assert_eq!(people(&r, 4.0), [(0, 9.0, 10.0)]);
        assert_eq!(people(&r, 4.1), []);
        let again: Vec<_> = r.at(r.wrapped(4.2)).map(|p| p.position).collect();
        assert!(again[0].distance(Point2::new(0.5, 1.0)) < 1e-9);
    }

    #[test]
    fn a_mark_is_read_over_and_a_compressed_file_is_told() {
        let marked = format!("\u{feff}{TWO}");
        let read = |bytes: &[u8]| Recording::read(bytes, RecordingFormat::Text, 25.0);
        assert_eq!(read(marked.as_bytes()).unwrap(), read(TWO.as_bytes()).unwrap());
        assert!(read(&[0x1f, 0x8b, 8, 8, 0]).unwrap_err().to_string().contains("gunzip"));
        assert!(read(b"# caf\xe9\n0 1 0 0\n").is_ok());
    }

    #[test]
    fn steps_are_as_fast_as_the_frames_say() {
        let r = Recording::parse(TWO, RecordingFormat::Text, 25.0).unwrap();
        let steps: Vec<Step> = r.steps().collect();
        // sqrt(5) m, 1 m and 1 m, each in 0.4 s; the gap of 2.8 s is an absence
        let expected = [(0.0, 5.0_f64.sqrt() / 0.4), (0.4, 2.5), (3.6, 2.5)];
        assert_eq!(steps.len(), expected.len());
        for (step, (time, speed)) in steps.iter().zip(expected) {
            assert!(step.id == 1 && step.time == time && (step.speed - speed).abs() < 1e-9, "{step:?}");
        }
    }

    #[test]
    fn a_bad_line_is_named() {
        for (line, word) in [
            ("10 1 1.0", "3 columns"),
            ("10 1 1.0 x", "`x`"),
            ("10 1.5 1.0 1.0", "1.5"),
            ("0 1 1.0 1.0", "already"),
            ("10 1 inf 1.0", "inf"),
        ] {
            let error = Recording::parse(&format!("0 1 0 0\n\n{line}\n"), RecordingFormat::Text, 25.0);
            let message = error.unwrap_err().to_string();
            assert!(message.starts_with("line 3: ") && message.contains(word), "{message}");
        }
        let empty = Recording::parse("\n", RecordingFormat::Text, 25.0).unwrap_err();
        assert!(empty.to_string().contains("empty"), "{empty}");
    }

    #[test]
    fn only_those_asked_for_are_kept() {
        let mut r = Recording::parse(TWO, RecordingFormat::Text, 25.0).unwrap();
        assert_eq!(r.keep(&[2, 7]), Err(7));
        r.keep(&[2]).unwrap();
        assert_eq!(people(&r, 0.0), [(0, 5.0, 5.0)]);
    }

    #[track_caller]
    fn published(file: &str) -> Option<String> {
        let path = reference_data(&format!("peds_eth_ucy/{file}"))?;
        Some(std::fs::read_to_string(path).unwrap())
    }

    #[test]
    fn the_published_recordings_are_read_whole() {
        use RecordingFormat::{Obsmat, Text};
        for (file, format, rows, people) in [
            ("zara01/obsmat.txt", Obsmat, 5024, 148),
            ("students03/obsmat.txt", Obsmat, 21_846, 428),
            ("text/crowds_zara01.txt", Text, 5153, 148),
            ("text/students003.txt", Text, 17_953, 434),
        ] {
            let Some(text) = published(file) else { return };
            let r = Recording::parse(&text, format, 25.0).unwrap();
            let read: usize = r.tracks.iter().map(|track| track.times.len()).sum();
            assert_eq!((read, r.ids().len()), (rows, people), "{file}");
        }
    }

    #[test]
    fn zara01_walks_at_walking_speed() {
        let Some(text) = published("zara01/obsmat.txt") else { return };
        let r = Recording::parse(&text, RecordingFormat::Obsmat, 25.0).unwrap();
        let Recording { first, last, .. } = r;
        assert!((last - first - 360.0).abs() < 5.0, "{first} to {last}");
        let mut speeds = Vec::new();
        for tick in 0..3600 {
            speeds.extend(r.at(0.1 * f64::from(tick)).map(|p| p.velocity.distance(Point2::default())));
        }
        speeds.sort_by(f64::total_cmp);
        let (median, greatest) = (speeds[speeds.len() / 2], speeds[speeds.len() - 1]);
        assert!((0.8..1.5).contains(&median) && greatest < 4.0, "{median}, {greatest}");
    }
}
