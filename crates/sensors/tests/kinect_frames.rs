//! Frames of a Kinect from packets that are lost, late, out of phase, or garbage.

mod common;

use common::{frame_data, packets};
use sphereflow_sensors::PacketFaults;
use sphereflow_sensors::kinect::{FrameAssembler, Mode, RawFrame};

fn frames_of(mode: Mode, packets: &[Vec<u8>]) -> (Vec<RawFrame>, PacketFaults) {
    let (mut assembler, mut frames) = (FrameAssembler::new(mode), Vec::new());
    for packet in packets {
        assembler.push(packet, |frame| frames.push(frame));
    }
    (frames, assembler.faults())
}

#[test]
fn frames_without_loss_are_complete_in_every_mode() {
    for mode in [
        Mode::DEPTH_11,
        Mode::DEPTH_10,
        Mode::BAYER,
        Mode::UYVY,
        Mode::INFRARED,
    ] {
        let (frames, faults) = frames_of(mode, &packets(&mode, 3));
        assert_eq!(frames.len(), 3, "{mode:?}");
        for (i, frame) in frames.iter().enumerate() {
            assert!(
                frame.is_complete() && frame.data == frame_data(&mode, i),
                "{mode:?} {i}"
            );
            assert_eq!(frame.ticks, Some(2_000_000 * (i as u32 + 1)));
        }
        assert_eq!((faults.lost, faults.complete_frames), (0, 3));
    }
}

#[test]
fn frames_with_lost_packets_mark_exactly_those_bytes() {
    let mode = Mode::DEPTH_11;
    // first, middle and last packets, and a run over the border of two frames
    for lost in [
        vec![242],
        vec![300, 301],
        vec![483],
        (480..490).collect::<Vec<_>>(),
    ] {
        let all = packets(&mode, 3);
        let kept = all.iter().enumerate().filter(|(i, _)| !lost.contains(i));
        let kept: Vec<Vec<u8>> = kept.map(|(_, packet)| packet.clone()).collect();
        let (frames, faults) = frames_of(mode, &kept);
        assert_eq!(
            (frames.len(), faults.lost as usize),
            (3, lost.len()),
            "{lost:?}"
        );
        for (i, frame) in frames.iter().enumerate() {
            let good = frame_data(&mode, i);
            let missing: usize = frame.missing.iter().map(|range| range.len()).sum();
            let gone = lost.iter().filter(|p| *p / 242 == i);
            assert_eq!(
                missing,
                gone.map(|p| mode.data_of(p % 242)).sum::<usize>(),
                "{lost:?}"
            );
            for (at, (a, b)) in frame.data.iter().zip(&good).enumerate() {
                let marked = frame.missing.iter().any(|range| range.contains(&at));
                assert!(
                    if marked { *a == 0xff } else { a == b },
                    "{lost:?} byte {at}"
                );
            }
            assert_eq!(
                frame.ticks.is_none(),
                lost.contains(&(i * 242 + 241)),
                "{lost:?}"
            );
        }
    }
}

#[test]
fn missing_depth_has_no_readings() {
    let mut all = packets(&Mode::DEPTH_11, 1);
    all.remove(100);
    let (frames, _) = frames_of(Mode::DEPTH_11, &all);
    let pixels = frames[0].unpacked().unwrap();
    let range = &frames[0].missing[0];
    let inside = range.start * 8 / 11 + 1..range.end * 8 / 11 - 1;
    assert!(
        inside.clone().all(|i| pixels.data()[i] == 2047),
        "{inside:?}"
    );
}

#[test]
fn late_packets_are_placed_and_counted() {
    let mut all = packets(&Mode::BAYER, 2);
    all.swap(50, 52);
    let (frames, faults) = frames_of(Mode::BAYER, &all);
    assert!(frames.iter().all(RawFrame::is_complete));
    assert_eq!((faults.lost, faults.late), (0, 2));
}

#[test]
fn packets_out_of_phase_are_put_together() {
    for mode in [Mode::DEPTH_11, Mode::BAYER] {
        let all = packets(&mode, 2);
        let halves: Vec<&[u8]> = all
            .iter()
            .flat_map(|p| [&p[..p.len().min(960)], &p[p.len().min(960)..]])
            .collect();
        let mut usb: Vec<Vec<u8>> = vec![halves[0].to_vec()];
        usb.extend(halves[1..].chunks(2).map(|pair| pair.concat()));
        let (frames, faults) = frames_of(mode, &usb);
        assert_eq!(frames.len(), 2, "{mode:?} {faults:?}");
        assert!(
            frames.iter().all(RawFrame::is_complete),
            "{mode:?} {faults:?}"
        );
        assert!(faults.misaligned > 300, "{faults:?}");
    }
}

#[test]
fn stream_joined_in_the_middle_waits_for_a_start() {
    let all = packets(&Mode::DEPTH_11, 3);
    let (frames, faults) = frames_of(Mode::DEPTH_11, &all[100..]);
    assert_eq!(frames.len(), 2);
    assert_eq!(
        (faults.unsynchronised, faults.lost, faults.complete_frames),
        (142, 0, 2)
    );
}

#[test]
fn a_loss_of_as_many_packets_as_the_counter_holds_is_noticed_by_the_flags() {
    let mut all = packets(&Mode::DEPTH_11, 4);
    all.drain(300..556);
    let (frames, faults) = frames_of(Mode::DEPTH_11, &all);
    assert!(faults.resyncs >= 1, "{faults:?}");
    for frame in frames.iter().filter(|frame| frame.is_complete()) {
        let index = frame.ticks.unwrap() as usize / 2_000_000 - 1;
        assert_eq!(frame.data, frame_data(&Mode::DEPTH_11, index));
    }
}

#[test]
fn garbage_between_packets_is_counted_and_harms_nothing() {
    let mut all = packets(&Mode::BAYER, 2);
    all.insert(40, vec![0x5a; 1920]);
    all.insert(10, vec![]);
    all.insert(200, vec![0x52, 0x42, 0, 0x72]);
    let (frames, faults) = frames_of(Mode::BAYER, &all);
    assert!(frames.iter().all(RawFrame::is_complete) && frames.len() == 2);
    assert_eq!(faults.malformed, 2);
}
