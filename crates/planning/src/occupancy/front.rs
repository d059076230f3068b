//! The front of a march: a queue that gives the nearest cell first.

/// Cells in the order of their distance, those of equal distance in the order of their numbers.
///
/// A calendar queue (Brown, 1988): distances are cut into slots, and only the cells of the slot that is being emptied
/// are sorted. The order is that of one heap for all cells, which is several times as slow.
pub(crate) struct Front {
    /// Cells of later slots, each in the place of its slot's number modulo the number of places.
    later: [Vec<Entry>; PLACES],
    /// Cells in `later`.
    count: usize,
    /// Cells of the slot that is being emptied and of any before it, the nearest last.
    now: Vec<Entry>,
    slot: usize,
    slots_per_metre: f32,
}

/// Distance and cell in one number: the bits of numbers that are not negative are in their order.
type Entry = u64;

/// Places for slots, a power of two: so many that a slot holds few cells, so few that hardly any slot is empty.
const PLACES: usize = 128;

impl Front {
    /// A front of cells that lie at most `farthest` metres beyond the one before; others may come too, but cost more.
    pub(crate) fn new(farthest: f32) -> Self {
        let later = std::array::from_fn(|_| Vec::new());
        // One place is being emptied, and rounding may need one more.
        Self { later, count: 0, now: Vec::new(), slot: 0, slots_per_metre: (PLACES - 2) as f32 / farthest }
    }

    /// Takes in a cell of a distance that is not negative, metres.
    pub(crate) fn push(&mut self, metres: f32, cell: usize) {
        let entry = (u64::from(metres.to_bits()) << 32) | cell as u64;
        let slot = self.slot_of(metres);
        if slot <= self.slot {
            let place = self.now.partition_point(|other| *other > entry);
            self.now.insert(place, entry);
        } else {
            // One that lies too far ahead is looked at again when the last place is emptied.
            let place = slot.min(self.slot + PLACES - 1) % PLACES;
            self.later[place].push(entry);
            self.count += 1;
        }
    }

    /// Gives up the nearest cell and its distance.
    pub(crate) fn pop(&mut self) -> Option<(f32, usize)> {
        loop {
            if let Some(entry) = self.now.pop() {
                return Some((metres(entry), cell(entry)));
            }
            if self.count == 0 {
                return None;
            }
            self.slot += 1;
            let place = self.slot % PLACES;
            std::mem::swap(&mut self.later[place], &mut self.now);
            self.count -= self.now.len();
            // Those that lay too far ahead for a place of their own.
            let slot = self.slot;
            let is_ahead = |entry: &Entry| self.slot_of(metres(*entry)) > slot;
            if self.now.iter().any(is_ahead) {
                let (ahead, now) = self.now.iter().partition(|entry| is_ahead(entry));
                self.now = now;
                let ahead: Vec<Entry> = ahead;
                ahead.into_iter().for_each(|entry| self.push(metres(entry), cell(entry)));
            }
            self.now.sort_unstable_by(|a, b| b.cmp(a));
        }
    }

    fn slot_of(&self, metres: f32) -> usize {
        (metres * self.slots_per_metre) as usize
    }
}

fn metres(entry: Entry) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

fn cell(entry: Entry) -> usize {
    entry as u32 as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    #[test]
    fn cells_come_in_the_order_of_one_sorted_list() {
        for seed in 0..40 {
            let mut r = rng(seed, 0);
            let mut front = Front::new(0.3);
            let mut all: Vec<(f32, usize)> = Vec::new();
            let mut nearest = 0.0;
            for cell in 0..3000 {
                // Most lie as near as was said, some much farther ahead, some at the same distance as another.
                let ahead = if uniform(&mut r) < 0.05 { 40.0 } else { 0.3 };
                let metres = nearest + (ahead * (uniform(&mut r) * 50.0).floor() / 50.0) as f32;
                front.push(metres, cell);
                all.push((metres, cell));
                if uniform(&mut r) < 0.4 {
                    let least = all.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    assert_eq!(front.pop(), least, "seed {seed}");
                    all.retain(|entry| Some(*entry) != least);
                    nearest = least.unwrap().0;
                }
            }
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let rest: Vec<_> = std::iter::from_fn(|| front.pop()).collect();
            assert_eq!(rest, all, "seed {seed}");
        }
    }
}
