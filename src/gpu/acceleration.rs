//! Driver-built acceleration structures for the optional ray-query path.

use super::Buffer;
use super::buffer::RawBuffer;
use super::context::Context;
use super::device::{Device, Grave};
use super::error::{Checked, GpuError};
use super::hazards::Access;
use super::profiler::Cost;
use super::recorder::Recorder;
use ash::vk;
use glam::{UVec3, Vec3};
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// World-space triangles as one bottom level under one top level. Primitive indices are triangle indices.
pub struct AccelerationStructure {
    bottom: Level,
    top: Level,
    instance: RawBuffer,
    scratch: RawBuffer,
    vertex_count: u32,
    triangle_count: u32,
    id: u64,
}

struct Level {
    raw: vk::AccelerationStructureKHR,
    // Holds the structure's memory.
    _storage: RawBuffer,
    bytes: u64,
    device: Arc<Device>,
}

impl Drop for Level {
    fn drop(&mut self) {
        self.device.bury(Grave::AccelerationStructure(self.raw));
    }
}

impl AccelerationStructure {
    /// Device bytes of both levels.
    pub fn size_bytes(&self) -> u64 {
        self.bottom.bytes + self.top.bytes
    }

    pub(super) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.top.raw
    }

    pub(super) fn id(&self) -> u64 {
        self.id
    }
}

fn address(device: &Device, buffer: vk::Buffer) -> u64 {
    let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
    // SAFETY: the buffer was made with SHADER_DEVICE_ADDRESS, which ray query support implies here.
    unsafe { device.raw.get_buffer_device_address(&info) }
}

fn triangles(
    device: &Device,
    positions: vk::Buffer,
    indices: vk::Buffer,
    vertex_count: u32,
) -> vk::AccelerationStructureGeometryKHR<'static> {
    let data = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: address(device, positions) })
        .vertex_stride(12)
        .max_vertex(vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(vk::DeviceOrHostAddressConstKHR { device_address: address(device, indices) });
    // Not opaque: shaders decide about holes of alpha masks.
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles: data })
}

fn instances(device: &Device, buffer: vk::Buffer) -> vk::AccelerationStructureGeometryKHR<'static> {
    let data = vk::AccelerationStructureGeometryInstancesDataKHR::default()
        .data(vk::DeviceOrHostAddressConstKHR { device_address: address(device, buffer) });
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data })
}

impl Context {
    /// Room for an acceleration structure over `triangle_count` triangles; `None` where the device lacks ray query.
    pub fn acceleration_structure(
        &self,
        name: &str,
        positions: &Buffer<Vec3>,
        indices: &Buffer<UVec3>,
    ) -> Result<Option<AccelerationStructure>, GpuError> {
        let device = &self.device;
        let Some(extension) = &device.acceleration_structure else { return Ok(None) };
        if !device.owns(positions.id()) || !device.owns(indices.id()) {
            return Err(GpuError::Refused(format!("{name}: its triangles are of another device")));
        }
        let (vertex_count, triangle_count) = (positions.len() as u32, indices.len() as u32);
        let address_usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let instance = RawBuffer::new(
            device,
            &format!("{name}/instance"),
            64,
            address_usage
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::TRANSFER_DST,
            MemoryLocation::CpuToGpu,
        )?;
        let make = |kind,
                    geometry: vk::AccelerationStructureGeometryKHR<'static>,
                    count: u32|
         -> Result<(Level, u64), GpuError> {
            let geometries = [geometry];
            let build = build_info(kind, &geometries);
            let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
            // SAFETY: one geometry, one count; the storage is as large as asked for.
            unsafe {
                extension.get_acceleration_structure_build_sizes(
                    vk::AccelerationStructureBuildTypeKHR::DEVICE,
                    &build,
                    &[count],
                    &mut sizes,
                );
                let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR | address_usage;
                let bytes = sizes.acceleration_structure_size;
                let storage = RawBuffer::new(device, name, bytes, usage, MemoryLocation::GpuOnly)?;
                let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(storage.raw).size(bytes).ty(kind);
                let raw = extension
                    .create_acceleration_structure(&info, None)
                    .checked("vkCreateAccelerationStructureKHR", name)?;
                device.set_name(raw, name);
                Ok((Level { raw, _storage: storage, bytes, device: device.clone() }, sizes.build_scratch_size))
            }
        };
        let geometry = triangles(device, positions.raw(), indices.raw(), vertex_count);
        let (bottom, bottom_scratch) = make(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, geometry, triangle_count)?;
        let (top, top_scratch) = make(vk::AccelerationStructureTypeKHR::TOP_LEVEL, instances(device, instance.raw), 1)?;
        // Room to align the scratch address; 256 satisfies every known device.
        let scratch_bytes = bottom_scratch.max(top_scratch) + 256;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | address_usage;
        let scratch =
            RawBuffer::new(device, &format!("{name}/scratch"), scratch_bytes, usage, MemoryLocation::GpuOnly)?;
        let id = device.new_id();
        let mut structure = AccelerationStructure { bottom, top, instance, scratch, vertex_count, triangle_count, id };
        structure.write_instance(device);
        Ok(Some(structure))
    }
}

