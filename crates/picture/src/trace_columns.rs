//! The columns of a trace that are drawn.

use curionav_planning::numerics::hypot;
use curionav_schemas::{PeopleTrace, Trace};

/// A run tick by tick; a list is empty when the trace lacks its columns.
#[derive(Debug, Clone, Default)]
pub(super) struct TraceColumns {
    /// Seconds.
    pub(super) time: Vec<f64>,
    /// Where the robot was, m.
    pub(super) truth: Vec<(f64, f64)>,
    /// Where it headed, rad.
    pub(super) heading: Vec<f64>,
    /// Where it believed it was, m.
    pub(super) belief: Vec<(f64, f64)>,
    /// Covariance of the believed position: xx, xy, yy, m^2.
    pub(super) covariance: Vec<[f64; 3]>,
    /// Trace of the covariance of the pose, m^2 + rad^2.
    pub(super) uncertainty: Vec<f64>,
    /// Forward speed, m/s.
    pub(super) speed: Vec<f64>,
    /// Distance to the nearest person's centre, m.
    pub(super) person_distance: Vec<f64>,
    /// Distance between truth and belief, m.
    pub(super) error: Vec<f64>,
    pub(super) people: Vec<Track>,
}

/// Rows over which a velocity is taken.
const ROWS: usize = 5;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track {
    /// `[row]` where, m; none while absent.
    pub(super) at: Vec<Option<(f64, f64)>>,
}

impl Track {
    /// The stretches without an absence in between.
    pub(super) fn stretches(&self) -> impl Iterator<Item = Vec<(f64, f64)>> {
        self.at
            .split(Option::is_none)
            .map(|part| part.iter().flatten().copied().collect())
            .filter(|stretch: &Vec<_>| !stretch.is_empty())
    }

    /// The last place, m, and the mean velocity over the few rows that led there, m/s.
    pub(super) fn end(&self, time: &[f64]) -> Option<((f64, f64), (f64, f64))> {
        let last = self.at.iter().rposition(Option::is_some)?;
        let first =
            (last.saturating_sub(ROWS)..=last).rev().take_while(|row| self.at[*row].is_some()).last()?;
        Some((self.at[last]?, self.velocity(first, last, time)?))
    }

    fn velocity(&self, first: usize, last: usize, time: &[f64]) -> Option<(f64, f64)> {
        let from = self.at[first]?;
        let to = self.at[last]?;
        let elapsed = time.get(last)? - time.get(first)?;
        if elapsed <= 0.0 {
            return Some((0.0, 0.0));
        }
        Some(((to.0 - from.0) / elapsed, (to.1 - from.1) / elapsed))
    }
}

impl TraceColumns {
    pub(super) fn new(trace: &Trace) -> Self {
        let column = |name: &str| trace.column(name).collect::<Vec<f64>>();
        let truth = pairs(&column("true_x"), &column("true_y"));
        let belief = pairs(&column("belief_x"), &column("belief_y"));
        let [xx, xy, yy, hh] = ["cov_xx", "cov_xy", "cov_yy", "cov_hh"].map(column);
        Self {
            time: column("time_s"),
            heading: column("true_heading"),
            covariance: (0..xx.len().min(xy.len()).min(yy.len())).map(|i| [xx[i], xy[i], yy[i]]).collect(),
            uncertainty: (0..xx.len().min(yy.len()).min(hh.len())).map(|i| xx[i] + yy[i] + hh[i]).collect(),
            speed: column("v"),
            person_distance: column("person_distance"),
            error: truth.iter().zip(&belief).map(|(a, b)| hypot(a.0 - b.0, a.1 - b.1)).collect(),
            people: tracks(&trace.people),
            truth,
            belief,
        }
    }

    /// The row at `time`, s: the last one that is not later.
    pub(super) fn row_at(&self, time: f64) -> usize {
        self.time.partition_point(|t| *t <= time + 1e-9).saturating_sub(1)
    }
}

fn pairs(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

fn tracks(people: &PeopleTrace) -> Vec<Track> {
    let count = people.id.len();
    (0..count)
        .map(|person| Track {
            at: (0..people.rows as usize).map(|row| place(people, row * count + person)).collect(),
        })
        .collect()
}

fn place(people: &PeopleTrace, cell: usize) -> Option<(f64, f64)> {
    let xy = people.xy.get(2 * cell..2 * cell + 2)?;
    (people.present.get(cell) == Some(&1)).then(|| (f64::from(xy[0]), f64::from(xy[1])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_late_person_has_a_track_that_begins_late() {
        let trace = TraceColumns::new(&golden::run_result().trace);
        assert_eq!(trace.people.len(), 2);
        assert_eq!(trace.people[0].at.iter().flatten().count(), 2);
        assert_eq!(trace.people[1].at[0], None);
        assert_eq!(trace.people[1].end(&trace.time).map(|end| end.1), Some((0.0, 0.0)));
        // Five centimetres in a tenth of a second.
        let velocity = trace.people[0].end(&trace.time).unwrap().1;
        assert!((velocity.0 + 0.5).abs() < 1e-6 && (velocity.1 - 0.1).abs() < 1e-6);
    }

    #[test]
    fn a_gap_cuts_a_track_in_two() {
        let at = vec![Some((0.0, 0.0)), Some((1.0, 0.0)), None, None, Some((5.0, 5.0))];
        let track = Track { at };
        assert_eq!(track.stretches().map(|stretch| stretch.len()).collect::<Vec<_>>(), [2, 1]);
    }

    #[test]
    fn missing_columns_are_empty() {
        let trace = TraceColumns::new(&golden::run_result().trace);
        assert_eq!(trace.time.len(), 2);
        assert!(trace.truth.is_empty() && trace.speed.is_empty());
    }

    #[test]
    fn a_moment_is_in_the_last_row_not_after_it() {
        let trace = TraceColumns { time: vec![0.0, 0.1, 0.2], ..TraceColumns::default() };
        assert_eq!([-1.0, 0.0, 0.15, 0.2, 9.0].map(|time| trace.row_at(time)), [0, 0, 1, 2, 2]);
    }
}
