//! The part of HDF5 that a VTKHDF file needs: groups, attributes, and datasets of known shape that
//! are stored in one piece.
//!
//! Values come first in the file, metadata last, and the superblock, which makes the file readable,
//! at the very end of writing. Every HDF5 library since 1.8 (2008) reads the result. Format:
//! "HDF5 File Format Specification Version 3.0" (The HDF Group); the sections are named below.

use std::io::{self, Seek, SeekFrom, Write};

use super::vtu::Values;

/// Size of the superblock, in bytes.
const SUPERBLOCK: u64 = 48;
/// An address that does not exist.
const UNDEFINED: u64 = u64::MAX;

/// Types of header messages ("Data Object Header Messages").
const DATASPACE: u8 = 0x01;
const LINK_INFO: u8 = 0x02;
const DATATYPE: u8 = 0x03;
const FILL_VALUE: u8 = 0x05;
const LINK: u8 = 0x06;
const LAYOUT: u8 = 0x08;
const GROUP_INFO: u8 = 0x0a;
const ATTRIBUTE: u8 = 0x0c;

/// A file that is being written.
#[derive(Debug)]
pub(super) struct Hdf5<W> {
    writer: W,
    /// The end of the space that datasets have reserved.
    end: u64,
}

/// An array in the file.
#[derive(Debug, Clone)]
pub(super) struct Dataset {
    datatype: Vec<u8>,
    /// Size of a value, in bytes.
    size: u64,
    shape: Vec<u64>,
    address: u64,
    attributes: Vec<Attribute>,
}

/// A value of a group or dataset.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    name: &'static str,
    datatype: Vec<u8>,
    dataspace: Vec<u8>,
    value: Vec<u8>,
}

/// Members of a group by name, and its attributes.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) attributes: Vec<Attribute>,
    pub(super) members: Vec<(&'static str, Object)>,
}

/// A member of a group.
#[derive(Debug)]
pub(super) enum Object {
    Group(Group),
    Dataset(Dataset),
}

impl<W: Write + Seek> Hdf5<W> {
    /// A file in an empty writer.
    pub(super) fn new(writer: W) -> Self {
        Self { writer, end: SUPERBLOCK }
    }

    /// Reserves space for an array of this shape, with values of the type of `like`.
    pub(super) fn dataset(&mut self, like: Values<'_>, shape: &[usize]) -> Dataset {
        let (datatype, size) = datatype(like);
        let shape: Vec<u64> = shape.iter().map(|&extent| extent as u64).collect();
        let address = self.end;
        self.end = (address + size * shape.iter().product::<u64>()).next_multiple_of(8);
        Dataset { datatype, size, shape, address, attributes: Vec::new() }
    }

    /// Writes values of a dataset from entry `start` on; entries that are never written are 0.
    pub(super) fn write(&mut self, dataset: &Dataset, start: usize, values: Values<'_>) -> io::Result<()> {
        debug_assert_eq!(datatype(values).0, dataset.datatype);
        debug_assert!((start + values.len()) as u64 <= dataset.shape.iter().product());
        self.writer.seek(SeekFrom::Start(dataset.address + dataset.size * start as u64))?;
        values.write(&mut self.writer)
    }

    /// An array with all of its values.
    pub(super) fn array(&mut self, values: Values<'_>, shape: &[usize]) -> io::Result<Dataset> {
        let dataset = self.dataset(values, shape);
        self.write(&dataset, 0, values)?;
        Ok(dataset)
    }

    /// Writes the metadata, then the superblock.
    pub(super) fn finish(mut self, root: &Group) -> io::Result<W> {
        let mut metadata = Metadata { start: self.end, bytes: Vec::new() };
        let root = metadata.group(root);
        self.writer.seek(SeekFrom::Start(self.end))?;
        self.writer.write_all(&metadata.bytes)?;
        let end = self.end + metadata.bytes.len() as u64;
        self.writer.rewind()?;
        self.writer.write_all(&superblock(root, end))?;
        Ok(self.writer)
    }
}

