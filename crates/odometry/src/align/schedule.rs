//! Which levels are solved, in which order.

use crate::config::Config;

/// Further solves where the last one moved more than the one before: noise does that at times, and
/// one more then settles; a solve that still grows after these has not converged.
const PATIENCE: usize = 2;
/// Added to a level of the schedule that is only solved where the steps still grow.
pub(super) const REPEAT: usize = 1 << 16;

/// The levels of the solves, one after the other; those beyond [`REPEAT`] only where the last step
/// was not small, or not smaller than the one before.
pub(super) fn schedule(
    config: &Config,
    finest: usize,
    coarsest: usize,
    coarse_solves: usize,
) -> impl Iterator<Item = usize> + use<> {
    let finest = finest.min(coarsest);
    let coarse = if coarsest > finest { coarse_solves } else { 1 };
    let down = (finest..coarsest).rev();
    std::iter::repeat_n(coarsest, coarse)
        .chain(down)
        .chain(std::iter::repeat_n(finest, config.warps))
        .chain(std::iter::repeat_n(finest + REPEAT, PATIENCE))
}
