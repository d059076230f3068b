//! Every example, encoded.

use super::planning::{
    candidate_set, cut_generate_reply, cycle_report, decision, evaluate_request,
    evaluate_request_of_positions, explained_cycle_report, generate_reply, generate_request, memory, scores,
    stop, tree, tree_of_two_roots, twist,
};
use super::sentences;
use super::world::{
    inject_request, occupancy_grid, run_result, run_status, service_status, zoned_occupancy_grid,
};
use super::{
    belief, lease, lease_request, mission, no_replica, odometry, particles, pause_reply, people, readiness,
    refused_mission, scan, scene, spotty_scan, tracked_people,
};
use curionav_schemas::{
    Lease, Message, MissionCommand, MissionEnd, PauseRequest, Readiness, Refusal, Reject,
};

/// An encoded example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Golden {
    /// File name in `schemas/golden/`, without `.cbor`: the message's name, for further examples with `.` and a
    /// variant.
    pub file: &'static str,
    /// [`Message::NAME`], which is also the CDDL rule.
    pub message: &'static str,
    /// The encoded message.
    pub bytes: Vec<u8>,
}

fn golden<M: Message>(file: &'static str, message: &M) -> Golden {
    Golden { file, message: M::NAME, bytes: message.encode() }
}

/// Every example.
pub fn all() -> Vec<Golden> {
    vec![
        golden("scan", &scan()),
        golden("scan.spotty", &spotty_scan()),
        golden("odometry", &odometry()),
        golden("people", &people()),
        golden("people.tracked", &tracked_people()),
        golden("belief", &belief()),
        golden("particles", &particles()),
        golden("scene", &scene()),
        golden("mission", &mission()),
        golden("mission.refused", &refused_mission()),
        golden("mission_command", &MissionCommand::Set { order: Box::new(mission().order) }),
        golden("mission_command.goal", &MissionCommand::Goal { x: -1.5, y: 2.25, heading: None, way: None }),
        golden(
            "mission_command.goal_along",
            &MissionCommand::Goal {
                x: 3.0,
                y: 2.0,
                heading: Some(0.5),
                way: Some(vec![0.0, 0.0, 1.5, 1.0, 3.0, 2.0].into()),
            },
        ),
        golden("mission_command.cancel", &MissionCommand::Cancel),
        golden("mission_command.finish", &MissionCommand::Finish { revision: 3, end: MissionEnd::Reached }),
        golden("readiness", &readiness()),
        golden("readiness.refused", &Readiness { refused: Some(no_replica()), ..readiness() }),
        golden("lease", &lease()),
        golden("lease.free", &Lease { lease: 0, holder: None, wanted_by: None, paused: false }),
        golden("lease_request", &lease_request()),
        golden("pause_request", &PauseRequest { paused: true }),
        golden("pause_reply", &pause_reply()),
        golden("decision", &decision()),
        golden("decision.stop", &stop()),
        golden("twist", &twist()),
        golden("candidate_set", &candidate_set()),
        golden("tree", &tree()),
        golden("tree.two_roots", &tree_of_two_roots()),
        golden("generate_request", &generate_request()),
        golden("generate_reply", &generate_reply()),
        golden("generate_reply.cut", &cut_generate_reply()),
        golden("evaluate_request", &evaluate_request()),
        golden("evaluate_request.positions", &evaluate_request_of_positions()),
        golden("scores", &scores()),
        golden("cycle_report", &cycle_report()),
        golden("cycle_report.explained", &explained_cycle_report()),
        golden("memory", &memory()),
        golden("occupancy_grid", &occupancy_grid()),
        golden("occupancy_grid.zones", &zoned_occupancy_grid()),
        golden("inject_request", &inject_request()),
        golden("run_status", &run_status()),
        golden("run_result", &run_result()),
        golden("service_status", &service_status()),
        golden("reject", &Refusal::WrongLength { found: 3, expected: 2 }.at("scene.people.x")),
        golden::<Reject>("reject.overloaded", &Refusal::Overloaded.into()),
    ]
}

/// The content of `schemas/golden/`: every example, the index that names the CDDL rule of each, and the sentences.
pub fn files() -> Vec<(String, Vec<u8>)> {
    let mut index = String::from("# file, CDDL rule\n");
    let mut files = Vec::new();
    for golden in all() {
        let name = format!("{}.cbor", golden.file);
        index.push_str(&format!("{name} {}\n", golden.message));
        files.push((name, golden.bytes));
    }
    files.push(("index.txt".to_owned(), index.into_bytes()));
    files.push(("sentences.cbor".to_owned(), sentences::encoded()));
    files
}
