//! Frames decoded ahead on worker threads, handed over in order.

use super::Recording;
use crate::{Error, Result};
use sphereflow_core::{Error as CoreError, RgbdFrame};
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// More workers than this gain nothing: decoding is then faster than anything that uses it.
const MAX_WORKERS: usize = 8;

/// An iterator over frames that are decoded while the caller works; see [`Recording::stream`].
///
/// Worker `w` of `n` decodes frames w, w + n, w + 2n, ... into a bounded channel of its own, and
/// the iterator takes from the channels in turn: frames come in order without any sorting.
/// Dropping the stream closes the channels, on which the workers end.
#[derive(Debug)]
pub struct FrameStream {
    channels: Vec<Receiver<Result<RgbdFrame>>>,
    workers: Vec<JoinHandle<()>>,
    taken: usize,
    total: usize,
}

impl Recording {
    /// Decode the frames of `range` ahead, at most about `prefetch` at a time (at least one),
    /// while the caller works. A frame that cannot be read is an `Err` naming its file; the
    /// stream goes on after it.
    ///
    /// # Errors
    /// [`Error::Core`] where `range` is not within the recording; [`Error::System`] where no
    /// thread can be started.
    pub fn stream(&self, range: Range<usize>, prefetch: usize) -> Result<FrameStream> {
        if range.start > range.end || range.end > self.len() {
            let expected = format!("frames within 0..{}", self.len());
            return Err(CoreError::value("range", expected, format!("{range:?}")).into());
        }
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        let count = cores.min(MAX_WORKERS).min(prefetch.max(1));
        let capacity = prefetch.max(1).div_ceil(count);
        let mut stream = FrameStream {
            channels: Vec::with_capacity(count),
            workers: Vec::with_capacity(count),
            taken: 0,
            total: range.len(),
        };
        for worker in 0..count {
            let (sender, receiver) = sync_channel(capacity);
            let recording = self.clone();
            let indices = (range.start + worker..range.end).step_by(count);
            let handle = std::thread::Builder::new()
                .name(format!("decode-{worker}"))
                .spawn(move || decode(&recording, indices, &sender))
                .map_err(Error::system(self.path(), "start a thread to read"))?;
            stream.channels.push(receiver);
            stream.workers.push(handle);
        }
        Ok(stream)
    }
}

fn decode(
    recording: &Recording,
    indices: impl Iterator<Item = usize>,
    sender: &SyncSender<Result<RgbdFrame>>,
) {
    for index in indices {
        if sender.send(recording.frame(index)).is_err() {
            return; // nobody listens any more
        }
    }
}

impl Iterator for FrameStream {
    type Item = Result<RgbdFrame>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.taken == self.total {
            return None;
        }
        let channel = self.channels.get(self.taken % self.channels.len().max(1))?;
        self.taken += 1;
        let lost = || CoreError::value("frame", "a decoded frame", "a decoder that stopped").into();
        Some(channel.recv().unwrap_or_else(|_| Err(lost())))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.total - self.taken;
        (left, Some(left))
    }
}

impl ExactSizeIterator for FrameStream {}

impl Drop for FrameStream {
    fn drop(&mut self) {
        self.channels.clear();
        for worker in self.workers.drain(..) {
            // A worker that panicked has already been reported as an `Err` item.
            let _ = worker.join();
        }
    }
}
