//! An open Kinect camera: parameters read, streams started, frames on the host's clock.

use super::registers::{DEPTH_ENDPOINT, VIDEO_ENDPOINT, format_code};
use super::{
    CameraCommand, FrameAssembler, Mode, PixelFormat, REPLY_BYTES, RawFrame, Reply, Step,
    TICKS_PER_SECOND, parse_fixed_parameters, parse_padding, parse_registration, parse_reply,
    parse_shift, start_colour, start_depth, start_infrared, stop_depth, stop_video,
};
use crate::clock::{ClockState, StreamClock, TickFaults};
use crate::colour::{Order, YuvWeights, demosaic, rgb_from_yuv422};
use crate::disparity::{DisparityModel, DisparityTable};
use crate::registration::Registration;
use crate::usb::{Request, UsbLink};
use crate::{Error, PacketFaults, Result};
use sphereflow_core::{DepthMap, Plane, Stamp};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How long a reply is awaited.
const REPLY: Duration = Duration::from_secs(1);
/// Between two fetches of a reply.
const BETWEEN: Duration = Duration::from_millis(1);

/// What a frame shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Depth: raw disparities, and metres in the depth camera's pixels.
    Depth(Plane<u16>, DepthMap),
    /// Colour.
    Colour(Plane<[u8; 3]>),
    /// Infrared brightness, 0 to 1023.
    Infrared(Plane<u16>),
}

/// A frame on the host's clock.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// When it was taken, as far as the device's clock tells; where its last packet is missing, when
    /// it arrived.
    pub stamp: Stamp,
    /// What it shows.
    pub content: Content,
    /// Bytes that are missing; empty in a complete frame. Depth has no readings there.
    pub missing: Vec<std::ops::Range<usize>>,
}

/// A running stream.
struct Stream {
    endpoint: u8,
    assembler: FrameAssembler,
    clock: StreamClock,
}

impl Stream {
    fn new(mode: Mode) -> Result<Self> {
        Ok(Self {
            endpoint: endpoint_of(&mode),
            assembler: FrameAssembler::new(mode),
            clock: StreamClock::new(TICKS_PER_SECOND)?,
        })
    }
}

/// An open camera.
pub struct Camera<L: UsbLink> {
    link: L,
    tag: u16,
    model: DisparityModel,
    table: DisparityTable,
    registration: Registration,
    streams: Vec<Stream>,
    waiting: VecDeque<CameraFrame>,
}

impl<L: UsbLink> Camera<L> {
    /// Reads the parameters of a device.
    ///
    /// # Errors
    /// Where the device does not answer as a Kinect.
    pub fn open(mut link: L) -> Result<Self> {
        let mut tag = 0;
        let mut ask = |command| exchange(&mut link, &mut tag, command);
        let mode = Mode::DEPTH_11;
        let algorithm = |id| CameraCommand::Algorithm {
            id,
            format: format_code(mode.format),
            resolution: mode.resolution,
            rate_hz: mode.rate_hz,
        };
        let padding = parse_padding(&ask(algorithm(0x41))?)?;
        let fixed = ask(CameraCommand::FixedParameters)?;
        let registration = parse_registration(&ask(algorithm(0x40))?)?;
        let shift = parse_shift(&ask(algorithm(0x00))?)?;
        let model = parse_fixed_parameters(&fixed, shift)?;
        Ok(Self {
            registration: Registration::new(640, 480, &registration, &model, padding[0])?,
            table: model.table(),
            model,
            streams: Vec::new(),
            waiting: VecDeque::new(),
            link,
            tag,
        })
    }

    /// The device's own geometry.
    pub fn model(&self) -> &DisparityModel {
        &self.model
    }

    /// Tables that carry raw disparities into the colour image.
    pub fn registration(&self) -> &Registration {
        &self.registration
    }

    /// Drift and jitter of the device's clock, by the stream of a mode.
    pub fn clock(&self, mode: &Mode) -> Option<ClockState> {
        self.stream(mode).map(|stream| stream.clock.state())
    }

    /// Steps and wraps of the device's clock, by the stream of a mode.
    pub fn tick_faults(&self, mode: &Mode) -> Option<TickFaults> {
        self.stream(mode).map(|stream| stream.clock.faults())
    }

    fn stream(&self, mode: &Mode) -> Option<&Stream> {
        self.streams
            .iter()
            .find(|stream| stream.endpoint == endpoint_of(mode))
    }

    /// What went wrong so far in the stream of a mode.
    pub fn faults(&self, mode: &Mode) -> Option<PacketFaults> {
        self.stream(mode).map(|stream| stream.assembler.faults())
    }

