//! One pass over untrusted bytes before anything is built from them: are they exactly one CBOR item of definite
//! length, within the limits of depth and item count? It allocates nothing and recurses never, so that whatever
//! follows can trust every declared length.

use crate::limits::{MAX_DEPTH, MAX_ITEMS};
use crate::reject::{CborFault, Refusal};

fn malformed(offset: usize, fault: CborFault) -> Refusal {
    Refusal::Malformed { offset: offset as u64, fault }
}

/// Checks that `bytes` are one well-formed item and nothing more; gives the length of the longest item without the
/// items in it: of the longest string, that is, with its head.
pub(crate) fn check(bytes: &[u8]) -> Result<usize, Refusal> {
    let mut offset = 0;
    let mut longest = 0;
    let mut items = 0;
    // Items still owed at each level of nesting; the first level owes the one item itself.
    let mut owed = [0; MAX_DEPTH + 1];
    owed[0] = 1;
    let mut depth = 0;
    loop {
        while owed[depth] == 0 {
            if depth == 0 {
                let trailing = malformed(offset, CborFault::TrailingBytes);
                return if offset == bytes.len() { Ok(longest) } else { Err(trailing) };
            }
            depth -= 1;
        }
        owed[depth] -= 1;
        items += 1;
        if items > MAX_ITEMS {
            return Err(malformed(offset, CborFault::TooManyItems));
        }
        let (next, children) = item(bytes, offset)?;
        if children > 0 {
            if depth == MAX_DEPTH {
                return Err(malformed(offset, CborFault::TooDeep));
            }
            depth += 1;
            owed[depth] = children;
        }
        longest = longest.max(next - offset);
        offset = next;
    }
}

/// Reads the head of one item and skips its bytes if it is a string: (offset after it, items that belong to it).
fn item(bytes: &[u8], offset: usize) -> Result<(usize, usize), Refusal> {
    let fault = |fault| malformed(offset, fault);
    let initial = *bytes.get(offset).ok_or_else(|| fault(CborFault::CutShort))?;
    let major = initial >> 5;
    let info = initial & 0x1f;
    let width = match info {
        0..24 => 0,
        24 => 1,
        25 => 2,
        26 => 4,
        27 => 8,
        31 => return Err(fault(CborFault::IndefiniteLength)),
        _ => return Err(fault(CborFault::ReservedInformation)),
    };
    let after = offset + 1 + width;
    let argument = bytes.get(offset + 1..after).ok_or_else(|| fault(CborFault::CutShort))?;
    let argument = argument.iter().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
    let argument = if width == 0 { u64::from(info) } else { argument };
    // Every owed item takes a byte at least, so no honest length exceeds what is left.
    let left = (bytes.len() - after) as u64;
    match major {
        0 | 1 => Ok((after, 0)),
        2 | 3 if argument <= left => Ok((after + argument as usize, 0)),
        4 if argument <= left => Ok((after, argument as usize)),
        5 if argument <= left / 2 => Ok((after, 2 * argument as usize)),
        2..=5 => Err(fault(CborFault::CutShort)),
        6 => Ok((after, 1)),
        _ if matches!(info, 20..=23 | 25..=27) => Ok((after, 0)),
        _ => Err(fault(CborFault::UnassignedSimple)),
    }
}
