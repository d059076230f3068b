//! Which people are in view from where candidates lead, looked up once for each place and window of states.

use super::{Line, Sight, is_in_wall};
use crate::candidates::CandidateSet;
use crate::geometry::Point2;
use crate::lanes::LANES;
use crate::occupancy::{OccupancyGrid, RayCaster};
use crate::scene::{People, Scene};

/// Length of a window, seconds: its states see what the middle one sees, and people are where they are expected then.
const WINDOW_S: f64 = 1.0;
/// Windows in a horizon; those of a long one are longer. A window has eight states at most unless that is so.
const WINDOWS_MOST: usize = 16;
/// Side of a place, metres: a state sees what the centre of its place sees, 0.35 m away at most.
const PLACE: f64 = 0.5;
/// How much farther than the robot drives at full speed its candidates may lead, metres: a decision is held up to half
/// a metre beside its trajectory.
const BEYOND: f64 = 1.0;
/// Places from the robot to the side of the square around it: for a robot that goes farther, 4 MB are not enough.
const HALF_MOST: usize = 127;
/// What is kept at once, for eight groups each: 16 MB.
const KEPT_MOST: usize = 1 << 20;
/// All of a group are in view.
const WHOLE: u8 = u8::MAX;

/// What share of the members of each of eight groups is in view, a byte for each.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// 255 for all of them. The lowest byte is that of the first group.
    shares: u64,
    /// Which groups have been looked at, lowest bit first.
    known: u8,
}

/// Where all are in view.
const OPEN: Seen = Seen { shares: u64::MAX, known: u8::MAX };

/// One place in one window.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Its centre, cells of the grid.
    at: (f64, f64),
    window: usize,
}

/// Where a person is expected in one window.
#[derive(Debug, Clone, Copy)]
struct Expected {
    /// Cells of the grid.
    at: (f64, f64),
    is_in_wall: bool,
}

/// Which people walls hide from the states of candidates in one scene, by groups of people who count together. Nothing
/// of it depends on the candidates: what they ask for is kept, and would be the same for others.
#[derive(Debug)]
pub(crate) struct View<'a> {
    rays: RayCaster<'a>,
    grid: &'a OccupancyGrid,
    /// The lower left corner of the square around the robot, map frame, and places along its side.
    corner: (f64, f64),
    side: usize,
    steps: usize,
    /// States in a window.
    states: usize,
    /// `[window, person]`, persons in the order of `ends`.
    people: Vec<Expected>,
    /// Where the members of each group end among the people.
    ends: Vec<usize>,
    /// Numbers of places, `[window, row, column]`; 0 where none has been asked for.
    numbers: Vec<u32>,
    /// By number; the first stands for all that is outside the square.
    places: Vec<Place>,
    /// `[place, eight groups]`.
    seen: Vec<Seen>,
}

impl<'a> View<'a> {
    /// Of `groups`, which are indices into the people of `scene`, for candidates of `steps` states `dt` seconds apart.
    pub(crate) fn new(sight: &'a Sight, scene: &Scene, groups: &[Vec<usize>], steps: usize, dt: f64) -> Self {
        let states = ((WINDOW_S / dt) as usize).clamp(1, LANES).max(steps.div_ceil(WINDOWS_MOST));
        let reach = sight.v_max * dt * steps as f64 + BEYOND;
        let half = ((reach / PLACE).ceil() as usize).min(HALF_MOST);
        let here = scene.belief.pose;
        let corner = [here.x, here.y].map(|of| ((of / PLACE).floor() - half as f64) * PLACE);
        let side = 2 * half + 1;
        let windows = steps.div_ceil(states);
        let mut view = Self {
            rays: RayCaster::new(&sight.map),
            grid: &sight.map.grid,
            corner: (corner[0], corner[1]),
            side,
            steps,
            states,
            people: Vec::with_capacity(windows * scene.people.len()),
            ends: ends(groups),
            numbers: vec![0; windows * side * side],
            places: Vec::new(),
            seen: Vec::new(),
        };
        view.expect(sight, &scene.people, groups, dt);
        view.forget();
        view
    }

