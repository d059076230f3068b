//! The mission desk: the robot's side of what to do. It lives in the driver, the one service without
//! which nothing moves, so that pausing works whatever else has failed.

use curionav_schemas::{Mission, MissionRequest, MissionState, Reject, RejectCode};

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

    /// Applies a request; answers with the mission as it then stands.
    pub fn handle(&mut self, request: MissionRequest) -> Result<Mission, Reject> {
        match request {
            MissionRequest::Set { mission } => Ok(self.set(*mission)),
            MissionRequest::Ready { role, instance: _, revision } => self.ready(&role, revision),
            MissionRequest::Goal { x, y, heading } => self.revise(|m| {
                (m.goal_x, m.goal_y, m.goal_heading) = (x, y, heading);
                prepare(m);
            }),
            MissionRequest::Pause => {
                let mission = self.transition(MissionState::Running, MissionState::Paused)?;
                self.paused = true;
                Ok(mission)
            }
            MissionRequest::Resume => {
                let mission = self.transition(MissionState::Paused, MissionState::Running)?;
                self.paused = false;
                Ok(mission)
            }
            MissionRequest::Cancel => {
                let state = self.current()?.state;
                if state == MissionState::Finished {
                    return Err(Reject::new(
                        RejectCode::Invalid,
                        "the mission is finished: there is nothing to cancel",
                    ));
                }
                self.update(|m| m.state = MissionState::Cancelled)
            }
            MissionRequest::Finish { revision, reason } => {
                let mission = self.current()?;
                if mission.revision != revision {
                    return Err(stale(revision, mission.revision));
                }
                self.update(|m| {
                    m.state = MissionState::Finished;
                    m.note = reason;
                })
            }
        }
    }

    fn set(&mut self, mut mission: Mission) -> Mission {
        mission.run = self.next_run;
        mission.revision = self.mission.as_ref().map_or(1, |m| m.revision + 1);
        self.next_run += 1;
        self.paused = false;
        mission.has_run = false;
        prepare(&mut mission);
        self.mission = Some(mission.clone());
        mission
    }

    fn ready(&mut self, role: &str, revision: u64) -> Result<Mission, Reject> {
        let mission = self.current()?;
        if mission.revision != revision {
            return Err(stale(revision, mission.revision));
        }
        let paused = self.paused;
        self.update(|m| {
            if m.require.iter().any(|r| r == role) && !m.ready.iter().any(|r| r == role) {
                m.ready.push(role.to_owned());
                m.ready.sort();
            }
            if m.state == MissionState::Preparing && m.require.iter().all(|r| m.ready.contains(r)) {
                m.has_run = true;
                m.state = if paused { MissionState::Paused } else { MissionState::Running };
            }
        })
    }

    fn current(&mut self) -> Result<&mut Mission, Reject> {
        self.mission.as_mut().ok_or_else(|| Reject::new(RejectCode::Unknown, "the robot has no mission yet"))
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
            let reason = format!("the mission is {state}, not {from}");
            return Err(Reject::new(RejectCode::Invalid, &reason));
        }
        self.update(|m| m.state = to)
    }
}

fn prepare(mission: &mut Mission) {
    mission.state = MissionState::Preparing;
    mission.ready.clear();
    mission.note.clear();
}

fn stale(asked: u64, current: u64) -> Reject {
    Reject::new(RejectCode::Invalid, format!("revision {asked} is not the current one, {current}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::golden;

    fn desk() -> Desk {
        let mut desk = Desk::new(7);
        let mut mission = golden::mission();
        mission.require = vec!["arbiter".into(), "localizer".into()];
        desk.handle(MissionRequest::Set { mission: Box::new(mission) }).unwrap();
        desk
    }

    fn ready(role: &str, revision: u64) -> MissionRequest {
        MissionRequest::Ready { role: role.into(), instance: "a".into(), revision }
    }

    #[test]
    fn it_runs_once_every_required_role_is_ready_for_this_revision() {
        let mut desk = desk();
        assert_eq!(desk.handle(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert!(desk.handle(ready("localizer", 7)).is_err());
        assert_eq!(desk.handle(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert_eq!(desk.handle(ready("localizer", 1)).unwrap().state, MissionState::Running);
    }

    #[test]
    fn a_new_goal_is_a_new_revision_to_prepare_for() {
        let mut desk = desk();
        desk.handle(ready("arbiter", 1)).unwrap();
        desk.handle(ready("localizer", 1)).unwrap();
        let mission = desk.handle(MissionRequest::Goal { x: 3.0, y: 4.0, heading: None }).unwrap();
        assert_eq!((mission.revision, mission.state, mission.ready.len()), (2, MissionState::Preparing, 0));
    }

    #[test]
    fn pausing_is_undone_by_resuming_and_by_nothing_else() {
        let mut desk = desk();
        assert!(desk.handle(MissionRequest::Pause).is_err());
        desk.handle(ready("arbiter", 1)).unwrap();
        desk.handle(ready("localizer", 1)).unwrap();
        assert_eq!(desk.handle(MissionRequest::Pause).unwrap().state, MissionState::Paused);
        assert_eq!(desk.handle(ready("arbiter", 1)).unwrap().state, MissionState::Paused);
        assert_eq!(desk.handle(MissionRequest::Resume).unwrap().state, MissionState::Running);
    }

    #[test]
    fn a_new_goal_leaves_a_paused_robot_paused() {
        let mut desk = desk();
        desk.handle(ready("arbiter", 1)).unwrap();
        desk.handle(ready("localizer", 1)).unwrap();
        desk.handle(MissionRequest::Pause).unwrap();
        desk.handle(MissionRequest::Goal { x: 1.0, y: 1.0, heading: None }).unwrap();
        desk.handle(ready("arbiter", 2)).unwrap();
        assert_eq!(desk.handle(ready("localizer", 2)).unwrap().state, MissionState::Paused);
    }

    #[test]
    fn without_a_mission_there_is_nothing_to_pause() {
        assert!(Desk::new(1).handle(MissionRequest::Pause).is_err());
    }
}
