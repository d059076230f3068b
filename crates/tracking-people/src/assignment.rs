//! Which column is given to which row, for the least sum of costs.

use std::collections::BTreeMap;

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;
use pathfinding::undirected::connected_components::separate_components;

/// Costs are compared to this precision: the library counts in whole numbers, which add up to the same in any order.
const UNITS_PER_COST: f64 = 1e6;
/// What no row is given: far above every sum of costs.
const NEVER: i64 = 1 << 40;

/// A column that may be given to a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) cost: f64,
}

/// Gives each row at most one column and each column to at most one row. Each pair costs at most `most`; a row that is
/// left without costs `most`. Answers with the column of each row.
///
/// Rows and columns that no chain of pairs connects are solved apart, so that the work grows with how crowded it is and
/// not with how many there are.
pub(crate) fn assign(rows: usize, pairs: &[Pair], most: f64) -> Vec<Option<usize>> {
    let mut given = vec![None; rows];
    for part in connected_parts(rows, pairs) {
        if let [pair] = part[..] {
            given[pair.row] = Some(pair.column);
        } else {
            assign_part(&part, most, &mut given);
        }
    }
    given
}

/// The pairs by the connected parts of their graph.
fn connected_parts(rows: usize, pairs: &[Pair]) -> Vec<Vec<Pair>> {
    let edges: Vec<Vec<usize>> = pairs.iter().map(|pair| vec![pair.row, rows + pair.column]).collect();
    let part_of_each = separate_components(&edges).1;
    let mut parts: BTreeMap<usize, Vec<Pair>> = BTreeMap::new();
    for (pair, part) in pairs.iter().zip(part_of_each) {
        parts.entry(part).or_default().push(*pair);
    }
    parts.into_values().collect()
}

fn assign_part(part: &[Pair], most: f64, given: &mut [Option<usize>]) {
    let rows = ascending(part.iter().map(|pair| pair.row));
    let columns = ascending(part.iter().map(|pair| pair.column));
    // A column more for each row, which is its own and stands for none.
    let mut matrix = Matrix::new(rows.len(), columns.len() + rows.len(), NEVER);
    for i in 0..rows.len() {
        matrix[(i, columns.len() + i)] = units(most);
    }
    for pair in part {
        if let (Ok(i), Ok(j)) = (rows.binary_search(&pair.row), columns.binary_search(&pair.column)) {
            matrix[(i, j)] = units(pair.cost);
        }
    }
    for (row, column) in rows.iter().zip(kuhn_munkres_min(&matrix).1) {
        given[*row] = columns.get(column).copied();
    }
}

fn units(cost: f64) -> i64 {
    (cost * UNITS_PER_COST).round() as i64
}

fn ascending(numbers: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::random::{rng, uniform};

    /// The least sum over all ways to give columns to rows from `row` on.
    fn least(rows: usize, pairs: &[Pair], most: f64, row: usize, taken: &mut Vec<usize>) -> f64 {
        if row == rows {
            return 0.0;
        }
        let mut best = most + least(rows, pairs, most, row + 1, taken);
        for pair in pairs.iter().filter(|pair| pair.row == row) {
            if !taken.contains(&pair.column) {
                taken.push(pair.column);
                best = best.min(pair.cost + least(rows, pairs, most, row + 1, taken));
                taken.pop();
            }
        }
        best
    }

    #[test]
    fn no_other_assignment_costs_less() {
        for seed in 0..300 {
            let mut r = rng(seed, 0);
            let mut number = |most: f64| uniform(&mut r) * most;
            let (rows, columns) = (1 + number(5.0) as usize, 1 + number(6.0) as usize);
            let mut pairs = Vec::new();
            for row in 0..rows {
                for column in 0..columns {
                    if number(1.0) < 0.5 {
                        pairs.push(Pair { row, column, cost: number(9.0) });
                    }
                }
            }
            let given = assign(rows, &pairs, 9.0);
            let mut taken: Vec<usize> = given.iter().flatten().copied().collect();
            taken.sort_unstable();
            assert!(taken.windows(2).all(|w| w[0] != w[1]), "seed {seed}: {given:?}");
            let cost = |row: usize, column: usize| {
                pairs.iter().find(|pair| (pair.row, pair.column) == (row, column)).unwrap().cost
            };
            let found: f64 = given
                .iter()
                .enumerate()
                .map(|(row, column)| column.map_or(9.0, |column| cost(row, column)))
                .sum();
            let expected = least(rows, &pairs, 9.0, 0, &mut Vec::new());
            assert!((found - expected).abs() < 1e-4, "seed {seed}: {found} for {expected}");
        }
    }
}