    /// Of people who each count alone; of none without `sight`.
    pub(crate) fn of_each(
        sight: Option<&'a Sight>,
        scene: &Scene,
        candidates: &CandidateSet,
    ) -> Option<Self> {
        let each_alone: Vec<Vec<usize>> = (0..scene.people.len()).map(|person| vec![person]).collect();
        sight.map(|sight| Self::new(sight, scene, &each_alone, candidates.steps(), candidates.dt()))
    }

    /// Where people are expected in each window: as forecast, but on this side of the first wall on their way.
    fn expect(&mut self, sight: &Sight, people: &People, groups: &[Vec<usize>], dt: f64) {
        let horizon = self.steps as f64 * dt;
        let members: Vec<(usize, f64)> =
            groups.iter().flatten().map(|&i| (i, sight.until_wall(people, i, horizon))).collect();
        for first in (0..self.steps).step_by(self.states) {
            let time = (self.middle(first) + 1) as f64 * dt;
            for &(i, until) in &members {
                let at = self.grid.grid_from_map(people.position_after(i, time.min(until)));
                self.people.push(Expected { at, is_in_wall: is_in_wall(&self.rays, at) });
            }
        }
    }

    /// Forgets what it has seen if that is much. Numbers of places are then no longer valid.
    pub(crate) fn trim(&mut self) {
        if self.seen.len() > KEPT_MOST {
            self.numbers.fill(0);
            self.forget();
        }
    }

    fn forget(&mut self) {
        self.places.clear();
        self.seen.clear();
        // From outside the square all are in view.
        self.places.push(Place { at: (0.0, 0.0), window: 0 });
        self.seen.resize(self.eights(), OPEN);
    }

    /// Groups of people, by eight.
    #[inline(always)]
    fn eights(&self) -> usize {
        self.ends.len().div_ceil(LANES)
    }

    /// The state in the middle of the window of state `step`.
    #[inline(always)]
    pub(crate) fn middle(&self, step: usize) -> usize {
        (step / self.states * self.states + self.states / 2).min(self.steps - 1)
    }

    /// The number of the place from which state `step` of a candidate sees; `x` and `y` are those of all its states.
    #[inline(always)]
    pub(crate) fn place(&mut self, step: usize, x: &[f64], y: &[f64]) -> usize {
        let middle = self.middle(step);
        let column = (x[middle] - self.corner.0) * (1.0 / PLACE);
        let row = (y[middle] - self.corner.1) * (1.0 / PLACE);
        let side = self.side as f64;
        let is_inside = (column >= 0.0) & (row >= 0.0) & (column < side) & (row < side);
        if !is_inside {
            return 0;
        }
        let window = step / self.states;
        let index = (window * self.side + row as u32 as usize) * self.side + column as u32 as usize;
        let number = self.numbers[index] as usize;
        if number > 0 { number } else { self.add(index) }
    }

    /// The number of the place from which state `step` of candidate `i` sees.
    pub(crate) fn place_of(&mut self, candidates: &CandidateSet, i: usize, step: usize) -> usize {
        if step == 0 {
            self.trim();
        }
        let states = candidates.all_states();
        let range = candidates.range(i);
        self.place(step, &states.x[range.clone()], &states.y[range])
    }

    #[cold]
    #[inline(never)]
    fn add(&mut self, index: usize) -> usize {
        let number = self.places.len();
        self.numbers[index] = number as u32;
        let column = index % self.side;
        let row = index / self.side % self.side;
        let window = index / (self.side * self.side);
        let x = self.corner.0 + (column as f64 + 0.5) * PLACE;
        let y = self.corner.1 + (row as f64 + 0.5) * PLACE;
        let at = self.grid.grid_from_map(Point2::new(x, y));
        self.places.push(Place { at, window });
        // From a place in a wall all are in view.
        let seen = if is_in_wall(&self.rays, at) { OPEN } else { Seen { shares: 0, known: 0 } };
        self.seen.resize(self.seen.len() + self.eights(), seen);
        number
    }

