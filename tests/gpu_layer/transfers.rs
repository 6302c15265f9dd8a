//! Transfers of more than one staging piece.

use crate::common::TestContext;
use glam::UVec3;

/// Bytes of a staging piece; the tests are aimed just beyond it.
const PIECE: usize = 64 << 20;

fn value(index: u32) -> UVec3 {
    UVec3::new(index.wrapping_mul(2_654_435_761), index, !index)
}

/// Twelve-byte elements do not divide a piece: the pieces end between elements all the same.
#[test]
fn data_of_several_staging_pieces_comes_back() {
    let context = TestContext::new();
    let per_piece = PIECE / size_of::<UVec3>();
    let data: Vec<UVec3> = (0..per_piece as u32 + 4099).map(value).collect();
    let buffer = context.upload("test/large", &data).unwrap();
    let uploads = context.take_records();
    assert_eq!(uploads.iter().filter(|record| record.name == "transfer/upload").count(), 2, "two pieces");
    assert!(uploads.iter().all(|record| record.bytes_written <= PIECE as u64), "no piece is larger than its staging");

    assert!(context.download(&buffer).unwrap() == data, "the whole buffer");
    let downloads = context.take_records();
    assert_eq!(downloads.iter().filter(|record| record.name == "transfer/download").count(), 2, "two pieces");

    // Ranges across the seam, and beyond the end.
    let seam = per_piece - 3..per_piece + 5;
    assert_eq!(context.download_range(&buffer, seam.clone()).unwrap(), data[seam]);
    let tail = data.len() - 2..data.len() + 10;
    assert_eq!(context.download_range(&buffer, tail).unwrap(), data[data.len() - 2..]);
    let (late, early) = (data.len() + 1..data.len() + 9, 7..7);
    assert!(context.download_range(&buffer, late).unwrap().is_empty());
    assert!(context.download_range(&buffer, early).unwrap().is_empty());
}

#[test]
fn fills_copies_and_partial_writes_touch_what_they_say() {
    let context = TestContext::new();
    let source = context.upload("test/source", &[1u32, 2, 3]).unwrap();
    let target = context.buffer::<u32>("test/target", 6).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&target, 9);
    recorder.copy(&source, &target);
    recorder.write(&target, 4, &[7u32]);
    recorder.write::<u32>(&target, 6, &[]);
    recorder.submit().unwrap();
    assert_eq!(context.download(&target).unwrap(), [1, 2, 3, 9, 7, 9]);
}
