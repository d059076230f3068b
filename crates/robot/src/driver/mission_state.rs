//! What the robot is to do: the mission, and how commands and reports of readiness change it. It lives in the driver,
//! the one service without which nothing moves, so that pausing works whatever else has failed.

use curionav_mission::convert;
use curionav_mission::robot_limits::Base;
use curionav_schemas::{
    Mission, MissionCommand, MissionEnd, MissionOrder, MissionState, Readiness, Refusal, Reject,
};

/// Holds the mission and its revision; every change is a new value to publish.
#[derive(Debug)]
pub struct CurrentMission {
    /// Bounds what may be ordered.
    base: Base,
    mission: Option<Mission>,
    /// Number of the next run: unlike any run of a driver that was here before.
    next_run: u64,
    /// The grant of the base under which this driver drives; 0 without one.
    lease: u64,
    /// Asked to pause and not to resume since: nothing else changes that.
    paused: bool,
}

impl CurrentMission {
    /// No mission yet, of a robot with this base. `first_run` must differ from every run number used before on this
    /// robot, for services that have outlived an earlier driver: milliseconds of the wall clock will do.
    pub fn new(base: Base, first_run: u64) -> Self {
        Self { base, mission: None, next_run: first_run, lease: 0, paused: false }
    }

    /// The mission as it stands.
    pub fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref()
    }

    /// Under which grant of the base it drives, and whether it is paused.
    pub fn standing(&self) -> (u64, bool) {
        (self.lease, self.paused)
    }

    /// The base has granted a lease, or taken it back: 0.
    pub fn set_lease(&mut self, lease: u64) {
        self.lease = lease;
        if let Some(mission) = &mut self.mission {
            mission.lease = lease;
        }
    }

    /// Begins a pause or ends it, in whatever state the mission is, and if there is none.
    pub fn pause(&mut self, paused: bool) {
        self.paused = paused;
        let Some(mission) = &mut self.mission else { return };
        mission.state = match (mission.state, paused) {
            (MissionState::Running, true) => MissionState::Paused,
            (MissionState::Paused, false) => MissionState::Running,
            (state, _) => state,
        };
    }

    /// Applies a command; answers with the mission as it then stands. Without a lease every command is refused.
    pub fn command(&mut self, command: MissionCommand) -> Result<Mission, Reject> {
        if self.lease == 0 {
            return Err(Refusal::NoLease.into());
        }
        match command {
            MissionCommand::Set { order } => {
                convert::check_order(&order)?;
                self.base.check_order(&order)?;
                self.set(*order);
            }
            MissionCommand::Goal { x, y, heading, way } => {
                let mission = self.current()?;
                // A planner outside gives a new way each second: the robot goes on along the one before meanwhile.
                let goes_on = mission.order.way.is_some() && way.is_some() && !mission.is_over();
                mission.revision += 1;
                mission.order.way = way;
                mission.order.goal_x = x;
                mission.order.goal_y = y;
                mission.order.goal_heading = heading;
                if !goes_on {
                    mission.state = MissionState::Preparing;
                }
                mission.end = None;
                mission.ready.clear();
            }
            MissionCommand::Cancel => {
                let mission = self.current()?;
                if mission.state == MissionState::Finished {
                    return Err(Refusal::AlreadyFinished.into());
                }
                mission.state = MissionState::Cancelled;
                mission.end = Some(MissionEnd::Cancelled);
            }
            MissionCommand::Finish { revision, end } => finish(self.of_revision(revision)?, end),
        }
        self.current().cloned()
    }

    /// Takes note of what has become of a service's preparing; answers with the mission as it then stands.
    pub fn readiness(&mut self, readiness: Readiness) -> Result<Mission, Reject> {
        let Readiness { role, instance, revision, refused } = readiness;
        let paused = self.paused;
        let mission = self.of_revision(revision)?;
        if mission.is_over() {
            return Ok(mission.clone());
        }
        // A role that the mission does not require can neither begin it nor end it.
        let required = mission.order.require.contains(&role);
        if let Some(reject) = refused.filter(|_| required) {
            finish(mission, MissionEnd::Unprepared { role, instance, reject });
            return Ok(mission.clone());
        }
        if required && !mission.ready.contains(&role) {
            mission.ready.push(role);
            mission.ready.sort();
        }
        let all_ready = mission.order.require.iter().all(|r| mission.ready.contains(r));
        if mission.state == MissionState::Preparing && all_ready {
            mission.has_run = true;
            mission.state = if paused { MissionState::Paused } else { MissionState::Running };
        }
        Ok(mission.clone())
    }

    fn set(&mut self, order: MissionOrder) {
        self.mission = Some(Mission {
            lease: self.lease,
            run: self.next_run,
            revision: self.mission.as_ref().map_or(1, |m| m.revision + 1),
            order,
            ready: Vec::new(),
            state: MissionState::Preparing,
            has_run: false,
            end: None,
        });
        self.next_run += 1;
    }

    fn current(&mut self) -> Result<&mut Mission, Reject> {
        self.mission.as_mut().ok_or_else(|| Refusal::NoMission.into())
    }

    fn of_revision(&mut self, revision: u64) -> Result<&mut Mission, Reject> {
        let mission = self.current()?;
        if mission.revision == revision {
            return Ok(mission);
        }
        Err(Refusal::StaleRevision { found: revision, current: mission.revision }.into())
    }
}