impl Dataset {
    /// Adds an attribute.
    pub(super) fn attribute(&mut self, attribute: Attribute) {
        self.attributes.push(attribute);
    }
}

impl Attribute {
    /// Whole numbers, as a vector.
    pub(super) fn integers(name: &'static str, values: &[i64]) -> Self {
        let value = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let shape = [values.len() as u64];
        Self { name, datatype: datatype(Values::I64(values)).0, dataspace: dataspace(&shape), value }
    }

    /// A single whole number.
    pub(super) fn integer(name: &'static str, value: i64) -> Self {
        Self { dataspace: dataspace(&[]), ..Self::integers(name, &[value]) }
    }

    /// An ASCII text without a terminating zero.
    pub(super) fn text(name: &'static str, text: &str) -> Self {
        // class 3, version 1; padded with zeros
        let mut datatype = vec![0x13, 1, 0, 0];
        datatype.extend((text.len() as u32).to_le_bytes());
        Self { name, datatype, dataspace: dataspace(&[]), value: text.as_bytes().to_vec() }
    }
}

/// Object headers, which are written behind each other.
struct Metadata {
    /// Address of the first byte.
    start: u64,
    bytes: Vec<u8>,
}

impl Metadata {
    /// Adds the members of a group, then the group; returns its address.
    fn group(&mut self, group: &Group) -> u64 {
        let mut messages = Messages::default();
        // Links are stored here, not in a heap with an index.
        let mut link_info = vec![0, 0];
        link_info.extend([UNDEFINED.to_le_bytes(); 2].as_flattened());
        messages.add(LINK_INFO, &link_info);
        messages.add(GROUP_INFO, &[0, 0]);
        for (name, object) in &group.members {
            let address = match object {
                Object::Group(group) => self.group(group),
                Object::Dataset(dataset) => self.dataset(dataset),
            };
            debug_assert!(name.len() < 256 && !name.contains(['/', '.']), "{name}");
            let mut link = vec![1, 0, name.len() as u8];
            link.extend(name.as_bytes());
            link.extend(address.to_le_bytes());
            messages.add(LINK, &link);
        }
        self.header(messages, &group.attributes)
    }

    fn dataset(&mut self, dataset: &Dataset) -> u64 {
        let mut messages = Messages::default();
        messages.add(DATASPACE, &dataspace(&dataset.shape));
        messages.add(DATATYPE, &dataset.datatype);
        // version 3; allocated late, written if set, and not set
        messages.add(FILL_VALUE, &[3, 0x0a]);
        let bytes = dataset.size * dataset.shape.iter().product::<u64>();
        let address = if bytes == 0 { UNDEFINED } else { dataset.address };
        // version 3, in one piece
        let mut layout = vec![3, 1];
        layout.extend([address.to_le_bytes(), bytes.to_le_bytes()].as_flattened());
        messages.add(LAYOUT, &layout);
        self.header(messages, &dataset.attributes)
    }

    /// "Version 2 Data Object Header Prefix".
    fn header(&mut self, mut messages: Messages, attributes: &[Attribute]) -> u64 {
        for Attribute { name, datatype, dataspace, value } in attributes {
            let mut message = vec![3, 0];
            for length in [name.len() + 1, datatype.len(), dataspace.len()] {
                message.extend((length as u16).to_le_bytes());
            }
            // names are ASCII
            message.push(0);
            message.extend(name.as_bytes());
            message.push(0);
            message.extend([&datatype[..], dataspace, value].concat());
            messages.add(ATTRIBUTE, &message);
        }
        let address = self.start + self.bytes.len() as u64;
        // the size of the messages has four bytes
        let mut header = b"OHDR\x02\x02".to_vec();
        header.extend((messages.0.len() as u32).to_le_bytes());
        header.extend(messages.0);
        header.extend(lookup3(&header).to_le_bytes());
        header.resize(header.len().next_multiple_of(8), 0);
        self.bytes.extend(header);
        address
    }
}

