//! The mission desk: the robot's side of what to do. It lives in the driver, the one service without
//! which nothing moves, so that pausing works whatever else has failed.

use curionav_runtime::convert;
use curionav_schemas::{
    Mission, MissionCommand, MissionEnd, MissionOrder, MissionState, Readiness, Refusal, Reject,
};

/// Holds the mission and its revision; every change is a new value to publish.
#[derive(Debug)]
pub struct Desk {
    mission: Option<Mission>,
    /// Number of the next run: unlike any run of a driver that was here before.
    next_run: u64,
    /// Asked to pause and not to resume since: a new goal does not change that.
    paused: bool,
}

impl Desk {
    /// No mission yet. `first_run` must differ from every run number used before on this robot, for
    /// services that have outlived an earlier driver: milliseconds of the wall clock will do.
    pub fn new(first_run: u64) -> Self {
        Self { mission: None, next_run: first_run, paused: false }
    }

    /// The mission as it stands.
    pub fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref()
    }

    /// Applies a command; answers with the mission as it then stands.
    pub fn command(&mut self, command: MissionCommand) -> Result<Mission, Reject> {
        match command {
            MissionCommand::Set { order } => {
                convert::check_order(&order)?;
                Ok(self.set(*order))
            }
            MissionCommand::Goal { x, y, heading } => self.revise(|m| {
                (m.order.goal_x, m.order.goal_y, m.order.goal_heading) = (x, y, heading);
                prepare(m);
            }),
            MissionCommand::Pause => {
                let mission = self.transition(MissionState::Running, MissionState::Paused)?;
                self.paused = true;
                Ok(mission)
            }
            MissionCommand::Resume => {
                let mission = self.transition(MissionState::Paused, MissionState::Running)?;
                self.paused = false;
                Ok(mission)
            }
            MissionCommand::Cancel => {
                if self.current()?.state == MissionState::Finished {
                    return Err(Refusal::AlreadyFinished.into());
                }
                self.update(|m| (m.state, m.end) = (MissionState::Cancelled, Some(MissionEnd::Cancelled)))
            }
            MissionCommand::Finish { revision, end } => self.finish(revision, end),
        }
    }

    /// Takes note of what has become of a service's preparing; answers with the mission as it then stands.
    pub fn readiness(&mut self, readiness: Readiness) -> Result<Mission, Reject> {
        let Readiness { role, instance, revision, refused } = readiness;
        self.of_revision(revision)?;
        // A role that the mission does not require can neither begin it nor end it.
        if let Some(reject) = refused.filter(|_| self.requires(&role)) {
            return self.finish(revision, MissionEnd::Unprepared { role, instance, reject });
        }
        let paused = self.paused;
        self.update(|m| {
            if m.order.require.contains(&role) && !m.ready.contains(&role) {
                m.ready.push(role);
                m.ready.sort();
            }
            if m.state == MissionState::Preparing && m.order.require.iter().all(|r| m.ready.contains(r)) {
                m.has_run = true;
                m.state = if paused { MissionState::Paused } else { MissionState::Running };
            }
        })
    }

    fn set(&mut self, order: MissionOrder) -> Mission {
        let mut mission = Mission {
            run: self.next_run,
            revision: self.mission.as_ref().map_or(1, |m| m.revision + 1),
            order,
            ready: Vec::new(),
            state: MissionState::Preparing,
            has_run: false,
            end: None,
        };
        prepare(&mut mission);
        self.next_run += 1;
        self.paused = false;
        self.mission = Some(mission.clone());
        mission
    }

    fn finish(&mut self, revision: u64, end: MissionEnd) -> Result<Mission, Reject> {
        self.of_revision(revision)?;
        self.update(|m| (m.state, m.end) = (MissionState::Finished, Some(end)))
    }

    fn requires(&self, role: &str) -> bool {
        self.mission.as_ref().is_some_and(|m| m.order.require.iter().any(|required| required == role))
    }

    fn of_revision(&mut self, revision: u64) -> Result<(), Reject> {
        match self.current()?.revision {
            current if current == revision => Ok(()),
            current => Err(Refusal::StaleRevision { found: revision, current }.into()),
        }
    }

    fn current(&mut self) -> Result<&mut Mission, Reject> {
        self.mission.as_mut().ok_or_else(|| Refusal::NoMission.into())
    }

    fn update(&mut self, change: impl FnOnce(&mut Mission)) -> Result<Mission, Reject> {
        let mission = self.current()?;
        change(mission);
        Ok(mission.clone())
    }

    fn revise(&mut self, change: impl FnOnce(&mut Mission)) -> Result<Mission, Reject> {
        self.update(|m| {
            m.revision += 1;
            change(m);
        })
    }

    fn transition(&mut self, from: MissionState, to: MissionState) -> Result<Mission, Reject> {
        let state = self.current()?.state;
        if state != from && state != to {
            return Err(Refusal::WrongState { found: state, needed: from }.into());
        }
        self.update(|m| m.state = to)
    }
}

