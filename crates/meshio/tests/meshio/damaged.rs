//! Damaged files: truncated, changed, with pieces missing or doubled. Whatever they hold, reading
//! ends with a mesh or an error that says something, and takes memory in proportion to the file.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use slipstick_meshio::{FileMesh, MeshFileError};

use crate::data;

/// Counts bytes, of all threads of this test program.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: all calls go to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller's layout.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's pointer and layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// More than any of the readers takes for a file of 16 kB, by far.
const MOST_BYTES: usize = 2 << 20;

/// The sequence of a linear congruential generator (Knuth's MMIX constants).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound.max(1)
    }
}

/// Numbers and words that readers trip over.
const PIECES: &[&[u8]] = &[
    b"-1",
    b"0",
    b"4294967295",
    b"18446744073709551615",
    b"99999999999999999999",
    b"1e309",
    b"nan",
    b"\xff\xff\xff\xff\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\0\0\0\0\0",
    b"$End",
    b"*",
    b",",
    b"<",
    b"\"",
    b"=",
    b"\n",
];

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    let length = random.below(40).min(bytes.len() - at);
    match random.below(7) {
        0 => bytes.truncate(at),
        1 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
        2 if at < bytes.len() => bytes[at] = b'0' + random.below(10) as u8,
        3 => drop(bytes.drain(at..at + length)),
        4 => {
            let copy = bytes[at..at + length].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        5 => {
            let piece = PIECES[random.below(PIECES.len())];
            let end = (at + piece.len()).min(bytes.len());
            bytes.splice(at..end, piece.iter().copied());
        }
        _ => {
            // a whole number in text becomes another one
            let start = (at..bytes.len()).find(|&i| bytes[i].is_ascii_digit());
            if let Some(start) = start {
                let end = (start..bytes.len()).find(|&i| !bytes[i].is_ascii_digit()).unwrap_or(bytes.len());
                bytes.splice(start..end, PIECES[random.below(7)].iter().copied());
            }
        }
    }
}

fn read(bytes: &[u8]) -> bool {
    let error = match FileMesh::parse(bytes) {
        Err(error) => error,
        Ok(file) => {
            let parts: Vec<String> = file.parts().map(str::to_owned).collect();
            let parts = parts.iter().map(|part| Some(part.as_str())).chain([None]);
            let read = |part| {
                file.body("a", part, 1.0).or_else(|error| {
                    assert_complete(&error);
                    file.first_order_body("a", part, 1.0)
                })
            };
            match parts.map(read).collect::<Result<Vec<_>, _>>() {
                Err(error) => error,
                Ok(bodies) => {
                    // never panics, whatever the mesh holds
                    bodies.iter().for_each(|body| drop(body.mesh.check()));
                    return true;
                }
            }
        }
    };
    assert_complete(&error);
    false
}

fn assert_complete(error: &MeshFileError) {
    assert!(!error.place.is_empty() && !error.message.is_empty() && !error.cure.is_empty(), "{error:?}");
}

#[test]
fn damaged_files_are_read_or_refused_in_bounded_memory() {
    let folder = format!("{}/tests/data", env!("CARGO_MANIFEST_DIR"));
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| [".msh", ".inp", ".vtu"].iter().any(|end| name.ends_with(end)));
    names.sort_unstable();
    assert!(names.len() >= 16, "{names:?}");
    let (mut random, mut refused, mut accepted, mut most) = (Random(20250), 0, 0, 0);
    for name in &names {
        let whole = data(name);
        for _ in 0..700 {
            let mut bytes = whole.clone();
            for _ in 0..=random.below(3) {
                damage(&mut bytes, &mut random);
            }
            MOST.store(HELD.load(Ordering::Relaxed), Ordering::Relaxed);
            let before = HELD.load(Ordering::Relaxed);
            let good = read(&bytes);
            let taken = MOST.load(Ordering::Relaxed).saturating_sub(before);
            most = most.max(taken);
            assert!(taken < MOST_BYTES, "{name}: {taken} bytes for a file of {}", bytes.len());
            if good { accepted += 1 } else { refused += 1 }
        }
    }
    println!("{refused} refused, {accepted} still a mesh, at most {most} bytes taken");
    assert!(refused > 5000 && accepted > 100, "{refused} refused, {accepted} still a mesh");
}

/// Of a file cut anywhere nothing is taken for a body of all its elements, unless only white space
/// or the end's mark is missing.
#[test]
fn cut_files_are_refused() {
    for name in ["gmsh_22_ascii.msh", "gmsh_22_binary.msh", "gmsh_41_ascii.msh", "gmsh_41_binary.msh"] {
        let whole = data(name);
        let end = whole.len() - "$EndElements\n".len();
        for length in (0..end).step_by(7) {
            assert!(FileMesh::parse(&whole[..length]).is_err(), "{name}, {length} of {}", whole.len());
        }
    }
}

/// A few kilobytes that unfold to 30 MB of node numbers: refused before anything is unfolded.
#[test]
fn what_is_compressed_too_well_is_refused() {
    use base64::Engine;
    use std::io::Write;
    let size = 30_000_000_u32;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    (0..size / 1000).for_each(|_| encoder.write_all(&[0; 1000]).expect("memory"));
    let block = encoder.finish().expect("memory");
    let header: Vec<u8> = [1, size, 0, block.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
    let encode = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
    let text = format!(
        "<VTKFile type=\"UnstructuredGrid\" header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"><Cells><DataArray type=\"UInt8\" Name=\"connectivity\" \
         format=\"binary\">{}{}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>",
        encode(&header),
        encode(&block)
    );
    assert!(text.len() < 50_000, "{}", text.len());
    let error = FileMesh::parse(text.as_bytes()).expect_err("too large");
    assert!(error.message.contains("more than the numbers of points and cells allow"), "{error}");
}
