//! Every program tries everything with every key, against one router with the access rules of a deployment: it may do
//! what the table of rights says, and nothing else. Programs without a certificate of the deployment do not get in at
//! all.

mod actor;
mod cells;
mod site;
mod without_rights;

use std::collections::BTreeSet;

use curionav_security::name::Name;
use curionav_security::rules::Rules;
use serde_json::Value;

use actor::Actor;
use cells::{Cells, Deed, expected};
use site::Site;

/// How often what is allowed is tried again.
const TRIES: usize = 5;

#[test]
fn every_name_may_do_what_the_table_says_and_nothing_else() {
    let site = Site::new();
    let cells = Cells::new(&site.names);
    let router = site.router(&site.rules());
    let mut tried = 0;
    for name in &site.names {
        let actor = Actor::join(&router, &site.client(name));
        for deed in Deed::ALL {
            let right: BTreeSet<usize> =
                (0..cells.keys.len()).filter(|&key| expected(name, deed, &cells.keys[key])).collect();
            let mut done = actor.try_all(deed, &cells);
            // What is allowed may come after the answer that ends the wait, which has another priority. What is
            // forbidden must come in no try.
            for _ in 0..TRIES {
                if right.is_subset(&done) {
                    break;
                }
                done.extend(actor.try_all(deed, &cells));
            }
            let keys =
                |some: BTreeSet<usize>| some.into_iter().map(|key| &cells.keys[key]).collect::<Vec<_>>();
            let (missing, forbidden) = (keys(&right - &done), keys(&done - &right));
            assert!(missing.is_empty(), "{name} may {deed:?} {missing:?}, and could not");
            assert!(forbidden.is_empty(), "{name} may not {deed:?} {forbidden:?}, and could");
            tried += cells.keys.len();
        }
    }
    println!(
        "{tried} cells: {} names, {} deeds, {} keys",
        site.names.len(),
        Deed::ALL.len(),
        cells.keys.len()
    );
    assert!(tried > 4000);
}

#[test]
fn without_any_one_rule_something_is_denied_that_should_not_be() {
    let site = Site::new();
    let cells = Cells::new(&site.names);
    let whole = site.rules();
    // Names do not share rules: one router can lack a rule of each.
    let of_name = |name: &Name| -> Vec<String> {
        let text = name.to_string();
        whole
            .rules
            .iter()
            .map(|rule| rule.id.clone())
            .filter(|id| id.split(' ').next() == Some(&text))
            .collect()
    };
    let most = site.names.iter().map(|name| of_name(name).len()).max().unwrap();
    let mut left_out = 0;
    for round in 0..most {
        let lacking: Vec<(&Name, String)> = site
            .names
            .iter()
            .filter_map(|name| Some((name, of_name(name).into_iter().nth(round)?)))
            .collect();
        let router = site.router(&without(&whole, &lacking));
        for (name, rule) in &lacking {
            let actor = Actor::join(&router, &site.client(name));
            let is_noticed = |deed: &Deed| {
                let allowed = cells.only(|key| expected(name, *deed, key));
                actor.try_all(*deed, &allowed).len() < allowed.keys.len()
            };
            assert!(Deed::ALL.iter().any(is_noticed), "nothing is denied without the rule `{rule}`");
            left_out += 1;
        }
    }
    println!("{left_out} rules left out, one at a time");
    assert_eq!(left_out, whole.rules.len());
}

/// The rules without these.
fn without(rules: &Rules, lacking: &[(&Name, String)]) -> Rules {
    let mut left = serde_json::to_value(rules).unwrap();
    let is_left = |id: &Value| !lacking.iter().any(|(_, rule)| id == rule);
    left["rules"].as_array_mut().unwrap().retain(|rule| is_left(&rule["id"]));
    let policies = left["policies"].as_array_mut().unwrap();
    policies.iter_mut().for_each(|policy| policy["rules"].as_array_mut().unwrap().retain(is_left));
    // Zenoh takes no policy without rules.
    policies.retain(|policy| !policy["rules"].as_array().unwrap().is_empty());
    serde_json::from_value(left).unwrap()
}