impl AccelerationStructure {
    fn write_instance(&mut self, device: &Device) {
        let Some(extension) = &device.acceleration_structure else { return };
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(self.bottom.raw);
        // SAFETY: the bottom level is alive.
        let reference = unsafe { extension.get_acceleration_structure_device_address(&info) };
        // VkAccelerationStructureInstanceKHR: identity 3x4, index 0 with mask 0xff, no culling, reference.
        let identity: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let no_culling = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() << 24;
        let words: [u32; 2] = [0xff << 24, no_culling];
        let bytes = self.instance.mapped();
        bytes[..48].copy_from_slice(bytemuck::cast_slice(&identity));
        bytes[48..56].copy_from_slice(bytemuck::cast_slice(&words));
        bytes[56..64].copy_from_slice(&reference.to_le_bytes());
    }
}

impl Recorder<'_> {
    /// Builds both levels from the present positions.
    pub fn build_acceleration_structure(
        &mut self,
        structure: &AccelerationStructure,
        positions: &Buffer<Vec3>,
        indices: &Buffer<UVec3>,
    ) {
        let device = self.context().device.clone();
        let Some(extension) = &device.acceleration_structure else { return };
        let (vertices, triangle_count) = (structure.vertex_count as usize, structure.triangle_count as usize);
        if positions.len() < vertices || indices.len() < triangle_count {
            let message = format!(
                "acceleration structure of {vertices} vertices and {triangle_count} triangles, built from {} and {}",
                positions.len(),
                indices.len()
            );
            return self.fail(GpuError::Refused(message));
        }
        if ![positions.id(), indices.id(), structure.id].into_iter().all(|id| device.owns(id)) {
            return self.fail(GpuError::Refused("acceleration structure: built from objects of another device".into()));
        }
        let scratch_address = address(&device, structure.scratch.raw).next_multiple_of(256);
        let levels = [
            (
                "acceleration/bottom",
                vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
                triangles(&device, positions.raw(), indices.raw(), structure.vertex_count),
                structure.bottom.raw,
                structure.bottom.bytes,
                structure.triangle_count,
            ),
            (
                "acceleration/top",
                vk::AccelerationStructureTypeKHR::TOP_LEVEL,
                instances(&device, structure.instance.raw),
                structure.top.raw,
                structure.top.bytes,
                1,
            ),
        ];
        for (name, kind, geometry, target, bytes, count) in levels {
            let accesses = [
                Access { id: positions.id(), reads: true, writes: false },
                Access { id: indices.id(), reads: true, writes: false },
                Access { id: structure.id, reads: true, writes: true },
            ];
            let cost = Cost { bytes_read: positions.size_bytes() + indices.size_bytes(), bytes_written: bytes };
            self.timed(name, &accesses, cost, u64::from(count), None, |recorder| {
                let geometries = [geometry];
                let build = build_info(kind, &geometries)
                    .dst_acceleration_structure(target)
                    .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch_address });
                let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
                // SAFETY: target and scratch were sized for this geometry; inputs are alive.
                unsafe { extension.cmd_build_acceleration_structures(recorder.commands(), &[build], &[&range]) };
            });
        }
    }
}

fn build_info<'a>(
    kind: vk::AccelerationStructureTypeKHR,
    geometries: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometries)
}
