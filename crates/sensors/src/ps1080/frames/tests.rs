//! Frames from packets with losses, and packets from a bulk stream cut anywhere.

use super::*;

fn packet(place: Place, id: u16, data: &[u8]) -> Vec<u8> {
    let header = Header {
        stream: 0x70,
        place,
        sequence: id.to_le_bytes(),
        length: HEADER_BYTES + data.len(),
        ticks: 1000 + u32::from(id),
    };
    header.to_bytes().iter().chain(data).copied().collect()
}

/// Packets of frames of four packets each.
fn packets(frames: u16) -> Vec<Vec<u8>> {
    let place = |i| match i % 4 {
        0 => Place::Start,
        3 => Place::End,
        _ => Place::Middle,
    };
    (0..4 * frames)
        .map(|i| packet(place(i), 65_530_u16.wrapping_add(i), &[i as u8; 50]))
        .collect()
}

fn frames_of(packets: &[Vec<u8>]) -> (Vec<RawFrame>, PacketFaults) {
    let mut assembler = FrameAssembler::new(0x70);
    let frames = packets
        .iter()
        .filter_map(|packet| assembler.push(packet))
        .collect();
    (frames, assembler.faults())
}

#[test]
fn frames_without_loss_are_complete_over_the_wrap_of_the_counter() {
    let (frames, faults) = frames_of(&packets(5));
    assert_eq!(frames.len(), 5);
    assert!(
        frames
            .iter()
            .all(|frame| frame.complete && frame.data.len() == 200)
    );
    assert_eq!(frames[1].ticks, Some(1000 + 1)); // packet 7 of 65530 on
    assert_eq!(
        (faults.lost, faults.complete_frames, faults.packets),
        (0, 5, 20)
    );
}

#[test]
fn frames_with_a_lost_packet_are_marked_and_the_loss_is_counted() {
    for lost in 4..8 {
        let mut packets = packets(3);
        packets.remove(lost);
        let (frames, faults) = frames_of(&packets);
        assert_eq!(faults.lost, 1, "packet {lost}");
        let complete = frames.iter().filter(|frame| frame.complete).count();
        assert_eq!(complete, 2, "packet {lost}");
        // the frame whose start is missing is passed over, any other comes out marked
        assert_eq!(frames.len(), if lost == 4 { 2 } else { 3 });
    }
}

#[test]
fn bulk_stream_cut_anywhere_gives_the_same_packets() {
    let packets = packets(3);
    let stream: Vec<u8> = [7, 0x52].into_iter().chain(packets.concat()).collect();
    for size in [1, 2, 13, 61, 62, 63, 512] {
        let (mut splitter, mut found) = (BulkSplitter::default(), Vec::new());
        for piece in stream.chunks(size) {
            splitter.push(piece, |packet| found.push(packet.to_vec()));
        }
        assert_eq!(found, packets, "pieces of {size}");
        assert_eq!(splitter.skipped_bytes(), 2);
    }
}

#[test]
fn bulk_stream_with_garbage_between_goes_on_with_the_next_packet() {
    let packets = packets(2);
    let mut stream = packets[..3].concat();
    stream.extend([0x52, 0x42, 9, 9, 9]);
    stream.extend(packets[3..].concat());
    let (mut splitter, mut found) = (BulkSplitter::default(), Vec::new());
    splitter.push(&stream, |packet| found.push(packet.to_vec()));
    assert_eq!(found, packets);
    assert_eq!(splitter.skipped_bytes(), 5);
}

#[test]
fn frame_without_end_does_not_grow_without_bound() {
    let mut assembler = FrameAssembler::new(0x70);
    assembler.push(&packet(Place::Start, 0, &[]));
    for id in 1..2000_u16 {
        assembler.push(&packet(Place::Middle, id, &[0; 1800]));
        let held = assembler
            .frame
            .as_ref()
            .map_or(0, |frame| frame.data.capacity());
        assert!(held <= 2 * LARGEST_FRAME);
    }
    assert_eq!(assembler.faults().resyncs, 1);
}