fn prepare(mission: &mut Mission) {
    mission.state = MissionState::Preparing;
    mission.ready.clear();
    mission.end = None;
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn desk() -> Desk {
        let mut desk = Desk::new(7);
        let mut order = golden::mission().order;
        order.require = vec!["arbiter".into(), "localizer".into()];
        desk.command(MissionCommand::Set { order: Box::new(order) }).unwrap();
        desk
    }

    fn ready(role: &str, revision: u64) -> Readiness {
        Readiness { role: role.into(), instance: "a".into(), revision, refused: None }
    }

    #[test]
    fn it_runs_once_every_required_role_is_ready_for_this_revision() {
        let mut desk = desk();
        assert_eq!(desk.readiness(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert!(desk.readiness(ready("localizer", 7)).is_err());
        assert_eq!(desk.readiness(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert_eq!(desk.readiness(ready("localizer", 1)).unwrap().state, MissionState::Running);
    }

    #[test]
    fn a_new_goal_is_a_new_revision_to_prepare_for() {
        let mut desk = desk();
        desk.readiness(ready("arbiter", 1)).unwrap();
        desk.readiness(ready("localizer", 1)).unwrap();
        let mission = desk.command(MissionCommand::Goal { x: 3.0, y: 4.0, heading: None }).unwrap();
        assert_eq!((mission.revision, mission.state, mission.ready.len()), (2, MissionState::Preparing, 0));
    }

    #[test]
    fn pausing_is_undone_by_resuming_and_by_nothing_else() {
        let mut desk = desk();
        assert!(desk.command(MissionCommand::Pause).is_err());
        desk.readiness(ready("arbiter", 1)).unwrap();
        desk.readiness(ready("localizer", 1)).unwrap();
        assert_eq!(desk.command(MissionCommand::Pause).unwrap().state, MissionState::Paused);
        assert_eq!(desk.readiness(ready("arbiter", 1)).unwrap().state, MissionState::Paused);
        assert_eq!(desk.command(MissionCommand::Resume).unwrap().state, MissionState::Running);
    }

    #[test]
    fn a_new_goal_leaves_a_paused_robot_paused() {
        let mut desk = desk();
        desk.readiness(ready("arbiter", 1)).unwrap();
        desk.readiness(ready("localizer", 1)).unwrap();
        desk.command(MissionCommand::Pause).unwrap();
        desk.command(MissionCommand::Goal { x: 1.0, y: 1.0, heading: None }).unwrap();
        desk.readiness(ready("arbiter", 2)).unwrap();
        assert_eq!(desk.readiness(ready("localizer", 2)).unwrap().state, MissionState::Paused);
    }

    #[test]
    fn a_role_that_can_never_be_ready_ends_the_mission_and_says_why() {
        let mut desk = desk();
        let refused = Refusal::PoseLost.at("localizer");
        let (role, instance) = ("localizer".to_owned(), "a".to_owned());
        let mission =
            desk.readiness(Readiness { refused: Some(refused.clone()), ..ready(&role, 1) }).unwrap();
        let end = MissionEnd::Unprepared { role, instance, reject: refused };
        assert_eq!((mission.state, mission.end), (MissionState::Finished, Some(end)));
        assert_eq!(desk.command(MissionCommand::Cancel).unwrap_err().why, Refusal::AlreadyFinished);
        let anew = desk.command(MissionCommand::Goal { x: 3.0, y: 4.0, heading: None }).unwrap();
        assert_eq!((anew.state, anew.end), (MissionState::Preparing, None));
    }

    #[test]
    fn a_role_that_is_not_required_ends_nothing() {
        let mut desk = desk();
        let refused = Some(Refusal::PoseLost.into());
        let mission = desk.readiness(Readiness { refused, ..ready("viewer", 1) }).unwrap();
        assert_eq!((mission.state, mission.end), (MissionState::Preparing, None));
    }

    #[test]
    fn without_a_mission_there_is_nothing_to_pause() {
        assert!(Desk::new(1).command(MissionCommand::Pause).is_err());
    }
}
