//! The configuration against scripted answers.

use super::*;

/// All bytes sent, with `product` told by the device.
fn run(setup: &mut Setup, product: [u16; 4]) -> Result<Vec<[u8; 3]>> {
    let mut sent = Vec::new();
    loop {
        match setup.next() {
            Action::Done => return Ok(sent),
            Action::Discard(_) => {}
            Action::Send(bytes) => sent.push(bytes),
            Action::Ask(bytes) => {
                let value: u16 = match bytes[0] {
                    0x02 => 0x0400,
                    0x4c => 0x5345,
                    0x06 => 0,
                    address => product[usize::from(address - 0x6a) / 2],
                };
                let [high, low] = value.to_be_bytes();
                setup.answer(&[bytes[0], high, low, 0x0d])?;
            }
        }
    }
}

const G366: [u16; 4] = [0x3347, 0x3636, 0x4450, 0x3047]; // as a device's register dump has them

#[test]
fn setup_sends_the_known_bytes_for_125_hz() {
    let mut setup = Setup::new(BurstFormat::STANDARD, 125.0).unwrap();
    let sent = run(&mut setup, G366).unwrap();
    assert_eq!(setup.product(), "G366PDG0");
    let expected = [
        [0xfe, 0, 0x0d],
        [0x83, 2, 0x0d],
        [0xfe, 0, 0x0d],
        [0xfe, 1, 0x0d],
        [0x85, 4, 0x0d],
        [0x88, 1, 0x0d],
        [0x8c, 7, 0x0d],
        [0x8d, 0xf0, 0x0d],
        [0x8f, 0, 0x0d],
        [0xfe, 0, 0x0d],
        [0x83, 1, 0x0d],
    ];
    assert_eq!(sent, expected);
    assert_eq!(setup.next(), Action::Done);
}

#[test]
fn setup_refuses_rates_that_do_not_exist_or_do_not_fit() {
    let text = Setup::new(BurstFormat::STANDARD, 120.0)
        .unwrap_err()
        .to_string();
    assert!(text.contains("125") && text.contains("120"), "{text}");
    assert!(Setup::new(BurstFormat::STANDARD, 2000.0).is_err()); // 48 000 bytes per second
    assert!(Setup::new(BurstFormat::STANDARD, 1000.0).is_ok());
}

#[test]
fn setup_with_an_unknown_model_names_the_known_ones() {
    let mut setup = Setup::new(BurstFormat::STANDARD, 125.0).unwrap();
    let text = run(&mut setup, [0x3347, 0x3035, 0x4450, 0x3047])
        .unwrap_err()
        .to_string();
    assert!(text.contains("G350PDG0") && text.contains("G366"), "{text}");
}

#[test]
fn setup_with_a_wrong_answer_or_a_device_that_hangs_ends() {
    let mut setup = Setup::new(BurstFormat::STANDARD, 125.0).unwrap();
    while !matches!(setup.next(), Action::Ask(_)) {}
    assert!(setup.answer(&[0x03, 0, 0, 0x0d]).is_err());
    let hung = (0..1000).find(|_| setup.answer(&[0x02, 0, 0, 0x0d]).is_err());
    assert_eq!(hung, Some(TRIES as usize));
}
