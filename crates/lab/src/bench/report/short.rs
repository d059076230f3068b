//! The first lines of the report: what a reader must take home who reads nothing else.

use std::ops::Add;

use super::super::comparison::{Order, Paired};
use super::super::measure::Measure;
use super::super::row::Tally;
use super::page::{Page, SIGNIFICANT};
use crate::plural::count;
use crate::statistics::{least_p, mean};

/// A kind of scenes is named if it has more than this share of the failures, and there are so many at least.
const MOST: f64 = 0.5;
const SOME: usize = 5;

/// Sentences about the first planner against the others, and about how far they reach.
pub(super) fn sentences(page: &Page<'_>) -> Vec<String> {
    let others: Vec<usize> = page.planners().skip(1).collect();
    let all = [Some(success(page, &others)), failures(page, &others), time(page), people(page, &others)];
    all.into_iter().flatten().chain(claims(page)).chain(order(page)).chain([places(page)]).collect()
}

fn name(page: &Page<'_>, planner: usize) -> String {
    format!("`{}`", page.name(&planner))
}

/// The planner with the least or the greatest of these values, if any planner has one.
fn extreme(planners: &[usize], greatest: bool, value: impl Fn(usize) -> Option<f64>) -> Option<(usize, f64)> {
    let sign = if greatest { -1.0 } else { 1.0 };
    let values = planners.iter().filter_map(|p| Some((*p, value(*p)?)));
    values.min_by(|(_, a), (_, b)| (sign * a).total_cmp(&(sign * b)))
}

fn success(page: &Page<'_>, others: &[usize]) -> String {
    let own = page.tally(&0);
    let Tally { success, runs, .. } = own;
    let mut says = format!(
        "{} reached the goal without a collision in {success} of {} (95 %, if runs were independent: {}).",
        name(page, 0),
        count(runs, "run"),
        page.success_interval(&own)
    );
    if let Some((best, most)) = extreme(others, true, |p| Some(page.tally(&p).success as f64)) {
        let better = others.iter().filter(|p| page.tally(p).success > success).count();
        let equal = others.iter().filter(|p| page.tally(p).success == success).count();
        let tests = || others.iter().filter_map(|p| page.tests.get(&(Measure::Success, *p)));
        let shown = tests().filter(|paired| paired.p < SIGNIFICANT);
        // What Holm makes of the least p of so many places that differ.
        let could = |paired: &Paired| least_p(paired.nonzero) * (page.tests.len() as f64) < SIGNIFICANT;
        let hopeless =
            if tests().any(could) { "" } else { ", and with so few places that differ no result could be" };
        says += &format!(
            " Of the other {}, {better} did so more often and {equal} as often; the most is {most} of {}. By the paired tests \
             below, with p < {SIGNIFICANT}, it can be told from chance for {} of them{hopeless}.",
            count(others.len(), "planner"),
            name(page, best),
            shown.count()
        );
    }
    says
}

/// Where most of the first planner's failures are, how the others fared there, and what is left without these scenes.
fn failures(page: &Page<'_>, others: &[usize]) -> Option<String> {
    let kinds = page.kinds();
    let failed = |tally: &Tally| tally.runs - tally.success;
    let all = page.tally(&0);
    let (kind, worst) = kinds.iter().max_by_key(|(_, tallies)| failed(&tallies[0]))?;
    if failed(&all) < SOME || failed(&worst[0]) as f64 <= MOST * failed(&all) as f64 {
        return None;
    }
    let there = |p: usize| Some(worst[p].success as f64);
    let without = |p: usize| page.tally(&p).success - worst[p].success;
    let mut says = format!(
        "Of its {} failures, {} are in scenes of the kind {kind}, where it has {} of {}",
        failed(&all),
        failed(&worst[0]),
        worst[0].success,
        count(worst[0].runs, "run")
    );
    if let (Some((worse, least)), Some((best, most))) =
        (extreme(others, false, there), extreme(others, true, there))
    {
        says += &format!(
            " and the others {least} ({}) to {most} ({}). Without these, its worst, it has {} of {}, and {} of the others have more",
            name(page, worse),
            name(page, best),
            without(0),
            all.runs - worst[0].runs,
            others.iter().filter(|p| without(**p) > without(0)).count()
        );
    }
    Some(says + ".")
}

