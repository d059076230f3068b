//! What is wrong on the robot's side, for operators.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// A kind of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProblemKind {
    /// Another node publishes what the gateway alone should.
    SecondPublisher,
    /// Another node has another type under the same name, so that they do not hear each other.
    OtherType,
    /// What was said last on a topic was not used.
    NotUsed,
    /// Nothing is heard on it any more, for which the robot stands.
    Silent,
    /// Nothing is heard on it any more, and the robot drives without.
    Unheard,
    /// A bumper is pressed.
    Pressed,
    /// The driver takes the laser for blind, for which the robot stands.
    Blind,
    /// Odometry does not come as often as the limits say.
    Rate,
    /// The driver has refused a mission.
    Refused,
    /// Nothing of it has come yet, and without it no mission can begin.
    Awaited,
    /// The robot stands until it is resumed.
    Paused,
    /// The localizer is not sure where the robot is.
    Unsure,
    /// The driver stops the robot, although a mission is under way.
    Stopped,
}

impl ProblemKind {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::SecondPublisher,
        Self::OtherType,
        Self::NotUsed,
        Self::Silent,
        Self::Unheard,
        Self::Pressed,
        Self::Blind,
        Self::Rate,
        Self::Refused,
        Self::Awaited,
        Self::Paused,
        Self::Unsure,
        Self::Stopped,
    ];

    /// As a label of a metric has it.
    pub fn code(self) -> &'static str {
        match self {
            Self::SecondPublisher => "second_publisher",
            Self::OtherType => "other_type",
            Self::NotUsed => "not_used",
            Self::Silent => "silent",
            Self::Unheard => "unheard",
            Self::Pressed => "pressed",
            Self::Blind => "blind",
            Self::Rate => "rate",
            Self::Refused => "refused",
            Self::Awaited => "awaited",
            Self::Paused => "paused",
            Self::Unsure => "unsure",
            Self::Stopped => "stopped",
        }
    }

    /// The problem in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::SecondPublisher => "is also published by",
            Self::OtherType => "has another type elsewhere:",
            Self::NotUsed => "is not used:",
            Self::Silent => "is silent, so the robot stands:",
            Self::Unheard => "is silent, and the robot drives without:",
            Self::Pressed => "is pressed, so the robot does not drive on:",
            Self::Blind => "shows too little, so the robot stands:",
            Self::Rate => "does not come as often as limits.tick_s says:",
            Self::Refused => "is refused:",
            Self::Awaited => "is awaited:",
            Self::Paused => "is paused:",
            Self::Unsure => "is",
            Self::Stopped => "stops the robot:",
        }
    }
}

/// A problem of one topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// What kind.
    pub kind: ProblemKind,
    /// Of which topic.
    pub topic: String,
    /// What exactly.
    pub detail: String,
}

/// Bytes of a detail, as diagnostics and logs show it: with its topic it is one text of a message.
const DETAIL_MAX: usize = curionav_ros2::limits::TEXT - 300;
/// Bytes of a detail as a metric's label: together with the other labels it is the name of a sample in a status.
const LABEL_MAX: usize = 80;
/// What stands for the rest of a text that is cut.
const REST: &str = "...";

impl Problem {
    /// A problem.
    pub fn new(kind: ProblemKind, topic: impl Into<String>, detail: impl Into<String>) -> Self {
        // What a metric's label would have to escape is left out.
        let detail: String = detail.into().replace(['"', '\\'], "'").replace('\n', " ");
        Self { kind, topic: topic.into(), detail: cut(detail, DETAIL_MAX) }
    }

    /// The detail as a metric's label.
    pub fn label(&self) -> String {
        cut(self.detail.clone(), LABEL_MAX)
    }

    /// The problem of which a sample of the metric `curionav_ros2_problem` tells, by its name with labels; nothing for
    /// the sample of another metric.
    pub fn of_sample(sample: &str) -> Option<Self> {
        let labels = sample.strip_prefix("curionav_ros2_problem{")?;
        let code = label(labels, "kind")?;
        let kind = ProblemKind::ALL.into_iter().find(|kind| kind.code() == code)?;
        Some(Self { kind, topic: label(labels, "topic")?, detail: label(labels, "detail")? })
    }

    /// The problem as a sentence.
    pub fn sentence(&self) -> String {
        format!("{} {} {}", self.topic, self.kind.words(), self.detail)
    }
}

