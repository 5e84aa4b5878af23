//! Which levels are solved, in which order.

use crate::config::Config;

/// Further solves where the last one moved more than the one before: noise does that at times, and
/// one more then settles; a solve that still grows after these has not converged.
const PATIENCE: usize = 2;

/// One solve of the schedule, with its level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solve {
    /// In any case.
    Always(usize),
    /// Only where the last step was not small, or not smaller than the one before.
    IfStillMoving(usize),
}

impl Solve {
    pub(super) fn level(self) -> usize {
        match self {
            Self::Always(level) | Self::IfStillMoving(level) => level,
        }
    }
}

/// The solves, one after the other, from the level `coarsest` down to `finest`.
pub(super) fn schedule(
    config: &Config,
    finest: usize,
    coarsest: usize,
    coarse_solves: usize,
) -> impl Iterator<Item = Solve> + use<> {
    let finest = finest.min(coarsest);
    let coarse = if coarsest > finest { coarse_solves } else { 1 };
    let down = (finest..coarsest).rev();
    std::iter::repeat_n(coarsest, coarse)
        .chain(down)
        .chain(std::iter::repeat_n(finest, config.warps))
        .map(Solve::Always)
        .chain(std::iter::repeat_n(Solve::IfStillMoving(finest), PATIENCE))
}
