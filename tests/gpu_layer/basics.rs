//! Small transfers, scans of awkward sizes, hazards, records, limits, memory by owner, the choice of a device.

use crate::common::{Random, TestContext};
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{Context, Format, GpuError, ImageDescription, Options, Shape};
use linklight::stages::scan;

#[test]
fn what_is_uploaded_comes_back() {
    let context = TestContext::new();
    for len in [0usize, 1, 63, 64, 65, 100_003] {
        let data: Vec<u32> = (0..len as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
        let buffer = context.upload("test/data", &data).unwrap();
        assert_eq!(context.download(&buffer).unwrap(), data, "{len} values");
    }
}

#[test]
fn image_pixels_come_back_and_mips_average() {
    let context = TestContext::new();
    let image = context
        .image(&ImageDescription {
            name: "test/image",
            width: 4,
            height: 2,
            layers: 1,
            mip_levels: 3,
            format: Format::Rgba32Float,
            shape: Shape::Flat,
        })
        .unwrap();
    let pixels: Vec<[f32; 4]> = (0..8).map(|i| [i as f32, 1.0, 0.5, 0.0]).collect();
    let mut recorder = context.recorder("test").unwrap();
    recorder.write_image(&image, 0, &pixels);
    recorder.generate_mips(&image);
    recorder.submit().unwrap();
    assert_eq!(context.download_image::<[f32; 4]>(&image, 0).unwrap(), pixels);
}

/// The plain twin of `stages::scan`.
fn scan_twin(values: &[u32]) -> Vec<u32> {
    values.iter().scan(0u32, |sum, v| Some(std::mem::replace(sum, sum.wrapping_add(*v)))).collect()
}

#[test]
fn scans_agree_with_the_twin_at_awkward_sizes() {
    let context = TestContext::new();
    let mut random = Random(1);
    for len in [1usize, 63, 64, 65, 1023, 1024, 1025, 4099, 1_048_576, 1_048_577, 3_000_017] {
        let data: Vec<u32> = (0..len).map(|_| random.below(10)).collect();
        let values = context.upload("test/values", &data).unwrap();
        let scratch = scan::ScanScratch::new(&context, "test", len).unwrap();
        let mut recorder = context.recorder("test").unwrap();
        scan::exclusive(&mut recorder, &values, len, &scratch);
        recorder.submit().unwrap();
        assert!(context.download(&values).unwrap() == scan_twin(&data), "scan of {len} values");
    }
}

#[test]
fn a_list_longer_than_one_dispatch_dimension_is_folded() {
    let context = TestContext::new();
    let len = 256 * (context.limits().workgroup_count as usize + 3);
    let values = context.buffer::<u32>("test/values", len).unwrap();
    let ones = vec![1u32; len.div_ceil(1024)];
    let block_sums = context.upload("test/ones", &ones).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.fill(&values, 0);
    recorder.dispatch(
        &AddBlockSums {
            values: &values,
            block_sums: &block_sums,
            params: AddBlockSumsParams { value_count: len as u32 },
        },
        len,
    );
    recorder.submit().unwrap();
    assert!(context.download(&values).unwrap().iter().all(|&v| v == 1), "each value is visited exactly once");
}

/// Two dependent dispatches; returns what validation said.
fn dependent_dispatches(options: Options) -> Vec<String> {
    let context = Context::new(Options { validation: true, ..options }).unwrap();
    let values = context.upload("test/values", &vec![0u32; 4096]).unwrap();
    let block_sums = context.upload("test/ones", &[1u32; 4]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    for _ in 0..2 {
        recorder.dispatch(
            &AddBlockSums {
                values: &values,
                block_sums: &block_sums,
                params: AddBlockSumsParams { value_count: 4096 },
            },
            4096u32,
        );
    }
    recorder.submit().unwrap();
    if !context.validation_messages().is_empty() {
        return context.validation_messages();
    }
    assert!(context.download(&values).unwrap().iter().all(|&v| v == 2));
    context.validation_messages()
}

#[test]
fn a_missing_barrier_is_reported_and_a_right_one_is_silent() {
    let planted = dependent_dispatches(Options { skip_barriers: true, ..Options::default() });
    assert!(
        planted.iter().any(|m| m.to_lowercase().contains("hazard")),
        "validation must report the planted hazard, said {planted:?}"
    );
    assert!(
        planted.iter().any(|m| m.contains("test/values")),
        "the message must call the buffer by its name, said {planted:?}"
    );
    assert_eq!(dependent_dispatches(Options::default()), Vec::<String>::new());
    assert_eq!(dependent_dispatches(Options { full_barriers: true, ..Options::default() }), Vec::<String>::new());
}

#[test]
fn passes_are_recorded_with_path_time_and_bytes() {
    let context = TestContext::with(Options { statistics: true, ..Options::default() });
    let values = context.upload("test/values", &vec![0u32; 5000]).unwrap();
    let block_sums = context.upload("test/ones", &[1u32; 5]).unwrap();
    context.take_records();
    let mut recorder = context.recorder("frame").unwrap();
    recorder.scope(format_args!("bounce {}", 2), |r| {
        r.dispatch(
            &AddBlockSums {
                values: &values,
                block_sums: &block_sums,
                params: AddBlockSumsParams { value_count: 5000 },
            },
            5000u32,
        );
    });
    recorder.submit().unwrap();
    let records = context.take_records();
    assert_eq!(records.len(), 1);
    let record = &records[0];
    assert_eq!(record.path, "frame/bounce 2/scan/add_block_sums");
    assert_eq!((record.bytes_read, record.bytes_written), (20_020, 20_000));
    assert!(record.end_ns > record.start_ns, "{record:?}");
    assert!(record.counters.contains(&("threads", 5000)), "{record:?}");
    if context.features().pipeline_statistics {
        assert!(record.counters.contains(&("compute_invocations", 5120)), "{record:?}");
    }
}

#[test]
fn limits_are_named_in_errors() {
    let context = TestContext::with(Options { max_storage_buffer_bytes: Some(1 << 20), ..Options::default() });
    match context.buffer::<u32>("test/large", (1 << 18) + 1) {
        Err(GpuError::StorageRange { name, bytes, allowed }) => {
            assert_eq!((name.as_str(), bytes, allowed), ("test/large", (1 << 20) + 4, 1 << 20))
        }
        other => panic!("{:?}", other.map(|b| b.len())),
    }
    assert!(context.buffer::<u32>("test/fits", 1 << 18).is_ok());
}

#[test]
fn memory_is_counted_by_owner() {
    let context = TestContext::new();
    let buffer = context.buffer::<u32>("links/table", 1 << 16).unwrap();
    assert!(context.memory_by_owner()["links"].current_bytes >= 1 << 18);
    drop(buffer);
    let usage = context.memory_by_owner()["links"];
    assert!(usage.current_bytes == 0 && usage.peak_bytes >= 1 << 18, "{usage:?}");
}

#[test]
fn an_unknown_device_is_refused_with_reasons() {
    let error = Context::new(Options { gpu: Some("no such device".into()), ..Options::default() }).err().unwrap();
    assert!(error.is_no_device());
    assert!(error.to_string().contains("no such device") && error.to_string().contains("usable"), "{error}");
}