/// In the pairs of runs in which both arrived.
fn time(page: &Page<'_>) -> Option<String> {
    let of_time = page.tests.iter().filter(|((measure, _), _)| *measure == Measure::Time);
    let tests: Vec<(usize, &Paired)> = of_time.map(|((_, p), paired)| (*p, paired)).collect();
    let sooner = || tests.iter().filter(|(_, paired)| paired.difference < 0.0);
    let shown = sooner().filter(|(_, paired)| paired.p < SIGNIFICANT).count();
    let (fastest, most) = tests.iter().min_by(|(_, a), (_, b)| a.difference.total_cmp(&b.difference))?;
    let least = most.difference;
    let by = if least < 0.0 { format!("{:.1} s sooner", -least) } else { format!("{least:.1} s later") };
    Some(format!(
        "In pairs of runs in which both arrived, {} of the others took less time than it on the mean ({shown} with p < \
         {SIGNIFICANT}); {} arrived {by} ({}, mean over {}).",
        sooner().count(),
        name(page, *fastest),
        count(most.pairs, "pair"),
        count(most.units, most.unit.into())
    ))
}

fn people(page: &Page<'_>, others: &[usize]) -> Option<String> {
    let near = |p: usize| mean(&page.values(Measure::TdSeconds, &p));
    let own = near(0)?;
    let mut says = format!(
        "It was nearer than 1.5 m to people for {own:.1} s per run (mean of all runs, also of those that failed)"
    );
    if let Some((best, least)) = extreme(others, false, near) {
        let less = others.iter().filter(|p| near(**p).is_some_and(|time| time < own)).count();
        says += &format!(
            "; {less} of the others for less, and the least of the others is {least:.1} s ({})",
            name(page, best)
        );
    }
    Some(says + ".")
}

/// How many claims hold, measure by measure.
fn claims(page: &Page<'_>) -> Option<String> {
    let all = &page.bench.claims;
    let mut about: Vec<&str> = Vec::new();
    for judged in all {
        if !about.contains(&judged.about.as_str()) {
            about.push(&judged.about);
        }
    }
    let of = |what: &&str| {
        let those = || all.iter().filter(|judged| judged.about == **what);
        let few = those().filter(|judged| !judged.holds && judged.too_few).count();
        let beyond =
            if few == 0 { String::new() } else { format!(" ({few} beyond what so few places can show)") };
        let share = if *what == Measure::Td.label() { " of the run" } else { "" };
        let hold = those().filter(|judged| judged.holds).count();
        format!("{hold} of {} about {what}{share}{beyond}", those().count())
    };
    let each: Vec<String> = about.iter().map(of).collect();
    (!all.is_empty()).then(|| {
        let hold = page.claims_that_hold();
        format!("Of {} written down before, {hold} hold: {}.", count(all.len(), "claim"), each.join("; "))
    })
}

/// How many pairs of planners are in the paper's order, measure by measure.
fn order(page: &Page<'_>) -> Option<String> {
    let totals = page.totals();
    let all = totals.into_iter().fold(Order::default(), Order::add);
    let each =
        Measure::PAPER.iter().zip(totals).filter(|(_, order)| order.pairs > 0).map(|(measure, order)| {
            let label = measure.label().split(" (").next().unwrap_or_default();
            format!("{label} {} of {}", order.agree, order.apart())
        });
    (all.pairs > 0).then(|| {
        format!(
            "Of {} pairs of planners and measures that the paper's tables tell apart, {} have equal means here, and {} of the \
             other {} are in the paper's order; half of them would be so by chance. {}.",
            all.pairs,
            all.tied,
            all.agree,
            all.apart(),
            each.collect::<Vec<_>>().join(", ")
        )
    })
}

fn places(page: &Page<'_>) -> String {
    let places = count(page.bench.comparison.count_places(), "place");
    if page.least_p() > SIGNIFICANT {
        format!(
            "All scenes are in {places}. That is too few to show anything for other places, however many runs there are: all of this \
             holds for these places."
        )
    } else {
        format!("The scenes are in {places}, which the tests take for units.")
    }
}
