//! What the method counted, for profiles and for judging a solution.

use super::Settings;
use crate::gpu::{Context, GpuError};
use crate::stages::elements::{BACK_SIDE, Elements};
use crate::stages::emitters::Emitters;
use crate::stages::links::{Links, Outcomes};
use serde::Serialize;
use std::fmt;

/// Counts of the last link generation and shadow rays.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Report {
    pub elements: u32,
    /// Of these, backs of double-sided surfaces.
    pub back_elements: u32,
    /// Rays cast for links.
    pub rays: u64,
    /// Of these, rays that met the back of a one-sided surface and carry nothing.
    pub blocked_rays: u64,
    /// Of these, rays that met nothing and see the environment.
    pub escaped_rays: u64,
    /// Elements of which most rays were blocked: they take their neighbours' light.
    pub unresolved_elements: u32,
    /// Three per ray that carries light.
    pub raw_links: u64,
    pub links: u32,
    /// Raw links per link.
    pub compression: f64,
    /// Bytes of links and offsets as allocated.
    pub link_bytes: u64,
    pub link_windows: u32,
    /// Emissive parts sampled and linked, and the points on sampled ones.
    pub sampled_parts: u32,
    pub linked_parts: u32,
    pub emitter_samples: u32,
    /// Shadow rays to emitters and to punctual lights.
    pub emitter_rays: u64,
    pub light_rays: u64,
    /// Elements whose links each device made, the main one first; empty where it made all.
    pub device_elements: Vec<u32>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} elements, {} rays, {} links ({:.1} raw links each, {:.1} MiB)",
            self.elements,
            self.rays,
            self.links,
            self.compression,
            self.link_bytes as f64 / (1 << 20) as f64
        )?;
        if !self.device_elements.is_empty() {
            write!(f, "; made by devices in runs of {:?} elements", self.device_elements)?;
        }
        match self.unresolved_elements {
            0 => Ok(()),
            count => write!(f, "; {count} elements inside other things take their neighbours' light"),
        }
    }
}

impl Report {
    pub(super) fn new(
        context: &Context,
        settings: &Settings,
        elements: &Elements,
        emitters: &Emitters,
        links: &Links,
        outcomes: &Outcomes,
    ) -> Result<Self, GpuError> {
        let ray_count = settings.rays_per_element.get();
        let counts = context.download(&outcomes.counts)?;
        let rays = u64::from(elements.count) * u64::from(ray_count);
        let blocked_rays = counts.iter().map(|c| u64::from(c & 0xffff)).sum();
        let escaped_rays = counts.iter().map(|c| u64::from(c >> 16)).sum();
        let raw_links = 3 * (rays - blocked_rays - escaped_rays);
        Ok(Self {
            elements: elements.count,
            back_elements: elements.topology.vertices.iter().filter(|&v| v & BACK_SIDE != 0).count() as u32,
            rays,
            blocked_rays,
            escaped_rays,
            unresolved_elements: counts.iter().filter(|&c| 2 * (c & 0xffff) > ray_count).count() as u32,
            raw_links,
            links: links.link_count,
            compression: raw_links as f64 / f64::from(links.link_count.max(1)),
            link_bytes: links.size_bytes(),
            link_windows: links.window_count() as u32,
            sampled_parts: emitters.plan.sampled_parts,
            linked_parts: emitters.plan.linked_parts,
            emitter_samples: emitters.plan.samples.len() as u32,
            emitter_rays: 0,
            light_rays: 0,
            device_elements: Vec::new(),
        })
    }
}
