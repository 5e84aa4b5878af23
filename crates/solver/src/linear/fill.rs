//! Which blocks of a Cholesky factor are not zero, in a given order of elimination.

use super::BlockPattern;

/// More blocks in a factor than this are not looked at one by one.
const MAX_BLOCKS: usize = 4_000_000;

/// The lower factor by block columns in the order of elimination; rows are places in that order.
pub(super) struct Fill {
    /// The block at each place.
    pub order: Vec<u32>,
    pub column_starts: Vec<usize>,
    /// Ascending; the first of a column is its diagonal.
    pub rows: Vec<u32>,
    /// Numbers in the factor.
    pub len: usize,
    /// Products of its computation.
    pub products: f64,
}

impl Fill {
    /// `None` where the factor has too many blocks.
    pub fn new(pattern: &BlockPattern, order: &[usize]) -> Option<Self> {
        let count = pattern.blocks();
        let mut place = vec![0_u32; count];
        for (at, &block) in order.iter().enumerate() {
            place[block] = at as u32;
        }
        let (starts, below) = lower(pattern, &place);
        let (mut column_starts, mut rows) = (vec![0], Vec::with_capacity(4 * below.len()));
        // children in the elimination tree, as lists
        let (mut first, mut next) = (vec![u32::MAX; count], vec![u32::MAX; count]);
        let mut seen = vec![u32::MAX; count];
        let (mut len, mut products) = (0, 0.0);
        for column in 0..count {
            let begin = rows.len();
            let mark = column as u32;
            rows.push(mark);
            seen[column] = mark;
            let mut take = |row: u32, rows: &mut Vec<u32>| {
                if seen[row as usize] != mark {
                    seen[row as usize] = mark;
                    rows.push(row);
                }
            };
            for &row in &below[starts[column]..starts[column + 1]] {
                take(row, &mut rows);
            }
            let mut child = first[column];
            while child != u32::MAX {
                let of_child = column_starts[child as usize] + 1..column_starts[child as usize + 1];
                for k in of_child {
                    take(rows[k], &mut rows);
                }
                child = next[child as usize];
            }
            rows[begin..].sort_unstable();
            if let Some(&parent) = rows.get(begin + 1) {
                next[column] = first[parent as usize];
                first[parent as usize] = mark;
            }
            let size = |row: &u32| pattern.size(order[*row as usize]);
            let (width, height): (usize, usize) =
                (size(&mark), rows[begin..].iter().map(size).sum());
            len += width * height;
            products += (width * height * height) as f64;
            column_starts.push(rows.len());
            if rows.len() > MAX_BLOCKS {
                return None;
            }
        }
        Some(Self {
            order: order.iter().map(|&block| block as u32).collect(),
            column_starts,
            rows,
            len,
            products,
        })
    }
}

/// The places below the diagonal of each column.
fn lower(pattern: &BlockPattern, place: &[u32]) -> (Vec<usize>, Vec<u32>) {
    let count = pattern.blocks();
    let pairs = || {
        (0..count).flat_map(|column| {
            let blocks = pattern.column(column).skip(1);
            blocks.map(move |(row, _)| {
                let (a, b) = (place[row], place[column]);
                (a.min(b), a.max(b))
            })
        })
    };
    let mut starts = vec![0; count + 1];
    for (column, _) in pairs() {
        starts[column as usize + 1] += 1;
    }
    for column in 0..count {
        starts[column + 1] += starts[column];
    }
    let (mut next, mut rows) = (starts.clone(), vec![0; starts[count]]);
    for (column, row) in pairs() {
        rows[next[column as usize]] = row;
        next[column as usize] += 1;
    }
    (starts, rows)
}
