//! What is wrong with a scenario, without its map, although each of its numbers lies in its range.

use curionav_planning::parameters::FieldError;

use super::{Clock, MapFile, Recorded, Scenario, WalkMode, Walker};

/// Most ticks of a run: a day at 0.1 s.
const MAX_TICKS: f64 = 864_000.0;
/// Longest name, bytes: it becomes a file name.
const MAX_NAME_BYTES: usize = 100;
/// Most people with routes, written and drawn.
const MAX_WALKERS: usize = 1000;

type Check = Result<(), FieldError>;

impl Scenario {
    /// People whom every seed draws.
    pub fn people_drawn(&self) -> usize {
        self.crowds.iter().map(|crowd| crowd.count as usize).sum()
    }

    pub(super) fn is_consistent(&self) -> Check {
        let is_plain = self.name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'));
        require(
            !self.name.is_empty() && self.name.len() <= MAX_NAME_BYTES && is_plain,
            "name",
            "is not a short plain name",
            "use 1 to 100 letters, digits, '-', '_' and '.'",
        )?;
        let people = self.walkers.len() + self.people_drawn();
        require(
            people <= MAX_WALKERS,
            "crowds",
            &format!("and walkers are {people} people"),
            &format!("have at most {MAX_WALKERS}"),
        )
    }
}

impl MapFile {
    pub(super) fn scales_a_mask(&self) -> Check {
        let scale = [("speed_base", self.speed_base), ("speed_multiplier", self.speed_multiplier)];
        let given = scale.into_iter().find(|(_, number)| number.is_some() && self.speed.is_none());
        given.map_or(Ok(()), |(field, _)| {
            require(false, field, "scales no mask", "name one in `speed`, or leave it out")
        })
    }
}

impl Clock {
    pub(super) fn has_ticks(&self) -> Check {
        let ticks = self.time_limit_s / self.tick_s;
        let mend = format!("give {} to {} s", self.tick_s, MAX_TICKS * self.tick_s);
        require((1.0..=MAX_TICKS).contains(&ticks), "time_limit_s", &format!("makes {ticks} ticks"), &mend)
    }
}

impl Walker {
    pub(super) fn leads_somewhere(&self) -> Check {
        if self.mode == WalkMode::Stand && self.route.len() == 1 {
            return require(self.start_offset == 0.0, "start_offset", "is not on the route", "leave it out");
        }
        let length = self.cycle_length();
        require(
            self.mode == WalkMode::Stand || length > 0.01,
            "route",
            "leads nowhere",
            "give two points apart from each other, or use mode = \"stand\"",
        )?;
        let problem = format!("is {}", self.start_offset);
        let mend = format!("give 0 to {length} m along the route");
        require(self.start_offset <= length, "start_offset", &problem, &mend)
    }
}

impl Recorded {
    pub(super) fn begins_in_order(&self) -> Check {
        let until = self.start_until_s.unwrap_or(self.start_s);
        let problem = format!("is before start_s, {} s", self.start_s);
        require(until >= self.start_s, "start_until_s", &problem, "give a later time, or leave it out")
    }
}

fn require(holds: bool, field: &str, problem: &str, mend: &str) -> Check {
    if holds { Ok(()) } else { Err(FieldError::new(field, problem, mend)) }
}
