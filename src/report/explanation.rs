//! What a pixel is made of: a ranked list of elements, links and bounces, and whether they sum up to it.
//!
//! As JSON (`--explain-json`):
//!
//! ```json
//! { "schema": "linklight-explanation", "version": 1, "pixel": [12, 7], "method": ..., "display": ...,
//!   "seen": ["triangle 17 of node 2 `wall`, material 0 `white`"],
//!   "pixel_value": { "direct": [r, g, b], "indirect": [r, g, b] }, "sum": { ... }, "difference": 1e-6,
//!   "bounces": [ { "bounce": 1, "radiance": [r, g, b] } ],
//!   "entries": [ { "light": "indirect", "bounce": 1, "source": "element 17 ...", "receiver": "element 3 ...",
//!                  "count": 1, "radiance": [r, g, b], "share": 0.1 } ] }
//! ```
//!
//! Radiance is what the entry adds to the pixel, W m^-2 sr^-1; `share` is its luminance of the pixel's.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DVec3, UVec2, Vec3};
use serde_json::{Value, json};

const SCHEMA: &str = "linklight-explanation";
const VERSION: u32 = 1;
/// Entries that are told as text.
const TOLD: usize = 24;
/// Share of the pixel by which the sum of its parts may be off: they are added up in another order.
pub const TOLERANCE: f64 = 1e-3;

/// Whether light was reflected before it reached what the pixel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Light {
    /// Emission seen, and light reflected exactly once.
    Direct,
    Indirect,
}

/// Something that adds to the pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    pub light: Light,
    /// Reflections before the one that the eye sees: 0 for direct light; `None` where the method keeps all together.
    pub bounce: Option<u32>,
    /// Where it comes from, and by what.
    pub source: String,
    /// What received it for the pixel; empty where the pixel itself did.
    pub receiver: String,
    /// Links (nodes, samples) in it.
    pub count: u32,
    /// W m^-2 sr^-1.
    pub radiance: DVec3,
}

/// A pixel and its parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    pub pixel: UVec2,
    pub method: String,
    /// Display stage; empty for a method with pixels of its own.
    pub display: String,
    /// What the pixel shows, one line for each thing.
    pub seen: Vec<String>,
    /// Of the picture: direct and indirect.
    pub value: [Vec3; 2],
    pub entries: Vec<Entry>,
}

/// The parts do not make the pixel.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "pixel {pixel}: its parts sum up to {sum} (direct) and {indirect_sum} (indirect) W/(m2 sr), the picture shows \
     {value} and {indirect_value}: off by {:.2} %", 100.0 * .difference
)]
pub struct Mismatch {
    pub pixel: UVec2,
    pub sum: DVec3,
    pub indirect_sum: DVec3,
    pub value: Vec3,
    pub indirect_value: Vec3,
    pub difference: f64,
}

impl Explanation {
    /// Brightest first.
    pub fn rank(&mut self) {
        self.entries.retain(|entry| entry.radiance != DVec3::ZERO);
        self.entries.sort_by(|a, b| luminance(b.radiance).abs().total_cmp(&luminance(a.radiance).abs()));
    }

    /// Of direct and of indirect light.
    pub fn sum(&self) -> [DVec3; 2] {
        [Light::Direct, Light::Indirect]
            .map(|light| self.entries.iter().filter(|entry| entry.light == light).map(|entry| entry.radiance).sum())
    }

    /// By bounce, those of unknown bounce last.
    pub fn by_bounce(&self) -> Vec<(Option<u32>, DVec3)> {
        let mut bounces: BTreeMap<u32, DVec3> = BTreeMap::new();
        for entry in &self.entries {
            *bounces.entry(entry.bounce.unwrap_or(u32::MAX)).or_default() += entry.radiance;
        }
        bounces.into_iter().map(|(bounce, sum)| (Some(bounce).filter(|&bounce| bounce != u32::MAX), sum)).collect()
    }

    /// How far the sum is off, of the brightest channel of the pixel.
    pub fn difference(&self) -> f64 {
        let off = |sum: DVec3, value: Vec3| (sum - value.as_dvec3()).abs().max_element();
        let [direct, indirect] = self.sum();
        if !(direct + indirect).is_finite() || !(self.value[0] + self.value[1]).is_finite() {
            return f64::NAN;
        }
        let most = (self.value[0] + self.value[1]).as_dvec3().abs().max_element();
        let off = off(direct, self.value[0]).max(off(indirect, self.value[1]));
        if off == 0.0 { 0.0 } else { off / most.max(f64::MIN_POSITIVE) }
    }

    /// An error where the parts do not make the pixel.
    pub fn check(&self) -> Result<(), Mismatch> {
        let difference = self.difference();
        // Not a number is no match either.
        if difference <= TOLERANCE {
            return Ok(());
        }
        let [sum, indirect_sum] = self.sum();
        let [value, indirect_value] = self.value;
        Err(Mismatch { pixel: self.pixel, sum, indirect_sum, value, indirect_value, difference })
    }

    fn share(&self, radiance: DVec3) -> f64 {
        let whole = luminance((self.value[0] + self.value[1]).as_dvec3());
        if whole > 0.0 { luminance(radiance) / whole } else { 0.0 }
    }