    /// What share of those of eight groups, number `eight`, that are `asked` for is in view of a place.
    #[inline(always)]
    fn shares(&mut self, place: usize, eight: usize, asked: u64) -> u64 {
        let at = place * self.eights() + eight;
        if asked & !u64::from(self.seen[at].known) != 0 {
            self.look(place, eight, asked as u8);
        }
        self.seen[at].shares
    }

    #[cold]
    #[inline(never)]
    fn look(&mut self, place: usize, eight: usize, asked: u8) {
        let index = place * self.eights() + eight;
        let Place { at, window } = self.places[place];
        let all = self.ends.last().copied().unwrap_or(0);
        let mut seen = self.seen[index];
        let mut open = asked & !seen.known;
        while open != 0 {
            let bit = open.trailing_zeros() as usize;
            open &= open - 1;
            let group = eight * LANES + bit;
            let first = group.checked_sub(1).map_or(0, |before| self.ends[before]);
            let members = &self.people[window * all..][first..self.ends[group]];
            let mut count = 0;
            for person in members {
                let is_seen = person.is_in_wall || Line::new(person.at, at).first_wall(&self.rays).is_none();
                count += usize::from(is_seen);
            }
            seen.shares |= u64::from(share(count, members.len())) << (8 * bit);
        }
        seen.known |= asked;
        self.seen[index] = seen;
    }

    /// What is in view of eight states at these places, of eight groups of which these are asked for.
    #[inline(always)]
    pub(crate) fn of_eight(&mut self, places: [usize; LANES], eight: usize, asked: u64) -> InView {
        let mut shares = self.shares(places[0], eight, asked);
        let mut in_view = InView { each: [shares; LANES], least: shares, most: shares };
        for lane in 1..LANES {
            if places[lane] != places[lane - 1] {
                shares = self.shares(places[lane], eight, asked);
                in_view.least &= shares;
                in_view.most |= shares;
            }
            in_view.each[lane] = shares;
        }
        in_view
    }

    /// Whether any of a group is in view of a place.
    #[inline(always)]
    pub(crate) fn shows(&mut self, place: usize, group: usize) -> bool {
        let bit = group % LANES;
        (self.shares(place, group / LANES, 1 << bit) >> (8 * bit)) as u8 > 0
    }
}

/// What is in view of eight states, of eight groups: a byte for each group, as shares of 255.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InView {
    each: [u64; LANES],
    /// The bits that all have.
    least: u64,
    /// The bits that any has.
    most: u64,
}

impl InView {
    /// All of all groups.
    pub(crate) const ALL: Self = Self { each: [u64::MAX; LANES], least: u64::MAX, most: u64::MAX };

    /// The share of a group that is in view of each state.
    #[inline(always)]
    pub(crate) fn of(&self, group: usize) -> Shares {
        let shift = 8 * group;
        if (self.least >> shift) as u8 == WHOLE {
            return Shares::Whole;
        }
        if (self.most >> shift) as u8 == 0 {
            return Shares::None;
        }
        let mut shares = [0.0; LANES];
        for (share, each) in shares.iter_mut().zip(self.each) {
            *share = f64::from((each >> shift) as u8) / f64::from(WHOLE);
        }
        Shares::Some(shares)
    }
}

/// The share of a group that is in view of eight states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shares {
    /// None of it, of any.
    None,
    /// All of it, of each.
    Whole,
    /// These, 0 to 1.
    Some([f64; LANES]),
}

/// Where each group ends in the list of all members.
fn ends(groups: &[Vec<usize>]) -> Vec<usize> {
    let mut end = 0;
    let mut ends = Vec::with_capacity(groups.len());
    for group in groups {
        end += group.len();
        ends.push(end);
    }
    ends
}

/// So many of so many, in 255ths; neither none nor all unless it is.
fn share(count: usize, of: usize) -> u8 {
    match count {
        0 => 0,
        _ if count == of => WHOLE,
        _ => (usize::from(WHOLE) * count / of).clamp(1, usize::from(WHOLE) - 1) as u8,
    }
}