    /// Starts the stream of a mode; one that runs on its endpoint is stopped before.
    ///
    /// # Errors
    /// Where the device refuses.
    pub fn start(&mut self, mode: Mode) -> Result<()> {
        let endpoint = endpoint_of(&mode);
        self.stop_endpoint(endpoint)?;
        let steps = match mode.format {
            PixelFormat::Disparity { .. } => start_depth(&mode),
            PixelFormat::Infrared => start_infrared(&mode),
            PixelFormat::Bayer | PixelFormat::Uyvy => start_colour(&mode),
        };
        self.streams.push(Stream::new(mode)?);
        self.run(&steps)
    }

    /// Stops all streams.
    ///
    /// # Errors
    /// Where the device refuses.
    pub fn stop(&mut self) -> Result<()> {
        self.stop_endpoint(DEPTH_ENDPOINT)?;
        self.stop_endpoint(VIDEO_ENDPOINT)
    }

    fn stop_endpoint(&mut self, endpoint: u8) -> Result<()> {
        if !self
            .streams
            .iter()
            .any(|stream| stream.endpoint == endpoint)
        {
            return Ok(());
        }
        self.streams.retain(|stream| stream.endpoint != endpoint);
        let steps = if endpoint == DEPTH_ENDPOINT {
            stop_depth()
        } else {
            stop_video()
        };
        self.run(&steps)
    }

    fn run(&mut self, steps: &[Step]) -> Result<()> {
        for step in steps {
            match *step {
                Step::Command(command) => {
                    exchange(&mut self.link, &mut self.tag, command)?;
                }
                Step::Submit { endpoint } => self.link.submit(endpoint)?,
                Step::Drain { endpoint } => self.link.drain(endpoint)?,
            }
        }
        Ok(())
    }

    /// The next frame; `None` where none came within `timeout`.
    ///
    /// # Errors
    /// [`Error::Unplugged`] where the device is gone.
    pub fn next_frame(&mut self, timeout: Duration) -> Result<Option<CameraFrame>> {
        let begin = Instant::now();
        loop {
            if let Some(frame) = self.waiting.pop_front() {
                return Ok(Some(frame));
            }
            let left = timeout.saturating_sub(begin.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            let (streams, waiting, table) = (&mut self.streams, &mut self.waiting, &self.table);
            self.link.packets(left, &mut |endpoint, bytes, arrived| {
                let stream = streams
                    .iter_mut()
                    .find(|stream| stream.endpoint == endpoint);
                let Some(stream) = stream else { return };
                let mut ended = Vec::new(); // a packet after a gap can end two
                stream.assembler.push(bytes, |frame| ended.push(frame));
                for frame in ended {
                    let stamp = stream.clock.stamp(frame.ticks, arrived);
                    let content = content(&frame, table);
                    let missing = frame.missing;
                    waiting.extend(content.map(|content| CameraFrame {
                        stamp,
                        content,
                        missing,
                    }));
                }
            })?;
        }
    }
}

fn endpoint_of(mode: &Mode) -> u8 {
    match mode.format {
        PixelFormat::Disparity { .. } => DEPTH_ENDPOINT,
        _ => VIDEO_ENDPOINT,
    }
}

fn content(frame: &RawFrame, table: &DisparityTable) -> Option<Content> {
    let (width, height) = (frame.mode.width, frame.mode.height);
    match frame.mode.format {
        PixelFormat::Disparity { .. } => frame.unpacked().map(|raw| {
            let depth = table.apply(&raw);
            Content::Depth(raw, depth)
        }),
        PixelFormat::Infrared => frame.unpacked().map(Content::Infrared),
        PixelFormat::Bayer => demosaic(width, height, &frame.data)
            .ok()
            .map(Content::Colour),
        PixelFormat::Uyvy => {
            let weights = &YuvWeights::KINECT;
            let colour = rgb_from_yuv422(width, height, &frame.data, Order::Uyvy, weights);
            colour.ok().map(Content::Colour)
        }
    }
}

/// Sends a command and fetches its reply until it is there.
fn exchange<L: UsbLink>(link: &mut L, tag: &mut u16, command: CameraCommand) -> Result<Vec<u8>> {
    let sent = *tag;
    *tag = tag.wrapping_add(1);
    let out = Request {
        kind: 0x40,
        request: 0,
        value: 0,
    };
    link.control_out(out, &command.to_bytes(sent))?;
    let begin = Instant::now();
    while begin.elapsed() < REPLY {
        let bytes = link.control_in(Request { kind: 0xc0, ..out }, REPLY_BYTES)?;
        if let Reply::Payload(payload) = parse_reply(&bytes, command.code(), sent)? {
            return Ok(payload.to_vec());
        }
        std::thread::sleep(BETWEEN);
    }
    Err(Error::Timeout {
        device: link.name(),
        action: format!("{command:?}"),
        seconds: REPLY.as_secs_f64(),
    })
}