/// No more than so many bytes of a text, and a mark where it was cut.
fn cut(mut text: String, most: usize) -> String {
    if text.len() > most {
        text.truncate(text.floor_char_boundary(most - REST.len()));
        text += REST;
    }
    text
}

fn label(labels: &str, name: &str) -> Option<String> {
    let (_, after) = labels.split_once(&format!(",{name}=\""))?;
    Some(after.split_once('"')?.0.to_owned())
}

/// What was not used, or was refused, is no problem any more after so long: what goes on is said again.
const REMEMBERED: Duration = Duration::from_secs(10);

/// The problems that there are now: at most one of a kind and topic, with what exactly is wrong and since when.
#[derive(Debug, Clone, Default)]
pub struct Problems(BTreeMap<(ProblemKind, String), (String, Instant)>);

impl Problems {
    /// There is such a problem now; whether it is new.
    pub fn set(&mut self, problem: Problem) -> bool {
        let Problem { kind, topic, detail } = problem;
        let before = self.0.insert((kind, topic), (detail.clone(), Instant::now()));
        before.is_none_or(|(before, _)| before != detail)
    }

    /// There is no such problem any more.
    pub fn clear(&mut self, kind: ProblemKind, topic: &str) {
        self.0.remove(&(kind, topic.to_owned()));
    }

    /// There are no problems of these kinds but those given.
    pub fn replace(&mut self, kinds: &[ProblemKind], problems: Vec<Problem>) {
        self.0.retain(|(kind, _), _| !kinds.contains(kind));
        for problem in problems {
            self.set(problem);
        }
    }

    /// All of them.
    pub fn all(&self) -> Vec<Problem> {
        self.all_at(Instant::now())
    }

    fn all_at(&self, now: Instant) -> Vec<Problem> {
        let of_events = [ProblemKind::NotUsed, ProblemKind::Refused];
        let lasts = |kind: &ProblemKind, since: &Instant| {
            !of_events.contains(kind) || now.saturating_duration_since(*since) < REMEMBERED
        };
        let lasting = self.0.iter().filter(|((kind, _), (_, since))| lasts(kind, since));
        lasting
            .map(|((kind, topic), (detail, _))| Problem {
                kind: *kind,
                topic: topic.clone(),
                detail: detail.clone(),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_read_back_from_its_sample() {
        let problem =
            Problem::new(ProblemKind::OtherType, "/r1/cmd_vel", "/r1/base has \"Twist_\" and\\more");
        let sample = format!(
            "curionav_ros2_problem{{role=\"ros2-gateway\",name=\"a\",robot=\"r1\",kind=\"{}\",topic=\"{}\",\
             detail=\"{}\"}}",
            problem.kind.code(),
            problem.topic,
            problem.detail
        );
        assert_eq!(Problem::of_sample(&sample), Some(problem.clone()));
        assert_eq!(
            problem.sentence(),
            "/r1/cmd_vel has another type elsewhere: /r1/base has 'Twist_' and'more"
        );
        assert_eq!(Problem::of_sample("curionav_uptime_seconds{role=\"cpc\"}"), None);
    }

    #[test]
    fn a_long_detail_is_whole_in_diagnostics_and_cut_with_a_mark_in_a_label() {
        let long = "\u{e4}".repeat(200);
        let problem = Problem::new(ProblemKind::Rate, "t", long.as_str());
        assert_eq!(problem.detail, long);
        assert!(problem.label().len() <= LABEL_MAX && problem.label().ends_with("..."));
        let endless = Problem::new(ProblemKind::Rate, "t", "x".repeat(5000));
        assert!(endless.sentence().len() <= curionav_ros2::limits::TEXT && endless.detail.ends_with("..."));
        assert_eq!(Problem::new(ProblemKind::Rate, "t", "x".repeat(80)).label(), "x".repeat(80));
    }

    #[test]
    fn a_problem_is_new_once_and_can_be_over() {
        let mut problems = Problems::default();
        let problem = |detail: &str| Problem::new(ProblemKind::NotUsed, "/scan", detail);
        assert!(problems.set(problem("a")) && !problems.set(problem("a")) && problems.set(problem("b")));
        assert_eq!(problems.all(), [problem("b")]);
        problems.replace(&[ProblemKind::Silent], Vec::new());
        assert_eq!(problems.all().len(), 1);
        let later = Instant::now() + REMEMBERED;
        assert!(problems.all_at(later).is_empty(), "what was refused once is not said for ever");
        problems.clear(ProblemKind::NotUsed, "/scan");
        assert!(problems.all().is_empty());
    }
}
