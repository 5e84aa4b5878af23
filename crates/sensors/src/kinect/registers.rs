//! Which registers start and stop a stream, in which order.

use super::{CameraCommand, Mode, PixelFormat};

/// One step of a start or stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Send the command, await its reply.
    Command(CameraCommand),
    /// Submit the transfers of an endpoint: they must wait before the stream starts.
    Submit {
        /// Address of the endpoint.
        endpoint: u8,
    },
    /// Cancel the transfers of an endpoint and await them.
    Drain {
        /// Address of the endpoint.
        endpoint: u8,
    },
}

/// Endpoint of colour and infrared packets.
pub(crate) const VIDEO_ENDPOINT: u8 = 0x81;
/// Endpoint of depth packets.
pub(crate) const DEPTH_ENDPOINT: u8 = 0x82;

/// Register that starts and stops colour and infrared.
pub(crate) const VIDEO_STREAM: u16 = 0x05;
/// Register that starts and stops depth.
pub(crate) const DEPTH_STREAM: u16 = 0x06;
const PROJECTOR_CYCLE: u16 = 0x105;
/// Registers of format, resolution, rate of a stream.
const COLOUR: [u16; 3] = [0x0c, 0x0d, 0x0e];
const DEPTH: [u16; 3] = [0x12, 0x13, 0x14];
const INFRARED: [u16; 3] = [0x19, 0x1a, 0x1b];
/// Registers of the horizontal mirror.
const MIRROR_DEPTH: u16 = 0x17;
const MIRROR_COLOUR: u16 = 0x47;
const MIRROR_INFRARED: u16 = 0x48;

/// Value of the format register.
pub(crate) const fn format_code(format: PixelFormat) -> u16 {
    match format {
        PixelFormat::Disparity { bits: 10 } => 2,
        PixelFormat::Disparity { .. } => 3,
        PixelFormat::Bayer | PixelFormat::Infrared => 0,
        PixelFormat::Uyvy => 5,
    }
}

fn start(endpoint: u8, first: &[(u16, u16)], registers: [u16; 3], mode: &Mode) -> Vec<Step> {
    let values = [format_code(mode.format), mode.resolution, mode.rate_hz];
    let settings = registers.into_iter().zip(values);
    let writes = first.iter().copied().chain(settings);
    std::iter::once(Step::Submit { endpoint })
        .chain(writes.map(write))
        .collect()
}

fn write((register, value): (u16, u16)) -> Step {
    Step::Command(CameraCommand::Write(register, value))
}

/// Steps that start depth in `mode`: [`Mode::DEPTH_11`] or [`Mode::DEPTH_10`].
pub fn start_depth(mode: &Mode) -> Vec<Step> {
    let first = [(PROJECTOR_CYCLE, 0), (DEPTH_STREAM, 0)];
    let mut steps = start(DEPTH_ENDPOINT, &first, DEPTH, mode);
    steps.extend([(DEPTH_STREAM, 2), (MIRROR_DEPTH, 0)].map(write));
    steps
}

/// Steps that start colour in `mode`: [`Mode::BAYER`], [`Mode::BAYER_LARGE`] or [`Mode::UYVY`].
pub fn start_colour(mode: &Mode) -> Vec<Step> {
    let mut steps = start(VIDEO_ENDPOINT, &[], COLOUR, mode);
    steps.extend([(VIDEO_STREAM, 1), (MIRROR_COLOUR, 0)].map(write));
    steps
}

/// Steps that start infrared instead of colour.
pub fn start_infrared(mode: &Mode) -> Vec<Step> {
    let mut steps = start(VIDEO_ENDPOINT, &[(PROJECTOR_CYCLE, 0)], INFRARED, mode);
    steps.extend([(VIDEO_STREAM, 3), (MIRROR_INFRARED, 0)].map(write));
    steps
}

/// Steps that stop depth.
pub fn stop_depth() -> Vec<Step> {
    vec![
        write((DEPTH_STREAM, 0)),
        Step::Drain {
            endpoint: DEPTH_ENDPOINT,
        },
    ]
}

/// Steps that stop colour or infrared.
pub fn stop_video() -> Vec<Step> {
    vec![
        write((VIDEO_STREAM, 0)),
        Step::Drain {
            endpoint: VIDEO_ENDPOINT,
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn writes(steps: &[Step]) -> Vec<(u16, u16)> {
        let pairs = steps.iter().filter_map(|step| match step {
            Step::Command(CameraCommand::Write(register, value)) => Some((*register, *value)),
            _ => None,
        });
        pairs.collect()
    }

    #[test]
    fn depth_starts_with_waiting_transfers_and_the_known_registers() {
        let steps = start_depth(&Mode::DEPTH_11);
        assert_eq!(steps[0], Step::Submit { endpoint: 0x82 });
        let expected = [
            (0x105, 0),
            (6, 0),
            (0x12, 3),
            (0x13, 1),
            (0x14, 30),
            (6, 2),
            (0x17, 0),
        ];
        assert_eq!(writes(&steps), expected);
    }

    #[test]
    fn colour_starts_with_waiting_transfers_and_the_known_registers() {
        let steps = start_colour(&Mode::BAYER);
        assert_eq!(steps[0], Step::Submit { endpoint: 0x81 });
        assert_eq!(
            writes(&steps),
            [(0x0c, 0), (0x0d, 1), (0x0e, 30), (5, 1), (0x47, 0)]
        );
        let large = writes(&start_colour(&Mode::BAYER_LARGE));
        assert_eq!(large[1..3], [(0x0d, 2), (0x0e, 15)]);
    }

    #[test]
    fn stop_drains_after_the_stream_is_off() {
        let steps = stop_depth();
        assert_eq!(writes(&steps[..1]), [(6, 0)]);
        assert_eq!(steps[1], Step::Drain { endpoint: 0x82 });
    }
}
