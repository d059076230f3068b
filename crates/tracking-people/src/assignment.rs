//! Which column is given to which row, for the least sum of costs.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are compared to this precision: the library counts in whole numbers, which add up to the same in any order.
const UNITS_PER_COST: f64 = 1e6;
/// What no row is given: far above every sum of costs.
const NEVER: i64 = 1 << 40;

/// Gives each row at most one column and each column to at most one row. `costs` are the pairs that may be, each at
/// most `most`; a row that is left without costs `most`. Answers with the column of each row.
///
/// Rows and columns that no chain of pairs connects are solved apart, so that the work grows with how crowded it is and
/// not with how many there are.
pub(crate) fn assign(
    rows: usize,
    columns: usize,
    costs: &[(usize, usize, f64)],
    most: f64,
) -> Vec<Option<usize>> {
    let mut given = vec![None; rows];
    for part in parts(rows, columns, costs) {
        let mut own_rows: Vec<usize> = part.iter().map(|pair| pair.0).collect();
        let mut own_columns: Vec<usize> = part.iter().map(|pair| pair.1).collect();
        for own in [&mut own_rows, &mut own_columns] {
            own.sort_unstable();
            own.dedup();
        }
        if let [(row, column, _)] = part[..] {
            given[row] = Some(column);
            continue;
        }
        // A column more for each row, which is its own and stands for none.
        let wide = own_columns.len() + own_rows.len();
        let whole = |cost: f64| (cost * UNITS_PER_COST).round() as i64;
        let mut matrix = Matrix::new(own_rows.len(), wide, NEVER);
        for i in 0..own_rows.len() {
            matrix[(i, own_columns.len() + i)] = whole(most);
        }
        for (row, column, cost) in part {
            if let (Ok(i), Ok(j)) = (own_rows.binary_search(&row), own_columns.binary_search(&column)) {
                matrix[(i, j)] = whole(cost);
            }
        }
        for (i, j) in kuhn_munkres_min(&matrix).1.into_iter().enumerate() {
            given[own_rows[i]] = own_columns.get(j).copied();
        }
    }
    given
}

/// The pairs by the connected parts of their graph, in the order of each part's first pair.
fn parts(rows: usize, columns: usize, costs: &[(usize, usize, f64)]) -> Vec<Vec<(usize, usize, f64)>> {
    // A forest over rows and then columns.
    let mut root: Vec<usize> = (0..rows + columns).collect();
    fn find(root: &mut [usize], mut at: usize) -> usize {
        while root[at] != at {
            root[at] = root[root[at]];
            at = root[at];
        }
        at
    }
    for (row, column, _) in costs {
        let (a, b) = (find(&mut root, *row), find(&mut root, rows + column));
        root[a.max(b)] = a.min(b);
    }
    let mut parts: Vec<Vec<(usize, usize, f64)>> = Vec::new();
    let mut number = vec![None; rows + columns];
    for pair in costs {
        let of = find(&mut root, pair.0);
        let at = *number[of].get_or_insert_with(|| {
            parts.push(Vec::new());
            parts.len() - 1
        });
        parts[at].push(*pair);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::random::{rng, uniform};

    /// The least sum over all ways to give columns to rows from `row` on.
    fn least(
        rows: usize,
        costs: &[(usize, usize, f64)],
        most: f64,
        row: usize,
        taken: &mut Vec<usize>,
    ) -> f64 {
        if row == rows {
            return 0.0;
        }
        let mut best = most + least(rows, costs, most, row + 1, taken);
        for (_, column, cost) in costs.iter().filter(|pair| pair.0 == row) {
            if !taken.contains(column) {
                taken.push(*column);
                best = best.min(cost + least(rows, costs, most, row + 1, taken));
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
            let mut costs = Vec::new();
            for row in 0..rows {
                for column in 0..columns {
                    if number(1.0) < 0.5 {
                        costs.push((row, column, number(9.0)));
                    }
                }
            }
            let given = assign(rows, columns, &costs, 9.0);
            let mut taken: Vec<usize> = given.iter().flatten().copied().collect();
            taken.sort_unstable();
            assert!(taken.windows(2).all(|w| w[0] != w[1]), "seed {seed}: {given:?}");
            let cost = |row: usize, column: usize| {
                costs.iter().find(|pair| (pair.0, pair.1) == (row, column)).unwrap().2
            };
            let found: f64 = given
                .iter()
                .enumerate()
                .map(|(row, column)| column.map_or(9.0, |column| cost(row, column)))
                .sum();
            let expected = least(rows, &costs, 9.0, 0, &mut Vec::new());
            assert!((found - expected).abs() < 1e-4, "seed {seed}: {found} for {expected}");
        }
    }
}
