//! Nested dissection: the order of elimination that graphs with small separators ask for.

use super::BlockPattern;

/// Parts of fewer nodes keep the order they came in.
const LEAF: usize = 48;

/// An undirected graph, neighbours of each node.
pub(super) struct Neighbours {
    starts: Vec<usize>,
    nodes: Vec<u32>,
}

impl Neighbours {
    /// The blocks that are tied.
    pub fn new(pattern: &BlockPattern) -> Self {
        let count = pattern.blocks();
        let pairs = || {
            (0..count).flat_map(|column| {
                let rows = pattern.column(column).map(|(row, _)| row);
                rows.filter(move |&row| row != column)
                    .map(move |row| (row, column))
            })
        };
        let mut starts = vec![0; count + 1];
        for (a, b) in pairs() {
            starts[a + 1] += 1;
            starts[b + 1] += 1;
        }
        for node in 0..count {
            starts[node + 1] += starts[node];
        }
        let (mut next, mut nodes) = (starts.clone(), vec![0; starts[count]]);
        for (a, b) in pairs() {
            for (from, to) in [(a, b), (b, a)] {
                nodes[next[from]] = to as u32;
                next[from] += 1;
            }
        }
        Self { starts, nodes }
    }

    fn of(&self, node: u32) -> &[u32] {
        &self.nodes[self.starts[node as usize]..self.starts[node as usize + 1]]
    }
}

/// The nodes in the order of their elimination: both halves before the separator between them.
/// Separators are levels of a breadth-first search from a node at the rim. `order` breaks ties inside
/// small parts (an order by minimum degree, say).
pub(super) fn order(graph: &Neighbours, order: &[usize]) -> Vec<usize> {
    let count = order.len();
    let mut work = Work {
        part: vec![0; count],
        level: vec![0; count],
        queue: Vec::with_capacity(count),
        parts: 1,
    };
    let mut all: Vec<u32> = order.iter().map(|&node| node as u32).collect();
    let mut stack = vec![(0, count)];
    while let Some((first, end)) = stack.pop() {
        if end - first <= LEAF {
            continue;
        }
        let (low, high) = work.split(graph, &mut all[first..end]);
        // a part that no level divides is eliminated as it is
        if low.max(high - low) < end - first {
            stack.push((first, first + low));
            stack.push((first + low, first + high));
        }
    }
    all.into_iter().map(|node| node as usize).collect()
}

struct Work {
    /// The part that each node is in.
    part: Vec<u32>,
    level: Vec<u32>,
    queue: Vec<u32>,
    parts: u32,
}

impl Work {
    /// Rearranges `nodes` into the part below the separator, that above it, and the separator;
    /// returns where the first two end. The order inside them stays.
    fn split(&mut self, graph: &Neighbours, nodes: &mut [u32]) -> (usize, usize) {
        self.parts += 1;
        let part = self.parts;
        for &node in nodes.iter() {
            self.part[node as usize] = part;
        }
        // twice: the node found last is at the rim
        self.search(graph, nodes[0], part);
        let rim = self.queue[self.queue.len() - 1];
        let reached = self.search(graph, rim, part);
        if reached < nodes.len() {
            // several components: what was reached against the rest
            return self.arrange(nodes, |level| if level == u32::MAX { 1 } else { 0 });
        }
        let depth = self.level[self.queue[reached - 1] as usize];
        let mut sizes = vec![0_usize; depth as usize + 1];
        for &node in nodes.iter() {
            sizes[self.level[node as usize] as usize] += 1;
        }
        let (mut best, mut before, mut least) = (None, 0, usize::MAX);
        for (level, &size) in sizes.iter().enumerate() {
            let after = nodes.len() - before - size;
            // a small separator is worth parts that differ, up to one against two
            if 2 * before.min(after) >= before.max(after) && size < least {
                (best, least) = (Some(level as u32), size);
            }
            before += size;
        }
        let Some(best) = best else {
            return (nodes.len(), nodes.len());
        };
        self.arrange(nodes, |level| match level.cmp(&best) {
            std::cmp::Ordering::Less => 0,
            std::cmp::Ordering::Greater => 1,
            std::cmp::Ordering::Equal => 2,
        })
    }

    /// Levels from a node on, within its part; returns how many nodes there are.
    fn search(&mut self, graph: &Neighbours, from: u32, part: u32) -> usize {
        for level in &mut self.level {
            *level = u32::MAX;
        }
        self.queue.clear();
        self.queue.push(from);
        self.level[from as usize] = 0;
        let mut next = 0;
        while next < self.queue.len() {
            let node = self.queue[next];
            next += 1;
            for &other in graph.of(node) {
                let at = other as usize;
                if self.part[at] == part && self.level[at] == u32::MAX {
                    self.level[at] = self.level[node as usize] + 1;
                    self.queue.push(other);
                }
            }
        }
        self.queue.len()
    }

    fn arrange(&mut self, nodes: &mut [u32], class: impl Fn(u32) -> usize) -> (usize, usize) {
        let of = |node: &u32| class(self.level[*node as usize]);
        nodes.sort_by_key(of);
        let low = nodes.partition_point(|node| of(node) < 1);
        (low, nodes.partition_point(|node| of(node) < 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of blocks of one row.
    fn grid(side: usize) -> BlockPattern {
        let (mut starts, mut members) = (vec![0], Vec::new());
        for k in 0..side * side {
            for (neighbour, inside) in [
                (k + 1, k % side + 1 < side),
                (k + side, k / side + 1 < side),
            ] {
                if inside {
                    members.extend([k as u32, neighbour as u32]);
                    starts.push(members.len());
                }
            }
        }
        BlockPattern::from_groups(vec![1; side * side], &starts, &members)
    }

    #[test]
    fn separator_comes_last_and_every_node_once() {
        let pattern = grid(20);
        let natural: Vec<usize> = (0..400).collect();
        let found = order(&Neighbours::new(&pattern), &natural);
        let mut sorted = found.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, natural);
        // without the nodes that come last the grid falls apart: breadth first from any of the others
        // does not reach them all
        let mut alive = vec![true; 400];
        for &node in &found[400 - 20..] {
            alive[node] = false;
        }
        let graph = Neighbours::new(&pattern);
        let mut stack = vec![found[0]];
        alive[found[0]] = false;
        let mut reached = 0;
        while let Some(node) = stack.pop() {
            reached += 1;
            for &other in graph.of(node as u32) {
                if alive[other as usize] {
                    alive[other as usize] = false;
                    stack.push(other as usize);
                }
            }
        }
        assert!(reached < 300, "{reached}");
    }

    #[test]
    fn parts_that_hang_together_nowhere_are_ordered_too() {
        let pattern = BlockPattern::from_groups(vec![2; 200], &[0], &[]);
        let natural: Vec<usize> = (0..200).collect();
        let mut found = order(&Neighbours::new(&pattern), &natural);
        found.sort_unstable();
        assert_eq!(found, natural);
    }
}
