//! An open PS1080 with bulk endpoints: parameters read, streams started, frames on the host's clock.

use super::{
    BulkSplitter, DEPTH_STREAM, DepthFormat, FrameAssembler, IMAGE_STREAM, ImageFormat, Opcode,
    Parameter, RawFrame, Reply, StreamSettings, Version, decode_depth, decode_image, padding_of,
    parse_reply, parse_version, request, start_depth, start_image, stop,
};
use crate::clock::StreamClock;
use crate::disparity::{DisparityModel, DisparityTable};
use crate::kinect::{parse_fixed_parameters, parse_shift};
use crate::usb::{Request, UsbLink};
use crate::{Error, PacketFaults, Result};
use sphereflow_core::{DepthMap, Plane, Stamp};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Endpoints of depth and images: the other way round than a Kinect's.
pub(crate) const DEPTH_ENDPOINT: u8 = 0x81;
pub(crate) const IMAGE_ENDPOINT: u8 = 0x82;

/// Ticks of the device clock per second.
const TICKS_PER_SECOND: f64 = 60e6;
/// How long a reply is awaited; a busy device is asked again after [`BUSY`].
const REPLY: Duration = Duration::from_secs(5);
const BUSY: Duration = Duration::from_secs(1);
/// Between two fetches of a reply.
const BETWEEN: Duration = Duration::from_millis(1);
/// Bytes of the fixed parameters.
const FIXED_BYTES: usize = 168;

/// What a frame shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Depth: raw disparities, and metres in the depth camera's pixels.
    Depth(Plane<u16>, DepthMap),
    /// Colour.
    Colour(Plane<[u8; 3]>),
}

/// A frame on the host's clock.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// When it was taken, by the device's clock; where its last packet is missing, when it arrived.
    pub stamp: Stamp,
    /// What it shows; what came after a gap is unknown.
    pub content: Content,
    /// Whether every packet came and held exactly the image's pixels.
    pub complete: bool,
}

#[derive(Clone, Copy)]
enum Settings {
    Depth(StreamSettings<DepthFormat>),
    Image(StreamSettings<ImageFormat>),
}

struct Stream {
    endpoint: u8,
    settings: Settings,
    splitter: BulkSplitter,
    assembler: FrameAssembler,
    clock: StreamClock,
}

/// An open camera.
pub struct Camera<L: UsbLink> {
    link: L,
    id: u16,
    version: Version,
    model: DisparityModel,
    table: DisparityTable,
    streams: Vec<Stream>,
    waiting: VecDeque<CameraFrame>,
}

impl<L: UsbLink> Camera<L> {
    /// Reads the parameters of a device.
    ///
    /// # Errors
    /// Where the device does not answer as a PS1080.
    pub fn open(mut link: L) -> Result<Self> {
        let mut id = 0;
        let mut ask = |opcode, words: &[u16]| exchange(&mut link, &mut id, opcode, words);
        let version = parse_version(&ask(Opcode::Version, &[])?)?;
        let mut fixed = Vec::new();
        while fixed.len() < FIXED_BYTES {
            let page = ask(Opcode::FixedParameters, &[(fixed.len() / 4) as u16])?;
            if page.is_empty() {
                break; // too few: the parser says how many
            }
            fixed.extend(page);
        }
        let shift = parse_shift(&ask(Opcode::Algorithm, &[0, 3, 1, 30, 0])?)?;
        let model = parse_fixed_parameters(&fixed, shift)?;
        let table = model.table();
        let (streams, waiting) = (Vec::new(), VecDeque::new());
        Ok(Self {
            link,
            id,
            version,
            model,
            table,
            streams,
            waiting,
        })
    }

    /// Version of the firmware.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The device's own geometry.
    pub fn model(&self) -> &DisparityModel {
        &self.model
    }

    /// What went wrong so far: of depth, of images.
    pub fn faults(&self) -> [Option<PacketFaults>; 2] {
        [DEPTH_ENDPOINT, IMAGE_ENDPOINT].map(|endpoint| {
            let stream = self
                .streams
                .iter()
                .find(|stream| stream.endpoint == endpoint);
            stream.map(|stream| stream.assembler.faults())
        })
    }

    /// Starts depth.
    ///
    /// # Errors
    /// Where the device refuses.
    pub fn start_depth(&mut self, settings: StreamSettings<DepthFormat>) -> Result<()> {
        let steps = start_depth(&settings);
        self.start(
            DEPTH_ENDPOINT,
            DEPTH_STREAM,
            Settings::Depth(settings),
            &steps,
        )
    }

