//! Validation listens: faults of each kind, planted, are reported, and the same work without them is silent. (A missing
//! barrier is planted in `basics.rs`.)

use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{Context, Format, ImageDescription, Options, Shape};

fn context(options: Options) -> Context {
    Context::new(Options { validation: true, ..options }).unwrap()
}

/// Adds to `count` values, of which there are 256; what validation says.
fn add_to(count: u32, options: Options) -> Vec<String> {
    let context = context(options);
    let values = context.upload("test/values", &[0u32; 256]).unwrap();
    let block_sums = context.upload("test/sums", &[1u32; 1]).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    let params = AddBlockSumsParams { value_count: count };
    recorder.dispatch(&AddBlockSums { values: &values, block_sums: &block_sums, params }, count);
    recorder.submit().unwrap();
    drop(context.download(&values).unwrap());
    // The layer says first what it switches on for itself.
    let is_setting =
        |m: &String| m.contains("layer settings provided") || m.contains("validation is adjusting settings");
    context.validation_messages().into_iter().filter(|message| !is_setting(message)).collect()
}

#[test]
fn a_write_beyond_a_buffer_is_reported_by_name() {
    let assisted = || Options { gpu_assisted: true, ..Options::default() };
    let planted = add_to(512, assisted());
    let is_told = |message: &String| message.contains("out of bounds") || message.contains("OOB");
    assert!(planted.iter().any(is_told), "the planted write must be reported, said {planted:?}");
    assert!(planted.iter().any(|m| m.contains("test/values")), "by the buffer's name, said {planted:?}");
    assert_eq!(add_to(256, assisted()), Vec::<String>::new());
}

/// An image cleared in the layout it is to have, with or without having been brought there.
fn clear(options: Options) -> Vec<String> {
    let context = context(options);
    let description = ImageDescription {
        name: "test/picture",
        width: 8,
        height: 8,
        layers: 1,
        mip_levels: 1,
        format: Format::Rgba8,
        shape: Shape::Flat,
    };
    let image = context.image(&description).unwrap();
    let mut recorder = context.recorder("test").unwrap();
    recorder.clear_image(&image, [1.0; 4]);
    recorder.submit().unwrap();
    context.validation_messages()
}

#[test]
fn a_wrong_image_layout_is_reported_by_name() {
    let planted = clear(Options { skip_layouts: true, ..Options::default() });
    assert!(
        planted.iter().any(|m| m.contains("test/picture") && m.to_lowercase().contains("layout")),
        "the planted layout must be reported, said {planted:?}"
    );
    assert_eq!(clear(Options::default()), Vec::<String>::new());
}

/// What every compute pipeline of ours is told (tests/common says why it stays) shows that best practices are listened to.
#[test]
fn best_practices_are_looked_at() {
    let practices = || Options { best_practices: true, ..Options::default() };
    assert_eq!(clear(practices()), Vec::<String>::new());
    let told = add_to(256, practices());
    assert!(told.len() == 1 && told[0].contains("using the SPIR-V Workgroup built-in"), "{told:?}");
    assert_eq!(add_to(256, Options::default()), Vec::<String>::new());
}
