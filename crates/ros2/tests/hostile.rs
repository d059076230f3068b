//! What is wrong is refused by name, and what is right survives its way.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use curionav_ros2::attachment::Attachment;
use curionav_ros2::cdr::CdrFault;
use curionav_ros2::message::Message;
use curionav_ros2::messages::{DiagnosticStatus, GetResultResponse, LaserScan, Navigated, People, Person};
use curionav_ros2::testing::{Rng, TYPES, type_of};
use curionav_ros2::token::Token;

const SEED: u64 = 16;

/// The same payload in the other byte order, for a message of numbers of `size` bytes alone.
fn big_endian(payload: &[u8], size: usize) -> Vec<u8> {
    let content = payload[4..].chunks(size).flat_map(|number| number.iter().rev().copied());
    [0, 0, 0, 0].into_iter().chain(content).collect()
}

#[test]
fn every_type_survives_its_way_with_random_values() {
    println!("seed {SEED}");
    let mut rng = Rng::new(SEED);
    for of in TYPES {
        for _ in 0..200 {
            let sent = (of.random)(&mut rng).unwrap();
            assert_eq!((of.recode)(&sent).unwrap(), sent, "{}", of.name);
        }
    }
}

#[test]
fn both_byte_orders_say_the_same() {
    println!("seed {SEED}");
    let twist = type_of("geometry_msgs/msg/Twist").unwrap();
    let sent = (twist.random)(&mut Rng::new(SEED)).unwrap();
    assert_eq!((twist.recode)(&big_endian(&sent, 8)).unwrap(), sent);
}

#[test]
fn a_payload_over_its_limit_is_refused_before_it_is_read() {
    for of in TYPES {
        let error = (of.recode)(&vec![0; of.max_bytes + 1]).unwrap_err();
        assert_eq!(error.fault, CdrFault::TooLong { found: of.max_bytes + 1, most: of.max_bytes });
    }
}

#[test]
fn an_error_names_its_field() {
    let scan = LaserScan { ranges: vec![1.0; 3], ..LaserScan::default() };
    let mut payload = scan.encode().unwrap();
    let at = payload.len() - 4 * 3 - 8;
    payload[at..at + 4].copy_from_slice(&10_000_u32.to_le_bytes());
    let said = LaserScan::decode(&payload).unwrap_err().to_string();
    assert_eq!(said, "ranges: has a length of 10000; the most is 8192");
    payload[at..at + 4].copy_from_slice(&100_u32.to_le_bytes());
    assert_eq!(LaserScan::decode(&payload).unwrap_err().to_string(), "ranges: is cut short");
    payload[1] = 3;
    let said = LaserScan::decode(&payload).unwrap_err().to_string();
    assert_eq!(said, "message: has the encapsulation 0x0003; 0x0000 and 0x0001 are plain CDR");
    assert!(LaserScan::decode(&[]).is_err() && LaserScan::decode(&[0, 1, 0]).is_err());
    let trailing = [&scan.encode().unwrap()[..], &[0; 4]].concat();
    assert_eq!(LaserScan::decode(&trailing).unwrap_err().fault, CdrFault::Trailing(4));
}

#[test]
fn what_a_reader_would_refuse_is_not_written() {
    let many = People { people: vec![Person::default(); 1025], ..People::default() };
    assert_eq!(many.encode().unwrap_err().fault, CdrFault::TooLong { found: 1025, most: 1024 });
    for text in ["a\0b".to_owned(), "a".repeat(1025)] {
        let result = Navigated { error_msg: text, error_code: 1 };
        assert!(GetResultResponse { status: 6, result }.encode().is_err());
    }
    let longest = Navigated { error_msg: "a".repeat(1024), error_code: 1 };
    assert!(GetResultResponse { status: 6, result: longest }.encode().is_ok());
    assert_eq!(DiagnosticStatus::default().level, 0);
}

#[test]
fn no_text_makes_a_token_and_no_bytes_an_attachment_but_those_of_the_form() {
    println!("seed {SEED}");
    let good =
        "@ros2_lv/0/29c4/0/11/MP/%/%r1/base/%r1%odom/nav_msgs::msg::dds_::Odometry_/RIHS01_3c/::,10:,:,:,,";
    assert!(good.parse::<Token>().is_ok());
    for bad in [
        "",
        "@ros2_lv",
        "a/0/29c4/0/11/MP/%/%r1/base/%r1%odom/T/H/::,10:,:,:,,",
        "@ros2_lv/-1/29c4/0/11/MP/%/%r1/base/%r1%odom/T/H/::,10:,:,:,,",
        "@ros2_lv/0/29c4/0/11/XX/%/%r1/base/%r1%odom/T/H/::,10:,:,:,,",
        "@ros2_lv/0/29c4/0/11/MP/%/%r1/base/%r1%odom/T/H/::10",
        "@ros2_lv/0/29c4/0/11/MP/%/%r1/base/%r1%odom/T/H/::,10:,:,:,,/more",
        "@ros2_lv/0/29c4/0/11/MP/%/%r1/base",
        &"@".repeat(5000),
    ] {
        assert!(bad.parse::<Token>().is_err(), "{bad}");
    }
    let mut rng = Rng::new(SEED);
    for _ in 0..20_000 {
        let mut text = good.as_bytes().to_vec();
        let at = rng.below(text.len());
        text[at] = rng.below(128) as u8;
        text.truncate(rng.below(text.len() + 20).max(1));
        // Either is right; the point is that it returns.
        let _ = String::from_utf8_lossy(&text).parse::<Token>();
    }
    for length in (0..200).filter(|length| *length != 33) {
        assert!(Attachment::decode(&vec![16; length]).is_err());
    }
    let mut bytes = Attachment { sequence: -1, stamp_ns: i64::MAX, gid: [3; 16] }.encode();
    assert!(Attachment::decode(&bytes).is_ok());
    bytes[16] = 17;
    assert!(Attachment::decode(&bytes).is_err());
}