    /// Starts colour.
    ///
    /// # Errors
    /// Where the device refuses.
    pub fn start_image(&mut self, settings: StreamSettings<ImageFormat>) -> Result<()> {
        let steps = start_image(&settings);
        self.start(
            IMAGE_ENDPOINT,
            IMAGE_STREAM,
            Settings::Image(settings),
            &steps,
        )
    }

    fn start(
        &mut self,
        endpoint: u8,
        stream: u8,
        settings: Settings,
        steps: &[(Parameter, u16)],
    ) -> Result<()> {
        self.streams.retain(|stream| stream.endpoint != endpoint);
        self.streams.push(Stream {
            endpoint,
            settings,
            splitter: BulkSplitter::default(),
            assembler: FrameAssembler::new(stream),
            clock: StreamClock::new(TICKS_PER_SECOND)?,
        });
        self.link.submit(endpoint)?;
        self.set(steps)
    }

    /// Stops both streams.
    ///
    /// # Errors
    /// Where the device refuses.
    pub fn stop(&mut self) -> Result<()> {
        self.set(&stop())?;
        for stream in std::mem::take(&mut self.streams) {
            self.link.drain(stream.endpoint)?;
        }
        Ok(())
    }

    fn set(&mut self, steps: &[(Parameter, u16)]) -> Result<()> {
        for (parameter, value) in steps {
            let words = [*parameter as u16, *value];
            exchange(&mut self.link, &mut self.id, Opcode::SetParameter, &words)?;
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
            let (streams, waiting) = (&mut self.streams, &mut self.waiting);
            let (table, pads) = (&self.table, self.version.pads_depth());
            self.link.packets(left, &mut |endpoint, bytes, arrived| {
                let stream = streams
                    .iter_mut()
                    .find(|stream| stream.endpoint == endpoint);
                let Some(Stream {
                    settings,
                    splitter,
                    assembler,
                    clock,
                    ..
                }) = stream
                else {
                    return;
                };
                splitter.push(bytes, |packet| {
                    let Some(frame) = assembler.push(packet) else {
                        return;
                    };
                    let stamp = clock.stamp(frame.ticks, arrived);
                    let decoded = decode(&frame, settings, table, pads);
                    waiting.extend(decoded.map(|(content, exact)| CameraFrame {
                        stamp,
                        content,
                        complete: exact && frame.complete,
                    }));
                });
            })?;
        }
    }
}

fn decode(
    frame: &RawFrame,
    settings: &Settings,
    table: &DisparityTable,
    pads: bool,
) -> Option<(Content, bool)> {
    match settings {
        Settings::Depth(settings) => {
            let padding = if pads {
                padding_of(frame.start_ticks)
            } else {
                (0, 0)
            };
            let size = settings.resolution.size();
            let (raw, exact) = decode_depth(settings.format, size, padding, &frame.data);
            let depth = table.apply(&raw);
            Some((Content::Depth(raw, depth), exact))
        }
        Settings::Image(settings) => {
            decode_image(settings.format, settings.resolution.size(), &frame.data)
                .map(|(colour, exact)| (Content::Colour(colour), exact))
        }
    }
}

/// Sends a message and fetches its reply until it is there.
fn exchange<L: UsbLink>(
    link: &mut L,
    id: &mut u16,
    opcode: Opcode,
    words: &[u16],
) -> Result<Vec<u8>> {
    let begin = Instant::now();
    let out = Request {
        kind: 0x40,
        request: 0,
        value: 0,
    };
    while begin.elapsed() < REPLY {
        *id = id.wrapping_add(1);
        link.control_out(out, &request(opcode, *id, words))?;
        while begin.elapsed() < REPLY {
            let bytes = link.control_in(Request { kind: 0xc0, ..out }, 512)?;
            match parse_reply(&bytes, opcode, *id)? {
                Reply::Payload(payload) => return Ok(payload.to_vec()),
                Reply::NotReady => std::thread::sleep(BETWEEN),
                Reply::Busy => {
                    std::thread::sleep(BUSY);
                    break; // send it again
                }
            }
        }
    }
    Err(Error::Timeout {
        device: link.name(),
        action: format!("{opcode:?}"),
        seconds: REPLY.as_secs_f64(),
    })
}
