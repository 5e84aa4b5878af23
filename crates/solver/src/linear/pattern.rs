//! Which blocks of a symmetric matrix are not zero, and where their numbers are kept.

/// The lower triangle of a symmetric block matrix: block columns with ascending block rows. A block
/// is stored by columns; a diagonal block is stored whole.
pub(crate) struct BlockPattern {
    sizes: Vec<usize>,
    starts: Vec<usize>,
    column_starts: Vec<usize>,
    rows: Vec<u32>,
    offsets: Vec<usize>,
}

impl BlockPattern {
    /// The pattern in which any two members of a group, and every block with itself, have a block.
    /// Group `g` is `members[group_starts[g]..group_starts[g + 1]]`.
    pub fn from_groups(sizes: Vec<usize>, group_starts: &[usize], members: &[u32]) -> Self {
        let blocks = sizes.len();
        let (in_starts, in_groups) = inverse(blocks, group_starts, members);
        let mut column_starts = Vec::with_capacity(blocks + 1);
        let mut rows: Vec<u32> = Vec::new();
        let mut seen = vec![u32::MAX; blocks];
        column_starts.push(0);
        for column in 0..blocks as u32 {
            let first = rows.len();
            rows.push(column);
            for &group in &in_groups[in_starts[column as usize]..in_starts[column as usize + 1]] {
                let group = group as usize;
                for &row in &members[group_starts[group]..group_starts[group + 1]] {
                    if row > column && seen[row as usize] != column {
                        seen[row as usize] = column;
                        rows.push(row);
                    }
                }
            }
            rows[first..].sort_unstable();
            column_starts.push(rows.len());
        }
        Self::new(sizes, column_starts, rows)
    }

    fn new(sizes: Vec<usize>, column_starts: Vec<usize>, rows: Vec<u32>) -> Self {
        let running = |values: &mut dyn Iterator<Item = usize>| {
            let mut sum = 0;
            let mut all = vec![0];
            for value in values {
                sum += value;
                all.push(sum);
            }
            all
        };
        let starts = running(&mut sizes.iter().copied());
        let mut areas = (0..sizes.len()).flat_map(|column| {
            let (rows, sizes) = (&rows, &sizes);
            (column_starts[column]..column_starts[column + 1])
                .map(move |k| sizes[column] * sizes[rows[k] as usize])
        });
        let offsets = running(&mut areas);
        Self {
            sizes,
            starts,
            column_starts,
            rows,
            offsets,
        }
    }

    /// Block rows.
    pub fn blocks(&self) -> usize {
        self.sizes.len()
    }

    /// Scalar rows.
    pub fn dimension(&self) -> usize {
        self.starts[self.blocks()]
    }

    /// Numbers in all blocks.
    pub fn len(&self) -> usize {
        self.offsets[self.rows.len()]
    }

    /// Rows of a block row.
    pub fn size(&self, block: usize) -> usize {
        self.sizes[block]
    }

    /// First scalar row of a block row.
    pub fn start(&self, block: usize) -> usize {
        self.starts[block]
    }

    /// The blocks of a block column: block row and offset of the numbers.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        (self.column_starts[column]..self.column_starts[column + 1])
            .map(|k| (self.rows[k] as usize, self.offsets[k]))
    }

    /// Offset of the diagonal block.
    pub fn diagonal(&self, block: usize) -> usize {
        self.offsets[self.column_starts[block]]
    }

    /// Offset of the block (`row`, `column`), `row >= column`; `None` where it is zero.
    pub fn offset(&self, row: usize, column: usize) -> Option<usize> {
        let first = self.column_starts[column];
        let rows = &self.rows[first..self.column_starts[column + 1]];
        rows.binary_search(&(row as u32))
            .ok()
            .map(|k| self.offsets[first + k])
    }

    /// `y = A x`.
    pub fn multiply(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for column in 0..self.blocks() {
            let (width, c0) = (self.sizes[column], self.starts[column]);
            for (row, offset) in self.column(column) {
                let (height, r0) = (self.sizes[row], self.starts[row]);
                for c in 0..width {
                    let entries = &values[offset + c * height..offset + (c + 1) * height];
                    let mut below = 0.0;
                    for (r, entry) in entries.iter().enumerate() {
                        y[r0 + r] += entry * x[c0 + c];
                        below += entry * x[r0 + r];
                    }
                    if row != column {
                        y[c0 + c] += below;
                    }
                }
            }
        }
    }
}

/// For each block the groups it is in.
fn inverse(blocks: usize, group_starts: &[usize], members: &[u32]) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0_usize; blocks + 1];
    for &member in members {
        starts[member as usize + 1] += 1;
    }
    for block in 0..blocks {
        starts[block + 1] += starts[block];
    }
    let (mut next, mut groups) = (starts.clone(), vec![0; members.len()]);
    for group in 0..group_starts.len().saturating_sub(1) {
        for &member in &members[group_starts[group]..group_starts[group + 1]] {
            groups[next[member as usize]] = group as u32;
            next[member as usize] += 1;
        }
    }
    (starts, groups)
}
