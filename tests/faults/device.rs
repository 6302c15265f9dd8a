//! Small work on a device that touches each kind of object, with every single call failing in its turn.

use crate::TURN;
use glam::{UVec3, Vec3};
use linklight::gpu::shaders::scan::{AddBlockSums, AddBlockSumsParams};
use linklight::gpu::{
    Context, Failure, FaultInjection, Format, GpuError, ImageDescription, Options, SamplerDescription, Shape,
};

/// What all of it comes to.
fn work() -> Result<Vec<u32>, GpuError> {
    let context = Context::new(Options { validation: true, statistics: true, ..Options::default() })?;
    let values = context.upload("test/values", &[1u32; 300])?;
    let block_sums = context.upload("test/sums", &[2u32; 1])?;
    let texels = context.texel_buffer("test/texels", 4)?;
    let description = ImageDescription {
        name: "test/image",
        width: 4,
        height: 4,
        layers: 2,
        mip_levels: 1,
        format: Format::R32Uint,
        shape: Shape::Array,
    };
    let image = context.image(&description)?;
    let mut recorder = context.recorder("test")?;
    recorder.write_image(&image, 1, &[7u32; 16]);
    let params = AddBlockSumsParams { value_count: 300 };
    recorder.dispatch(&AddBlockSums { values: &values, block_sums: &block_sums, params }, 300u32);
    recorder.submit()?;
    let mut result = context.download(&values)?;
    result.extend(context.download_image::<u32>(&image, 1)?);
    let sampler = context.sampler("test/sampler", SamplerDescription::NEAREST_CLAMP)?;
    let texture = ImageDescription {
        name: "test/texture",
        layers: 1,
        format: Format::Rgba32Float,
        shape: Shape::Flat,
        ..description
    };
    drop(context.texture_table(vec![context.image(&texture)?], vec![sampler], &[(0, 0)])?);
    if context.features().ray_query {
        let positions = context.upload("test/positions", &[Vec3::ZERO, Vec3::X, Vec3::Y])?;
        let triangles = context.upload("test/triangles", &[UVec3::new(0, 1, 2)])?;
        drop(context.acceleration_structure("test/structure", &positions, &triangles)?);
    }
    context.calibrate();
    drop(texels);
    Ok(result)
}

/// Calls whose failure costs nothing that was asked for.
const HARMLESS: [&str; 4] = [
    "vkSetDebugUtilsObjectNameEXT",
    "vkGetCalibratedTimestampsKHR",
    "vkGetCalibratedTimestampsEXT",
    "vkDeviceWaitIdle",
];

#[test]
fn every_call_of_small_work_may_fail() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let faults = FaultInjection::start();
    let whole = work().unwrap();
    assert_eq!(whole, [vec![3; 300], vec![7; 16]].concat());
    let names = faults.calls();
    assert_eq!(faults.complaints(), Vec::<String>::new());
    assert!(names.len() > 60 && names.contains(&"vkCreateInstance") && names.contains(&"allocation"), "{names:?}");
    for failure in [Failure::OutOfHostMemory, Failure::OutOfDeviceMemory] {
        // Both on the first run would double it for little: device memory is told for calls that may answer so.
        let may =
            |name: &str| failure == Failure::OutOfHostMemory || name.contains("Memory") || name.contains("Submit");
        for at in (1..=names.len()).filter(|at| may(names[at - 1])) {
            faults.fail(at as u64, failure);
            let result = work();
            let name = faults.failed().unwrap_or_else(|| panic!("call {at} was not reached"));
            match result {
                Ok(result) => assert!(result == whole && HARMLESS.contains(&name), "{name}, call {at}, goes unnoticed"),
                Err(GpuError::OutOfMemory { .. }) => {}
                // A device that cannot say what it offers is not usable.
                Err(GpuError::NoDevice { reasons, .. }) => {
                    assert!(reasons.contains("MEMORY") || name == "allocation", "{name}, call {at}: {reasons}");
                }
                Err(error) => panic!("{name}, call {at}: {error}"),
            }
            assert_eq!(faults.complaints(), Vec::<String>::new(), "{name}, call {at}");
        }
    }
}

/// The check for what is left behind sees what is left behind.
#[test]
fn a_planted_leak_is_seen() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let faults = FaultInjection::start();
    let context = Context::new(Options { validation: true, ..Options::default() }).unwrap();
    let recorder = context.recorder("a recording that never ends").unwrap();
    std::mem::forget(recorder);
    drop(context);
    let complaints = faults.complaints();
    assert!(complaints.iter().any(|complaint| complaint.contains("have not been destroyed")), "{complaints:?}");
}

#[test]
fn a_lost_device_is_called_lost() {
    let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let faults = FaultInjection::start();
    work().unwrap();
    let names = faults.calls();
    for at in (1..=names.len()).filter(|at| ["vkQueueSubmit", "vkWaitSemaphores"].contains(&names[at - 1])) {
        faults.fail(at as u64, Failure::DeviceLost);
        let error = work().expect_err("a lost device");
        assert!(matches!(error, GpuError::DeviceLost { .. }), "call {at}: {error}");
        assert_eq!(faults.complaints(), Vec::<String>::new(), "call {at}");
    }
}
