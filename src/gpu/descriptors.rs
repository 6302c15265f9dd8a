//! Descriptors of one pass, pushed into its command buffer.

use super::device::Device;
use super::pass::{Bindings, Handle, Program};
use super::pipelines::descriptor_type;
use ash::vk;

/// # Safety
/// `commands` is recording on `device`, `layout` was made for `program`, and everything bound is alive until the submission
/// ends.
pub(super) unsafe fn push_descriptors(
    device: &Device,
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    program: &Program,
    bindings: &Bindings<'_>,
) {
    let structures: Vec<[vk::AccelerationStructureKHR; 1]> = bindings
        .resources
        .iter()
        .map(|r| match r.handle {
            Handle::AccelerationStructure(raw) => [raw],
            _ => [vk::AccelerationStructureKHR::null()],
        })
        .collect();
    let mut structure_writes: Vec<_> = structures
        .iter()
        .map(|s| vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(s))
        .collect();
    let mut writes = Vec::with_capacity(bindings.resources.len());
    for ((info, resource), structure) in program.bindings.iter().zip(&bindings.resources).zip(&mut structure_writes) {
        let write =
            vk::WriteDescriptorSet::default().dst_binding(info.binding).descriptor_type(descriptor_type(info.kind));
        writes.push(match &resource.handle {
            Handle::Buffer(buffer) => write.buffer_info(std::slice::from_ref(buffer)),
            Handle::TexelBuffer(view) => write.texel_buffer_view(view),
            Handle::Image(image) => write.image_info(std::slice::from_ref(image)),
            Handle::AccelerationStructure(_) => {
                let mut write = write.push_next(structure);
                write.descriptor_count = 1;
                write
            }
        });
    }
    if !writes.is_empty() {
        // SAFETY: every write refers to live objects of the kinds the layout declares.
        unsafe { device.push_descriptor.cmd_push_descriptor_set(commands, point, layout, 0, &writes) };
    }
}
