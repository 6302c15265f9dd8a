//! Gathering: every receiver reads what its links' senders send.

use super::links::{LinkTable, Links};
use crate::gpu::shaders::gather as passes;
use crate::gpu::shaders::types::Link;
use crate::gpu::{Buffer, Cost, Recorder};
use glam::Vec3;

/// `irradiance[r] = sum of weight * radiosity[sender]` over the links of every receiver `r`, W/m2.
pub fn over_links(recorder: &mut Recorder<'_>, links: &Links, radiosity: &Buffer<Vec3>, irradiance: &Buffer<Vec3>) {
    for window in &links.windows {
        let (first_element, receiver_count) = (window.first_element, window.element_count);
        let first_link = window.first_link;
        let cost = |link_bytes: usize| {
            let per_link = (link_bytes + size_of::<Vec3>()) as u64;
            Some(Cost {
                bytes_read: u64::from(window.link_count) * per_link + 4 * (u64::from(receiver_count) + 1),
                bytes_written: u64::from(receiver_count) * size_of::<Vec3>() as u64,
            })
        };
        match &window.table {
            LinkTable::Full(table) => recorder.dispatch_counted(
                &passes::Links {
                    link_offsets: &links.offsets,
                    links: table,
                    radiosity,
                    irradiance,
                    params: passes::LinksParams { first_element, receiver_count, first_link },
                },
                receiver_count,
                cost(size_of::<Link>()),
            ),
            LinkTable::Packed(packed_links) => recorder.dispatch_counted(
                &passes::PackedLinks {
                    link_offsets: &links.offsets,
                    packed_links,
                    radiosity,
                    irradiance,
                    params: passes::PackedLinksParams { first_element, receiver_count, first_link },
                },
                receiver_count,
                cost(size_of::<u32>()),
            ),
        }
    }
}
