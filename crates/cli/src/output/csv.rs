//! The trace and the planning cycles as CSV (RFC 4180), for spreadsheets and notebooks.

use curionav_deployment::csv_row::csv_row;
use curionav_schemas::{CycleReport, RunResult, Timings, words};

/// Columns of `cycles.csv`; the time of a term is empty where its condition did not hold.
const CYCLE_COLUMNS: &str = "tick,stamp_s,epoch,seq,action,reason,candidate,candidates,uncertainty,uncertain,degraded,\
                             generate_us,evaluate_cpc_us,evaluate_cnc_us,arbitrate_us,total_us,crowds\n";

/// The trace: its columns, a line per row, every number in the shortest form that reads back as the same number.
pub(super) fn trajectory(result: &RunResult) -> String {
    let trace = &result.trace;
    let mut text = csv_row(trace.columns.iter().map(String::as_str));
    for values in trace.values.chunks(trace.columns.len().max(1)) {
        text += &csv_row(values.iter().map(f64::to_string));
    }
    text
}

pub(super) fn cycles(reports: &[CycleReport]) -> String {
    CYCLE_COLUMNS.to_owned() + &reports.iter().map(|report| csv_row(cycle(report))).collect::<String>()
}

fn cycle(report: &CycleReport) -> [String; 17] {
    let CycleReport { decision, timings, .. } = report;
    [
        decision.tick.to_string(),
        decision.stamp.to_string(),
        report.epoch.to_string(),
        report.seq.to_string(),
        words::say("action", &decision.action),
        words::say("reason", &decision.reason),
        decision.candidate.map_or_else(String::new, |id| id.to_string()),
        report.candidates.count.to_string(),
        decision.uncertainty.to_string(),
        decision.uncertain.to_string(),
        words::say_all("degradation", &decision.degraded),
        timings.generate_us.to_string(),
        term_us(timings, "cpc"),
        term_us(timings, "cnc"),
        timings.arbitrate_us.to_string(),
        timings.total_us.to_string(),
        report.crowds.len().to_string(),
    ]
}

fn term_us(timings: &Timings, term: &str) -> String {
    let time = timings.evaluate_us.iter().find(|time| time.term == term);
    time.map_or_else(String::new, |time| time.us.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_trajectory_has_a_header_and_one_row_per_tick_with_every_bit() {
        let mut result = golden::run_result();
        result.trace.values.0[1] = 0.1 + 0.2;
        let text = trajectory(&result);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], result.trace.columns.join(","));
        assert_eq!(lines.len(), 1 + result.trace.rows as usize);
        let read: Vec<f64> = lines[1..]
            .iter()
            .flat_map(|line| line.split(','))
            .map(|number| number.parse().unwrap())
            .collect();
        assert_eq!(read, result.trace.values.0);
    }

    #[test]
    fn every_cycle_is_one_row_of_as_many_fields_as_the_header() {
        let mut report = golden::cycle_report();
        report.decision.degraded.push(curionav_schemas::Degradation::CutShort);
        let text = cycles(&[report.clone(), report]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert_eq!(lines[1], lines[2]);
        assert_eq!(
            lines[1],
            "42,4.2,2,14,follow,least cost,9,2,0.09,true,`cpc` was evaluated by the arbiter; a tree was cut short by the \
             budget,5900,2100,1400,310,12345,1"
        );
        for line in lines {
            assert_eq!(line.split(',').count(), CYCLE_COLUMNS.split(',').count());
        }
    }
}
