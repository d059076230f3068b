//! What filmed pedestrians say of the planner's reading of a crowd: which people belong together.
//!
//! The films are the four of ETH and UCY whose authors also say who walks together (`groups.txt`). The linkage of
//! `curionav` was chosen on the two of ETH and on synthetic crowds, never on those of UCY, which the suite `recorded`
//! uses.

use std::collections::BTreeMap;
use std::fs;

use curionav_crowdsim::Recording;
use curionav_crowdsim::scenario::RecordingFormat;
use curionav_planning::crowd_cluster::{GroupParams, crowd_clusters};
use curionav_planning::profile::Profile;
use curionav_planning::scene::People;
use curionav_testing::downloaded_data;

/// A film whose groups are known.
struct Film {
    people: Recording,
    ids: Vec<u32>,
    /// The group of each id that walks in one.
    groups: BTreeMap<u32, usize>,
}

impl Film {
    /// The film in a folder of a dataset, annotated so many frames per second; nothing where its files are missing.
    fn read(folder: &str, fps: f64) -> Option<Self> {
        let people = downloaded_data(&format!("{folder}/obsmat.txt"))?;
        let groups = downloaded_data(&format!("{folder}/groups.txt"))?;
        let people = Recording::read(&fs::read(people).unwrap(), RecordingFormat::Obsmat, fps).unwrap();
        let text = fs::read_to_string(groups).unwrap();
        let mut of_id = BTreeMap::new();
        for (group, line) in text.lines().enumerate() {
            for id in line.split_whitespace() {
                of_id.insert(id.parse().unwrap(), group);
            }
        }
        Some(Self { ids: people.ids().collect(), people, groups: of_id })
    }

    /// When someone is annotated, seconds, ascending.
    fn times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.people.steps().map(|step| step.time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The people of one moment, as a planner is told of them.
    fn at(&self, time: f64) -> People {
        let present = self.people.at(time);
        let (ids, each): (Vec<u32>, Vec<[f64; 4]>) = present
            .map(|p| (self.ids[p.index], [p.position.x, p.position.y, p.velocity.x, p.velocity.y]))
            .unzip();
        People { id: ids, ..People::walking(0.25, &each) }
    }

    /// Whether two people walk together, as the film's authors say.
    fn are_together(&self, a: u32, b: u32) -> bool {
        self.groups.get(&a).is_some_and(|group| self.groups.get(&b) == Some(group))
    }

    /// Compares the groups that the planner sees at each moment with those that the authors saw, pair by pair.
    fn compare(&self, params: &GroupParams) -> Pairs {
        let mut pairs = Pairs::default();
        for time in self.times() {
            let people = self.at(time);
            let mut group_of = vec![0; people.len()];
            for (group, members) in crowd_clusters(&people, params, None).into_iter().enumerate() {
                members.into_iter().for_each(|i| group_of[i] = group);
            }
            for i in 0..people.len() {
                for j in 0..i {
                    let is_found = group_of[i] == group_of[j];
                    let is_pair = self.are_together(people.id[i], people.id[j]);
                    pairs.right += u32::from(is_found && is_pair);
                    pairs.wrong += u32::from(is_found && !is_pair);
                    pairs.missed += u32::from(!is_found && is_pair);
                }
            }
        }
        pairs
    }
}

/// Pairs of people at all moments of a film.
#[derive(Debug, Default)]
struct Pairs {
    /// Of one group as the planner and as the authors see it.
    right: u32,
    /// As the planner sees it alone.
    wrong: u32,
    /// As the authors see it alone.
    missed: u32,
}

impl Pairs {
    fn precision(&self) -> f64 {
        f64::from(self.right) / f64::from(self.right + self.wrong)
    }

    fn recall(&self) -> f64 {
        f64::from(self.right) / f64::from(self.right + self.missed)
    }

    /// The harmonic mean of both.
    fn f1(&self) -> f64 {
        2.0 * f64::from(self.right) / f64::from(2 * self.right + self.wrong + self.missed)
    }
}

/// Folder, annotated frames per second, and the F1 of pairs that `curionav` reaches at least.
const FILMS: [(&str, f64, f64); 4] = [
    ("peds_eth/seq_eth", 15.0, 0.7),
    ("peds_eth/seq_hotel", 25.0, 0.7),
    ("peds_eth_ucy/students03", 25.0, 0.6),
    ("peds_eth_ucy/zara01", 25.0, 0.84),
];

#[test]
fn groups_are_mostly_those_that_the_authors_of_films_saw() {
    for (folder, fps, least) in FILMS {
        let Some(film) = Film::read(folder, fps) else { continue };
        let profile = Profile::builtin("curionav").unwrap();
        let ours = film.compare(&profile.groups);
        let paper = film.compare(&Profile::default().groups);
        for (name, pairs) in [("curionav", &ours), ("curiosity", &paper)] {
            let [precision, recall, f1] = [pairs.precision(), pairs.recall(), pairs.f1()];
            println!("{folder}, {name}: precision {precision:.2}, recall {recall:.2}, F1 {f1:.2}");
        }
        assert!(ours.f1() >= least, "{folder}: {ours:?}");
        assert!(ours.f1() > paper.f1(), "{folder}: {ours:?} and {paper:?}");
    }
}
