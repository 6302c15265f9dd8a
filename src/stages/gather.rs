//! Gathering: every receiver reads what its links' senders send.

use super::links::{LinkWords, Links};
use crate::gpu::shaders::gather as passes;
use crate::gpu::{Buffer, Cost, Recorder};
use glam::Vec3;

/// `irradiance[r] = sum of weight * radiosity[sender]` over the links of every receiver `r`, W/m2.
pub fn over_links(recorder: &mut Recorder<'_>, links: &Links, radiosity: &Buffer<Vec3>, irradiance: &Buffer<Vec3>) {
    let link_offsets = &links.offsets;
    match &links.words {
        LinkWords::Full(set) => {
            let sender_count = set.sent.len() as u32;
            let params = passes::SendParams { sender_count };
            recorder.dispatch(&passes::Send { radiosity, sent: &set.sent, params }, sender_count);
            for window in &set.windows {
                let (first_element, receiver_count) = (window.first_element, window.element_count);
                let params = passes::LinksParams { first_element, receiver_count, first_link: window.first_link };
                let pass = passes::Links { link_offsets, links: &window.words, sent: &set.sent, irradiance, params };
                let cost = cost(size_of::<u64>(), window.link_count, receiver_count);
                recorder.dispatch_counted(&pass, receiver_count, Some(cost));
            }
        }
        LinkWords::Packed(set) => {
            let sender_count = set.sent.len() as u32;
            let params = passes::SendPackedParams { sender_count };
            recorder.dispatch(&passes::SendPacked { radiosity, sent: &set.sent, params }, sender_count);
            for window in &set.windows {
                let (first_element, receiver_count) = (window.first_element, window.element_count);
                let params = passes::PackedLinksParams { first_element, receiver_count, first_link: window.first_link };
                let (packed_links, sent) = (&window.words, &set.sent);
                let pass = passes::PackedLinks { link_offsets, packed_links, sent, irradiance, params };
                let cost = cost(size_of::<u32>(), window.link_count, receiver_count);
                recorder.dispatch_counted(&pass, receiver_count, Some(cost));
            }
        }
    }
}

/// A link and what its sender sends are words of the same length.
fn cost(word_bytes: usize, link_count: u32, receiver_count: u32) -> Cost {
    Cost {
        bytes_read: u64::from(link_count) * 2 * word_bytes as u64 + 4 * (u64::from(receiver_count) + 1),
        bytes_written: u64::from(receiver_count) * size_of::<Vec3>() as u64,
    }
}
