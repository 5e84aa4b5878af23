//! A Kinect camera in the same process: the real control messages and packets, of any pictures.

use super::kinect_registers::Registers;
use crate::bits::pack;
use crate::colour::mosaic;
use crate::kinect::Mode;
use crate::kinect::registers::{DEPTH_ENDPOINT, DEPTH_STREAM, VIDEO_ENDPOINT, VIDEO_STREAM};
use crate::usb::{Request, UsbLink};
use crate::usb_packet::{HEADER_BYTES, Header, Place};
use crate::{Error, Result};
use sphereflow_core::{Plane, Stamp};
use std::time::Duration;

/// What the cameras see: raw disparities and colour, 640x480 each.
pub type Picture = (Plane<u16>, Plane<[u8; 3]>);

/// What goes wrong, by packet numbers of each stream.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KinectScript {
    /// Every so many packets one is lost; 0 for none.
    pub lose_every: u64,
    /// After so many packets the device is unplugged; 0 for never.
    pub unplug_after: u64,
    /// Ticks of the device's clock when it starts.
    pub first_tick: u32,
}

struct Stream {
    endpoint: u8,
    register: u16,
    mode: Mode,
    submitted: bool,
    data: Vec<u8>,
    frame: usize,
    packet: usize,
    sent: u64,
}

/// The device. Its time is that of its packets, so that a slow computer loses nothing.
pub struct KinectSimulator {
    registers: Registers,
    streams: [Stream; 2],
    script: KinectScript,
    picture: Box<dyn FnMut(usize) -> Picture + Send>,
    started: Stamp,
}

impl KinectSimulator {
    /// A device that sees `picture(i)` in frame `i` of each stream; its first frame is taken at
    /// `started`.
    pub fn new(
        script: KinectScript,
        started: Stamp,
        picture: impl FnMut(usize) -> Picture + Send + 'static,
    ) -> Self {
        let stream = |endpoint, register, mode| Stream {
            endpoint,
            register,
            mode,
            submitted: false,
            data: Vec::new(),
            frame: 0,
            packet: 0,
            sent: 0,
        };
        Self {
            registers: Registers::default(),
            streams: [
                stream(DEPTH_ENDPOINT, DEPTH_STREAM, Mode::DEPTH_11),
                stream(VIDEO_ENDPOINT, VIDEO_STREAM, Mode::BAYER),
            ],
            script,
            picture: Box::new(picture),
            started,
        }
    }

    /// The next packet of a stream, `None` where it is lost; and when it comes.
    fn packet(&mut self, which: usize) -> (Option<Vec<u8>>, Stamp) {
        let stream = &mut self.streams[which];
        if stream.packet == 0 {
            let (disparity, colour) = (self.picture)(stream.frame);
            stream.data = if which == 0 {
                pack(11, disparity.data())
            } else {
                mosaic(&colour)
            };
            stream.data.resize(stream.mode.frame_bytes(), 0xff);
        }
        let (index, count) = (stream.packet, stream.mode.packets());
        let place = match index {
            0 => Place::Start,
            i if i + 1 == count => Place::End,
            _ => Place::Middle,
        };
        let begin = index * stream.mode.packet_data();
        let data = &stream.data[begin..begin + stream.mode.data_of(index)];
        let header = Header {
            stream: stream.mode.stream(),
            place,
            sequence: [0, stream.sent as u8],
            length: HEADER_BYTES + data.len(),
            ticks: match place {
                Place::Start => 0,
                _ => self
                    .script
                    .first_tick
                    .wrapping_add(2_000_000 * stream.frame as u32),
            },
        };
        let bytes: Vec<u8> = header.to_bytes().iter().chain(data).copied().collect();
        let share = (index + 1) as f64 / count as f64;
        let arrived = self
            .started
            .plus_seconds((stream.frame as f64 + share) / 30.0);
        stream.sent += 1;
        (stream.packet, stream.frame) = if index + 1 == count {
            (0, stream.frame + 1)
        } else {
            (index + 1, stream.frame)
        };
        let lost = self.script.lose_every > 0 && stream.sent.is_multiple_of(self.script.lose_every);
        ((!lost).then_some(bytes), arrived)
    }

    fn check_plugged(&self) -> Result<()> {
        let sent: u64 = self.streams.iter().map(|stream| stream.sent).sum();
        if self.script.unplug_after > 0 && sent >= self.script.unplug_after {
            return Err(Error::Unplugged {
                device: self.name(),
            });
        }
        Ok(())
    }

    fn stream(&mut self, endpoint: u8) -> Result<&mut Stream> {
        let name = self.name();
        self.streams
            .iter_mut()
            .find(|stream| stream.endpoint == endpoint)
            .ok_or_else(|| {
                Error::protocol(name, "endpoint", "0x81 or 0x82", format!("{endpoint:#04x}"))
            })
    }
}

impl UsbLink for KinectSimulator {
    fn name(&self) -> String {
        "sim:kinect".into()
    }

    fn control_out(&mut self, request: Request, data: &[u8]) -> Result<()> {
        self.check_plugged()?;
        if request.kind == 0x40 && request.request == 0 && self.registers.receive(data) {
            return Ok(());
        }
        Err(Error::protocol(
            self.name(),
            "control transfer",
            "a command",
            format!("{request:?}"),
        ))
    }

    fn control_in(&mut self, _request: Request, length: usize) -> Result<Vec<u8>> {
        self.check_plugged()?;
        let mut reply = self.registers.fetch();
        reply.truncate(length);
        Ok(reply)
    }

    fn submit(&mut self, endpoint: u8) -> Result<()> {
        self.stream(endpoint)?.submitted = true;
        Ok(())
    }

    fn drain(&mut self, endpoint: u8) -> Result<()> {
        self.stream(endpoint)?.submitted = false;
        Ok(())
    }

    fn packets(
        &mut self,
        timeout: Duration,
        packet: &mut dyn FnMut(u8, &[u8], Stamp),
    ) -> Result<usize> {
        let mut count = 0;
        for which in 0..self.streams.len() {
            let stream = &self.streams[which];
            let endpoint = stream.endpoint;
            if !stream.submitted || self.registers.get(stream.register) == 0 {
                continue;
            }
            // both streams end their frames together
            for _ in 0..stream.mode.packets() {
                self.check_plugged()?;
                let (bytes, arrived) = self.packet(which);
                if let Some(bytes) = bytes {
                    packet(endpoint, &bytes, arrived);
                }
                count += 1;
            }
        }
        if count == 0 {
            std::thread::sleep(timeout.min(Duration::from_millis(1)));
        }
        Ok(count)
    }
}