    /// For people.
    pub fn to_text(&self) -> String {
        let UVec2 { x, y } = self.pixel;
        let [direct, indirect] = self.value.map(Vec3::as_dvec3);
        let mut text = String::new();
        let shown = if self.display.is_empty() { String::new() } else { format!(", shown by {}", self.display) };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "pixel {x},{y} by {}{shown}", self.method);
        for line in &self.seen {
            let _ = writeln!(text, "  sees {line}");
        }
        let _ = writeln!(
            text,
            "  radiance {} = direct {} + indirect {}",
            rgb(direct + indirect),
            rgb(direct),
            rgb(indirect)
        );
        for (bounce, sum) in self.by_bounce() {
            let name = bounce_name(bounce);
            let _ = writeln!(text, "  {name:12} {} {:6.2} %", rgb(sum), 100.0 * self.share(sum));
        }
        for entry in self.entries.iter().take(TOLD) {
            let Entry { bounce, source, receiver, count, radiance, .. } = entry;
            let by = if *count > 1 { format!(" x{count}") } else { String::new() };
            let to = if receiver.is_empty() { String::new() } else { format!(" -> {receiver}") };
            let share = 100.0 * self.share(*radiance);
            let _ = writeln!(text, "  {share:6.2} % {} {:9} {source}{by}{to}", rgb(*radiance), bounce_name(*bounce));
        }
        if let Some(rest) = self.entries.get(TOLD..).filter(|rest| !rest.is_empty()) {
            let sum = rest.iter().map(|entry| entry.radiance).sum();
            let _ = writeln!(text, "  {:6.2} % {} of {} more", 100.0 * self.share(sum), rgb(sum), rest.len());
        }
        let sum = self.sum();
        let _ = writeln!(text, "  sum {}: off by {:.1e} of the pixel", rgb(sum[0] + sum[1]), self.difference());
        text
    }

    /// As data.
    pub fn to_json(&self) -> Value {
        let of = |color: DVec3| json!(color.to_array());
        let both = |[direct, indirect]: [DVec3; 2]| json!({ "direct": of(direct), "indirect": of(indirect) });
        let entry = |entry: &Entry| {
            json!({
                "light": if entry.light == Light::Direct { "direct" } else { "indirect" },
                "bounce": entry.bounce,
                "source": entry.source,
                "receiver": entry.receiver,
                "count": entry.count,
                "radiance": of(entry.radiance),
                "share": self.share(entry.radiance),
            })
        };
        let bounce = |(bounce, sum): &(Option<u32>, DVec3)| json!({ "bounce": bounce, "radiance": of(*sum) });
        json!({
            "schema": SCHEMA,
            "version": VERSION,
            "pixel": self.pixel.to_array(),
            "method": self.method,
            "display": self.display,
            "seen": self.seen,
            "pixel_value": both(self.value.map(Vec3::as_dvec3)),
            "sum": both(self.sum()),
            "difference": self.difference(),
            "bounces": self.by_bounce().iter().map(bounce).collect::<Vec<_>>(),
            "entries": self.entries.iter().map(entry).collect::<Vec<_>>(),
        })
    }
}

fn bounce_name(bounce: Option<u32>) -> String {
    match bounce {
        Some(0) => "direct".into(),
        Some(bounce) => format!("bounce {bounce}"),
        None => "all bounces".into(),
    }
}

fn rgb(color: DVec3) -> String {
    format!("({:9.3e} {:9.3e} {:9.3e})", color.x, color.y, color.z)
}

fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn explanation() -> Explanation {
        let entry = |light, bounce, radiance: f64| Entry {
            light,
            bounce,
            source: format!("element {radiance}"),
            receiver: String::new(),
            count: 1,
            radiance: DVec3::splat(radiance),
        };
        Explanation {
            pixel: UVec2::new(3, 4),
            method: "explicit-visibility".into(),
            display: "vertex".into(),
            seen: vec!["triangle 1".into()],
            value: [Vec3::splat(1.0), Vec3::splat(0.75)],
            entries: vec![
                entry(Light::Indirect, Some(1), 0.25),
                entry(Light::Indirect, Some(2), 0.5),
                entry(Light::Direct, Some(0), 1.0),
                entry(Light::Indirect, None, 0.0),
            ],
        }
    }

    #[test]
    fn parts_are_ranked_and_sum_up_to_the_pixel() {
        let mut whole = explanation();
        whole.rank();
        assert_eq!(whole.entries.iter().map(|e| e.radiance.x).collect::<Vec<_>>(), [1.0, 0.5, 0.25]);
        assert_eq!(whole.check(), Ok(()));
        let bounces: Vec<_> = whole.by_bounce().iter().map(|(bounce, sum)| (*bounce, sum.x)).collect();
        assert_eq!(bounces, [(Some(0), 1.0), (Some(1), 0.25), (Some(2), 0.5)]);
        let json = whole.to_json();
        assert_eq!((&json["entries"][1]["bounce"], &json["difference"]), (&json!(2), &json!(0.0)));
        assert!(whole.to_text().contains("57.14 %") && whole.to_text().contains("off by 0"), "{}", whole.to_text());
    }

    #[test]
    fn a_part_that_is_wrong_or_missing_is_found() {
        let mut off = explanation();
        off.entries[1].radiance *= 1.01;
        assert!(off.check().unwrap_err().to_string().contains("pixel [3, 4]"));
        let mut missing = explanation();
        missing.entries.remove(0);
        assert!(missing.check().is_err());
        let mut swapped = explanation();
        swapped.entries[0].light = Light::Direct;
        assert!(swapped.check().is_err(), "light of the wrong kind");
        let mut bad = explanation();
        bad.entries[0].radiance.x = f64::NAN;
        assert!(bad.check().is_err());
    }

    #[test]
    fn a_black_pixel_is_explained_by_nothing() {
        let black = Explanation { value: [Vec3::ZERO; 2], entries: Vec::new(), ..explanation() };
        assert_eq!(black.check(), Ok(()));
        assert!(black.to_text().contains("off by 0"));
    }
}