/// Header messages.
#[derive(Default)]
struct Messages(Vec<u8>);

impl Messages {
    fn add(&mut self, kind: u8, data: &[u8]) {
        self.0.push(kind);
        self.0.extend((data.len() as u16).to_le_bytes());
        self.0.push(0);
        self.0.extend(data);
    }
}

/// "Disk Format: Level 0A", version 2.
fn superblock(root: u64, end: u64) -> Vec<u8> {
    let mut block = b"\x89HDF\r\n\x1a\n".to_vec();
    // version; addresses and lengths of eight bytes; no flags
    block.extend([2, 8, 8, 0]);
    for address in [0, UNDEFINED, end, root] {
        block.extend(address.to_le_bytes());
    }
    block.extend(lookup3(&block).to_le_bytes());
    debug_assert_eq!(block.len() as u64, SUPERBLOCK);
    block
}

/// "The Datatype Message", version 1, and the size of a value in bytes.
fn datatype(values: Values<'_>) -> (Vec<u8>, u64) {
    // class, little-endian with a sign or not, size, first bit and number of bits
    let integer = |sign: u8, size: u8| vec![0x10, sign, 0, 0, size, 0, 0, 0, 0, 0, 8 * size, 0];
    // class, little-endian with an implied leading 1, sign bit, size, first bit and number of bits;
    // exponent and mantissa: first bit and number of bits; bias
    match values {
        Values::F64(_) => (vec![0x11, 0x20, 63, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xff, 3, 0, 0], 8),
        Values::F32(_) => (vec![0x11, 0x20, 31, 0, 4, 0, 0, 0, 0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0], 4),
        Values::I64(_) => (integer(8, 8), 8),
        Values::U8(_) => (integer(0, 1), 1),
    }
}

/// "The Dataspace Message", version 2: fixed extents, none for a single value.
fn dataspace(shape: &[u64]) -> Vec<u8> {
    let mut message = vec![2, shape.len() as u8, 0, u8::from(!shape.is_empty())];
    message.extend(shape.iter().flat_map(|extent| extent.to_le_bytes()));
    message
}

/// The checksum of metadata: Bob Jenkins, `lookup3.c` (May 2006, public domain), `hashlittle` from
/// 0.
fn lookup3(bytes: &[u8]) -> u32 {
    let mut state = [0xdead_beef_u32.wrapping_add(bytes.len() as u32); 3];
    let mut rest = bytes;
    while !rest.is_empty() {
        let mut block = [0; 12];
        let taken = rest.len().min(12);
        block[..taken].copy_from_slice(&rest[..taken]);
        rest = &rest[taken..];
        for (sum, word) in state.iter_mut().zip(block.as_chunks().0) {
            *sum = sum.wrapping_add(u32::from_le_bytes(*word));
        }
        if rest.is_empty() { last_mix(&mut state) } else { mix(&mut state) }
    }
    state[2]
}

fn mix([a, b, c]: &mut [u32; 3]) {
    let step = |x: &mut u32, y: &mut u32, z: &mut u32, turn: u32| {
        *x = x.wrapping_sub(*z) ^ z.rotate_left(turn);
        *z = z.wrapping_add(*y);
    };
    step(a, b, c, 4);
    step(b, c, a, 6);
    step(c, a, b, 8);
    step(a, b, c, 16);
    step(b, c, a, 19);
    step(c, a, b, 4);
}

fn last_mix([a, b, c]: &mut [u32; 3]) {
    let step = |x: &mut u32, y: u32, turn: u32| *x = (*x ^ y).wrapping_sub(y.rotate_left(turn));
    step(c, *b, 14);
    step(a, *c, 11);
    step(b, *a, 25);
    step(c, *b, 16);
    step(a, *c, 4);
    step(b, *a, 14);
    step(c, *b, 24);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values that the author of the function gives in its source.
    #[test]
    fn the_checksum_is_that_of_its_author() {
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }
}