fn finish(mission: &mut Mission, end: MissionEnd) {
    mission.state = MissionState::Finished;
    mission.end = Some(end);
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn current() -> CurrentMission {
        let mut current = CurrentMission::new(Base::Simulated, 7);
        current.set_lease(17);
        let mut order = golden::mission().order;
        order.require = vec!["arbiter".into(), "localizer".into()];
        current.command(MissionCommand::Set { order: Box::new(order) }).unwrap();
        current
    }

    fn ready(role: &str, revision: u64) -> Readiness {
        Readiness { role: role.into(), instance: "a".into(), revision, refused: None }
    }

    #[test]
    fn it_runs_once_every_required_role_is_ready_for_this_revision() {
        let mut current = current();
        assert_eq!(current.readiness(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert!(current.readiness(ready("localizer", 7)).is_err());
        assert_eq!(current.readiness(ready("arbiter", 1)).unwrap().state, MissionState::Preparing);
        assert_eq!(current.readiness(ready("localizer", 1)).unwrap().state, MissionState::Running);
    }

    #[test]
    fn a_robot_on_a_way_goes_on_while_it_prepares_for_another() {
        let along = |x: f64| MissionCommand::Goal {
            x,
            y: 0.0,
            heading: None,
            way: Some(vec![0.0, 0.0, x, 0.0].into()),
        };
        let mut current = current();
        both_ready(&mut current, 1);
        assert_eq!(current.command(along(3.0)).unwrap().state, MissionState::Preparing, "it was on no way");
        both_ready(&mut current, 2);
        let mission = current.command(along(4.0)).unwrap();
        assert_eq!((mission.revision, mission.state, mission.ready.len()), (3, MissionState::Running, 0));
        let elsewhere = MissionCommand::Goal { x: 1.0, y: 1.0, heading: None, way: None };
        assert_eq!(current.command(elsewhere).unwrap().state, MissionState::Preparing);
    }

    #[test]
    fn a_new_goal_is_a_new_revision_to_prepare_for() {
        let mut current = current();
        current.readiness(ready("arbiter", 1)).unwrap();
        current.readiness(ready("localizer", 1)).unwrap();
        let mission =
            current.command(MissionCommand::Goal { x: 3.0, y: 4.0, heading: None, way: None }).unwrap();
        assert_eq!((mission.revision, mission.state, mission.ready.len()), (2, MissionState::Preparing, 0));
    }

    fn both_ready(current: &mut CurrentMission, revision: u64) -> MissionState {
        current.readiness(ready("arbiter", revision)).unwrap();
        current.readiness(ready("localizer", revision)).unwrap().state
    }

    #[test]
    fn pausing_is_undone_by_resuming_and_by_nothing_else() {
        // Whenever it is paused: before there is a mission, while it prepares, and while it runs.
        for paused_at in 0..3 {
            let mut current = CurrentMission::new(Base::Simulated, 7);
            current.set_lease(17);
            let pause_at = |now: usize, current: &mut CurrentMission| {
                if now == paused_at {
                    current.pause(true);
                }
            };
            let mut order = golden::mission().order;
            order.require = vec!["arbiter".into(), "localizer".into()];
            let set = MissionCommand::Set { order: Box::new(order) };
            pause_at(0, &mut current);
            current.command(set.clone()).unwrap();
            pause_at(1, &mut current);
            both_ready(&mut current, 1);
            pause_at(2, &mut current);
            assert_eq!(current.mission().unwrap().state, MissionState::Paused, "paused at {paused_at}");
            current.command(MissionCommand::Goal { x: 1.0, y: 1.0, heading: None, way: None }).unwrap();
            assert_eq!(both_ready(&mut current, 2), MissionState::Paused, "a new goal");
            current.command(MissionCommand::Cancel).unwrap();
            current.command(set).unwrap();
            assert_eq!(both_ready(&mut current, 3), MissionState::Paused, "a new order");
            current.set_lease(18);
            assert_eq!(current.standing(), (18, true), "a new lease");
            current.pause(false);
            assert_eq!(current.mission().unwrap().state, MissionState::Running);
        }
    }

    #[test]
    fn what_is_over_or_prepares_is_not_begun_by_resuming() {
        let mut current = current();
        current.pause(false);
        assert_eq!(current.mission().unwrap().state, MissionState::Preparing);
        current.command(MissionCommand::Cancel).unwrap();
        current.pause(true);
        current.pause(false);
        assert_eq!(current.mission().unwrap().state, MissionState::Cancelled);
    }

    #[test]
    fn without_a_lease_no_command_is_taken() {
        let mut current = current();
        current.set_lease(0);
        assert_eq!(current.command(MissionCommand::Cancel).unwrap_err().why, Refusal::NoLease);
        assert_eq!(current.mission().unwrap().lease, 0);
    }

    #[test]
    fn a_role_that_can_never_be_ready_ends_the_mission_and_says_why() {
        let mut current = current();
        let refused = Refusal::PoseLost.at("localizer");
        let (role, instance) = ("localizer".to_owned(), "a".to_owned());
        let mission =
            current.readiness(Readiness { refused: Some(refused.clone()), ..ready(&role, 1) }).unwrap();
        let end = MissionEnd::Unprepared { role, instance, reject: refused };
        assert_eq!((mission.state, mission.end), (MissionState::Finished, Some(end)));
        assert_eq!(current.command(MissionCommand::Cancel).unwrap_err().why, Refusal::AlreadyFinished);
        let anew =
            current.command(MissionCommand::Goal { x: 3.0, y: 4.0, heading: None, way: None }).unwrap();
        assert_eq!((anew.state, anew.end), (MissionState::Preparing, None));
    }

    #[test]
    fn a_role_that_is_not_required_ends_nothing() {
        let mut current = current();
        let refused = Some(Refusal::PoseLost.into());
        let mission = current.readiness(Readiness { refused, ..ready("viewer", 1) }).unwrap();
        assert_eq!((mission.state, mission.end), (MissionState::Preparing, None));
    }

    #[test]
    fn what_is_over_stays_as_it_ended() {
        let mut current = current();
        let cancelled = current.command(MissionCommand::Cancel).unwrap();
        for refused in [None, Some(Refusal::PoseLost.into())] {
            let mission = current.readiness(Readiness { refused, ..ready("arbiter", 1) }).unwrap();
            assert_eq!(mission, cancelled);
        }
    }
}
