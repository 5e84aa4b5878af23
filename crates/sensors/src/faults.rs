//! What went wrong in a stream, counted: nothing is lost without a number that says so.

/// Counts of a stream of packets that make images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketFaults {
    /// Packets that were placed in a frame.
    pub packets: u64,
    /// Packets missing in the frames that came out, by their sequence numbers.
    pub lost: u64,
    /// Packets that came after a later one, and were still placed.
    pub late: u64,
    /// Packets, or pieces of them, without a header that makes sense.
    pub malformed: u64,
    /// Packets that were put together from halves out of phase.
    pub misaligned: u64,
    /// Times that flags and sequence numbers contradicted each other and a new start was awaited.
    pub resyncs: u64,
    /// Packets passed over while waiting for a start.
    pub unsynchronised: u64,
    /// Frames that came out with every packet in its place.
    pub complete_frames: u64,
    /// Frames that came out with packets missing.
    pub incomplete_frames: u64,
}

/// Counts of a stream of messages, as serial sensors send them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MessageFaults {
    /// Messages that were read.
    pub messages: u64,
    /// Messages of the right form with a wrong checksum.
    pub bad_checksums: u64,
    /// Messages with a right checksum and content that makes no sense.
    pub malformed: u64,
    /// Bytes passed over to find the next message.
    pub skipped_bytes: u64,
    /// Messages missing between those that came, by their counters.
    pub lost: u64,
    /// Messages whose time or counter stepped back.
    pub steps_back: u64,
}
